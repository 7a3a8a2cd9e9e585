"""Tip, pen and camera as found, with their joint covariance."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.errors import CalibrationError
from lightpen.estimation.bundle.consistency_findings import DIAMETER
from lightpen.estimation.calibrate import Calibration
from lightpen.estimation.uncertainty.disc_normals import (
    across_normals,
    effect_of_normals,
)
from lightpen.estimation.uncertainty.instrument import Parameters, instrument_mixing
from lightpen.model.camera import Camera
from lightpen.model.coverage import COVERAGE_FACTOR, N_DIRECTIONS, dial_counts, inverse
from lightpen.model.limits import SwingLimits
from lightpen.model.pen import Pen, moved
from lightpen.model.rigid import Posture, tilts_of
from lightpen.model.self_calibration import FoundCamera, FoundPen
from lightpen.swing.capture.guidance import (
    GuidanceInput,
    next_posture,
    turn_range,
    visible_fields,
)
from lightpen_extensions.boards.distortion import Choice
from lightpen_extensions.discover.hypotheses import Hypothesis, framed
from lightpen_extensions.discover.labelling import Labelled
from lightpen_extensions.discover.scale import (
    Request,
    nearest_pair,
    with_led_covariance,
)
from lightpen_extensions.discover.starts import FACING, KnownLength
from lightpen_extensions.discover.tracks import Sightings


@dataclass(frozen=True, eq=False)
class Discovery:
    """Tip, pen and camera that a swing showed."""

    pen: Pen  # in its frame, with the covariance of its LEDs
    camera: Camera  # with its covariance
    tip_pen: FloatArray  # (3,), mm
    # (q, q), of tip, camera, diameter and LEDs, as `parameters` has them, in the frame
    # in which the LEDs fit the true ones best
    covariance: FloatArray
    # (3, 3), share of the lens in the covariance of the tip, mm^2
    beyond_fit: FloatArray
    calibration: Calibration  # the final adjustment
    lengths: tuple[KnownLength, ...]
    is_relative: bool  # whether there was no length
    hypotheses: tuple[Hypothesis, ...]
    n_lamps: int  # lights that did not move with the pen
    lens_choice: Choice | None = None  # None if the camera is known

    @property
    def parameters(self) -> Parameters:
        """Indices of each kind of parameter in the covariance."""
        return self.calibration.instrument.parameters

    @property
    def expanded_uncertainty(self) -> FloatArray:
        """U (k = 2) of the tip, (3,), mm."""
        return COVERAGE_FACTOR * np.sqrt(np.diag(self.covariance)[:3])

    @property
    def intrinsics_sigma(self) -> FloatArray:
        """Standard uncertainties of the camera's intrinsics."""
        at = self.parameters.cameras[0]
        return np.sqrt(np.diag(self.covariance)[at])

    @property
    def led_uncertainty(self) -> FloatArray:
        """U (k = 2) of each LED coordinate, (L, 3), mm."""
        at = self.parameters.leds
        sigmas = np.sqrt(np.diag(self.covariance)[at])
        return COVERAGE_FACTOR * sigmas.reshape(-1, 3)


def discovery_of(
    calibration: Calibration,
    choice: Choice | None,
    lengths: tuple[KnownLength, ...],
    *,
    is_relative: bool,
) -> Discovery:
    """Return the result of a calibration with wide priors.

    ``choice`` is the choice of the lens model, None for a known camera.
    """
    bundle, instrument = calibration.bundle, calibration.instrument
    state, tip = bundle.state, calibration.joint.tip_pen
    # The start found the normal, by the same images.
    normals = effect_of_normals(bundle)
    of_turn = inverse(normals.information + FACING**-2 * np.eye(2))
    by, axes = instrument_mixing(bundle), across_normals(state.pen.normals)
    covariance = instrument.covariance + by @ normals.covariance(of_turn) @ by.T
    at = instrument.parameters
    budget = calibration.budget.covariance[:3, :3] - instrument.covariance[:3, :3]
    values, vectors = np.linalg.eigh(budget)
    beyond_fit = (vectors * np.maximum(values, 0.0)) @ vectors.T
    covariance[at.tip, at.tip] += beyond_fit
    marks = marks_of(calibration.observations.pixels[calibration.used])
    camera = replace(
        state.rig.cameras[0],
        covariance=covariance[at.cameras[0], at.cameras[0]],
        found=_camera_before(bundle.unknowns.start.rig.cameras[0], marks),
    )
    diameter_sigma = float(np.sqrt(covariance[at.diameter, at.diameter][0, 0]))
    before = bundle.unknowns.start.pen
    assert before.led_covariance is not None
    pen = replace(
        with_led_covariance(state.pen, covariance[at.leds, at.leds]),
        diameter_sigma=diameter_sigma,
        normal_covariance=axes.T @ of_turn @ axes,
        nominal_tip=None,
        expansion=None,
        found=FoundPen(marks, before.diameter, before.led_covariance),
    )
    _, R, t = framed(pen, tip)
    found = Discovery(
        pen=pen,
        camera=camera,
        tip_pen=tip,
        covariance=covariance,
        beyond_fit=beyond_fit,
        calibration=calibration,
        lengths=lengths,
        is_relative=is_relative,
        hypotheses=(),
        n_lamps=0,
        lens_choice=choice,
    )
    return _in_frame(found, R, t)


def _camera_before(start: Camera, marks: FloatArray) -> FoundCamera:
    earlier = start.found
    if earlier is not None:
        return replace(earlier, marks=np.concatenate([earlier.marks, marks]))
    return FoundCamera(marks, start.intrinsics, start.covariance)


def _in_frame(found: Discovery, R: FloatArray, t: FloatArray) -> Discovery:
    at = found.parameters
    turn = np.eye(at.number)
    turn[at.tip, at.tip] = R
    turn[at.leds, at.leds] = np.kron(np.eye(found.pen.n_leds), R)
    covariance = turn @ found.covariance @ turn.T
    return replace(
        found,
        pen=moved(found.pen, R, t),
        tip_pen=R @ found.tip_pen + t,
        covariance=covariance,
        beyond_fit=R @ found.beyond_fit @ R.T,
    )


N_PER_FIELD = 3  # images
TURNS_NEEDED = (-0.35, 0.35)  # rad, about the pen's own axis


@dataclass(frozen=True, eq=False)
class Guide:
    """Postures of a swing so far, and what is missing."""

    outlook: GuidanceInput  # as found, with the postures of the images so far
    # (3, 8), images wanted in each field of the dial; none where the LEDs are not seen
    needed: IntArray
    target: Posture | None = None  # next posture; None once none is missing

    @property
    def pen(self) -> Pen:
        """The pen as found."""
        return self.outlook.pen

    @property
    def counts(self) -> IntArray:
        """Images by field of the dial, (3, 8); upright in the first column."""
        return dial_counts(self.outlook.rotations)

    @property
    def turns(self) -> tuple[float, float] | None:
        """Least and greatest turn of the pen about its own axis, rad."""
        return turn_range(self.pen, self.outlook.rotations)

    @property
    def is_complete(self) -> bool:
        """Whether every field has its images, and the pen was turned enough."""
        turns = self.turns or (0.0, 0.0)
        is_turned = turns[0] <= TURNS_NEEDED[0] and turns[1] >= TURNS_NEEDED[1]
        return is_turned and bool((self.counts >= self.needed).all())

    def with_postures(self, new: FloatArray) -> Self:
        """Return the guide after images with rotations (M, 3, 3), cam_from_pen."""
        rotations = np.concatenate([self.outlook.rotations, new])
        after = replace(self, outlook=replace(self.outlook, rotations=rotations))
        missing = after.counts < self.needed
        target = None
        if missing.any():
            target = next_posture(after.outlook, new[-1], missing)
        return replace(after, target=target)


def guide_of(found: Discovery) -> Guide:
    """Return the guide by the images that a discovery is of."""
    calibration = found.calibration
    state, joint = calibration.bundle.state, calibration.joint
    outlook = GuidanceInput(
        rig=state.rig,
        pen=state.pen,
        tip_pen=joint.tip_pen,
        cone_cam=joint.cone_cam,
        information=inverse(calibration.bundle.covariance[:6, :6]),
        sigma=calibration.bundle.sigma,
        rotations=joint.rotations,
        spacing=SwingLimits().spacing,
    )
    needed = np.full((3, N_DIRECTIONS), N_PER_FIELD, dtype=np.int64)
    needed[0] = 0  # a hand that swings is hardly upright
    return Guide(outlook, needed * visible_fields(outlook))


MIN_IMAGES = 40
MIN_LEDS = 5
SECOND_PEN = 3  # lights that move together, besides the LEDs of the pen
OTHER_SIZE = 0.1  # relative: discs that are another size than stated
LARGEST_FOLD = 0.2  # of the image
ZOOMED = 1e-3  # of the focal length, between both halves of a swing, and
HALVES_APART = 6.0  # standard deviations of the difference
HALVES_MISFIT = 3.0  # times the noise of either half alone
MOST_USED = 0.7  # of the images that show LEDs enough
OTHERWISE_WARM = 2e-4  # relative, of a length: 10 K of aluminium
WORST_TIP, WORST_FOCAL = 0.02, 0.03  # U over the pen's size, and relative


class Halves(NamedTuple):
    """The two halves of a swing, each adjusted alone."""

    focal_lengths: FloatArray  # (2,), px
    sigmas: FloatArray  # (2,), their standard uncertainties, px
    misfit: float  # noise about the common start, over the noisier half's own


def require_enough(sightings: Sightings) -> None:
    """Refuse too few images or LEDs."""
    counts = np.array([len(each) for each in sightings.centers])
    if len(counts) < MIN_IMAGES:
        raise CalibrationError(
            "discover.too-few-images", n_images=len(counts), needed=MIN_IMAGES
        )
    n_leds = int(np.quantile(counts, 0.75))
    if n_leds < MIN_LEDS:
        raise CalibrationError("discover.too-few-leds", n_leds=n_leds, needed=MIN_LEDS)


def require_no_second_pen(found: Labelled) -> None:
    """Refuse images with moving spots beside a pen that is seen whole."""
    n_leds = (found.spots >= 0).sum(axis=1)
    is_whole = n_leds >= np.quantile(n_leds, 0.75)
    n_others = int(np.median(found.unexplained[is_whole].sum(axis=1)))
    if n_others >= SECOND_PEN:
        raise CalibrationError("discover.two-pens", n_others=n_others)


def require_length(
    calibration: Calibration, request: Request, lengths: Sequence[KnownLength]
) -> None:
    """Refuse a length that contradicts the diameter of the discs."""
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


def require_lens(camera: Camera) -> None:
    """Refuse a lens that no camera file can state, as the corners were not seen."""
    if camera.folded_share > LARGEST_FOLD:
        raise CalibrationError("discover.lens-folds")


def require_one_camera(halves: Halves) -> None:
    """Refuse a swing whose halves fit alone, but not together."""
    first, second = halves.focal_lengths.tolist()
    by_chance = HALVES_APART * float(np.linalg.norm(halves.sigmas))
    if abs(first - second) > max(ZOOMED * first, by_chance):
        raise CalibrationError("discover.camera-changed", first=first, second=second)
    if halves.misfit > HALVES_MISFIT:
        raise CalibrationError("discover.halves-apart", times=halves.misfit)


def require_certain(discovery: Discovery, sightings: Sightings) -> None:
    """Refuse a swing with weak tip or camera, or with many excluded images."""
    calibration = discovery.calibration
    n_used = int(calibration.used.sum())
    n_images = sum(len(each) >= MIN_LEDS for each in sightings.centers)
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


MAX_MARKS = 1000  # images


def marks_of(pixels: FloatArray) -> FloatArray:
    """Return an LED centre of each image, (M, 2), px, from centres (N, L, 2)."""
    seen = np.isfinite(pixels[..., 0])
    images = np.flatnonzero(seen.any(axis=1))
    images = images[:: -(-len(images) // MAX_MARKS) or 1]
    return np.asarray(pixels[images, seen[images].argmax(axis=1)])
