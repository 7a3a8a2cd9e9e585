"""The report of a verification, a repeatability study or a drift.

The figures are taken from the JSON record, with its names, so that a new task needs no
code here.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PySide6.QtCore import QCoreApplication

from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.opened_files import InputFile
from lightpen.model.names import Laboratory, Origin
from lightpen.record.calibrations import TracedItem
from lightpen.record.folder import BALL_CENTRE, MEASURED_PART, StoredVerification
from lightpen.record.library.entered_files import EntryPlace
from lightpen_app.look.languages import worded
from lightpen_app.look.phrases import grade_text, origin_text
from lightpen_app.look.words import number_text
from lightpen_app.widgets.figure import Axes, Figure
from lightpen_app.widgets.result_plots import ArrowPlot
from lightpen_app_extensions.report.pages import Margins, PrintReport
from lightpen_app_extensions.report.template import (
    Content,
    Piece,
    condition,
    environment_texts,
    facts,
    fill_template,
    laboratory_texts,
    paragraph,
    proof_texts,
    record_number,
    signatures,
    table,
    traced_rows,
    zoned_moment_text,
)

translate = QCoreApplication.translate

N_DECIMALS = 4
FIGURES = (
    *("nominal", "lower_limit", "upper_limit", "actual", "deviation"),
    *("expanded_uncertainty", "probability_of_conformity"),
)


def part_pieces(record: Mapping[str, Any]) -> tuple[Piece, ...]:
    """Return characteristics, budget, features, alignment, points and plan."""
    characteristics, alignment = record["characteristics"], record["alignment"]
    rejected = [i for i, e in enumerate(characteristics) if e["decision"] == "rejected"]
    point_texts, plots = _points(record["touches"])
    texts = {
        "aligned": condition(alignment is not None),
        "unaligned": condition(alignment is None),
        **point_texts,
    }
    tables = {
        "characteristics": [
            (
                each["name"],
                *(_text(each[name]) for name in FIGURES),
                each["decision"] or "",
            )
            for each in characteristics
        ],
        "features": [_feature_row(each) for each in record["features"]],
        "alignment": _alignment_rows(alignment),
        "plan": [
            (
                *(each["name"], each["kind"]),
                ", ".join(f"{k} {v}" for k, v in each.get("nominal", {}).items() if v),
            )
            for each in record["plan"]["features"]
        ],
    }
    strong = {"characteristics": rejected}
    return fill_template("part", Content(texts, tables, strong, charts=plots))


def _text(value: float | None) -> str:
    return "" if value is None else number_text(value, N_DECIMALS)


def _feature_row(feature: Mapping[str, Any]) -> tuple[str, ...]:
    sizes = ", ".join(f"{k} {_text(v)}" for k, v in _sizes(feature["sizes"]))
    return (
        *(feature["name"], _kind(feature)),
        *map(_text, feature["origin_mm"]),
        _text(max(feature["expanded_uncertainty"][:3])),
        *(sizes, _text(feature["form_error_mm"]), str(feature["n_touches"])),
    )


def _kind(feature: Mapping[str, Any]) -> str:
    """Return the kind of a feature, with the side of the ball and its evidence."""
    kind, by = feature["kind"], feature["side_by"]
    if by == BALL_CENTRE:
        return str(kind)
    return f"{kind}, {feature['side']} ({by})"


def _sizes(sizes: Mapping[str, float]) -> Iterator[tuple[str, float]]:
    """Yield the sizes of a feature as a plan states them, mm and degrees."""
    if "radius" in sizes:
        yield "diameter", 2 * sizes["radius"]
    if "half_angle" in sizes:
        yield "angle", 2 * float(np.rad2deg(sizes["half_angle"]))


def _alignment_rows(alignment: dict[str, Any] | None) -> list[tuple[str, ...]]:
    if alignment is None:
        return []
    turn = alignment["part_from_cam_rotation"]
    shift = alignment["part_from_cam_translation_mm"]
    return [
        ("xyz"[i], *(f"{x:.8f}" for x in turn[i]), _text(shift[i])) for i in range(3)
    ]


def _points(
    touches: list[dict[str, Any]],
) -> tuple[dict[str, str | None], dict[str, Figure]]:
    """Return a plot of all points with their deviations, from the flattest side."""
    points = np.array([each["point_cam_mm"] for each in touches])
    off = np.array([each["deviation_cam_mm"] or [0, 0, 0] for each in touches])
    middle = points.mean(axis=0)
    axes = np.linalg.svd(points - middle, full_matrices=False)[2]
    texts: dict[str, str | None] = {
        "n_points": None,
        "enlargement": None,
        "largest_deviation": _text(float(np.linalg.norm(off, axis=1).max())),
    }
    if len(axes) < 2:
        return texts, {}
    flat = (points - middle) @ axes[:2].T
    plot = ArrowPlot(Axes("", "mm", "mm"))
    plot.set_data(None, flat, off @ axes[:2].T)
    plot.mark(flat)
    names = np.array([each["feature"] for each in touches])
    each = list(dict.fromkeys(names.tolist()))
    plot.set_labels(np.array([flat[names == n].mean(axis=0) for n in each]), each)
    texts |= {"n_points": str(len(points)), "enlargement": f"{plot.scale():g}"}
    return texts, {"points": plot}


# Entries of the record that are elsewhere in the report, or too long for it.
ELSEWHERE = {
    *("program", "created", "verification", "verdict", "session", "station"),
    *("operator", "pen", "tip", "origin", "inputs", "records", "checksum"),
    *("temperature_c", "humidity_percent", "camera_serials"),
    *("touches", "left_out", "rejected", "images", "covariance"),
}
DECIMALS = 4  # of a length in mm
N_DIGITS = 6  # of another number
LONGEST_TABLE = 50  # rows


def verification_print_report(
    file: InputFile,
    done: StoredVerification,
    entered: EntryPlace | None,
    traced: Sequence[TracedItem] = (),
    laboratory: Laboratory | None = None,
) -> PrintReport:
    """Return the pages of the report of a verification, in the selected language.

    ``traced`` is what was verified and measured with, the laboratory where.
    """
    record: dict[str, Any] = json.loads(file.content or b"{}")
    is_part = done.verification == MEASURED_PART
    title = translate("paper", "Verification report")
    by, heading_text = (
        translate("paper", "Verified by"),
        translate("paper", "Item under verification"),
    )
    if is_part:
        title = translate("paper", "Measurement report")
        by, heading_text = (
            translate("paper", "Measured by"),
            translate("paper", "Station"),
        )
    inputs = record.get("inputs", {})
    texts = {
        "title": title,
        "task_heading": heading_text,
        "task": done.verification,
        "created": zoned_moment_text(done.created),
        "pen": done.pen,
        "station": done.station,
        "tip": done.tip,
        "operator": done.operator,
        "origin": origin_text(done.origin),
        **environment_texts(done.temperature_c, done.humidity_percent),
        "program": str(done.program),
        **laboratory_texts(laboratory, traced),
        **_verdict_texts(done, record.get("verdict")),
        **proof_texts(file.path.name, file.sha256, entered),
        "n_observations": str(len(inputs.get("images", ()))),
    }
    judged = done.verdict if texts["unjudged"] is None else None
    limits = {} if judged is None else judged.limits_mm
    tables: dict[str, Sequence[Sequence[str]]] = {
        "traced": traced_rows(traced),
        "limits": [
            (name.replace("_", " "), f"{limit:.{DECIMALS}f}")
            for name, limit in limits.items()
        ],
        "files": _file_rows(inputs),
    }
    drawn = {
        "figures": part_pieces(record) if is_part else tuple(_figures(record)),
        "signatures": [signatures(by)],
    }
    parts = fill_template("verification", Content(texts, tables, drawn=drawn))
    items = (each or "\u2013" for each in (done.pen, done.tip, done.verification))
    foot = translate("paper", "SHA-256 of the JSON file: {0}")
    margins = Margins(
        title=title,
        subject=translate("paper", "Pen {0}, tip {1}, {2}").format(*items),
        number=record_number(file.sha256),
        badges=_badges(done),
        foot=foot.format(file.sha256),
    )
    return PrintReport(done.operator, margins, parts)


def verification_stem(file: Path, done: StoredVerification) -> str:
    """Return the beginning of the default file name."""
    return f"{file.stem}_{done.verification}".replace(" ", "-")


def _badges(done: StoredVerification) -> tuple[str, ...]:
    badges = []
    if done.origin not in (None, Origin.LIVE):
        badges.append(origin_text(done.origin))
    if done.verdict is not None and done.verdict.grade != Grade.PASS:
        badges.append(grade_text(Grade(done.verdict.grade)))
    return tuple(badges)


def _verdict_texts(done: StoredVerification, verdict: Any) -> dict[str, str | None]:
    if done.verdict is None or not isinstance(verdict, Mapping):
        of_verdict = ("grade", "why", "rule", "limited", "reason")
        return {"unjudged": "", **dict.fromkeys(of_verdict)}
    return {
        "unjudged": None,
        "grade": grade_text(Grade(done.verdict.grade)),
        "why": worded(done.why),
        "rule": str(verdict.get("decision_rule") or ""),
        "limited": condition(done.verdict.limits_mm),
        "reason": done.reason or None,
    }


def _figures(record: Mapping[str, Any]) -> Iterator[Piece]:
    yield paragraph(translate("paper", "Figures, as the JSON file names them"), "# ")
    yield from _values(record)
    for name, value in record.items():
        if name in ELSEWHERE:
            continue
        if isinstance(value, Mapping):
            yield paragraph(_title(name), "## ")
            yield from _values(value)
            yield from _tables(value)
        elif _is_list_of(value, Mapping):
            for i, each in enumerate(value[:LONGEST_TABLE], 1):
                yield paragraph(f"{_title(name)} {i}", "## ")
                yield from _values(each)
    yield from _tables(record)


def _values(of: Mapping[str, Any]) -> tuple[Piece, ...]:
    """Return numbers, words, and short lists of numbers."""
    rows = [
        (_title(name), _plain(name, value))
        for name, value in of.items()
        if name not in ELSEWHERE and _is_short(value)
    ]
    return facts(rows, n_columns=1) if rows else ()


def _tables(of: Mapping[str, Any]) -> Iterator[Piece]:
    """Yield points, and longer lists of numbers."""
    for name, value in of.items():
        if name in ELSEWHERE or _is_short(value):
            continue
        if _is_list_of(value, (int, float)):
            value = [[each] for each in value]
        if not (_is_list_of(value, list) and all(map(_is_short, value))):
            continue
        yield paragraph(_title(name), "## ")
        n_columns = max(map(len, value), default=0)
        titles, widths = [""] * (n_columns + 1), ["0.5", *[">1"] * n_columns]
        rows = [
            [str(i), *(_number(name, x) for x in each), *[""] * (n_columns - len(each))]
            for i, each in enumerate(value[:LONGEST_TABLE], 1)
        ]
        yield from table(titles, widths, rows)


def _file_rows(inputs: Any) -> list[tuple[str, str, str]]:
    """Return the files with their hashes."""
    files = {k: v for k, v in inputs.items() if isinstance(v, Mapping) and "file" in v}
    others = inputs.get("files", ())
    rows = [(name, each["file"], each["sha256"]) for name, each in files.items()]
    rows += [("", each["file"], each["sha256"]) for each in others]
    for each in inputs.get("touches", ()):  # of live ones, whose images it lists
        rows.append(("touches", each["folder"], each["journal_sha256"]))
    return rows


def _title(name: str) -> str:
    words, unit = name, ""
    for end in ("_mm", "_px", "_deg"):
        if name.endswith(end):
            words, unit = name.removesuffix(end), f" / {end[1:]}"
    return words.replace("_", " ") + unit


def _is_short(value: Any) -> bool:
    if isinstance(value, list):
        return 0 < len(value) <= 3 and _is_list_of(value, (int, float))
    return isinstance(value, (str, int, float)) or value is None


def _is_list_of(value: Any, kind: Any) -> bool:
    return isinstance(value, list) and all(isinstance(each, kind) for each in value)


def _plain(name: str, value: Any) -> str:
    if isinstance(value, list):
        return "  ".join(_number(name, each) for each in value)
    if isinstance(value, bool):
        return translate("paper", "yes") if value else translate("paper", "no")
    if isinstance(value, (int, float)):
        return _number(name, value)
    return str(value or "") or translate("paper", "not stated")


def _number(name: str, value: float) -> str:
    """Return a length with decimals, and any other number with significant digits."""
    is_length = isinstance(value, float) and name.endswith("_mm")
    return number_text(value, DECIMALS) if is_length else f"{value:.{N_DIGITS}g}"
