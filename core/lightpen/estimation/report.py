"""A calibration as a JSON record, and as text for the screen."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import version
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.calibrate import USUAL_SIGMA, Calibration
from lightpen.estimation.pivot import PivotFit
from lightpen.estimation.uncertainty import COVERAGE_FACTOR
from lightpen.formats.hashes import InputFile, Inputs
from lightpen.model.coverage import DIRECTION_NAMES
from lightpen.sentences import Sentence, sentence

METHODS = ("joint", "two-stage")


@dataclass(frozen=True, eq=False)
class MethodResult:
    """Tip and cone by one of the methods.

    Attributes
    ----------
    tip_pen, cone_cam : (3,) array
        mm.
    covariance : (6, 6) array
        Of both, mm^2.
    rms_mm : float
        Root mean square distance of the tip of single images from the cone point.
    """

    tip_pen: FloatArray
    cone_cam: FloatArray
    covariance: FloatArray
    rms_mm: float

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


def calibration_json(calibration: Calibration, inputs: Inputs, method: str) -> str:
    """Return the record of a calibration as JSON; README.md documents its fields."""
    result = result_of(calibration, method)
    tip = result.tip_pen
    nominal = inputs.nominal_tip
    head = {
        "program": _program(),
        "created": datetime.now().astimezone().isoformat(timespec="seconds"),
        "method": method,
        "tip_pen_mm": tip,
        "cone_cam_mm": result.cone_cam,
        "covariance": result.covariance,
        "expanded_uncertainty_mm": result.expanded_uncertainty[:3],
        "cone_expanded_uncertainty_mm": result.expanded_uncertainty[3:],
        "coverage_factor": COVERAGE_FACTOR,
        "nominal_tip_mm": nominal,
        "change_from_nominal_mm": None if nominal is None else tip - nominal,
        "rms_px": calibration.joint.rms,
        "rms_mm": result.rms_mm,
        "sigma_px": calibration.joint.sigma,
        "images": {
            "total": len(calibration.used),
            "used": int(calibration.used.sum()),
            "dropped": dict(_dropped(calibration)),
        },
        "methods": _methods(calibration),
        "warnings": warnings_of(calibration),
        "uncertainty": _uncertainty(calibration),
        "weakest_direction": {
            "vector_pen": calibration.budget.weakest_direction,
            "expanded_uncertainty_mm": calibration.budget.weakest_uncertainty,
        },
        "coverage": _coverage(calibration),
        "leds": _leds(calibration),
        "inputs": {
            "camera": _input(inputs.camera),
            "pen": _input(inputs.pen),
            "observations": [_input(file) for file in inputs.observations],
        },
    }
    return _with_rows(head, "frames", _frames(calibration))


def pivot_json(fit: PivotFit, poses: InputFile, least_squares: bool) -> str:
    """Return a pivot calibration as JSON; README.md documents its fields."""
    uncertainty = COVERAGE_FACTOR * np.sqrt(np.diag(fit.covariance))
    head = {
        "program": _program(),
        "created": datetime.now().astimezone().isoformat(timespec="seconds"),
        "method": "least squares" if least_squares else "robust",
        "tip_pen_mm": fit.tip_pen,
        "pivot_cam_mm": fit.pivot_cam,
        "covariance": fit.covariance,
        "expanded_uncertainty_mm": uncertainty[:3],
        "pivot_expanded_uncertainty_mm": uncertainty[3:],
        "coverage_factor": COVERAGE_FACTOR,
        "rms_mm": fit.rms,
        "poses": {"total": len(fit.used), "used": int(fit.used.sum())},
        "inputs": {"poses": _input(poses)},
    }
    rows = [
        {"pose": i + 1, "used": used, "residual_mm": residual}
        for i, (used, residual) in enumerate(
            zip(fit.used.tolist(), fit.residuals.tolist(), strict=True)
        )
    ]
    return _with_rows(head, "frames", rows)


def encoded(record: str) -> bytes:
    """Return a record as UTF-8.

    The bytes of a file name that is no text in this system's encoding become JSON
    escapes.
    """
    return record.encode("utf-8", "backslashreplace")


def calibration_text(
    calibration: Calibration, method: str, nominal_tip: FloatArray | None
) -> str:
    """Return a calibration as text for the screen."""
    results = {name: result_of(calibration, name) for name in METHODS}
    chosen = results[method]
    lines = [_heading("Tip in the pen frame, mm", "xyz")]
    for name in (method, *(other for other in METHODS if other != method)):
        lines.append(_numbers(name, results[name].tip_pen))
        part = ", of image noise" if name == "two-stage" else ""
        lines.append(
            _numbers(f"  U (k = 2){part}", results[name].expanded_uncertainty[:3])
        )
    if nominal_tip is not None:
        lines.append(_numbers("nominal", nominal_tip))
        lines.append(_numbers("change from nominal", chosen.tip_pen - nominal_tip))
    lines += ["", _heading("Cone in the camera frame, mm", "uvw")]
    lines.append(_numbers(method, chosen.cone_cam))
    lines.append(_numbers("  U (k = 2)", chosen.expanded_uncertainty[3:]))
    lines += ["", *_image_lines(calibration), "", *_quality_lines(calibration, chosen)]
    warnings = warnings_of(calibration)
    if warnings:
        lines += ["", *map(str, warnings)]
    return "\n".join(lines)


def warnings_of(calibration: Calibration) -> list[Sentence]:
    """Return what the user should look into, one sentence or two each."""
    leds, sigma = calibration.leds, calibration.joint.sigma
    warnings = [
        sentence(
            "warning.led-unseen",
            "LED {led} was found in no image. A finger may cover it, it may be off, or "
            "its place in the pen file may be wrong.",
            led=int(led) + 1,
        )
        for led in np.flatnonzero(leds.n_seen == 0)
    ]
    warnings += [
        sentence(
            "warning.led-displaced",
            "LED {led} sits {distance:.3f} mm off its place in the pen file. Check the "
            "file, or measure the pen again.",
            led=led,
            distance=float(np.linalg.norm(leds.displacement[led - 1])),
        )
        for led in leds.displaced
    ]
    if sigma > USUAL_SIGMA:
        warnings.append(
            sentence(
                "warning.large-residuals",
                "The residuals are large: {sigma:.2f} px, {usual} px or less is usual. "
                "Check that the camera file is of this camera, lens and focus, and the "
                "pen file of this pen: the uncertainty does not cover a wrong file.",
                sigma=sigma,
                usual=USUAL_SIGMA,
            )
        )
    return warnings


def pivot_text(fit: PivotFit) -> str:
    """Return a pivot calibration as text for the screen."""
    uncertainty = COVERAGE_FACTOR * np.sqrt(np.diag(fit.covariance))
    return "\n".join(
        [
            _heading("Tip in the frame of the poses, mm", "xyz"),
            _numbers("tip", fit.tip_pen),
            _numbers("  U (k = 2)", uncertainty[:3]),
            "",
            _heading("Pivot in the camera frame, mm", "uvw"),
            _numbers("pivot", fit.pivot_cam),
            _numbers("  U (k = 2)", uncertainty[3:]),
            "",
            f"Poses        {fit.used.sum()} of {len(fit.used)} used",
            f"Residuals    {fit.rms:.3f} mm rms an axis",
        ]
    )


def _image_lines(calibration: Calibration) -> list[str]:
    n_used = int(calibration.used.sum())
    lines = [f"Images       {n_used} of {len(calibration.used)} used"]
    for reason, count in _dropped(calibration).items():
        names = [
            name
            for name, why in zip(
                calibration.observations.names, calibration.reasons, strict=True
            )
            if why == reason
        ]
        shown = ", ".join(names[:5]) + (", ..." if count > 5 else "")
        lines.append(f"  dropped    {count} {reason}: {shown}")
    return lines


def _quality_lines(calibration: Calibration, chosen: MethodResult) -> list[str]:
    budget, halves = calibration.budget, calibration.halves
    joint = calibration.joint
    parts = {
        "noise": budget.correlation_factor * budget.noise,
        "LED geometry": budget.leds,
        "camera": budget.camera,
    }
    tilt = np.degrees(calibration.coverage.tilts)
    lines = [
        f"Residuals    {joint.rms:.4f} px rms, tip of single images "
        f"{chosen.rms_mm:.4f} mm rms",
        f"Weakest      {_direction(budget.weakest_direction)}, "
        f"U = {budget.weakest_uncertainty:.4f} mm",
        _numbers("Odd - even images", halves.difference),
        _numbers("  U (k = 2)", halves.expanded_uncertainty),
    ]
    lines += [
        _numbers(f"U from {name}", COVERAGE_FACTOR * np.sqrt(np.diag(part)[:3]))
        for name, part in parts.items()
        if np.any(part)
    ]
    lines.append(
        f"Repeatability between blocks of images: {np.sqrt(budget.block_ratio):.2f} "
        f"times that of independent noise, lag-1 autocorrelation "
        f"{budget.autocorrelation:.2f}"
    )
    lines.append(
        f"Postures     tilt {tilt.min():.0f} to {tilt.max():.0f} degrees, turn "
        f"{np.degrees(np.ptp(calibration.coverage.turns)):.0f} degrees"
    )
    if calibration.coverage.missing:
        lines.append(f"  never leant {', '.join(calibration.coverage.missing)}")
    if calibration.geometry.led_sigma > 0:
        lines.append(
            f"LED file     off by {calibration.geometry.led_sigma:.4f} mm (standard "
            "deviation of a coordinate), corrected as far as the images tell"
        )
    return lines


def _heading(title: str, axes: str) -> str:
    return f"{title:<30}" + "".join(f"{axis:>13}" for axis in axes)


def _numbers(title: str, values: FloatArray) -> str:
    return f"  {title:<28}" + "".join(f"{value:13.4f}" for value in values)


def _direction(vector: FloatArray) -> str:
    axis = int(np.argmax(np.abs(vector)))
    if abs(vector[axis]) > 0.95:
        return f"along the pen's {'xyz'[axis]} axis"
    return "along ({:.2f}, {:.2f}, {:.2f}) of the pen".format(*vector)


def _dropped(calibration: Calibration) -> Counter[str]:
    return Counter(str(reason) for reason in calibration.reasons if reason)


def _program() -> dict[str, str]:
    return {"name": "lightpen", "version": version("lightpen")}


def _input(file: InputFile) -> dict[str, str]:
    return {"file": file.path.name, "sha256": file.sha256}


def _methods(calibration: Calibration) -> dict[str, Any]:
    methods: dict[str, Any] = {}
    for name in METHODS:
        result = result_of(calibration, name)
        methods[name] = {
            "tip_pen_mm": result.tip_pen,
            "cone_cam_mm": result.cone_cam,
            "covariance": result.covariance,
            "expanded_uncertainty_mm": result.expanded_uncertainty[:3],
            "rms_mm": result.rms_mm,
        }
    two_stage = calibration.two_stage
    methods["two-stage"]["convergence"] = {
        "x_mm": two_stage.iterates,
        "objective_mm2": two_stage.objectives,
        "alpha": two_stage.step_lengths,
        "increment_mm": two_stage.increments,
    }
    return methods


def _uncertainty(calibration: Calibration) -> dict[str, Any]:
    budget = calibration.budget

    def std(covariance: FloatArray | None) -> FloatArray | None:
        return None if covariance is None else np.sqrt(np.diag(covariance)[:3])

    return {
        "noise_mm": std(budget.noise),
        "blocks_mm": std(budget.blocks),
        "block_ratio": budget.block_ratio,
        "correlation_factor": budget.correlation_factor,
        "lag1_autocorrelation": budget.autocorrelation,
        "led_geometry_mm": std(budget.leds),
        "camera_mm": std(budget.camera),
        "led_sigma_mm": calibration.geometry.led_sigma,
        "halves_difference_mm": calibration.halves.difference,
        "halves_expanded_uncertainty_mm": calibration.halves.expanded_uncertainty,
    }


def _coverage(calibration: Calibration) -> dict[str, Any]:
    coverage = calibration.coverage
    return {
        "directions": list(DIRECTION_NAMES),
        "leaning": coverage.counts[0],
        "leaning_far": coverage.counts[1],
        "upright": coverage.n_upright,
        "missing": coverage.missing,
        "tilt_deg": np.degrees([coverage.tilts.min(), coverage.tilts.max()]),
        "turn_deg": np.degrees([coverage.turns.min(), coverage.turns.max()]),
        "spread_deg": np.degrees(coverage.spread),
        "spread_axes_pen": coverage.axes,
        "predicted_bound_mm": np.sqrt(np.diag(calibration.budget.noise)[:3]),
    }


def _leds(calibration: Calibration) -> list[dict[str, Any]]:
    leds = calibration.leds
    return [
        {
            "led": j + 1,
            "seen": leds.n_seen[j],
            "used": leds.n_used[j],
            "rms_px": leds.rms[j],
            "mean_px": leds.mean[j],
            "displacement_mm": leds.displacement[j],
            "displaced": j + 1 in leds.displaced,
            "correction_mm": calibration.geometry.corrections[j],
        }
        for j in range(len(leds.rms))
    ]


def _frames(calibration: Calibration) -> list[dict[str, Any]]:
    observations = calibration.observations
    seen = np.isfinite(observations.seen_pixels[..., 0]).tolist()
    pixels = observations.seen_pixels.tolist()
    leds_used = calibration.leds_used.tolist()
    return [
        {
            "file": observations.names[i],
            "used": used,
            "reason": str(calibration.reasons[i]),
            "detail": str(observations.details[i] or ""),
            "rms_px": rms,
            "tip_cam_mm": tip,
            "leds": [
                {"led": j + 1, "x_px": x, "y_px": y, "used": leds_used[i][j]}
                for j, (x, y) in enumerate(pixels[i])
                if seen[i][j]
            ],
        }
        for i, (used, rms, tip) in enumerate(
            zip(
                calibration.used.tolist(),
                calibration.rms.tolist(),
                calibration.tips_cam.tolist(),
                strict=True,
            )
        )
    ]


def _with_rows(head: dict[str, Any], key: str, rows: Sequence[dict[str, Any]]) -> str:
    """Return JSON, readable: one line an entry, and one a row of the long list."""
    lines = [f"  {json.dumps(name)}: {_dumps(value)}" for name, value in head.items()]
    listed = ",\n    ".join(_dumps(row) for row in rows)
    lines.append(f"  {json.dumps(key)}: [\n    {listed}\n  ]")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _dumps(value: Any) -> str:
    return json.dumps(_plain(value), ensure_ascii=False, allow_nan=False)


def _plain(value: Any) -> Any:
    """Return arrays as lists, what is not a number as null, sentences with codes."""
    if isinstance(value, Sentence):
        value = {"code": value.code, "text": str(value), "values": value.values}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, dict):
        return {name: _plain(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
