"""The report of a verification, a repeatability study or a drift.

The figures are taken from the JSON record, with its names, so that a new task needs no
code here.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from PySide6.QtCore import QCoreApplication

from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.hashes import InputFile
from lightpen.model.laboratory import Laboratory
from lightpen.model.origin import Origin
from lightpen.record.calibrations.traceability import TracedItem
from lightpen.record.folder.verifications import MEASURED_PART, StoredVerification
from lightpen.record.library.entered_files import EntryPlace
from lightpen_app.look.phrases import grade_text, origin_text
from lightpen_app.look.quantities import number_text
from lightpen_app.look.sentences import worded
from lightpen_app.print_report.blocks import (
    RIGHT,
    Block,
    Column,
    facts,
    heading,
    subheading,
    table,
)
from lightpen_app.print_report.common import (
    environment_texts,
    laboratory_texts,
    proof_texts,
    record_number,
    signatures,
    traced_rows,
    zoned_moment_text,
)
from lightpen_app.print_report.pages import Margins, PrintReport, lay_out
from lightpen_app.print_report.part import part_blocks
from lightpen_app.print_report.template import Content, condition, fill

translate = QCoreApplication.translate

# Entries of the record that are elsewhere in the report, or too long for it.
ELSEWHERE = {
    *("program", "created", "verification", "verdict", "session", "station"),
    *("operator", "pen", "tip", "origin", "inputs", "records", "checksum"),
    *("temperature_c", "humidity_percent", "camera_serials"),
    *("touches", "left_out", "rejected", "witness", "images", "covariance"),
}
N_DECIMALS = 4  # of a length in mm
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
            (name.replace("_", " "), f"{limit:.{N_DECIMALS}f}")
            for name, limit in limits.items()
        ],
        "files": _file_rows(inputs),
    }
    drawn = {
        "figures": part_blocks(record) if is_part else tuple(_figures(record)),
        "signatures": [signatures(by)],
    }
    blocks = fill("verification", Content(texts, tables, drawn=drawn))
    items = (each or "\u2013" for each in (done.pen, done.tip, done.verification))
    foot = translate("paper", "SHA-256 of the JSON file: {0}")
    margins = Margins(
        title=title,
        subject=translate("paper", "Pen {0}, tip {1}, {2}").format(*items),
        number=record_number(file.sha256),
        badges=_badges(done),
        foot=foot.format(file.sha256),
    )
    return PrintReport(done.operator, margins, lay_out(blocks))


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
        names = "grade why rule limited reason"
        return {"unjudged": "", **dict.fromkeys(names.split())}
    return {
        "unjudged": None,
        "grade": grade_text(Grade(done.verdict.grade)),
        "why": worded(done.why),
        "rule": str(verdict.get("decision_rule") or ""),
        "limited": condition(done.verdict.limits_mm),
        "reason": done.reason or None,
    }


def _figures(record: Mapping[str, Any]) -> Iterator[Block]:
    yield heading(translate("paper", "Figures, as the JSON file names them"))
    yield from _values(record)
    for name, value in record.items():
        if name in ELSEWHERE:
            continue
        if isinstance(value, Mapping):
            yield subheading(_title(name))
            yield from _values(value)
            yield from _tables(value)
        elif _is_list_of(value, Mapping):
            for i, each in enumerate(value[:LONGEST_TABLE], 1):
                yield subheading(f"{_title(name)} {i}")
                yield from _values(each)
    yield from _tables(record)


def _values(of: Mapping[str, Any]) -> tuple[Block, ...]:
    """Return numbers, words, and short lists of numbers."""
    rows = [
        (_title(name), _plain(name, value))
        for name, value in of.items()
        if name not in ELSEWHERE and _is_short(value)
    ]
    return facts(rows, n_columns=1) if rows else ()


def _tables(of: Mapping[str, Any]) -> Iterator[Block]:
    """Yield points, and longer lists of numbers."""
    for name, value in of.items():
        if name in ELSEWHERE or _is_short(value):
            continue
        if _is_list_of(value, (int, float)):
            value = [[each] for each in value]
        if not (_is_list_of(value, list) and all(map(_is_short, value))):
            continue
        yield subheading(_title(name))
        n_columns = max(map(len, value), default=0)
        columns = [Column("", 0.5), *(Column("", 1.0, RIGHT),) * n_columns]
        rows = [
            [str(i), *(_number(name, x) for x in each), *[""] * (n_columns - len(each))]
            for i, each in enumerate(value[:LONGEST_TABLE], 1)
        ]
        yield from table(columns, rows)


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
    return number_text(value, N_DECIMALS) if is_length else f"{value:.{N_DIGITS}g}"
