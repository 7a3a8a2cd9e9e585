"""Observations by several cameras at the same moments."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.observations import (
    Observations,
    Report,
    observe_centers,
    observe_images,
)
from lightpen.detection.reasons import Reason
from lightpen.errors import CalibrationError, FileError
from lightpen.formats.images import ImageSource
from lightpen.formats.observation_files import Centers
from lightpen.formats.pairing import NONE, Pairing
from lightpen.messages import Message, message
from lightpen.model.pen import Pen
from lightpen.model.rig import Rig, of_camera


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
    each. A camera whose images are refused is named.
    """
    seen = []
    for c, source in enumerate(sources):

        def part(fraction: float, c: int = c) -> None:
            report((c + fraction) / len(sources))

        try:
            mask = None if masks is None else masks[c]
            seen.append(observe_images(source, rig.cameras[c], pen, part, mask=mask))
        except FileError as error:
            raise FileError(_with_exchange(rig, c, error.message)) from error
        except CalibrationError as error:
            fault = of_camera(rig.names[c], error.message)
            raise CalibrationError(fault) from error
    return at_moments(seen, pairing)


def observe_rig_centers(
    centers: Sequence[Centers], pairing: Pairing, rig: Rig, pen: Pen
) -> tuple[Observations, ...]:
    """Take LED centres that were found elsewhere; see `observe_centers`.

    A camera whose centres are refused is named.
    """
    seen = []
    for c, each in enumerate(centers):
        try:
            seen.append(observe_centers(each, rig.cameras[c], pen))
        except FileError as error:
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

    def moved(values: FloatArray) -> FloatArray:
        taken = values[images]
        taken[absent] = np.nan
        return taken

    return replace(
        seen,
        names=tuple("" if i == NONE else seen.names[i] for i in images),
        pixels=moved(seen.pixels),
        seen_pixels=moved(seen.seen_pixels),
        areas=moved(seen.areas),
        sigmas=moved(seen.sigmas),
        rotations=moved(seen.rotations),
        translations=moved(seen.translations),
        edge_widths=moved(seen.edge_widths),
        lamps=moved(seen.lamps),
        reasons=tuple(Reason.ABSENT if i == NONE else seen.reasons[i] for i in images),
        details=tuple(None if i == NONE else seen.details[i] for i in images),
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
