"""Tip and cone by each method from the same images."""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.calibrate import Calibration
from lightpen.estimation.uncertainty.budget import (
    Budget,
    ContributionName,
    UncertaintyContribution,
)
from lightpen.model.method import Method


@dataclass(frozen=True, eq=False)
class MethodResult:
    """Tip and cone by one of the methods."""

    tip_pen: FloatArray  # (3,), mm
    cone_cam: FloatArray  # (3,), mm
    budget: Budget  # of both, systematic errors included
    # (N, 3), of the tip of each used image from the cone point, mm
    deviations: FloatArray

    @property
    def rms_mm(self) -> float:
        """Root mean square length of the deviations, mm."""
        return float(np.sqrt(np.mean(np.sum(self.deviations**2, axis=1))))

    @property
    def covariance(self) -> FloatArray:
        """Combined covariance of (tip_pen, cone_cam), (6, 6), mm^2."""
        return self.budget.covariance

    @property
    def expanded_uncertainty(self) -> FloatArray:
        """U (k = 2) of tip and cone, (6,), mm."""
        return self.budget.expanded_uncertainty


def reported(calibration: Calibration) -> MethodResult:
    """Return tip and cone by the method that the calibration reports."""
    return result_of(calibration, calibration.method)


def result_of(calibration: Calibration, method: Method) -> MethodResult:
    """Return tip and cone by one of the methods.

    The two-stage result is uncertain by its difference from the joint fit, which
    contains the projection bias of the discs, and by U of the joint fit: equation (22)
    of method.md.
    """
    joint, budget = calibration.joint, calibration.budget
    if method == "two-stage":
        fit, off = calibration.two_stage, two_stage_difference(calibration)
        share = UncertaintyContribution(ContributionName.METHOD, np.outer(off, off))
        budget = replace(budget, shares=(*budget.shares, share))
        return MethodResult(fit.tip_pen, fit.cone_cam, budget, fit.residuals)
    tips_cam = calibration.tips_cam[calibration.used]
    return MethodResult(
        joint.tip_pen, joint.cone_cam, budget, tips_cam - joint.cone_cam
    )


def two_stage_difference(calibration: Calibration) -> FloatArray:
    """Return tip and cone, two-stage less joint, (6,), mm."""
    joint, fit = calibration.joint, calibration.two_stage
    return np.concatenate([fit.tip_pen - joint.tip_pen, fit.cone_cam - joint.cone_cam])
