"""A fixed point measured again and again in new postures: the paper's Table 2.

A tip that is right stays where it is, however the pen is held; one that is off by d in
the pen's frame moves by ``R_i d``. So where the points scatter, the postures tell by
which tip they would not.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.instrument import Instrument
from lightpen.estimation.uncertainty import COVERAGE_FACTOR
from lightpen.model.coverage import posture_spread
from lightpen.model.limits import VerificationLimits
from lightpen.sentences import Sentence, sentence
from lightpen.verification.assessment import (
    CALIBRATE_AGAIN,
    VERIFY_AGAIN,
    Conformity,
    accepted,
    check,
    refused,
)
from lightpen.verification.touch import NO_DRIFT, Touch, joint_covariance, with_tip

USUAL_TOUCHES = 10
MIN_TOUCHES = 3
MIN_SPREAD = np.radians(3.0)  # rms turn of the best direction; less proves nothing
ASTRAY = 8.0  # times the median distance from the middle
LIFTED = 0.2  # mm; nearer points scatter, farther ones may be of a lifted pen
TIP_SIGMA = 3.0  # mm, by which another tip may differ
SEATING = 0.003  # mm, of a tip in a good cone
TIP_GATE = 4.03  # square root of chi-square, 3 degrees of freedom, at 1e-3
WORTH_TELLING = 0.01  # mm, of another tip


@dataclass(frozen=True, eq=False)
class Scatter:
    """Coordinates of a point measured several times, mm.

    Attributes
    ----------
    points : (N, 3) array
    """

    points: FloatArray

    @property
    def mean(self) -> FloatArray:
        """Of each coordinate, (3,)."""
        return np.asarray(self.points.mean(axis=0))

    @property
    def deviation(self) -> FloatArray:
        """Standard deviation of each coordinate, (3,)."""
        return np.asarray(self.points.std(axis=0, ddof=1))

    @property
    def range(self) -> FloatArray:
        """Largest minus smallest of each coordinate, (3,)."""
        return np.asarray(np.ptp(self.points, axis=0))


@dataclass(frozen=True, eq=False)
class FixedPoint:
    """A fixed point by N touches.

    Attributes
    ----------
    left_out : tuple of Touch
        Far from all others: the pen was lifted.
    nominal : Scatter or None
        The same images with the nominal tip; None where it is not known.
    uncertainty : (3,) array
        U (k = 2) of the mean, mm.
    expected_deviation : (3,) array
        Standard deviation of the touches by all that is known of them, mm.
    tip_change : (3,) array
        By which tip, less the given one, the points would scatter least, mm.
    tip_change_uncertainty : (3,) array
        U (k = 2) of it, mm.
    wants_other_tip : bool
        Whether that tip differs by more than chance.
    moved : (3,) array or None
        Mean less the cone of the calibration, mm; None before another camera.
    """

    touches: tuple[Touch, ...]
    left_out: tuple[Touch, ...]
    calibrated: Scatter
    nominal: Scatter | None
    uncertainty: FloatArray
    expected_deviation: FloatArray
    tip_change: FloatArray
    tip_change_uncertainty: FloatArray
    wants_other_tip: bool
    moved: FloatArray | None
    assessment: Conformity


def measure_fixed_point(
    touches: Sequence[Touch],
    instrument: Instrument,
    limits: VerificationLimits,
    nominal_tip: FloatArray | None = None,
    cone_cam: FloatArray | None = None,
    drift: FloatArray = NO_DRIFT,
) -> FixedPoint:
    """Measure a fixed point and judge the tip by its scatter.

    Parameters
    ----------
    nominal_tip : (3,) array, optional
        mm, to be shown beside.
    cone_cam : (3,) array, optional
        Where the calibration had the same cone before the same camera, mm.
    drift : (3,) array
        Standard uncertainty of a point by a camera that moved meanwhile, mm.

    Raises
    ------
    CalibrationError
        There are too few touches of one point.
    """
    kept, left_out = _at_one_place(touches)
    calibrated = scatter_of(kept)
    covariance = joint_covariance(kept, instrument)
    change, change_covariance = _other_tip(kept)
    spread = change_covariance + instrument.covariance[:3, :3]
    distance = float(np.sqrt(change @ np.linalg.solve(spread, change)))
    n = len(kept)
    blocks = covariance.reshape(n, 3, n, 3)
    of_mean = blocks.sum(axis=(0, 2)) / n**2
    own = np.einsum("nini->i", blocks) / n
    expected = np.sqrt(np.maximum((own - np.diag(of_mean)) * n / (n - 1), 0.0))
    found = FixedPoint(
        touches=kept,
        left_out=left_out,
        calibrated=calibrated,
        nominal=nominal_scatter(kept, instrument, nominal_tip),
        uncertainty=COVERAGE_FACTOR * np.sqrt(np.diag(of_mean) + drift**2),
        expected_deviation=expected,
        tip_change=change,
        tip_change_uncertainty=COVERAGE_FACTOR * np.sqrt(np.diag(change_covariance)),
        wants_other_tip=distance > TIP_GATE
        and float(np.linalg.norm(change)) > WORTH_TELLING,
        moved=None if cone_cam is None else calibrated.mean - cone_cam,
        assessment=accepted(_steady(calibrated)),
    )
    return replace(found, assessment=_assessment(found, limits))


def _steady(scatter: Scatter) -> Sentence:
    u, v, w = scatter.deviation.tolist()
    return sentence(
        "fixed-point.steady",
        "The point stays within {u:.4f} {v:.4f} {w:.4f} mm (standard deviation along "
        "u v w) however the pen is held.",
        u=u,
        v=v,
        w=w,
    )


def scatter_of(touches: Sequence[Touch]) -> Scatter:
    """Return the coordinates of touches."""
    return Scatter(np.array([touch.point_cam for touch in touches]))


def nominal_scatter(
    touches: Sequence[Touch], instrument: Instrument, nominal_tip: FloatArray | None
) -> Scatter | None:
    """Return the coordinates of touches with the nominal tip; None if not known."""
    if nominal_tip is None:
        return None
    return scatter_of([with_tip(each, instrument, nominal_tip) for each in touches])


def _at_one_place(
    touches: Sequence[Touch],
) -> tuple[tuple[Touch, ...], tuple[Touch, ...]]:
    if not touches:
        raise _too_few(0)
    points = scatter_of(touches).points
    distances = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    limit = max(ASTRAY * float(np.median(distances)), LIFTED)
    kept = tuple(t for t, d in zip(touches, distances, strict=True) if d <= limit)
    left_out = tuple(t for t, d in zip(touches, distances, strict=True) if d > limit)
    if len(kept) < MIN_TOUCHES:
        raise _too_few(len(kept))
    return kept, left_out


def _too_few(n_touches: int) -> CalibrationError:
    return CalibrationError(
        sentence(
            "fixed-point.too-few",
            "{n_touches} touches of the point can be used, at least {needed} are "
            "needed, {usual} are usual. Touch the cone again, each time in another "
            "posture.",
            n_touches=n_touches,
            needed=MIN_TOUCHES,
            usual=USUAL_TOUCHES,
        )
    )


def _other_tip(touches: Sequence[Touch]) -> tuple[FloatArray, FloatArray]:
    """Return by which change of the tip the points meet best, and its covariance.

    What all touches share moves the point as a whole, and hardly their scatter; where
    the points scatter by more than their noise, so does the change.
    """
    prior = np.diag([TIP_SIGMA**-2] * 3 + [0.0] * 3)
    middle = np.mean([touch.point_cam for touch in touches], axis=0)
    A = np.array([np.hstack([touch.rotation, -np.eye(3)]) for touch in touches])
    b = middle - np.array([touch.point_cam for touch in touches])
    W = np.linalg.inv([touch.noise + SEATING**2 * np.eye(3) for touch in touches])
    AtW = np.swapaxes(A, 1, 2) @ W
    covariance = np.linalg.inv(prior + (AtW @ A).sum(axis=0))
    step = covariance @ np.einsum("nij,nj->i", AtW, b)
    left = b - A @ step
    n_free = max(3 * len(touches) - len(step), 1)
    excess = max(float(np.einsum("ni,nij,nj->", left, W, left)) / n_free, 1.0)
    return np.asarray(step[:3]), np.asarray(excess * covariance[:3, :3])


def _assessment(found: FixedPoint, limits: VerificationLimits) -> Conformity:
    deviation = found.calibrated.deviation
    allowed = np.array([limits.across, limits.across, limits.along])
    axis = int(np.argmax(deviation / allowed))
    is_beyond = bool(deviation[axis] > allowed[axis])
    if found.wants_other_tip and is_beyond:
        x, y, z = found.tip_change.tolist()
        return refused(
            sentence(
                "fixed-point.other-tip",
                "The point moves as the pen leans, by {deviation:.4f} mm along {axis} "
                "(limit {limit:.4f} mm): the tip sits {x:+.4f} {y:+.4f} {z:+.4f} mm "
                "from where it was calibrated. Was it exchanged, bent or screwed in "
                "anew, or is it the tip of another pen?",
                deviation=float(deviation[axis]),
                axis="uvw"[axis],
                limit=float(allowed[axis]),
                x=x,
                y=y,
                z=z,
            ),
            CALIBRATE_AGAIN,
        )
    if is_beyond:
        return refused(
            sentence(
                "fixed-point.scatters",
                "The point scatters by {deviation:.4f} mm along {axis} (standard "
                "deviation, limit {limit:.4f} mm), which no other tip would mend. The "
                "tip may not rest in the cone: look for dirt, wear and a loose cone.",
                deviation=float(deviation[axis]),
                axis="uvw"[axis],
                limit=float(allowed[axis]),
            ),
            VERIFY_AGAIN,
        )
    spread = float(
        posture_spread(np.array([touch.rotation for touch in found.touches]))[0][-1]
    )
    if spread < MIN_SPREAD:
        return check(
            sentence(
                "fixed-point.same-posture",
                "The pen was held alike each time: its postures differ by {found:.1f} "
                "degrees (rms), {needed:.0f} are needed to prove a tip. Lean it to all "
                "sides.",
                found=float(np.degrees(spread)),
                needed=float(np.degrees(MIN_SPREAD)),
            ),
            VERIFY_AGAIN,
        )
    if found.left_out:
        return check(
            sentence(
                "fixed-point.lifted",
                "{n_left_out} of {n_touches} touches lie elsewhere and were left out, "
                "the first {first}: the pen was lifted there, or slipped.",
                n_left_out=len(found.left_out),
                n_touches=len(found.left_out) + len(found.touches),
                first=found.left_out[0].label,
            ),
            VERIFY_AGAIN,
        )
    return found.assessment
