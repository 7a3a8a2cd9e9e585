"""The tip of a recorded swing: the one computation for all callers.

The wizard, its review and the command line compute the tip of a record here, always
from the images on the disk, so that they agree to the last digit. Detections do not
depend on which images are used; excluding one solves again without reading images.
"""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from lightpen.arrays import FloatArray, Image, IntArray
from lightpen.detection.observations import Observations, leave_out, observe_images
from lightpen.detection.reasons import Reason
from lightpen.detection.rig_observations import observe_rig_images
from lightpen.errors import CalibrationError
from lightpen.estimation.calibrate import Calibration, calibrate_rig
from lightpen.estimation.contact.camera_motion import steadied
from lightpen.estimation.contact.joint import ContactModel, reduce
from lightpen.formats.hashes import Inputs, RigInputs, all_hashed, with_content
from lightpen.formats.pairing import Pairing
from lightpen.model.method import Method
from lightpen.model.rig import Rig, rig_of
from lightpen.model.rigid import rotation_from_vector
from lightpen.record.swings.reading import Record
from lightpen.record.swings.recorded_source import RecordSource, source

TURNS = 8  # steps by which an image that is left out is turned into the fit

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Solution:
    """The tip of a record, with its input."""

    source: RecordSource
    numbers: IntArray  # (N,), of the images, in the record
    observations: Observations  # detections in all N images, accepted or not
    excluded: Mapping[int, str]  # numbers of images that do not take part, and why
    calibration: Calibration
    # (N, C, L, 2), observed less modelled centres with tip in the cone, px; an image
    # that is left out is turned as fits it best; NaN where an LED or pen was not seen
    residuals: FloatArray
    others: tuple[Observations, ...] = ()

    def seen_by(self, camera: int) -> Observations:
        """Return the detections of a camera, from 0."""
        return (self.observations, *self.others)[camera]

    @property
    def misfits(self) -> FloatArray:
        """Root mean square residual of each image, px, (N,); NaN without the pen.

        Of a used image, over its used LEDs; else over all. Of a rig, over the images of
        all cameras.
        """
        calibration = self.calibration
        squares = np.sum(self.residuals**2, axis=3)
        seen = np.isfinite(squares)
        in_fit = np.stack([each.leds_used for each in calibration.cameras], axis=1)
        counted = np.where(calibration.used[:, None, None], in_fit, seen)
        n_leds = counted.sum(axis=(1, 2))
        total = np.sum(squares, axis=(1, 2), where=counted)
        rms = np.sqrt(total / np.maximum(n_leds, 1))
        return np.where(n_leds > 0, rms, np.nan)


def solve_record(
    record: Record, report: Callable[[float], None] = lambda fraction: None
) -> Solution:
    """Solve a record.

    ``report`` is called with the fraction done, 0 to 1; what it raises ends the
    computation. Raises `FileError` if no image, or not the camera or pen file, can be
    read, and `CalibrationError` if the images do not determine the tip.
    """
    if not record.images:
        raise CalibrationError("record.no-images", name=record.folder.name)
    found = source(record)
    _logger.info("solving %d images of %s", len(record.images), record.folder)
    if found.rig is None:
        seen: tuple[Observations, ...] = (
            observe_images(
                found.images, found.camera, found.pen, report, mask=found.masks[0]
            ),
        )
    else:
        sources = (found.images, *found.other_images)
        moments = np.arange(len(record.images))[:, None]
        pairing = Pairing(np.repeat(moments, len(sources), axis=1))
        seen = observe_rig_images(
            sources, pairing, found.rig, found.pen, report, found.masks
        )
    timed = tuple(replace(each, interval_ms=record.interval_ms) for each in seen)
    return _solved(found, record.all_numbers, timed, record.excluded)


def solve_again(solution: Solution, excluded: Mapping[int, str]) -> Solution:
    """Solve with other images excluded, from the same detections.

    ``excluded`` has the numbers of all images to exclude, with the reason. Raises
    `CalibrationError` if the rest does not determine the tip.
    """
    seen = (solution.observations, *solution.others)
    return _solved(solution.source, solution.numbers, seen, excluded)


def report_by(solution: Solution, method: Method) -> Solution:
    """Return a solution whose tip is reported by another method."""
    return replace(
        solution,
        source=replace(solution.source, method=method),
        calibration=replace(solution.calibration, method=method),
    )


def load_image(solution: Solution, number: int, camera: int = 0) -> Image:
    """Read an image of a solved record again, (H, W), by its number and camera."""
    index = int(np.searchsorted(solution.numbers, number))
    source = solution.source
    images = (source.images, *source.other_images)[camera]
    load = next(islice(images.open(), index, None))
    return load()


def record_inputs(source: RecordSource) -> Inputs:
    """Return the files that the tip of a record is computed from, with their hashes.

    Images that are gone took no part and are not among them.
    """
    images = [
        file for each in (source.images, *source.other_images) for file in each.files
    ]
    rig = None
    if source.rig_file is not None:
        cameras = tuple(map(with_content, source.camera_files))
        rig = RigInputs(with_content(source.rig_file), cameras)
    return Inputs(
        camera=with_content(source.camera_files[0]),
        pen=with_content(source.pen_file),
        observations=all_hashed([file for file in images if file.is_file()]),
        nominal_tip=source.pen.nominal_tip,
        rig=rig,
        origin=source.origin,
        units=source.units,
        led_diameter=source.led_diameter,
    )


def _solved(
    source: RecordSource,
    numbers: IntArray,
    seen: tuple[Observations, ...],
    excluded: Mapping[int, str],
) -> Solution:
    reasons = {
        index: _reason(excluded[number])
        for index, number in enumerate(numbers.tolist())
        if number in excluded
    }
    calibration = calibrate_rig(
        source.rig or rig_of(source.camera),
        source.pen,
        [leave_out(each, reasons) for each in seen],
        source.assumptions,
    )
    calibration = replace(calibration, method=source.method)
    return Solution(
        source=source,
        numbers=numbers,
        observations=seen[0],
        excluded=dict(excluded),
        calibration=calibration,
        residuals=_all_residuals(source, seen, calibration),
        others=seen[1:],
    )


def _all_residuals(
    source: RecordSource, seen: tuple[Observations, ...], calibration: Calibration
) -> FloatArray:
    """Return the residuals of all images, (N, C, L, 2), as `Solution` has them."""
    joint, fitted = calibration.joint, calibration.bundle.state
    cameras = (source.rig or rig_of(source.camera)).cameras
    pixels = np.stack(
        [
            steadied(camera, each, images.path).pixels
            for camera, each, images in zip(
                cameras, seen, calibration.cameras, strict=True
            )
        ],
        axis=1,
    )
    residuals = np.full_like(pixels, np.nan)
    in_fit = joint.residuals[joint.used.any(axis=1)]
    residuals[calibration.used] = in_fit.reshape(-1, *pixels.shape[1:])
    rotations = _rough_rotations(fitted.rig, seen)
    shows_pen = np.isfinite(rotations[:, 0, 0])
    others = np.flatnonzero(~calibration.used & shows_pen)
    if len(others):
        model = ContactModel(fitted.rig, fitted.pen, pixels[others])
        turned = _turned_to_fit(model, rotations[others], joint.tip_pen, joint.cone_cam)
        residuals[others] = turned.reshape(-1, *pixels.shape[1:])
    return residuals


def _rough_rotations(rig: Rig, seen: tuple[Observations, ...]) -> FloatArray:
    """Return rig_from_pen by the first camera that shows the pen, (N, 3, 3)."""
    found = seen[0].rotations
    for R, each in zip(rig.rotations[1:], seen[1:], strict=True):
        missing = np.isnan(found[:, 0, 0])[:, None, None]
        found = np.where(missing, R.T @ each.rotations, found)
    return found


def _turned_to_fit(
    model: ContactModel,
    rotations: FloatArray,
    tip_pen: FloatArray,
    cone_cam: FloatArray,
) -> FloatArray:
    """Return the residuals of images turned about the tip until they fit best, px."""
    state = model.at(rotations, tip_pen, cone_cam)
    weights = np.isfinite(state.residuals[..., 0]).astype(float)
    for _ in range(TURNS):
        turns = reduce(state, weights).turn
        rotations = rotation_from_vector(turns) @ rotations
        state = model.at(rotations, tip_pen, cone_cam)
    return state.residuals


def _reason(text: str) -> Reason:
    known = (Reason.SLIPPED, Reason.OUTSIDE)
    return Reason(text) if text in known else Reason.TAKEN_OUT
