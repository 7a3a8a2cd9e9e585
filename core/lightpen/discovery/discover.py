"""Tip, pen and camera from one swing about a fixed point.

The steps: spots are followed (`tracks`), a part of the swing is solved for every mirror
and focal length (`hypotheses`), all images are labelled by it (`labelling`), the LEDs
are numbered and scaled by a known length (`numbering`, `scale`), and the calibration of
a tip that `lightpen.estimation` does adjusts everything, with priors that leave all but
the length to the images.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.observations import Observations
from lightpen.detection.pose import MIN_POSE_LEDS
from lightpen.detection.reasons import Reason
from lightpen.detection.spots import EXACT_SIGMA
from lightpen.discovery.found import Discovery, discovery_of
from lightpen.discovery.hypotheses import Hypothesis, camera_prior, solve_seed
from lightpen.discovery.labelling import Labelled, label, pixels_of
from lightpen.discovery.normals import towards_camera
from lightpen.discovery.numbering import framed, number_by_place, number_by_sketch
from lightpen.discovery.scale import (
    MeasuredLength,
    known_lengths,
    nearest_pair,
    scale_by,
    with_lengths_known,
)
from lightpen.discovery.sightings import Sightings
from lightpen.discovery.starts import (
    KnownLength,
    adjust_start,
    any_covariance,
    scaled_to,
)
from lightpen.discovery.tracks import find_lamps, follow, without_lamps
from lightpen.errors import CalibrationError
from lightpen.estimation.bundle.consistency_findings import DIAMETER
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.estimation.bundle.priors import ConeSeparation
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.uncertainty.second_cone import SecondSwing
from lightpen.model.camera import Camera
from lightpen.model.ellipse import centers_from_centroids
from lightpen.model.pen import Pen
from lightpen.model.posture import tilts_of
from lightpen.model.rigid import fit_rigid

MIN_IMAGES = 40
MIN_LEDS = 5
N_ADJUSTED = 100  # images that the start is adjusted to
MIN_SHARE, MIN_SEEN = 0.05, 10  # of the images, and images, in which an LED is seen
SECOND_PEN = 3  # lights that move with one another, beside those of the pen
OTHER_SIZE = 0.1  # relative: discs that are another size than stated
MOST_USED = 0.5  # of the images
WORST_TIP, WORST_FOCAL = 0.02, 0.03  # U over the pen's size, and relative
USUAL_DISC = 0.05  # of the largest distance of two LEDs
RELATIVE = 100.0  # the largest distance of two LEDs, where no length is known
LEAST_LENGTH_SIGMA = 1e-4  # mm

Report = Callable[[float], None]


@dataclass(frozen=True, eq=False)
class Request:
    """What is known, and how results are to be given.

    Attributes
    ----------
    lengths : tuple of MeasuredLength
        Without any the result is relative: the largest distance is `RELATIVE`.
    diameter : float
        Of the LED discs, mm.
    camera : Camera or None
        Of a camera file, with its covariance.
    sketch : Pen or None
        Rough LEDs, which give numbers and frame.
    second : SecondSightings or None
        A swing in a second cone, before the same camera, not moved. The distance of
        the cones gives the scale where there is no length.
    """

    lengths: tuple[MeasuredLength, ...]
    diameter: float
    camera: Camera | None = None
    sketch: Pen | None = None
    second: "SecondSightings | None" = None

    @property
    def is_relative(self) -> bool:
        """Whether nothing gives the scale."""
        return not self.lengths and self.second is None

    @property
    def rough_leds(self) -> FloatArray | None:
        """LEDs of the sketch, (L, 3), mm."""
        return None if self.sketch is None else self.sketch.leds


@dataclass(frozen=True, eq=False)
class SecondSightings:
    """A swing of the pen in a second cone, at a certified distance from the first."""

    sightings: Sightings
    separation: ConeSeparation


@dataclass(frozen=True, eq=False)
class _Swing:
    """A swing with its spots labelled.

    Attributes
    ----------
    centers, kept : tuple of array
        Spots that are no lamps, px, and the numbers that they have in the sightings.
    """

    sightings: Sightings
    centers: tuple[FloatArray, ...]
    kept: tuple[IntArray, ...]
    found: Labelled
    hypotheses: tuple[Hypothesis, ...]
    n_lamps: int

    @property
    def numbers(self) -> IntArray:
        """Spot of each LED in the sightings, (N, L); -1 without one."""
        return _in_sightings(self.found.spots, self.kept)


def discover(
    sightings: Sightings, request: Request, report: Report = lambda fraction: None
) -> Discovery:
    """Find tip, pen and camera.

    Parameters
    ----------
    sightings : Sightings
        Of a swing in time order, with the tip in the cone.
    report : callable
        Called with the fraction done; what it raises stops the computation.

    Raises
    ------
    CalibrationError
        The images do not determine them; the text says what to do.
    """
    swing = _labelled_swing(sightings, request, report)
    swing = replace(swing, found=_numbered(swing.found, request))
    report(0.5)
    pixels = pixels_of(swing.found.spots, swing.centers)
    start, lengths = _scaled_start(request, swing.found, pixels)
    report(0.6)
    second = None
    if request.second is not None:
        start, second = _with_second(start, request, report)
        lengths = lengths if request.lengths else ()
    observations = _observations(sightings, start, swing.found.images, swing.numbers)
    camera = _camera_to_adjust(start, request)
    pen = with_lengths_known(start.pen, lengths)
    calibration = calibrate(camera, pen, observations, second=second)
    _require_length(calibration, request, lengths)
    report(0.95)
    discovery = discovery_of(
        calibration, lengths, request.rough_leds, is_relative=request.is_relative
    )
    _require_certain(discovery)
    return replace(discovery, hypotheses=swing.hypotheses, n_lamps=swing.n_lamps)


def _labelled_swing(sightings: Sightings, request: Request, report: Report) -> _Swing:
    """Return a swing with its spots labelled, LEDs in any order."""
    _require_enough(sightings)
    width = sightings.size[0]
    lamps, centers, kept = _without_lamps(sightings)
    certain, joined = follow(centers, width)
    report(0.2)
    seed = solve_seed(joined, sightings.size, request.camera)
    report(0.4)
    found = label(seed, joined, certain, centers, width)
    _require_one_pen(found)
    return _Swing(sightings, centers, kept, found, seed.hypotheses, len(lamps))


def _with_second(
    start: BundleState, request: Request, report: Report
) -> tuple[BundleState, SecondSwing]:
    """Return a start with the scale by two cones, and the second swing in its frame."""
    assert request.second is not None
    separation, sightings = request.second.separation, request.second.sightings
    swing = _labelled_swing(sightings, request, lambda done: report(0.6 + 0.3 * done))
    state = swing.found.state
    order = number_by_sketch(state.pen.leds, start.pen.leds)
    leds = state.pen.leds[order]
    leds_there = start.pen.leds - start.pen.leds.mean(axis=0)
    ratio = np.linalg.norm(leds_there) / np.linalg.norm(leds - leds.mean(axis=0))
    R, _ = fit_rigid(ratio * leds, start.pen.leds)
    cone = ratio * state.cone_rig
    factor = 1.0
    if not request.lengths:
        apart = float(np.linalg.norm(cone - start.cone_rig))
        factor = separation.distance / max(apart, LEAST_LENGTH_SIGMA)
    start = scaled_to(start, factor)
    start = replace(start, pen=replace(start.pen, diameter=request.diameter))
    there = replace(start, cone_rig=factor * cone, rotations=state.rotations @ R.T)
    swing = replace(
        swing, found=replace(swing.found, spots=swing.found.spots[:, order])
    )
    observations = _observations(sightings, there, swing.found.images, swing.numbers)
    return start, SecondSwing(observations, separation)


def _require_enough(sightings: Sightings) -> None:
    """Refuse too few images or LEDs."""
    counts = np.array([len(each) for each in sightings.centers])
    if len(counts) < MIN_IMAGES:
        raise CalibrationError(
            "discover.too-few-images", n_images=len(counts), needed=MIN_IMAGES
        )
    n_leds = int(np.quantile(counts, 0.75))
    if n_leds < MIN_LEDS:
        raise CalibrationError("discover.too-few-leds", n_leds=n_leds, needed=MIN_LEDS)


def _without_lamps(
    sightings: Sightings,
) -> tuple[FloatArray, tuple[FloatArray, ...], tuple[IntArray, ...]]:
    """Return lamps, the other spots, and the numbers that these have."""
    _, joined = follow(sightings.centers, sightings.size[0])
    lamps = find_lamps(joined)
    return lamps, *without_lamps(sightings.centers, lamps)


def _in_sightings(labels: IntArray, kept: Sequence[IntArray]) -> IntArray:
    """Return labels (N, L) by the numbers of the spots with the lamps."""
    own = labels.copy()
    for row, numbers in zip(own, kept, strict=True):
        row[row >= 0] = numbers[row[row >= 0]]
    return own


def _require_one_pen(found: Labelled) -> None:
    """Refuse images in which more moves than one pen."""
    n_others = int(np.median(found.unexplained.sum(axis=1)))
    if n_others >= SECOND_PEN:
        raise CalibrationError("discover.two-pens", n_others=n_others)


def _numbered(found: Labelled, request: Request) -> Labelled:
    """Return the labelling by LED numbers, without LEDs that hardly any image shows."""
    n_seen = (found.spots >= 0).sum(axis=0)
    good = np.flatnonzero(n_seen >= max(MIN_SHARE * len(found.spots), MIN_SEEN))
    if len(good) < MIN_LEDS:
        raise CalibrationError(
            "discover.too-few-leds", n_leds=len(good), needed=MIN_LEDS
        )
    state = _of_leds(found.state, good)
    order = (
        number_by_place(state)
        if request.sketch is None
        else number_by_sketch(state.pen.leds, request.sketch.leds)
    )
    return replace(
        found, state=_of_leds(state, order), spots=found.spots[:, good[order]]
    )


def _of_leds(state: BundleState, order: IntArray) -> BundleState:
    pen = state.pen
    pen = replace(pen, leds=pen.leds[order], normals=pen.normals[order])
    return replace(state, pen=pen)


def _scaled_start(
    request: Request, found: Labelled, pixels: FloatArray
) -> tuple[BundleState, tuple[KnownLength, ...]]:
    """Return the start of the adjustment to scale and in its frame, and the lengths.

    Parameters
    ----------
    pixels : (N, L, 2) array
        px.
    """
    state, leds = found.state, found.state.pen.leds
    measured = request.lengths or (MeasuredLength(None, RELATIVE, 0.0),)
    lengths = tuple(
        replace(each, sigma=max(each.sigma, LEAST_LENGTH_SIGMA))
        for each in known_lengths(measured, leds)
    )
    state = scaled_to(state, scale_by(lengths, leds))
    normals = np.tile(towards_camera(state), (len(leds), 1))
    pen, known = _with_discs(state.pen, request), request.camera
    pen = replace(pen, normals=normals)
    state = replace(state, pen=pen)
    some = np.unique(np.linspace(0, len(found.images) - 1, N_ADJUSTED).astype(int))
    part = replace(state, rotations=state.rotations[some])
    pixels = pixels[found.images]
    for n_steps in (40, 40):  # the second time about the focal length found
        prior = camera_prior(part.rig.cameras[0], known)
        part = adjust_start(part, pixels[some], prior, n_steps, lengths).state
    turned, _ = fit_rigid(state.pen.leds, part.pen.leds)
    every = replace(part, rotations=state.rotations @ turned.T)
    prior = camera_prior(part.rig.cameras[0], known)
    every = adjust_start(every, pixels, prior, 8, lengths).state
    pen, R, t = framed(every.pen, every.tip_pen, request.rough_leds)
    return replace(
        every, pen=pen, tip_pen=R @ every.tip_pen + t, rotations=every.rotations @ R.T
    ), lengths


def _with_discs(pen: Pen, request: Request) -> Pen:
    if request.lengths:
        return replace(pen, diameter=request.diameter)
    usual = USUAL_DISC * RELATIVE  # nothing shows how large they are
    return replace(pen, diameter=usual, diameter_sigma=usual)


def _camera_to_adjust(start: BundleState, request: Request) -> Camera:
    """Return the camera of the file, or the one found with a covariance of any."""
    if request.camera is not None:
        return request.camera
    camera = start.rig.cameras[0]
    return replace(camera, covariance=any_covariance(camera))


def _observations(
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


def _require_length(
    calibration: Calibration, request: Request, lengths: Sequence[KnownLength]
) -> None:
    """Refuse a length by which the discs would be of another size than stated."""
    if not request.lengths:
        return
    for each in calibration.contradictions:
        if each.what != DIAMETER or each.estimated <= 0:
            continue
        ratio = each.stated / each.estimated
        if abs(ratio - 1) < OTHER_SIZE:
            continue
        leds, length = ratio * calibration.bundle.state.pen.leds, lengths[0].length
        first, second, _ = nearest_pair(leds, length)
        raise CalibrationError(
            "discover.length-of-others",
            length=length,
            first=lengths[0].first + 1,
            second=lengths[0].second + 1,
            found=each.estimated,
            stated=each.stated,
            other=first,
            another=second,
        )


def _require_certain(discovery: Discovery) -> None:
    """Refuse a swing that hardly determines tip or camera, or much of which is left.

    Raises
    ------
    CalibrationError
        Says what is missing.
    """
    calibration = discovery.calibration
    n_used, n_images = int(calibration.used.sum()), len(calibration.used)
    if n_used < MOST_USED * n_images:
        raise CalibrationError(
            "discover.many-left-out", n_used=n_used, n_images=n_images
        )
    size = float(np.ptp(discovery.pen.leds, axis=0).max())
    U = float(discovery.expanded_uncertainty.max())
    focal = float(discovery.intrinsics_sigma[0]) / discovery.camera.fx
    if U / size > WORST_TIP or focal > WORST_FOCAL:
        tilts = np.degrees(tilts_of(calibration.joint.rotations))
        raise CalibrationError(
            "discover.weak-swing", U=U, focal=100 * focal, tilt=float(np.ptp(tilts))
        )
