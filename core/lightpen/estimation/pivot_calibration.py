"""Pivot calibration from poses of another system, with its warnings.

`lightpen.estimation.pivot.pivot.fit_pivot` trusts the poses. Here they are judged
first: by their convention, and by whether they are of one tip in one place. The
uncertainty accounts for residuals that are correlated from pose to pose.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.errors import CalibrationError
from lightpen.estimation.pivot.pivot import (
    PivotFit,
    agreeing_solution,
    contact_matrix,
    contact_residuals,
    fit_pivot,
    require_poses,
    tip_covariances,
)
from lightpen.estimation.pivot.pivot_groups import (
    PoseGroups,
    correlated_covariance,
    find_groups,
)
from lightpen.messages import Message, message
from lightpen.model.coverage import COVERAGE_FACTOR

# Detection of other conventions of poses: frames, order of numbers, units.
#
# Poses in another convention are valid rotations and translations and may even fit a
# tip badly; only their scatter shows it. So each usual mistake is undone in turn; one
# that brings the poses much closer to a common tip is reported.
#
# Inverted poses are the exception. They fit as well, since ``R tip + t = pivot`` also
# reads ``R^T pivot - R^T t = tip``: tip and pivot change places. Only a tip farther
# from its pen than from the camera gives them away, which may be true: that is
# reported, not refused.


Poses: TypeAlias = tuple[FloatArray, FloatArray]

MUCH_CLOSER = 0.6  # of the scatter as read
ROUNDING = 1e-6  # of the length of the translations: scatter of exact poses
AGREEING = 0.5  # of the poses, at least
FEW = 20  # poses; half of fewer would agree with anything
AGREEING_OF_FEW = 0.9
MAX_LOOKED_AT = 200  # poses examined; all have one convention
SHORT = 10.0  # mm; no tracked pen is that close to its tracker in most poses
LONG = 10_000.0  # mm; no pen is that long
MAX_SCATTER = 20.0  # mm; no tip rests so badly
USUAL_SCATTER = 5.0  # mm; more is no noise if the poses move by little more
MAX_SHARE = 0.4  # of the movement of the poses, that a tip leaves over


@dataclass(frozen=True)
class _PoseMistake:
    """A usual mistake: how it is undone, and its message."""

    undo: Callable[[FloatArray, FloatArray], Poses]
    remark: Callable[[float, float], Message]


def require_usual_reading(rotations: FloatArray, translations: FloatArray) -> None:
    """Raise `CalibrationError` if poses are not cam_from_pen, mm, or have no tip.

    It says what they look like, and what is needed.
    """
    typical = float(np.median(np.linalg.norm(translations, axis=1)))
    if typical < SHORT:
        raise CalibrationError("poses.in-metres", typical=typical)
    chosen = np.unique(
        np.linspace(0, len(rotations) - 1, MAX_LOOKED_AT).round().astype(int)
    )
    R, t = rotations[chosen], translations[chosen]
    as_read = _scatter(R, t)
    undone = [_scatter(*mistake.undo(R, t)) for mistake in _MISTAKES]
    likeliest = int(np.argmin(undone))
    closer = undone[likeliest] < MUCH_CLOSER * as_read
    if closer and as_read > ROUNDING * typical:
        raise CalibrationError(_MISTAKES[likeliest].remark(as_read, undone[likeliest]))
    _require_tip(R, t, as_read)


def is_likely_inverted(tip_pen: FloatArray, pivot_cam: FloatArray) -> bool:
    """Return whether a tip is farther from its pen than from the camera."""
    return bool(np.linalg.norm(tip_pen) > np.linalg.norm(pivot_cam))


def _require_tip(R: FloatArray, t: FloatArray, scatter: float) -> None:
    length = float(np.linalg.norm(_solution(R, t)[:3]))
    if length > LONG:
        raise CalibrationError("poses.in-micrometres", length=length / 1000)
    movement = float(np.median(np.linalg.norm(t - np.median(t, axis=0), axis=1)))
    unexplained = scatter > USUAL_SCATTER and scatter > MAX_SHARE * movement
    if scatter > MAX_SCATTER or unexplained:
        raise CalibrationError("poses.no-tip", scatter=scatter, movement=movement)


def _scatter(rotations: FloatArray, translations: FloatArray) -> float:
    """Return the median distance of the poses' tips from their pivot, mm."""
    solution = _solution(rotations, translations)
    residuals = contact_residuals(rotations, translations, solution[:3], solution[3:])
    return float(np.median(np.linalg.norm(residuals, axis=1)))


def _solution(rotations: FloatArray, translations: FloatArray) -> FloatArray:
    share = AGREEING_OF_FEW if len(rotations) <= FEW else AGREEING
    return agreeing_solution(rotations, translations, share)


def _transposed(rotations: FloatArray) -> FloatArray:
    return np.swapaxes(rotations, 1, 2)


def _with_scalar_moved(rotations: FloatArray, places: int) -> FloatArray:
    """Return rotations from quaternions with the scalar at the other end."""
    from scipy.spatial.transform import Rotation  # takes 0.2 s

    quaternions = Rotation.from_matrix(rotations).as_quat()
    return np.asarray(Rotation.from_quat(np.roll(quaternions, places, 1)).as_matrix())


def _flipped(axis: int) -> _PoseMistake:
    return _PoseMistake(
        lambda R, t: (R, t * np.where(np.arange(3) == axis, -1.0, 1.0)),
        lambda as_read, undone: message(
            "poses.flipped", axis="xyz"[axis], as_read=as_read, undone=undone
        ),
    )


def _quaternion_message(as_read: float, undone: float) -> Message:
    return message("poses.quaternion-order", as_read=as_read, undone=undone)


_MISTAKES = (
    _PoseMistake(
        lambda R, t: (_transposed(R), t),
        lambda as_read, undone: message(
            "poses.transposed", as_read=as_read, undone=undone
        ),
    ),
    _PoseMistake(lambda R, t: (_with_scalar_moved(R, 1), t), _quaternion_message),
    _PoseMistake(lambda R, t: (_with_scalar_moved(R, -1), t), _quaternion_message),
    *(_flipped(axis) for axis in range(3)),
)


LARGEST_MINORITY = 0.4  # of the poses; with more the tip is ambiguous
MANY_LEFT_OUT = 0.1  # of the poses
MAX_RUNS = 10  # of neighbouring poses, that a warning names; the record has all

COVERED = message("pivot.covered")
NOT_COVERED = message("pivot.not-covered")


@dataclass(frozen=True, eq=False)
class PivotCalibration:
    """Tip and pivot of poses, with covariance and warnings."""

    fit: PivotFit  # its covariance assumes independent noise
    # (6, 6), of (tip_pen, pivot_cam) by correlated residuals, mm^2.
    covariance: FloatArray
    # Set if the poses have two tips or pivots; the fit uses the larger group.
    groups: PoseGroups | None
    warnings: tuple[Message, ...]

    @property
    def expanded_uncertainty(self) -> FloatArray:
        """U (k = 2) of tip_pen and pivot_cam, (6,), mm."""
        return COVERAGE_FACTOR * np.sqrt(np.diag(self.covariance))

    @property
    def correlation_factor(self) -> float:
        """Variance inflation of tip and pivot by correlated residuals, on average."""
        independent = np.linalg.inv(self.fit.covariance)
        return float(np.trace(independent @ self.covariance)) / 6


def calibrate_pivot(
    rotations: FloatArray,
    translations: FloatArray,
    covariances: FloatArray | None = None,
    *,
    robust: bool = True,
    places: IntArray | None = None,
) -> PivotCalibration:
    """Find the tip from poses in the order of capture.

    ``places`` (N,) are their numbers for messages; parameters else as of
    `lightpen.estimation.pivot.pivot.fit_pivot`. Raises
    `CalibrationError` if the poses do not fix a tip, are in another convention or unit,
    have no tip in common, or have two without a clear majority.
    """
    require_poses(rotations)
    require_usual_reading(rotations, translations)
    agreeing = fit_pivot(rotations, translations).used
    groups = find_groups(rotations, translations, agreeing)
    if places is None:
        places = np.arange(len(rotations)) + 1
    left_out = np.zeros(len(rotations), dtype=bool)
    if groups is not None and robust:
        _require_majority(groups, places)
        left_out = groups.group == 2
    fit = fit_pivot(
        rotations, translations, covariances, robust=robust, candidates=~left_out
    )
    return PivotCalibration(
        fit=fit,
        covariance=_covariance(rotations, covariances, fit),
        groups=groups,
        warnings=tuple(_warnings(fit, groups, left_out, places)),
    )


def _names(chosen: BoolArray, max_runs: int, places: IntArray) -> str:
    """Return the chosen poses (N,) as text, by their place in the file from 1."""
    indices = np.flatnonzero(chosen)
    runs = np.split(places[indices], np.flatnonzero(np.diff(indices) > 1) + 1)
    named = [
        f"{run[0]}" if len(run) == 1 else f"{run[0]}-{run[-1]}"
        for run in runs[:max_runs]
    ]
    return ", ".join(named) + (", ..." if len(runs) > max_runs else "")


def _covariance(
    rotations: FloatArray, covariances: FloatArray | None, fit: PivotFit
) -> FloatArray:
    """Return the covariance of tip and pivot by the residuals of the used poses."""
    design = contact_matrix(rotations[fit.used])
    residuals = fit.residuals[fit.used]
    if covariances is None:
        return correlated_covariance(design, residuals)
    of_tips = tip_covariances(rotations[fit.used], covariances[fit.used], fit.tip_pen)
    roots = np.linalg.cholesky(of_tips)
    return correlated_covariance(
        np.linalg.solve(roots, design),
        np.linalg.solve(roots, residuals[..., None])[..., 0],
        least=1.0,
    )


def _require_majority(groups: PoseGroups, places: IntArray) -> None:
    if groups.minor_share > LARGEST_MINORITY:
        raise CalibrationError(
            _parted(groups, _CALIBRATE_EACH, len(groups.group), places)
        )


_CALIBRATE_EACH = message("pivot.calibrate-each")
_MINORITY_LEFT_OUT = message("pivot.minority-left-out")
_BOTH_TAKEN = message("pivot.both-taken")


def _parted(
    groups: PoseGroups, consequence: Message, max_runs: int, places: IntArray
) -> Message:
    """Return the message on two groups of poses, and the consequence."""
    first, second = (_names(groups.group == name, max_runs, places) for name in (1, 2))
    if groups.has_two_tips:
        return message(
            "pivot.two-tips",
            distance=groups.tip_distance,
            first=first,
            second=second,
            consequence=consequence,
        )
    return message(
        "pivot.two-pivots",
        distance=groups.pivot_distance,
        first=first,
        second=second,
        consequence=consequence,
    )


def _warnings(
    fit: PivotFit, groups: PoseGroups | None, left_out: BoolArray, places: IntArray
) -> list[Message]:
    warnings = []
    if groups is not None:
        consequence = _MINORITY_LEFT_OUT if left_out.any() else _BOTH_TAKEN
        warnings.append(_parted(groups, consequence, MAX_RUNS, places))
    scattered = ~fit.used & ~left_out
    if scattered.mean() > MANY_LEFT_OUT:
        warnings.append(
            message(
                "pivot.many-left-out",
                n_left_out=int(scattered.sum()),
                n_poses=len(scattered),
                poses=_names(scattered, MAX_RUNS, places),
            )
        )
    if is_likely_inverted(fit.tip_pen, fit.pivot_cam):
        warnings.append(
            message(
                "poses.likely-inverted",
                tip=float(np.linalg.norm(fit.tip_pen)),
                pivot=float(np.linalg.norm(fit.pivot_cam)),
            )
        )
    return warnings
