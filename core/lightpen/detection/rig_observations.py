"""Observations by several cameras at the same moments."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.observations import (
    Observations,
    Report,
    observe_centers,
    observe_images,
)
from lightpen.detection.pose import CameraReprojection, Poses, fit_reprojection
from lightpen.detection.reasons import Reason
from lightpen.errors import CalibrationError, FileError
from lightpen.formats.images import ImageSource
from lightpen.formats.observation_files import NONE, Centers, Pairing
from lightpen.messages import Message, message
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig, of_camera


def observe_rig_images(
    sources: Sequence[ImageSource],
    pairing: Pairing,
    rig: Rig,
    pen: Pen,
    report: Report = lambda fraction: None,
    masks: Sequence[FloatArray | None] | None = None,
) -> tuple[Observations, ...]:
    """Find and label the LEDs in simultaneous images of a rig; see `observe_images`.

    Observations are of each camera, all of the same moments, with a mask of stray light
    each. A camera of several whose images are refused is named.
    """
    seen = []
    for c, source in enumerate(sources):

        def part(fraction: float, c: int = c) -> None:
            report((c + fraction) / len(sources))

        try:
            mask = None if masks is None else masks[c]
            seen.append(observe_images(source, rig.cameras[c], pen, part, mask=mask))
        except FileError as error:
            if not rig.names:
                raise
            raise FileError(_with_exchange(rig, c, error.message)) from error
        except CalibrationError as error:
            if not rig.names:
                raise
            fault = of_camera(rig.names[c], error.message)
            raise CalibrationError(fault) from error
    return at_moments(seen, pairing)


def observe_rig_centers(
    centers: Sequence[Centers], pairing: Pairing, rig: Rig, pen: Pen
) -> tuple[Observations, ...]:
    """Take LED centres that were found elsewhere; see `observe_centers`.

    A camera of several whose centres are refused is named.
    """
    seen = []
    for c, each in enumerate(centers):
        try:
            seen.append(observe_centers(each, rig.cameras[c], pen))
        except FileError as error:
            if not rig.names:
                raise
            raise FileError(of_camera(rig.names[c], error.message)) from error
    return at_moments(seen, pairing)


def at_moments(
    observations: Sequence[Observations], pairing: Pairing
) -> tuple[Observations, ...]:
    """Return observations of each camera with the images of a moment side by side.

    Of a moment that a camera has no image of, the reason is `Reason.ABSENT`.
    """
    return tuple(
        _responsive(seen, pairing.images[:, c]) for c, seen in enumerate(observations)
    )


def _responsive(seen: Observations, images: IntArray) -> Observations:
    absent = images == NONE
    arrays: dict[str, Any] = {}
    for each in fields(seen):
        values = getattr(seen, each.name)
        if isinstance(values, np.ndarray):
            arrays[each.name] = values[images]
            arrays[each.name][absent] = np.nan
    return replace(
        seen,
        names=tuple("" if i == NONE else seen.names[i] for i in images),
        reasons=tuple(Reason.ABSENT if i == NONE else seen.reasons[i] for i in images),
        details=tuple(None if i == NONE else seen.details[i] for i in images),
        **arrays,
    )


def _with_exchange(rig: Rig, c: int, fault: Message) -> Message:
    """Return the error of a camera's images, and the camera with that size."""
    finding = of_camera(rig.names[c], fault)
    size = fault.values.get("size")
    if not isinstance(size, Message):
        return finding
    theirs = size.values["width"], size.values["height"]
    others = [
        name
        for name, camera in zip(rig.names, rig.cameras, strict=True)
        if camera.image_size == theirs
    ]
    if not others:
        return finding
    return message("rig.size-of-another", told=finding, other=others[0])


# One pose of the pen by all cameras of a rig that see it at the same moment.
#
# All LEDs in all images make one pose ``rig_from_pen``, by maximum likelihood as in
# `lightpen.detection.pose`. One camera hardly determines the depth along its view,
# others do; the covariance of the pose combines all cameras.


@dataclass(frozen=True, eq=False)
class RigReprojection:
    """Reprojection errors in the images of all cameras, camera by camera."""

    rig: Rig
    cameras: tuple[CameraReprojection, ...]

    @property
    def pixels(self) -> FloatArray:
        """Observed centres, (N, C L, 2), px; NaN where an LED was not seen."""
        return np.concatenate([each.pixels for each in self.cameras], axis=1)

    def residuals_with_jacobian(
        self, R: FloatArray, t: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return residuals (N, C L, 2) at poses rig_from_pen, and their Jacobian."""
        residuals, jacobians = [], []
        places = zip(self.rig.rotations, self.rig.translations, strict=True)
        for camera, (turn, shift) in zip(self.cameras, places, strict=True):
            errors, J = camera.residuals_with_jacobian(turn @ R, t @ turn.T + shift)
            residuals.append(errors)
            jacobians.append(derivatives_in_rig(J, turn))
        return np.concatenate(residuals, axis=1), np.concatenate(jacobians, axis=1)


def derivatives_in_rig(J: FloatArray, turn: FloatArray) -> FloatArray:
    """Convert derivatives (..., 6) by the camera pose into those by the rig pose.

    ``turn`` (3, 3) is the rotation of cam_from_rig.
    """
    return np.concatenate([J[..., :3] @ turn, J[..., 3:] @ turn], axis=-1)


def fit_rig_poses(
    rig: Rig,
    pen: Pen,
    pixels: FloatArray,
    rotations: FloatArray,
    translations: FloatArray,
) -> Poses:
    """Fit poses rig_from_pen, each to the LEDs in all cameras.

    Residuals and weights are ordered by camera.

    Parameters
    ----------
    pixels : (N, C, L, 2) array
        Ellipse centres of the LEDs, px; NaN where a camera did not see one. Every
        moment needs four.
    rotations, translations : (N, 3, 3) and (N, 3) array
        Start, rig_from_pen, mm.
    """
    cameras = tuple(
        CameraReprojection(camera, pen.leds, pen.normals, pen.diameter / 2, seen)
        for camera, seen in zip(rig.cameras, np.moveaxis(pixels, 1, 0), strict=True)
    )
    problem = cameras[0] if rig.n_cameras == 1 else RigReprojection(rig, cameras)
    return fit_reprojection(problem, rotations, translations)
