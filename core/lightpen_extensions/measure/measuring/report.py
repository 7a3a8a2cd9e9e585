"""A measured part as rows of tables and as JSON."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from lightpen.arrays import FloatArray
from lightpen.formats.files import FileFormat
from lightpen.formats.spreadsheets import csv_table
from lightpen.messages import Message, Number, message
from lightpen.model.artefacts import SIDES, Side
from lightpen.model.coverage import Decision
from lightpen_extensions.measure.measuring.alignment import Quantity
from lightpen_extensions.measure.measuring.characteristics import Measured
from lightpen_extensions.measure.measuring.compensation import Evidence, TouchedSurface
from lightpen_extensions.measure.measuring.features import (
    AXIS,
    PLACE,
    Feature,
    frame_about,
)
from lightpen_extensions.measure.measuring.part import (
    CharacteristicResult,
    MeasuredPart,
)
from lightpen_extensions.measure.measuring.qif import qif_text
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


POINTS = message("table.points")


@dataclass(frozen=True, eq=False)
class ResultRow:
    """A row of a table: its name, and a value for each column or None for a blank."""

    name: Message | str
    values: Sequence[float | str | None]
    decimals: int = 4
    remark: Message | str = ""  # in the last column, with its own head

    def texts(self) -> tuple[str, ...]:
        """Return the values as texts, without a sign before zero."""
        return tuple(
            x or ""
            if x is None or isinstance(x, str)
            else f"{Number(x):.{self.decimals}f}"
            for x in self.values
        )


@dataclass(frozen=True, eq=False)
class ResultTable:
    """Figures of a task with sentences below, for the screen and the window alike."""

    title: Message
    columns: tuple[Message | str, ...] = ()
    rows: tuple[ResultRow, ...] = ()
    notes: tuple[Message, ...] = ()


def points_table(points: Iterable[FloatArray], title: Message = POINTS) -> ResultTable:
    """Return the coordinates of points (3,) in the camera frame."""
    rows = tuple(
        ResultRow(message("table.point", number=i), point.tolist())
        for i, point in enumerate(points, start=1)
    )
    return ResultTable(title, tuple("uvw") if rows else (), rows)


def part_tables(part: MeasuredPart) -> tuple[ResultTable, ...]:
    """Return the characteristics and the features of a part."""
    in_part = message("part.features-in-part")
    in_camera = message("part.features-in-camera")
    features = ResultTable(
        in_camera if part.alignment is None else in_part,
        (
            *("x", "y", "z", message("part.position-uncertainty")),
            *(message("part.size"), message("part.size-uncertainty")),
            message("part.form"),
            message("part.kind"),
        ),
        tuple(_feature_rows(part)),
    )
    characteristics = ResultTable(
        message("part.characteristics"),
        (
            message("part.nominal"),
            message("part.tolerance"),
            message("part.actual"),
            message("part.deviation"),
            message("table.uncertainty"),
            message("part.probability"),
            message("part.decision"),
        ),
        tuple(map(_characteristic_row, part.results)),
    )
    return tuple(each for each in (characteristics, features) if each.rows)


def _feature_rows(part: MeasuredPart) -> Iterator[ResultRow]:
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
        form = None if one.kind is FeatureKind.POINT else one.feature.form_error
        place = (float(x) for x in values[:3])
        row = *place, float(spread[:3].max()), *size, form
        yield ResultRow(name, row, remark=_kind_and_side(one))


def _kind_and_side(one: Measured) -> Message:
    """Return the kind of a feature, the side of the ball, and what decided it.

    What the plan states of a side needs no evidence.
    """
    kind, side, evidence = NAMES[one.kind], one.surface.side, one.surface.evidence
    if evidence is Evidence.NONE:
        return message("measuring.sided", kind=kind, side=SIDES[Side.CENTRE])
    if one.kind not in ROUND:  # it is outside of the material
        return message("measuring.decided-by", kind=kind, by=EVIDENCES[evidence])
    if evidence is Evidence.PLAN:
        return message("measuring.sided", kind=kind, side=SIDES[side])
    by = EVIDENCES[evidence]
    return message("measuring.sided-by", kind=kind, side=SIDES[side], by=by)


def _characteristic_row(result: CharacteristicResult) -> ResultRow:
    """Return nominal, tolerance, actual, deviation, U, P and decision."""
    values = (
        result.planned.nominal,
        _tolerance(result),
        result.value.value,
        result.deviation,
        result.value.uncertainty,
        result.probability,
    )
    decision = DECISIONS[result.decision]
    return ResultRow(result.planned.words, values, remark=decision)


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
                "form_error_mm": one.feature.form_error,
                "n_touches": len(one.feature.distances),
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


# Measured parts for other programs, in one table of formats.
#
# CSV has a row for each characteristic, and QIF 3.0 [1]_ the results with their
# tolerances.
#
# References
# ----------
# .. [1] ISO 23952:2020, "Automation systems and integration. Quality information
#    framework (QIF)".


CSV = (
    *("quantity", "features", "unit", "nominal", "lower_limit", "upper_limit"),
    *("actual", "deviation", "expanded_uncertainty", "decision"),
    "probability_of_conformity",
)


def _csv(part: MeasuredPart) -> str:
    rows: list[list[object]] = [["characteristic", *CSV]]
    for result in part.results:
        entries = _result_entries(result)
        entries["features"] = " ".join(entries["of"])
        values = [entries["name"], *(entries[name] for name in CSV)]
        rows.append(["" if x is None else x for x in values])
    return csv_table(rows)


EXPORTS = (
    FileFormat("csv", message("part.csv"), ".csv", _csv),
    FileFormat("qif", message("part.qif"), ".qif", qif_text),
)


N_ROUND = 73  # points of a closed circle
MARK = 1.0  # mm, half size of the cross of a point, and of an untouched feature
CORNERS = ((1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1))


def outline_of(one: Measured) -> list[FloatArray]:
    """Return the lines (M, 3) of a feature, mm, in the frame of the camera."""
    values = one.surface.quantity.values
    origin, axis, sizes = values[PLACE], values[AXIS], values[6:]
    frame = frame_about(axis)
    reach = _reach(one)
    along = [-reach * axis, reach * axis]
    match one.kind:
        case FeatureKind.POINT:
            return [origin + np.outer([-MARK, MARK], each) for each in np.eye(3)]
        case FeatureKind.LINE:
            return [origin + np.array(along)]
        case FeatureKind.PLANE:
            points = one.points.values.reshape(-1, 3) - origin
            half = np.abs(points @ frame[:, :2]).max(axis=0)
            return [origin + half * np.array(CORNERS) @ frame[:, :2].T]
        case FeatureKind.CIRCLE:
            return [_ring(origin, frame, sizes[0])]
        case FeatureKind.SPHERE:
            turned = (np.roll(np.eye(3), k, axis=0) for k in range(3))
            return [_ring(origin, each, sizes[0]) for each in turned]
        case FeatureKind.CYLINDER:
            return [_ring(origin + each, frame, sizes[0]) for each in along]
        case FeatureKind.CONE:
            slope = np.tan(sizes[1])
            radii = (max(sizes[0] + sign * reach * slope, 0.0) for sign in (-1, 1))
            pairs = zip(along, radii, strict=True)
            return [_ring(origin + each, frame, radius) for each, radius in pairs]


def of_centres(fit: Feature, points: FloatArray) -> Measured:
    """Return the feature of ball centres (N, 3) without an uncertainty, to be drawn."""
    values = Quantity(fit.values, np.zeros((len(fit.values), 0)))
    centres = Quantity(points.ravel(), np.zeros((points.size, 0)))
    surface = TouchedSurface(fit.kind, values, Side.OUTSIDE, Evidence.NONE)
    return Measured(surface, values, fit, centres)


def _ring(center: FloatArray, frame: FloatArray, radius: float) -> FloatArray:
    turn = np.linspace(0, 2 * np.pi, N_ROUND)
    return np.asarray(
        center + radius * np.column_stack([np.cos(turn), np.sin(turn)]) @ frame[:, :2].T
    )


def _reach(one: Measured) -> float:
    """Return the half extent of the points along an axis, mm."""
    points = one.points.values.reshape(-1, 3)
    along = (points - points.mean(axis=0)) @ one.surface.quantity.values[AXIS]
    return float(np.abs(along).max())
