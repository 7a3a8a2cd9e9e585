"""The tip from poses of another system, with what they leave in doubt.

`lightpen.estimation.pivot.fit_pivot` takes poses at their word. Here they are judged
first: by their convention, and by whether they are of one tip in one place. The
uncertainty is that of residuals which hang together from pose to pose.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.correlation import correlated_covariance
from lightpen.estimation.pivot import (
    PivotFit,
    contact_matrix,
    fit_pivot,
    require_poses,
    tip_covariances,
)
from lightpen.estimation.pivot_groups import PoseGroups, find_groups
from lightpen.estimation.pose_readings import (
    is_likely_inverted,
    require_usual_reading,
)
from lightpen.estimation.uncertainty import COVERAGE_FACTOR
from lightpen.sentences import Sentence, sentence

LARGEST_MINORITY = 0.4  # of the poses; with more nobody knows which tip is meant
MANY_LEFT_OUT = 0.1  # of the poses
MAX_RUNS = 10  # of neighbouring poses, that a warning names; the record has all

COVERED = sentence(
    "pivot.covered",
    "the scatter of the poses, and that it hangs together from pose to pose",
)
NOT_COVERED = sentence(
    "pivot.not-covered",
    "what stays the same in all poses: the scale of the tracker and of the pen, a tip "
    "that is worn or does not seat",
)


@dataclass(frozen=True, eq=False)
class PivotCalibration:
    """Tip and pivot of poses, and what to know about them.

    Attributes
    ----------
    fit : PivotFit
        Its covariance is that of independent noise.
    covariance : (6, 6) array
        Of (tip_pen, pivot_cam), with residuals that hang together, mm^2.
    groups : PoseGroups or None
        Where the poses have two tips or pivots; the fit is that of the larger group.
    warnings : tuple of Sentence
        What the user should look into.
    """

    fit: PivotFit
    covariance: FloatArray
    groups: PoseGroups | None
    warnings: tuple[Sentence, ...]

    @property
    def expanded_uncertainty(self) -> FloatArray:
        """U (k = 2) of tip_pen and pivot_cam, (6,), mm."""
        return COVERAGE_FACTOR * np.sqrt(np.diag(self.covariance))

    @property
    def correlation_factor(self) -> float:
        """Variance of tip and pivot over that of independent noise, on average."""
        independent = np.linalg.inv(self.fit.covariance)
        return float(np.trace(independent @ self.covariance)) / 6


def calibrate_pivot(
    rotations: FloatArray,
    translations: FloatArray,
    covariances: FloatArray | None = None,
    *,
    robust: bool = True,
) -> PivotCalibration:
    """Find the tip from poses in the order of capture.

    Its parameters are those of `lightpen.estimation.pivot.fit_pivot`.

    Raises
    ------
    CalibrationError
        The poses do not fix a tip, are in another convention or unit, have no tip in
        common, or have two without a clear majority.
    """
    require_poses(rotations)
    require_usual_reading(rotations, translations)
    agreeing = fit_pivot(rotations, translations).used
    groups = find_groups(rotations, translations, agreeing)
    left_out = np.zeros(len(rotations), dtype=bool)
    if groups is not None and robust:
        _require_majority(groups)
        left_out = groups.group == 2
    fit = fit_pivot(
        rotations, translations, covariances, robust=robust, candidates=~left_out
    )
    return PivotCalibration(
        fit=fit,
        covariance=_covariance(rotations, covariances, fit),
        groups=groups,
        warnings=tuple(_warnings(fit, groups, left_out)),
    )


def _names(chosen: BoolArray, max_runs: int) -> str:
    """Return the chosen poses (N,) in words, by their place in the file from 1."""
    places = np.flatnonzero(chosen) + 1
    runs = np.split(places, np.flatnonzero(np.diff(places) > 1) + 1)
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


def _require_majority(groups: PoseGroups) -> None:
    if groups.minor_share > LARGEST_MINORITY:
        raise CalibrationError(_parted(groups, _CALIBRATE_EACH, len(groups.group)))


_CALIBRATE_EACH = sentence(
    "pivot.calibrate-each", "Calibrate each of both from a file of its own."
)
_MINORITY_LEFT_OUT = sentence(
    "pivot.minority-left-out", "The tip is that of the first, which are more."
)
_BOTH_TAKEN = sentence(
    "pivot.both-taken", "All of them were taken, so the tip lies between both."
)


def _parted(groups: PoseGroups, consequence: Sentence, max_runs: int) -> Sentence:
    """Say which poses belong together, and what follows."""
    first, second = (_names(groups.group == name, max_runs) for name in (1, 2))
    if groups.has_two_tips:
        return sentence(
            "pivot.two-tips",
            "The poses are of two tips, {distance:.2f} mm apart in the pen, as if the "
            "tip had been exchanged or had slipped in its holder. One: poses {first}. "
            "The other: poses {second}. {consequence}",
            distance=groups.tip_distance,
            first=first,
            second=second,
            consequence=consequence,
        )
    return sentence(
        "pivot.two-pivots",
        "The tip rested on two points, {distance:.2f} mm apart, as if cone or tracker "
        "had moved. On one: poses {first}. On the other: poses {second}. {consequence}",
        distance=groups.pivot_distance,
        first=first,
        second=second,
        consequence=consequence,
    )


def _warnings(
    fit: PivotFit, groups: PoseGroups | None, left_out: BoolArray
) -> list[Sentence]:
    warnings = []
    if groups is not None:
        told = _MINORITY_LEFT_OUT if left_out.any() else _BOTH_TAKEN
        warnings.append(_parted(groups, told, MAX_RUNS))
    scattered = ~fit.used & ~left_out
    if scattered.mean() > MANY_LEFT_OUT:
        warnings.append(
            sentence(
                "pivot.many-left-out",
                "{n_left_out} of {n_poses} poses agree with no common tip and were "
                "left out: {poses}. Look for what disturbed the tracking.",
                n_left_out=int(scattered.sum()),
                n_poses=len(scattered),
                poses=_names(scattered, MAX_RUNS),
            )
        )
    if is_likely_inverted(fit.tip_pen, fit.pivot_cam):
        warnings.append(
            sentence(
                "poses.likely-inverted",
                "The tip would be {tip:.0f} mm from the origin of the pen, farther "
                "than the pivot from that of the camera ({pivot:.0f} mm). Inverted "
                "poses give this: if they are pen_from_cam, tip and pivot have to "
                "change places.",
                tip=float(np.linalg.norm(fit.tip_pen)),
                pivot=float(np.linalg.norm(fit.pivot_cam)),
            )
        )
    return warnings
