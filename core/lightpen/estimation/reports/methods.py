"""Tip and cone by each method from the same images."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.calibrate import Calibration
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR

Method: TypeAlias = Literal["joint", "two-stage"]
METHODS: tuple[Method, ...] = ("joint", "two-stage")


@dataclass(frozen=True, eq=False)
class MethodResult:
    """Tip and cone by one of the methods."""

    tip_pen: FloatArray  # (3,), mm
    cone_cam: FloatArray  # (3,), mm
    covariance: FloatArray  # (6, 6), of both, mm^2
    rms_mm: float  # distance of the tip of single images from the cone point

    @property
    def expanded_uncertainty(self) -> FloatArray:
        """U (k = 2) of tip and cone, (6,), mm."""
        return COVERAGE_FACTOR * np.sqrt(np.diag(self.covariance))


def result_of(calibration: Calibration, method: str) -> MethodResult:
    """Return tip and cone by ``"joint"`` or ``"two-stage"``."""
    if method == "two-stage":
        fit = calibration.two_stage
        return MethodResult(
            fit.tip_pen, fit.cone_cam, calibration.two_stage_covariance, fit.rms
        )
    joint = calibration.joint
    deviations = calibration.tips_cam[calibration.used] - joint.cone_cam
    return MethodResult(
        joint.tip_pen,
        joint.cone_cam,
        calibration.budget.covariance,
        float(np.sqrt(np.mean(np.sum(deviations**2, axis=1)))),
    )
