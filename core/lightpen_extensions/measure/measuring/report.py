"""A measured part as rows of tables and as JSON."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from lightpen.messages import Message, message
from lightpen.model.artefacts import SIDES, Side
from lightpen.model.decision_rules import Decision
from lightpen_extensions.measure.measuring.characteristics import Measured
from lightpen_extensions.measure.measuring.compensation import Evidence
from lightpen_extensions.measure.measuring.part import (
    CharacteristicResult,
    MeasuredPart,
)
from lightpen_extensions.measure.measuring.surfaces import (
    NAMES,
    ROUND,
    SURFACES,
    FeatureKind,
)

DECISIONS: dict[Decision | None, Message | str] = {
    Decision.ACCEPTED: message("part.ok"),
    Decision.OPEN: message("part.open"),
    Decision.REJECTED: message("part.rejected"),
    None: "",
}

EVIDENCES = {
    Evidence.PLAN: message("measuring.by-plan"),
    Evidence.PLANE: message("measuring.by-plane"),
    Evidence.APPROACH: message("measuring.by-approach"),
    Evidence.STYLUS: message("measuring.by-stylus"),
}


@dataclass(frozen=True)
class PartRow:
    """A row of a table: numbers or words, None for a blank, and a remark."""

    name: Message | str
    values: tuple[float | str | None, ...]
    remark: Message | str


def feature_rows(part: MeasuredPart) -> Iterator[PartRow]:
    """Yield x, y, z with the largest U, size with U, form error, and kind.

    A size is a diameter, or the angle of a cone in degrees.
    """
    for name, one in part.features.items():
        values, spread = one.in_part.values, part.uncertainty(name)
        size: tuple[float | None, float | None] = (None, None)
        if one.kind is FeatureKind.CONE:
            size = 2 * float(np.rad2deg(values[7])), 2 * float(np.rad2deg(spread[7]))
        elif SURFACES[one.kind].sizes:
            size = 2 * float(values[6]), 2 * float(spread[6])
        has_form = one.feature is not None and one.kind is not FeatureKind.POINT
        form = one.feature.form_error if has_form and one.feature is not None else None
        place = (float(x) for x in values[:3])
        yield PartRow(
            name, (*place, float(spread[:3].max()), *size, form), _kind_and_side(one)
        )


def _kind_and_side(one: Measured) -> Message:
    """Return the kind of a feature, the side of the ball, and what decided it.

    What the plan states of a side needs no evidence.
    """
    kind, side, evidence = NAMES[one.kind], one.surface.side, one.surface.evidence
    if evidence is Evidence.NONE:
        if one.feature is None:
            return kind
        return message("measuring.sided", kind=kind, side=SIDES[Side.CENTRE])
    if one.kind not in ROUND:  # it is outside of the material
        return message("measuring.decided-by", kind=kind, by=EVIDENCES[evidence])
    if evidence is Evidence.PLAN:
        return message("measuring.sided", kind=kind, side=SIDES[side])
    by = EVIDENCES[evidence]
    return message("measuring.sided-by", kind=kind, side=SIDES[side], by=by)


def characteristic_rows(part: MeasuredPart) -> Iterator[PartRow]:
    """Yield nominal, tolerance, actual, deviation, U, P and decision."""
    for result in part.results:
        yield PartRow(
            result.planned.words,
            (
                result.planned.nominal,
                _tolerance(result),
                result.value.value,
                result.deviation,
                result.value.uncertainty,
                result.probability,
            ),
            DECISIONS[result.decision],
        )


def _tolerance(result: CharacteristicResult) -> str:
    """Return the limits of a geometrical deviation, else of the deviation."""
    nominal = result.planned.nominal or 0.0
    lower, upper = result.lower - nominal, result.upper - nominal
    if np.isinf(upper):
        return ""
    if np.isinf(lower):
        return f"\N{LESS-THAN OR EQUAL TO} {upper:.6g}"
    if np.isclose(lower, -upper):
        return f"\N{PLUS-MINUS SIGN}{upper:.6g}"
    return f"{lower:+.6g} / {upper:+.6g}"


def part_entries(part: MeasuredPart) -> dict[str, Any]:
    """Return the results for a record."""
    inputs = part.touches.inputs
    alignment = part.alignment
    return {
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
        "features": [
            {
                "name": name,
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
                "n_touches": 0 if one.feature is None else len(one.feature.distances),
                "nominal": msgspec.to_builtins(one.nominal),
            }
            for name, one in part.features.items()
        ],
        "characteristics": [_result_entries(result) for result in part.results],
    }


def _result_entries(result: CharacteristicResult) -> dict[str, Any]:
    planned, lower, upper = result.planned, result.lower, result.upper
    return {
        "name": planned.label,
        "quantity": planned.quantity.value,
        "of": list(planned.of),
        "unit": planned.unit,
        "nominal": planned.nominal,
        "actual": result.value.value,
        "deviation": result.deviation,
        "lower_limit": None if np.isinf(lower) else lower,
        "upper_limit": None if np.isinf(upper) else upper,
        "expanded_uncertainty": result.value.uncertainty,
        "certified_expanded_uncertainty": planned.certified,
        "decision": None if result.decision is None else result.decision.value,
        "probability_of_conformity": result.probability,
    }
