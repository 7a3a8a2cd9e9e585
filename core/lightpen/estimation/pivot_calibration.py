"""Pivot calibration from poses of another system, with its warnings.

`lightpen.estimation.pivot.pivot.fit_pivot` trusts the poses. Here they are judged
first: by their convention, and by whether they are of one tip in one place. The
uncertainty accounts for residuals that are correlated from pose to pose.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.errors import CalibrationError
from lightpen.estimation.pivot.pivot import (
    PivotFit,
    contact_matrix,
    fit_pivot,
    require_poses,
    tip_covariances,
)
from lightpen.estimation.pivot.pivot_groups import PoseGroups, find_groups
from lightpen.estimation.pivot.pose_conventions import (
    is_likely_inverted,
    require_usual_reading,
)
from lightpen.estimation.statistics.correlation import correlated_covariance
from lightpen.messages import Message, message
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR

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
