"""A pivot calibration as a JSON record."""

from typing import Any

import numpy as np

from lightpen.arrays import IntArray
from lightpen.estimation.pivot_calibration import COVERED, NOT_COVERED, PivotCalibration
from lightpen.formats.hashes import InputFile
from lightpen.formats.json_records import file_entry, plain, record_heading
from lightpen.local_time import local_now
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR


def pivot_record(
    calibration: PivotCalibration,
    poses: InputFile,
    least_squares: bool,
    places: IntArray,
    n_lost: int,
) -> dict[str, Any]:
    """Return the record of a pivot calibration; README.md documents its entries.

    ``places`` (N,) are the numbers of the poses in the file, ``n_lost`` how many others
    it has.
    """
    fit, groups = calibration.fit, calibration.groups
    uncertainty = calibration.expanded_uncertainty
    group = np.ones(len(fit.used), dtype=int) if groups is None else groups.group
    record = {
        **record_heading(local_now()),
        "method": "least squares" if least_squares else "robust",
        "tip_pen_mm": fit.tip_pen,
        "pivot_cam_mm": fit.pivot_cam,
        "covariance": calibration.covariance,
        "expanded_uncertainty_mm": uncertainty[:3],
        "pivot_expanded_uncertainty_mm": uncertainty[3:],
        "coverage_factor": COVERAGE_FACTOR,
        "uncertainty": {
            "covers": str(COVERED),
            "leaves_out": str(NOT_COVERED),
            "independent_noise": fit.covariance,
            "correlation_factor": calibration.correlation_factor,
        },
        "rms_mm": fit.rms,
        "warnings": calibration.warnings,
        "poses": {"total": len(fit.used), "used": int(fit.used.sum()), "lost": n_lost},
        "inputs": {"poses": file_entry(poses)},
        "frames": [
            {
                "pose": place,
                "used": used,
                "group": name or None,
                "residual_mm": residual,
            }
            for place, used, name, residual in zip(
                places.tolist(),
                fit.used.tolist(),
                group.tolist(),
                fit.residuals.tolist(),
                strict=True,
            )
        ],
    }
    return {name: plain(entry) for name, entry in record.items()}
