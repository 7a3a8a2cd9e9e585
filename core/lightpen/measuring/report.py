"""A measured part as text and as JSON."""

from typing import Any

import msgspec
import numpy as np

from lightpen.estimation.uncertainty.budget import COVERAGE_FACTOR
from lightpen.measuring.characteristics import IS_ANGLE, Measured
from lightpen.measuring.part import CharacteristicResult, MeasuredPart
from lightpen.measuring.plan import Nominal
from lightpen.measuring.surfaces import SURFACES
from lightpen.model.decision_rules import Decision

WORDS = {
    Decision.ACCEPTED: "OK",
    Decision.OPEN: "NOT PROVEN",
    Decision.REJECTED: "OUT OF TOLERANCE",
    None: "",
}


def part_text(part: MeasuredPart) -> str:
    """Return the results as text for the command line."""
    lines = [f"{part.plan.name}: {len(part.touches.points_cam)} touches"]
    frame = "part" if part.alignment is not None else "camera"
    lines.append(f"features, frame of the {frame}; mm, degrees, U (k = 2)")
    for name, one in part.features.items():
        lines += _feature_lines(name, one, part)
    if part.results:
        lines.append(
            f"{'characteristic':32} {'nominal':>10} {'actual':>10} {'deviation':>10} "
            f"{'U':>8} {'U alone':>8} {'P':>7}  decision ({part.plan.rule})"
        )
        lines += [_result_line(result) for result in part.results]
        if any(each.independent_uncertainty is not None for each in part.results):
            lines.append("U alone: U (k = 2) if the touches shared no error.")
    return "\n".join(lines)


def _feature_lines(name: str, one: Measured, part: MeasuredPart) -> list[str]:
    values, uncertainty = one.in_part.values, part.uncertainty(name)
    side = f", {one.surface.side} by {one.surface.evidence}" if one.feature else ""
    lines = [f"  {name}: {one.kind.value}{side}"]
    lines.append(_line("origin", values[:3], uncertainty[:3]))
    if one.kind.value not in {"point", "sphere"}:
        lines.append(_line("axis", values[3:6], uncertainty[3:6], digits=6))
    for size, value, u in zip(
        SURFACES[one.kind].sizes, values[6:], uncertainty[6:], strict=True
    ):
        if size == "half_angle":
            value, u = np.rad2deg(value), np.rad2deg(u)
        lines.append(_line(size.replace("_", " "), [value], [u]))
    if one.feature is not None and one.kind.value != "point":
        lines.append(f"    {'form error':12} {one.feature.form_error:10.4f}")
    return lines


def _line(name: str, values: Any, uncertainty: Any, digits: int = 4) -> str:
    numbers = " ".join(f"{value:{digits + 8}.{digits}f}" for value in values)
    spread = " ".join(f"{value:.{digits}f}" for value in uncertainty)
    return f"    {name:12} {numbers}   U {spread}"


def _result_line(result: CharacteristicResult) -> str:
    planned, value = result.planned, result.value

    def number(given: float | None, width: int) -> str:
        return f"{given:{width}.4f}" if given is not None else width * " "

    chance = "" if result.probability is None else f"{result.probability:.3f}"
    return (
        f"{planned.label:32} {number(planned.nominal, 10)} {value.value:10.4f} "
        f"{number(result.deviation, 10)} {value.uncertainty:8.4f} "
        f"{number(result.independent_uncertainty, 8)} {chance:>7}  "
        f"{WORDS[result.decision]}"
    ).rstrip()


def part_entries(part: MeasuredPart) -> dict[str, Any]:
    """Return the results for a record."""
    inputs = part.touches.inputs
    alignment = part.alignment
    return {
        "coverage_factor": COVERAGE_FACTOR,
        "plan": msgspec.to_builtins(part.plan),
        "ball_diameter_mm": 2 * part.touches.ball_radius,
        "alignment": None
        if alignment is None
        else {
            "part_from_cam_rotation": alignment.rotation,
            "part_from_cam_translation_mm": alignment.translation,
            "covariance": alignment.motion.covariance(inputs),
            "residuals_mm": alignment.residuals,
        },
        "features": {
            name: {
                "kind": one.kind.value,
                "side": one.surface.side.value,
                "side_by": one.surface.evidence.value,
                "origin_mm": one.in_part.values[:3],
                "axis": one.in_part.values[3:6],
                "sizes": dict(
                    zip(
                        SURFACES[one.kind].sizes,
                        one.in_part.values[6:].tolist(),
                        strict=True,
                    )
                ),
                "expanded_uncertainty": part.uncertainty(name),
                "covariance": one.in_part.covariance(inputs),
                "form_error_mm": None
                if one.feature is None
                else one.feature.form_error,
                "nominal": _nominal(one.nominal),
            }
            for name, one in part.features.items()
        },
        "characteristics": [_result_entries(result) for result in part.results],
    }


def _nominal(nominal: Nominal | None) -> Any:
    return None if nominal is None else msgspec.to_builtins(nominal)


def _result_entries(result: CharacteristicResult) -> dict[str, Any]:
    planned = result.planned
    lower, upper = planned.limits
    return {
        "name": planned.label,
        "quantity": planned.quantity.value,
        "of": list(planned.of),
        "unit": "degree" if planned.quantity in IS_ANGLE else "mm",
        "nominal": planned.nominal,
        "actual": result.value.value,
        "deviation": result.deviation,
        "lower_limit": None if np.isinf(lower) else lower,
        "upper_limit": None if np.isinf(upper) else upper,
        "expanded_uncertainty": result.value.uncertainty,
        "independent_expanded_uncertainty": result.independent_uncertainty,
        "decision": None if result.decision is None else result.decision.value,
        "probability_of_conformity": result.probability,
    }
