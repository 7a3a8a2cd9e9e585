"""Tip, pen and camera from one swing about a fixed point.

The steps: spots are followed (`tracks`), a part of the swing is solved for every mirror
and focal length (`hypotheses`), all images are labelled by it (`labelling`), the LEDs
are numbered and scaled by a known length (`numbering`, `scale`), and the calibration of
a tip that `lightpen.estimation` does adjusts everything, with priors that leave all but
the length to the images.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.detection.observations import Observations
from lightpen.detection.pose import MIN_POSE_LEDS
from lightpen.detection.reasons import Reason
from lightpen.detection.spots import EXACT_SIGMA
from lightpen.errors import CalibrationError
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.model.ellipse import centers_from_centroids
from lightpen_extensions.boards.distortion import Choice
from lightpen_extensions.discover.found import (
    Discovery,
    discovery_of,
    require_certain,
    require_enough,
    require_length,
    require_no_second_pen,
    require_one_camera,
)
from lightpen_extensions.discover.hypotheses import Hypothesis, solve_seed
from lightpen_extensions.discover.labelling import Labelled, label, pixels_of
from lightpen_extensions.discover.scale import Request, with_lengths_known
from lightpen_extensions.discover.scaled_start import (
    adjust_halves,
    numbered,
    scaled_start,
)
from lightpen_extensions.discover.starts import any_covariance
from lightpen_extensions.discover.tracks import (
    Report,
    Sightings,
    find_lamps,
    follow,
    without_lamps,
)

NOT_SETTLED = (
    "bundle.not-settled",
    "joint.not-settled",
    "calibrate.files-disagree",
    "calibrate.leds-do-not-fit",
    "calibrate.leds-do-not-fit-nor-tip",
)
SLIPPED = 0.03  # of the images, that are left out after a slip


@dataclass(frozen=True, eq=False)
class _Swing:
    """A swing with its spots labelled."""

    sightings: Sightings
    centers: tuple[FloatArray, ...]  # spots that are no lamps, px
    kept: tuple[IntArray, ...]  # (S,) each, their numbers in the sightings
    found: Labelled
    hypotheses: tuple[Hypothesis, ...]
    n_lamps: int

    @property
    def numbers(self) -> IntArray:
        """Spot of each LED in the sightings, with lamps, (N, L); -1 without one."""
        own = self.found.spots.copy()
        for row, numbers in zip(own, self.kept, strict=True):
            row[row >= 0] = numbers[row[row >= 0]]
        return own


def discover(
    sightings: Sightings, request: Request, report: Report = lambda fraction: None
) -> Discovery:
    """Find tip, pen and camera.

    ``sightings`` are of one swing with the tip in the cone, in time order. ``report``
    is called with the fraction done; an exception from it stops the computation. Raises
    `CalibrationError` if the images do not determine them.
    """
    swing = _labelled_swing(sightings, request, report)
    swing = replace(swing, found=numbered(swing.found))
    report(0.5)
    return _adjusted(swing, request, report)


def _adjusted(
    swing: _Swing,
    request: Request,
    report: Report = lambda fraction: None,
    *,
    is_cleared: bool = False,
) -> Discovery:
    """Return tip, pen and camera by a swing with numbered LEDs.

    Where many images are left out, as after a slip, all is begun anew without them:
    they have shifted the start, which gives the lens model and the normal of the discs.
    """
    sightings = swing.sightings
    pixels = pixels_of(swing.found.spots, swing.centers)
    scaled = start, lengths, choice = scaled_start(request, swing.found, pixels)
    halves = partial(adjust_halves, scaled, pixels[swing.found.images])
    try:
        require_one_camera(halves(request.camera))
    except CalibrationError as error:
        if request.camera is None:
            raise
        require_one_camera(halves(None))
        raise CalibrationError("discover.other-camera") from error
    report(0.6)
    observations = _labelled_observations(
        sightings, start, swing.found.images, swing.numbers
    )
    start = replace(start, pen=with_lengths_known(start.pen, lengths))
    try:
        calibration = _calibrated(start, choice, request, observations)
    except CalibrationError as error:
        if error.message.code not in NOT_SETTLED:
            raise
        if request.camera is not None:
            raise CalibrationError("discover.other-camera") from error
        raise CalibrationError("discover.not-settled") from error
    fits = calibration.used[swing.found.images]
    if not is_cleared and np.mean(~fits) > SLIPPED:
        cleared = replace(swing, found=_of_images(swing.found, fits))
        return _adjusted(cleared, request, report, is_cleared=True)
    is_off = not all(each.of_pen for each in calibration.contradictions)
    if (
        request.camera is not None
        and is_off
        and np.mean(calibration.used) < 1 - SLIPPED
    ):
        raise CalibrationError("discover.other-camera")
    require_length(calibration, request, lengths)
    report(0.95)
    discovery = discovery_of(
        *(calibration, choice, lengths), is_relative=request.is_relative
    )
    require_certain(discovery, sightings)
    return replace(discovery, hypotheses=swing.hypotheses, n_lamps=swing.n_lamps)


def _labelled_swing(sightings: Sightings, request: Request, report: Report) -> _Swing:
    """Return a swing with its spots labelled, LEDs in any order."""
    require_enough(sightings)
    width = sightings.size[0]
    centers = sightings.centers
    kept = tuple(np.arange(len(each)) for each in centers)
    certain, joined = follow(centers, width)
    lamps = find_lamps(joined)
    if len(lamps):
        centers, kept = without_lamps(centers, lamps)
        certain, joined = follow(centers, width)
    report(0.2)
    seed = solve_seed(joined, sightings.size, request.camera)
    report(0.4)
    found = label(seed, certain, centers, width)
    require_no_second_pen(found)
    return _Swing(sightings, centers, kept, found, seed.hypotheses, len(lamps))


def _of_images(found: Labelled, some: BoolArray) -> Labelled:
    """Return the labelling with some of the images that have a rotation."""
    state = replace(found.state, rotations=found.state.rotations[some])
    return replace(found, state=state, images=found.images[some])


def _labelled_observations(
    sightings: Sightings, start: BundleState, images: IntArray, spots: IntArray
) -> Observations:
    """Return the labelled observations; ``spots`` (N, L) are numbers in sightings."""
    n_images, n_leds = spots.shape
    pixels = pixels_of(spots, sightings.centers)
    areas = np.full((n_images, n_leds), np.nan)
    if sightings.shapes is not None and sightings.areas is not None:
        shapes = np.full((n_images, n_leds, 2, 2), np.nan)
        for i, j in zip(*np.nonzero(spots >= 0), strict=True):
            shapes[i, j] = sightings.shapes[i][spots[i, j]]
            areas[i, j] = sightings.areas[i][spots[i, j]]
        pixels = centers_from_centroids(start.rig.cameras[0], pixels, shapes)
    rotations = np.full((n_images, 3, 3), np.nan)
    rotations[images] = start.rotations
    translations = start.cone_rig - rotations @ start.tip_pen
    widths = sightings.edge_widths
    return Observations(
        names=sightings.names,
        pixels=pixels,
        seen_pixels=pixels,
        areas=areas,
        sigmas=np.where(np.isfinite(pixels[..., 0]), EXACT_SIGMA, np.nan),
        rotations=rotations,
        translations=translations,
        edge_widths=np.full(n_images, np.nan) if widths is None else widths,
        lamps=np.zeros((n_images, 0, 2)),
        reasons=tuple(
            _reason(int((row >= 0).sum()), bool(np.isfinite(R[0, 0])))
            for row, R in zip(spots, rotations, strict=True)
        ),
        details=(None,) * n_images,
    )


def _reason(n_seen: int, has_rotation: bool) -> Reason:
    if not has_rotation:
        return Reason.NOT_THE_PEN
    return Reason.NONE if n_seen >= MIN_POSE_LEDS else Reason.TOO_FEW_LEDS


def _calibrated(
    start: BundleState,
    choice: Choice | None,
    request: Request,
    observations: Observations,
) -> Calibration:
    """Return the calibration.

    The camera is read from a file, or starts with a wide covariance.
    """
    pen, camera = start.pen, start.rig.cameras[0]
    if choice is None:  # the camera is known
        camera = request.camera or camera
        return calibrate(camera, pen, observations)
    of_any = replace(camera, covariance=any_covariance(camera))
    return calibrate(of_any, pen, observations)
