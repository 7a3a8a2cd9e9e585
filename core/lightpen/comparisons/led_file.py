"""Improved LED and camera files from several swings of one pen.

Each swing measures camera, disc diameter, scale and LEDs by the information of its
images, ``N_k x = b_k``, with its own tip, cone, seat and drift eliminated. The sum over
the swings and the priors of the files gives the joint estimate [1]_. A swing that was
not used must confirm it: its images must fit the new LEDs, held fixed, better than the
old ones.

References
----------
.. [1] B. Triggs et al., "Bundle adjustment - a modern synthesis", LNCS 1883 (2000)
   298-372, section 6.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeVar

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.comparisons.assessment import Scale
from lightpen.comparisons.pen_health import MOVED, examine_pen, require_one_pen
from lightpen.detection.observations import observe_centers
from lightpen.errors import CalibrationError, UsageError
from lightpen.estimation.bundle.bundle import Bundle
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.contact.joint import ContactModel, JointFit, fit_contact
from lightpen.estimation.contact.single_images import steadied
from lightpen.formats.observation_files import Centers
from lightpen.model.camera import Camera
from lightpen.model.coverage import COVERAGE_FACTOR, inverse, normal_quantile
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig, rig_of
from lightpen.model.self_calibration import FoundCamera, FoundPen, marks_of
from lightpen.record.calibrations import CalibrationFile, shown_images

FoundT = TypeVar("FoundT", FoundPen, FoundCamera)

MIN_POOLED = 3  # swings, beside the one held out
MIN_JOINT = 2  # the same, of an adjustment that needs to gain nothing
CONTRADICTING = 4.0  # standard deviations of a swing held out
CONFIRMED = 0.01  # probability of such a gain by chance
FINEST = 1e-4  # mm; no LED file is that accurate


@dataclass(frozen=True, eq=False)
class ImprovedPen:
    """A pen with an LED file improved by several swings."""

    pen: Pen
    camera: Camera
    moves: FloatArray  # (L, 3), new less old LED positions, mm
    pooled: tuple[str, ...]  # names of the swings
    held_out: str  # name of the swing that confirms it
    sigma_before: float  # noise of that swing by the old LEDs, px
    sigma_after: float  # the same by the new LEDs, px


def calibrate_again(
    calibration: CalibrationFile, camera: Camera, pen: Pen
) -> Calibration:
    """Calibrate again from the LED centres of a calibration by one camera."""
    if calibration.is_of_rig:
        raise UsageError("led-file.of-rig", path=calibration.path)
    shown = shown_images(calibration.calibration)
    numbers = np.arange(1, len(shown.pixels) + 1)
    centers = Centers(numbers, shown.pixels, calibration.path)
    measured = replace(
        observe_centers(centers, camera, pen),
        areas=shown.areas,
        sigmas=shown.sigmas,
        edge_widths=shown.edge_widths,
        lamps=shown.lamps,
    )
    return calibrate(camera, pen, measured, calibration.calibration.assumptions)


def improve_pen(
    calibrations: Sequence[CalibrationFile],
    camera: Camera,
    pen: Pen,
    scale: Scale | None = None,
    report: Callable[[float], None] = lambda fraction: None,
    *,
    must_gain: bool = True,
) -> ImprovedPen:
    """Improve the LEDs of a pen by several swings; the last one has to confirm it.

    If the files were found from one of the swings, the prior knowledge before it is
    used, so that each swing counts once. The scale of the pen is from certified
    lengths; ``report`` is called with the fraction done, 0 to 1; what it raises ends
    the work. With ``must_gain`` the last swing has to fit the new LEDs better than the
    old ones; without, it has to agree with the others within its uncertainty. Raises
    `UsageError` for different pens, and `CalibrationError` if there are too few swings,
    an LED moved between them, or the last one does not confirm the new LEDs.
    """
    require_one_pen(calibrations)
    needed = MIN_POOLED if must_gain else MIN_JOINT
    if len(calibrations) < needed + 1:
        raise CalibrationError(
            "led-file.too-few", n_swings=len(calibrations), needed=needed
        )
    _require_unchanged(calibrations, pen)
    *pooled, held_out = calibrations
    known_camera, known_pen = _known_before(calibrations, camera, pen)
    again = []
    for n, calibration in enumerate(calibrations, start=1):
        again.append(calibrate_again(calibration, known_camera, known_pen))
        report(n / (len(calibrations) + 1))
    *others, confirming = again
    joint = _pooled(others, known_camera, known_pen, scale)
    improved, refined = joint.pen, joint.camera
    rigs = [confirming.instrument.rig] * 2
    if not must_gain:
        rigs = [rig_of(camera), rig_of(refined)]
        _require_agreement(joint, confirming.bundle, held_out.path.name)
    before, after = (
        fit_held(confirming, rig, each)
        for rig, each in zip(rigs, (pen, improved), strict=True)
    )
    if must_gain and not _is_better(before, after):
        raise CalibrationError(
            "led-file.not-confirmed",
            swing=held_out.path.name,
            before=before.sigma,
            after=after.sigma,
        )
    marks = [marks_of(shown_images(each.calibration).pixels) for each in pooled]
    report(1.0)
    return ImprovedPen(
        pen=replace(improved, found=_with_marks(pen.found, marks)),
        camera=replace(refined, found=_with_marks(camera.found, marks)),
        moves=improved.leds - pen.leds,
        pooled=tuple(each.path.name for each in pooled),
        held_out=held_out.path.name,
        sigma_before=before.sigma,
        sigma_after=after.sigma,
    )


def _require_unchanged(calibrations: Sequence[CalibrationFile], pen: Pen) -> None:
    """Refuse swings before and after an LED moved: no LED file fits both."""
    health = examine_pen(calibrations, None, pen.leds)
    if not health.moved:
        return
    led = health.moved[0]
    distances = [
        float(np.nan_to_num(np.linalg.norm(swing.shifts[led - 1])))
        for swing in health.swings
    ]
    raise CalibrationError(
        "led-file.changed-meanwhile",
        led=led,
        distance=max(distances),
        first=health.swings[0].name,
        swing=health.swings[int(np.argmax(np.array(distances) > MOVED))].name,
    )


def _known_before(
    calibrations: Sequence[CalibrationFile], camera: Camera, pen: Pen
) -> tuple[Camera, Pen]:
    """Return camera and pen without what their files found from one of the swings."""
    for each in calibrations:
        pixels = shown_images(each.calibration).pixels
        if camera.is_found_from(pixels) or pen.is_found_from(pixels):
            return camera.before_images(), pen.before_images()
    return camera, pen


def _with_marks(found: FoundT | None, marks: Sequence[FloatArray]) -> FoundT | None:
    """Return the prior knowledge with the marks of more images it was found from."""
    if found is None:
        return None
    return replace(found, marks=np.concatenate([found.marks, *marks]))


class _Joint(NamedTuple):
    """Pen and camera by all swings, and the shared unknowns with their covariance."""

    pen: Pen
    camera: Camera
    values: FloatArray
    covariance: FloatArray


def _require_agreement(joint: _Joint, bundle: Bundle, name: str) -> None:
    """Refuse a swing that contradicts the others in an unknown they share."""
    common = _common_to_swings(bundle)
    off = np.abs(bundle.values[common] - joint.values)
    variances = np.diag(bundle.covariance)[common] + np.diag(joint.covariance)
    worst = float((off / np.sqrt(variances)).max())
    if worst > CONTRADICTING:
        raise CalibrationError("led-file.contradicted", swing=name, times=worst)


def _pooled(
    calibrations: Sequence[Calibration], camera: Camera, pen: Pen, scale: Scale | None
) -> _Joint:
    first = calibrations[0].bundle
    at = first.layout
    common = _common_to_swings(first)
    information = first.prior_information[np.ix_(common, common)].copy()
    leds = np.flatnonzero(np.isin(common, np.r_[at.leds]))
    information[np.ix_(leds, leds)] = 0.0
    typical = float(np.median([each.led_sigma for each in calibrations]))
    if pen.led_covariance is None or typical > 0:  # the images deny what is stated
        information[leds, leds] = 1 / (pen.led_sigma or max(typical, FINEST)) ** 2
    else:
        known = first.unknowns.basis.T @ pen.led_covariance @ first.unknowns.basis
        known += FINEST**2 * np.eye(len(known))
        information[np.ix_(leds, leds)] = inverse(known)
    right = np.zeros(len(common))
    for calibration in calibrations:
        own, own_right = _of_images(calibration.bundle)
        information += own
        right += own_right
    at_scale = int(np.flatnonzero(common == at.scale.start)[0])
    if scale is not None:
        # Information on the scale that the length added.
        before, after = scale.uncertainty_before, scale.uncertainty
        added = COVERAGE_FACTOR**2 * (1 / after**2 - 1 / before**2)
        information[at_scale, at_scale] += added
        right[at_scale] += (scale.factor - 1) * COVERAGE_FACTOR**2 / after**2
    covariance = inverse(information)
    values = covariance @ right
    unknowns = first.unknowns
    moves = unknowns.basis @ values[leds] + unknowns.scaling * values[at_scale]
    led_covariance = unknowns.basis @ covariance[np.ix_(leds, leds)] @ unknowns.basis.T
    at_diameter = int(np.flatnonzero(common == at.diameter.start)[0])
    intrinsics = np.flatnonzero(np.isin(common, np.r_[at.cameras[0]]))
    refined = replace(
        camera.with_intrinsics(camera.intrinsics + values[intrinsics]),
        covariance=covariance[np.ix_(intrinsics, intrinsics)],
    )
    better = replace(
        pen,
        leds=pen.leds + moves.reshape(-1, 3),
        diameter=pen.diameter + float(values[at_diameter]),
        led_sigma=float(np.sqrt(np.trace(led_covariance) / len(led_covariance))),
        led_covariance=led_covariance,
        scale_sigma=float(np.sqrt(covariance[at_scale, at_scale])),
        diameter_sigma=float(np.sqrt(covariance[at_diameter, at_diameter])),
    )
    return _Joint(better, refined, values, covariance)


def _common_to_swings(bundle: Bundle) -> IntArray:
    """Return the indices of the unknowns that swings share; effects differ."""
    at = bundle.layout
    shared = (*at.cameras, at.extrinsics, at.diameter, at.scale, at.leds)
    return np.asarray(np.r_[shared], dtype=np.int64)


def _of_images(bundle: Bundle) -> tuple[FloatArray, FloatArray]:
    """Return information matrix and right side of the shared unknowns of a swing."""
    both = bundle.information + bundle.prior_information
    right = both @ bundle.values
    common = _common_to_swings(bundle)
    own = np.setdiff1d(np.arange(len(both)), common)
    cross = bundle.information[np.ix_(common, own)]
    gain = np.linalg.solve(both[np.ix_(own, own)], cross.T).T
    information = bundle.information[np.ix_(common, common)] - gain @ cross.T
    return 0.5 * (information + information.T), right[common] - gain @ right[own]


def fit_held(calibration: Calibration, rig: Rig, pen: Pen) -> JointFit:
    """Fit tip and cone of a swing with cameras and LEDs held as they are."""
    joint = calibration.joint
    views = [
        np.where(
            each.used[:, None, None],
            steadied(camera, each.observations, each.path).pixels,
            np.nan,
        )
        for camera, each in zip(rig.cameras, calibration.cameras, strict=True)
    ]
    model = ContactModel(rig, pen, np.stack(views, axis=1)[calibration.used])
    return fit_contact(
        model, joint.rotations[joint.used.any(axis=1)], joint.tip_pen, joint.cone_cam
    )


def _is_better(before: JointFit, after: JointFit) -> bool:
    """Return whether the images of a swing fit better by more than chance.

    Both fits are of the same images: their difference, image by image, has far less
    scatter than either.
    """
    both = before.used & after.used
    squares = [
        np.sum(np.where(both[..., None], fit.residuals, 0.0) ** 2, axis=(1, 2))
        for fit in (before, after)
    ]
    gains = squares[0] - squares[1]
    return bool(
        gains.mean()
        > normal_quantile(CONFIRMED) * gains.std(ddof=1) / np.sqrt(len(gains))
    )
