"""The accepted images of a swing, and the running fit to them."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.detection.labelling.constellation import certain_leds
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.pose import fit_poses
from lightpen.detection.reasons import Reason
from lightpen.errors import CalibrationError
from lightpen.estimation.contact.joint import ContactModel, JointFit, fit_contact
from lightpen.estimation.pivot.pivot import (
    contact_matrix,
    contact_residuals,
    in_deviations,
    median_distance,
    outlier_distance,
    tip_covariances,
)
from lightpen.estimation.rigs.rig_poses import poses_in_rig
from lightpen.estimation.uncertainty.prediction import (
    UNKNOWN_UNCERTAINTY,
    PredictedUncertainty,
    predict_uncertainty,
)
from lightpen.model.coverage import MIN_SPREAD, chi_quantile, posture_spread
from lightpen.model.limits import USUAL, Assumptions
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig

# Tip and cone by a few poses, and distances of poses from them.
#
# The equations are those of `estimation.pivot.pivot`, R_i tip_pen + t_i = cone_cam,
# weighed by the covariances of the poses. Prior knowledge of the tip is added, so that
# a second of hardly moving poses already gives the cone point.


NOMINAL_SIGMA = 3.0  # mm, of a tip about its design
UNKNOWN_SIGMA = 200.0  # mm, of a tip about the LEDs
CONE_SIGMA = 1e4  # mm, of the cone before anything is seen
SEATING = 0.01  # mm, by which the tip may move in a good cone


@dataclass(frozen=True, eq=False)
class Seat:
    """Tip and cone with their covariance."""

    tip_pen: FloatArray  # (3,), mm
    cone_cam: FloatArray  # (3,), mm
    covariance: FloatArray  # (6, 6), of (tip_pen, cone_cam), mm^2


def tip_prior(pen: Pen) -> tuple[FloatArray, float]:
    """Return the prior of the tip, (3,), mm, and its standard deviation."""
    if pen.nominal_tip is None:
        return pen.leds.mean(axis=0), UNKNOWN_SIGMA
    return pen.nominal_tip, NOMINAL_SIGMA


def fit_seat(
    pen: Pen, rotations: FloatArray, translations: FloatArray, covariances: FloatArray
) -> Seat:
    """Fit tip and cone to poses and to a prior of the tip; see `tip_distances`."""
    expected, sigma = tip_prior(pen)
    spread = tip_covariances(rotations, covariances, expected) + SEATING**2 * np.eye(3)
    A = contact_matrix(rotations)
    AtW = np.swapaxes(A, 1, 2) @ np.linalg.inv(spread)
    center = (rotations @ expected + translations).mean(axis=0)
    missing = center - (rotations @ expected + translations)
    prior = np.diag([sigma**-2] * 3 + [CONE_SIGMA**-2] * 3)
    H = (AtW @ A).sum(axis=0) + prior
    step = np.linalg.solve(H, (AtW @ missing[..., None]).sum(axis=0)[:, 0])
    return Seat(expected + step[:3], center + step[3:], np.linalg.inv(H))


def tip_offsets(
    seat: Seat, rotations: FloatArray, translations: FloatArray
) -> FloatArray:
    """Return the tip by each pose minus the cone, camera frame, (N, 3), mm."""
    return contact_residuals(rotations, translations, seat.tip_pen, seat.cone_cam)


def tip_distances(
    seat: Seat, rotations: FloatArray, translations: FloatArray, covariances: FloatArray
) -> FloatArray:
    """Return the distances (N,) of the tip from the cone, in standard deviations.

    They are 1.73 on average where the tip rests in the cone. The poses cam_from_pen are
    rotations (N, 3, 3) and translations (N, 3), mm; their covariances (N, 6, 6) are of
    (theta, dt), rad and mm.
    """
    offsets = tip_offsets(seat, rotations, translations)
    A = contact_matrix(rotations)
    spread = tip_covariances(rotations, covariances, seat.tip_pen)
    spread = spread + A @ seat.covariance @ np.swapaxes(A, 1, 2)
    return in_deviations(offsets, spread + SEATING**2 * np.eye(3))


class SimultaneousPoses(NamedTuple):
    """Poses rig_from_pen at N moments."""

    rotations: FloatArray  # (N, 3, 3)
    translations: FloatArray  # (N, 3), mm
    cofactors: FloatArray  # (N, 6, 6), covariances for a noise of 1 px, rad and mm
    sigmas: FloatArray  # (N,), standard deviation of one image coordinate, px


def seen_by_rig(rig: Rig, pen: Pen, detection: PenDetection) -> PenDetection:
    """Return a detection with the pose by another camera where the first has none.

    It is the detection of the first camera, with the simultaneous ones of the others.
    Unchanged if the first camera shows enough of the pen, or none does.
    """
    for c, seen in enumerate((detection, *detection.others)):
        if seen.has_pose and seen.n_leds >= certain_leds(pen) and not seen.is_blurred:
            return detection if c == 0 else _posed_by(rig, detection, c)
    return detection


def fit_moments(
    rig: Rig,
    pen: Pen,
    pixels: FloatArray,
    rotations: FloatArray,
    translations: FloatArray,
) -> SimultaneousPoses:
    """Fit the pose of each moment to the LEDs in one camera, as when captured.

    The fit to pixels (N, C, L, 2), NaN where an LED was not seen, starts at rotations
    (N, 3, 3) and translations (N, 3), mm, of rig_from_pen.
    """
    n_seen = np.isfinite(pixels[..., 0]).sum(axis=2)
    enough = n_seen >= certain_leds(pen)
    cameras = np.where(enough.any(axis=1), enough.argmax(axis=1), n_seen.argmax(axis=1))
    n_moments = len(pixels)
    found = SimultaneousPoses(
        rotations.copy(),
        translations.copy(),
        np.zeros((n_moments, 6, 6)),
        np.zeros(n_moments),
    )
    for c, camera in enumerate(rig.cameras):
        at = np.flatnonzero(cameras == c)
        if not len(at):
            continue
        R, t = rig.rotations[c], rig.translations[c]
        start = R @ rotations[at], translations[at] @ R.T + t
        poses = fit_poses(camera, pen, pixels[at, c], *start)
        cofactors = poses.covariances / poses.sigma**2
        by_rig = poses_in_rig(rig, c, poses.rotations, poses.translations, cofactors)
        found.rotations[at], found.translations[at], found.cofactors[at] = by_rig
        found.sigmas[at] = poses.sigma
    return found


def _posed_by(rig: Rig, detection: PenDetection, c: int) -> PenDetection:
    """Return the detection with the pose by the c-th camera."""
    seen = detection.others[c - 1]
    R, t, cofactors = poses_in_rig(
        rig, c, seen.rotation[None], seen.translation[None], seen.cofactors[None]
    )
    return replace(
        detection,
        reason=Reason.NONE,
        rotation=R[0],
        translation=t[0],
        cofactors=cofactors[0],
        sigma=seen.sigma,
        posed_by=c,
    )


MIN_JOINT = 8  # images of the first joint fit
LEAVING = 0.01  # probability that an image is excluded though the tip rests
MAX_PASSES = 3  # of looking for slipped images
RENEWED = 0.04  # of the images, which change U by 2 %; then it is predicted anew
NO_NOISE = 1e-4  # px, less than any camera has


@dataclass(frozen=True, eq=False)
class AcceptedImages:
    """N accepted images and the fit to them."""

    numbers: IntArray  # (N,), in the swing's record
    times: FloatArray  # (N,), seconds
    pixels: FloatArray  # (N, C, L, 2), ellipse centres, px; NaN where one was not seen
    rotations: FloatArray  # (N, 3, 3), of each image alone, first cam_from_pen
    translations: FloatArray  # (N, 3), mm
    cofactors: FloatArray  # (N, 6, 6), covariances for a noise of 1 px, rad and mm
    sigmas: FloatArray  # (N,), noise of each image alone, px
    assumed: Assumptions = USUAL
    seat: Seat | None = None  # tip and cone by the best fit there is
    joint: JointFit | None = None  # as soon as the postures allow one
    predicted: PredictedUncertainty = UNKNOWN_UNCERTAINTY

    def __len__(self) -> int:
        return len(self.numbers)

    @property
    def uncertainty(self) -> float:
        """U (k = 2) of the tip along its weakest direction, mm; infinite at first."""
        return self.predicted.uncertainty

    @property
    def sigma(self) -> float:
        """Noise of one image coordinate that the images share, px."""
        if self.joint is not None:
            return max(self.joint.sigma, NO_NOISE)
        return max(float(np.median(self.sigmas)), NO_NOISE) if len(self) else NO_NOISE

    @property
    def misfits(self) -> FloatArray:
        """Root mean square residual of each image in the joint fit, px, (N,).

        Of an image that the fit leaves out, over all LEDs that it shows.
        """
        if self.joint is None:
            return self.sigmas
        squares = np.einsum("nli,nli->nl", self.joint.residuals, self.joint.residuals)
        used = self.joint.used
        takes_part = used.any(axis=1, keepdims=True)
        counted = np.where(takes_part, used, np.isfinite(squares))
        total = np.sum(squares, axis=1, where=counted)
        return np.asarray(np.sqrt(total / np.maximum(counted.sum(axis=1), 1)))


def none_kept(
    n_cameras: int, n_leds: int, assumed: Assumptions = USUAL
) -> AcceptedImages:
    """Return no images of a pen with this number of LEDs."""
    return AcceptedImages(
        numbers=np.zeros(0, dtype=np.int64),
        times=np.zeros(0),
        pixels=np.zeros((0, n_cameras, n_leds, 2)),
        rotations=np.zeros((0, 3, 3)),
        translations=np.zeros((0, 3)),
        cofactors=np.zeros((0, 6, 6)),
        sigmas=np.zeros(0),
        assumed=assumed,
    )


def kept_before(
    rig: Rig,
    pen: Pen,
    numbers: IntArray,
    pixels: FloatArray,
    rotations: FloatArray,
    translations: FloatArray,
    assumed: Assumptions = USUAL,
) -> AcceptedImages:
    """Return the images accepted before an interruption, with their fit.

    They have numbers (N,) in the swing's record, pixels (N, C, L, 2), NaN where an LED
    was not seen, and rotations (N, 3, 3) and translations (N, 3), mm, of rig_from_pen.
    """
    if not len(numbers):
        return none_kept(rig.n_cameras, pen.n_leds, assumed)
    poses = fit_moments(rig, pen, pixels, rotations, translations)
    kept = AcceptedImages(
        numbers=numbers,
        times=np.full(len(numbers), -np.inf),
        pixels=pixels,
        rotations=poses.rotations,
        translations=poses.translations,
        cofactors=poses.cofactors,
        sigmas=poses.sigmas,
        assumed=assumed,
    )
    return _refit(rig, pen, kept, poses.rotations)


def keep(
    rig: Rig,
    pen: Pen,
    kept: AcceptedImages,
    detection: PenDetection,
    number: int,
    time: float,
) -> AcceptedImages:
    """Return the images with one more, and the fit to all of them."""
    longer = AcceptedImages(
        numbers=np.append(kept.numbers, number),
        times=np.append(kept.times, time),
        pixels=np.concatenate([kept.pixels, detection.rig_pixels[None]]),
        rotations=np.concatenate([kept.rotations, detection.rotation[None]]),
        translations=np.concatenate([kept.translations, detection.translation[None]]),
        cofactors=np.concatenate([kept.cofactors, detection.cofactors[None]]),
        sigmas=np.append(kept.sigmas, detection.sigma),
        assumed=kept.assumed,
    )
    if kept.joint is None:
        return _refit(rig, pen, longer, longer.rotations)
    starts = np.concatenate([kept.joint.rotations, detection.rotation[None]])
    longer = replace(longer, seat=kept.seat, predicted=kept.predicted)
    return _refit(rig, pen, longer, starts, is_near=True)


def first_images(
    rig: Rig, pen: Pen, kept: AcceptedImages, n_images: int
) -> AcceptedImages:
    """Return the first of the images, and the fit to them."""
    out = np.arange(len(kept)) >= n_images
    return _leave_out(rig, pen, kept, out, is_near=kept.joint is not None)


def _leave_out(
    rig: Rig, pen: Pen, kept: AcceptedImages, out: BoolArray, *, is_near: bool = False
) -> AcceptedImages:
    """Return the images without ``out`` (N,), and the new fit.

    ``is_near`` is for images that are as good as those that stay.
    """
    stay = ~out
    starts = kept.rotations if kept.joint is None else kept.joint.rotations
    rest = replace(
        kept,
        numbers=kept.numbers[stay],
        times=kept.times[stay],
        pixels=kept.pixels[stay],
        rotations=kept.rotations[stay],
        translations=kept.translations[stay],
        cofactors=kept.cofactors[stay],
        sigmas=kept.sigmas[stay],
        joint=None,
        predicted=UNKNOWN_UNCERTAINTY,
    )
    return _refit(rig, pen, rest, starts[stay], is_near=is_near) if len(rest) else rest


def _refit(
    rig: Rig,
    pen: Pen,
    kept: AcceptedImages,
    starts: FloatArray,
    *,
    is_near: bool = False,
) -> AcceptedImages:
    """Return the images with a new fit that starts at rotations (N, 3, 3)."""
    before = kept.predicted
    kept = replace(kept, joint=None, predicted=UNKNOWN_UNCERTAINTY)
    fixed = len(kept) >= MIN_JOINT and posture_spread(starts)[0][0] >= MIN_SPREAD
    seat = kept.seat
    if seat is None or not fixed:
        covariances = kept.cofactors * kept.sigma**2
        seat = fit_seat(pen, kept.rotations, kept.translations, covariances)
    if not fixed:
        return replace(kept, seat=seat)
    try:
        joint = fit_contact(
            ContactModel(rig, pen, kept.pixels),
            starts,
            seat.tip_pen,
            seat.cone_cam,
            is_near=is_near,
        )
    except CalibrationError:  # an image too bad to settle; the next ones may help
        return replace(kept, seat=seat)
    used = joint.used.any(axis=1)
    if posture_spread(joint.rotations[used])[0][0] < MIN_SPREAD:
        return replace(kept, seat=seat)  # as the solution of the whole swing judges
    fitted = Seat(joint.tip_pen, joint.cone_cam, joint.covariance)
    sigma = max(joint.sigma, NO_NOISE)
    if before.n_images < (1 - RENEWED) * len(kept):
        before = predict_uncertainty(rig, pen, kept.pixels, joint, sigma, kept.assumed)
    return replace(kept, seat=fitted, joint=joint, predicted=before)


def distance_unit(kept: AcceptedImages) -> float:
    """Return the median distance of accepted images over its expectation, 1 or more.

    A model that fits worse than the covariances say (geometry errors, a worn cone)
    must not cost good images, as in `lightpen.estimation.pivot.pivot`.
    """
    if len(kept) < MIN_JOINT:
        return 1.0
    return max(1.0, float(np.median(_distances(kept))) / median_distance())


def without_slipped(
    rig: Rig, pen: Pen, kept: AcceptedImages, since: float = np.inf
) -> tuple[AcceptedImages, set[int]]:
    """Exclude images with the tip out of the cone; return the rest and the numbers.

    From the time ``since`` on, s, an image need not be far out: it was taken when the
    tip was about to leave.
    """
    numbers = set[int]()
    for _ in range(MAX_PASSES):
        thresholds = np.where(
            kept.times >= since, chi_quantile(3, LEAVING), outlier_distance()
        )
        out = _distances(kept) > thresholds * distance_unit(kept)
        if not out.any():
            break
        numbers |= set(map(int, kept.numbers[out]))
        kept = _leave_out(rig, pen, kept, out)
    return kept, numbers


def _distances(kept: AcceptedImages) -> FloatArray:
    if kept.seat is None or not len(kept):
        return np.zeros(len(kept))
    covariances = kept.cofactors * kept.sigma**2
    return tip_distances(kept.seat, kept.rotations, kept.translations, covariances)
