"""A calibration record of two images and one LED, for what is not about figures."""

import json
from collections.abc import Mapping
from typing import Any

from lightpen.estimation.reports.calibration_record import CalibrationRecord
from lightpen.formats.own_json import in_shape, json_bytes

ZERO = [0.0, 0.0, 0.0]
FILE = {"file": "file.csv", "sha256": 64 * "0"}
PARAMETER = {
    "value": 1.0,
    "standard_uncertainty": 0.1,
    "standard_uncertainty_before": 0.2,
}
SMALL: Mapping[str, Any] = {
    "program": {"name": "lightpen", "version": "0.0.1"},
    "created": "2026-01-02T12:00:00+00:00",
    "origin": "live camera",
    "method": "joint",
    "tip_pen_mm": [1.0, -90.0, -25.0],
    "cone_cam_mm": [0.0, 200.0, 1000.0],
    "covariance": 6 * [6 * [0.25]],
    "expanded_uncertainty_mm": [0.003, 0.004, 0.005],
    "cone_expanded_uncertainty_mm": [0.003, 0.004, 0.005],
    "coverage_factor": 2.0,
    "nominal_tip_mm": None,
    "change_from_nominal_mm": None,
    "rms_px": 0.02,
    "rms_mm": 0.02,
    "sigma_px": 0.02,
    "images": {"total": 2, "used": 2, "dropped": {}},
    "methods": {},
    "verdict": {
        "code": "verdict.good",
        "text": "The tip is good: U = 0.0050 mm.",
        "values": {"uncertainty": 0.005},
        "grade": "pass",
        "next_step": "accept",
        "limits": {"max_uncertainty_mm": 0.016, "min_images": 2, "min_per_field": 0},
    },
    "warnings": [],
    "uncertainty": {
        "shares": [],
        "independent_noise_mm": None,
        "correlation_factor": 1.0,
        "led_sigma_mm": 0.0,
        "halves_difference_mm": ZERO,
        "halves_expanded_uncertainty_mm": ZERO,
    },
    "adjusted": {
        "intrinsics": dict.fromkeys(("fx", "fy", "cx", "cy"), PARAMETER),
        "intrinsics_uncertainty_assumed": False,
        "pen_growth": 0.0,
        "disc_diameter_mm": 10.0,
        "disc_diameter_by_areas_mm": None,
        "contradictions": [],
    },
    "assumptions": {},
    "instrument": {
        "intrinsics": [2000.0, 2000.0, 600.0, 500.0],
        "disc_diameter_mm": 10.0,
        "leds_mm": [ZERO],
        "covariance": 11 * [11 * [0.0]],
        "scale": {
            "growth": 0.0,
            "file_sigma": 1e-5,
            "thermal_sigma": 0.0,
            "deviation": 0.0,
            "variance": 1e-10,
            "covariance": 11 * [0.0],
        },
    },
    "weakest_direction": {
        "vector_pen": [0.0, 0.0, 1.0],
        "expanded_uncertainty_mm": 0.005,
    },
    "coverage": {
        "directions": [],
        "leaning": 8 * [0],
        "leaning_far": 8 * [0],
        "upright": 2,
        "missing": [],
        "tilt_deg": [0.0, 1.0],
        "turn_deg": [0.0, 1.0],
    },
    "leds": [
        {
            "led": 1,
            "seen": 2,
            "used": 2,
            "rms_px": 0.02,
            "mean_px": [0.0, 0.0],
            "displacement_mm": ZERO,
            "displaced": False,
        }
    ],
    "inputs": {
        "camera": FILE,
        "pen": FILE,
        "observations": [FILE],
        "units": None,
        "led_diameter_mm": None,
    },
    "frames": [
        {
            "file": f"{n}.png",
            "used": True,
            "reason": "",
            "detail": "",
            "detail_code": "",
            "rms_px": 0.02,
            "tip_cam_mm": ZERO,
            "edge_width_px": 1.0,
            "lamps_px": [],
            "leds": [],
        }
        for n in (1, 2)
    ],
}


def small_record(changes: Mapping[str, Any] | None = None) -> CalibrationRecord:
    """Return a record with other entries, as JSON has them."""
    return record_of({**SMALL, **(changes or {})})


def record_of(entries: Mapping[str, Any]) -> CalibrationRecord:
    """Return the record that is so in JSON."""
    return in_shape(entries, CalibrationRecord)


def entries_of(record: CalibrationRecord) -> dict[str, Any]:
    """Return a record as JSON has it."""
    entries: dict[str, Any] = json.loads(json_bytes(record))
    return entries
