"""Tip and cone by each method from the same images."""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.calibrate import Calibration
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.model.method import Method


@dataclass(frozen=True, eq=False)
class MethodResult:
    """Tip and cone by one of the methods."""

    tip_pen: FloatArray  # (3,), mm
    cone_cam: FloatArray  # (3,), mm
    covariance: FloatArray  # (6, 6), of both, systematic errors included, mm^2
    # (N, 3), of the tip of each used image from the cone point, mm
    deviations: FloatArray

    @property
    def rms_mm(self) -> float:
        """Root mean square length of the deviations, mm."""
        return float(np.sqrt(np.mean(np.sum(self.deviations**2, axis=1))))

    @property
    def expanded_uncertainty(self) -> FloatArray:
        """U (k = 2) of tip and cone, (6,), mm."""
        return COVERAGE_FACTOR * np.sqrt(np.diag(self.covariance))

    @property
    def weakest_direction(self) -> FloatArray:
        """Unit vector of the pen frame along which the tip is most uncertain, (3,)."""
        _, vectors = np.linalg.eigh(self.covariance[:3, :3])
        weakest = vectors[:, -1]
        return np.asarray(weakest * np.sign(weakest[np.argmax(np.abs(weakest))]))

    @property
    def weakest_uncertainty(self) -> float:
        """U (k = 2) along the weakest direction, mm."""
        values = np.linalg.eigvalsh(self.covariance[:3, :3])
        return COVERAGE_FACTOR * float(np.sqrt(values[-1]))


def reported(calibration: Calibration) -> MethodResult:
    """Return tip and cone by the method that the calibration reports."""
    return result_of(calibration, calibration.method)


def result_of(calibration: Calibration, method: Method) -> MethodResult:
    """Return tip and cone by one of the methods.

    The two-stage result is uncertain by its difference from the joint fit, which
    contains the projection bias of the discs, and by U of the joint fit: equation (22)
    of method.md.
    """
    joint, covariance = calibration.joint, calibration.budget.covariance
    if method == "two-stage":
        fit = calibration.two_stage
        off = two_stage_difference(calibration)
        covariance = covariance + np.outer(off, off)
        return MethodResult(fit.tip_pen, fit.cone_cam, covariance, fit.residuals)
    tips_cam = calibration.tips_cam[calibration.used]
    return MethodResult(
        joint.tip_pen, joint.cone_cam, covariance, tips_cam - joint.cone_cam
    )


def two_stage_difference(calibration: Calibration) -> FloatArray:
    """Return tip and cone, two-stage less joint, (6,), mm."""
    joint, fit = calibration.joint, calibration.two_stage
    return np.concatenate([fit.tip_pen - joint.tip_pen, fit.cone_cam - joint.cone_cam])
