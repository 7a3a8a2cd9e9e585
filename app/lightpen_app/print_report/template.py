"""Fills the template of a report, which holds texts, tables and plots in their order.

A language has a file, a kind of report a section of it. Its paragraphs are apart by
blank lines, and begin with a mark of their size or with what they show:

    :facts COLUMNS       names and values, a line each
    :table NAME WIDTHS   columns, > right-aligned, titles, and rows below those of NAME
    :small NAME WIDTHS   the same in small letters
    :charts HEIGHT NAMES plots side by side, mm high
    :draw NAME           what is drawn by the program
    :include SECTION     another section
    :keep, :free         what is between stands on one page

A line is left out if one of its values is None; an empty value is a condition that is
met, or a fact that is not stated.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import cache, partial

from PySide6.QtCore import QCoreApplication, QLocale, QRectF
from PySide6.QtGui import QPainter

from lightpen.model.names import Laboratory
from lightpen.record.calibrations import TracedItem
from lightpen.record.library.entered_files import EntryPlace
from lightpen.record.library.tip_library import ItemKind
from lightpen_app.look.languages import listed
from lightpen_app.look.theme import LIGHT
from lightpen_app.print_report.blocks import (
    LEFT,
    MM,
    RIGHT,
    WIDTH,
    Block,
    Column,
    PrintSize,
    draw_text,
    facts,
    heading,
    line_pen,
    paragraph,
    subheading,
    table,
)
from lightpen_app.print_report.charts import Chart, row_of_charts
from lightpen_resources import RESOURCES, SOURCE_LANGUAGE

translate = QCoreApplication.translate

REPORTS = RESOURCES / "reports"
FIELD = re.compile(r"\{(\w+)\}")
SECTION = re.compile(r"^\[(\w+)\]$", re.MULTILINE)
BOLD = "* "
MARKS: dict[str, Callable[[str], Block]] = {
    "= ": partial(paragraph, size=PrintSize.TITLE, bold=True),
    "~ ": partial(paragraph, size=PrintSize.HEADING, color=LIGHT.muted),
    "# ": heading,
    "## ": subheading,
    ", ": partial(paragraph, size=PrintSize.SMALL, color=LIGHT.muted),
    ". ": partial(paragraph, size=PrintSize.SMALL),
    BOLD: partial(paragraph, bold=True),
}


@dataclass(frozen=True)
class Content:
    """What a template is filled with, by the names in it."""

    texts: Mapping[str, str | None]
    tables: Mapping[str, Sequence[Sequence[str]]] = field(default_factory=dict)
    strong: Mapping[str, Sequence[int]] = field(default_factory=dict)  # bold rows
    charts: Mapping[str, Chart | None] = field(default_factory=dict)
    drawn: Mapping[str, Sequence[Block]] = field(default_factory=dict)


def fill(section: str, content: Content) -> tuple[Block, ...]:
    """Return the blocks of a section in the language of the window."""
    blocks: list[Block] = []
    keeps = False
    for stanza in _sections(QLocale().name())[section].split("\n\n"):
        head, *lines = stanza.splitlines()
        command, *words = head.split(" ")
        if command in (":keep", ":free"):
            keeps = command == ":keep"
            continue
        new = _blocks(stanza, command, words, lines, content)
        blocks += (replace(each, keeps=True) for each in new) if keeps else new
    return tuple(blocks)


def condition(is_met: object) -> str | None:
    """Return the value on which lines of a template depend."""
    return "" if is_met else None


def cells(texts: Iterable[str]) -> str:
    """Return the text of several cells of a row."""
    return " | ".join(texts)


@cache
def _sections(locale: str) -> dict[str, str]:
    files = {QLocale(file.stem).name(): file for file in REPORTS.glob("*.txt")}
    file = files.get(locale, REPORTS / f"{SOURCE_LANGUAGE}.txt")
    _, *parts = SECTION.split(file.read_text(encoding="utf-8"))
    return {
        name: text.strip() for name, text in zip(parts[::2], parts[1::2], strict=True)
    }


def _blocks(
    stanza: str,
    command: str,
    words: Sequence[str],
    lines: Sequence[str],
    content: Content,
) -> Iterable[Block]:
    match command:
        case ":include":
            return fill(words[0], content)
        case ":draw":
            return content.drawn[words[0]]
        case ":charts":
            charts = [content.charts[name] for name in words[1:]]
            there = [chart for chart in charts if chart is not None]
            return [row_of_charts(there, float(words[0]) * MM)] if there else ()
        case ":facts":
            n_columns, *name = words
            rows = [row for each in name for row in content.tables[each]]
            rows += [_cells(line, 1) for line in _filled(lines, content)]
            unstated = translate("paper", "not stated")
            return facts(
                [(name, text or unstated) for name, text in rows], int(n_columns)
            )
        case ":table" | ":small":
            size = PrintSize.BODY if command == ":table" else PrintSize.SMALL
            return _table(words[0], words[1:], lines, content, size)
    if command.startswith(":"):
        raise ValueError(f"A template must have known commands, got {command}.")
    mark = next((each for each in MARKS if stanza.startswith(each)), "")
    texts = list(_filled(stanza.removeprefix(mark).splitlines(), content))
    return [MARKS.get(mark, paragraph)(" ".join(texts))] if texts else ()


def _table(
    name: str,
    widths: Sequence[str],
    lines: Sequence[str],
    content: Content,
    size: PrintSize,
) -> tuple[Block, ...]:
    """Return a table of the rows of its name, and of lines below its titles."""
    title, *below = lines
    columns = [
        Column(each, float(width.lstrip(">")), RIGHT if width[0] == ">" else LEFT)
        for each, width in zip(_cells(title), widths, strict=True)
    ]
    rows, strong = list(content.tables.get(name, ())), [*content.strong.get(name, ())]
    for line in _filled(below, content):
        if line.startswith(BOLD):
            strong.append(len(rows))
        rows.append(_cells(line.removeprefix(BOLD)))
    return table(columns, rows, strong=strong, size=size)


def _filled(lines: Iterable[str], content: Content) -> Iterator[str]:
    """Yield the lines of which all values are there, with these."""
    for line in lines:
        if all(content.texts[name] is not None for name in FIELD.findall(line)):
            yield FIELD.sub(lambda found: content.texts[found[1]] or "", line)


def _cells(line: str, n_breaks: int = -1) -> list[str]:
    return [cell.strip() for cell in line.split("|", n_breaks)]


NUMBER_LENGTH = 12  # digits of the SHA-256 that name a record


def zoned_moment_text(moment: datetime) -> str:
    """Return a moment with the time zone that it was written in."""
    return moment.isoformat(sep=" ", timespec="seconds")


def environment_texts(
    temperature_c: float | None, humidity_percent: float | None
) -> dict[str, str | None]:
    """Return temperature of the pen and humidity of the room."""
    unknown = translate("paper", "not measured")
    temperature = unknown if temperature_c is None else f"{temperature_c:.1f} \xb0C"
    humidity = unknown if humidity_percent is None else f"{humidity_percent:g} %"
    return {"temperature": temperature, "humidity": humidity}


def laboratory_texts(
    laboratory: Laboratory | None, traced: Sequence[TracedItem]
) -> dict[str, str | None]:
    """Return laboratory, place and procedure, and whether nothing is traced."""
    known = laboratory or Laboratory()
    place = (known.street, f"{known.post_code} {known.city}".strip(), known.country)
    return {
        "laboratory": known.name,
        "place": listed(filter(None, place)),
        "procedure": known.procedure,
        "untraced": condition(not traced),
    }


def traced_rows(traced: Sequence[TracedItem]) -> list[tuple[str, ...]]:
    """Return the certificates of the equipment used."""
    kinds = {
        ItemKind.CAMERA: translate("paper", "Camera (intrinsics)"),
        ItemKind.PEN: translate("paper", "Pen (LED measurement)"),
        ItemKind.TIP: translate("paper", "Probe tip (ball)"),
        ItemKind.CONE: translate("paper", "Cone"),
        ItemKind.REFERENCE: translate("paper", "Reference"),
    }
    unstated = translate("paper", "not stated")
    rows = []
    for each in traced:
        item = each.item
        known = (
            ("", None, None)
            if item is None
            else (item.certificate, item.certified, item.due)
        )
        rows.append((kinds[each.kind], each.id, *(str(k or unstated) for k in known)))
    return rows


def proof_texts(
    name: str, sha256: str, entered: EntryPlace | None
) -> dict[str, str | None]:
    """Return the hashes that bind the report to its file."""
    return {
        "file": name,
        "sha256": sha256,
        "entry": translate("paper", "none") if entered is None else f"{entered.number}",
        "entry_sha256": None if entered is None else entered.sha256,
        "chain": None if entered is None else entered.chain,
    }


def record_number(sha256: str) -> str:
    """Return the number of a report, by the hash of its file."""
    digits = sha256[:NUMBER_LENGTH]
    number = " ".join(digits[i : i + 4] for i in range(0, NUMBER_LENGTH, 4))
    return translate("paper", "No. {0}").format(number)


def signatures(by: str) -> Block:
    """Return the fields for signatures, the first with a title."""
    names = (by, translate("paper", "Checked by"))
    below = translate("paper", "Name, date, signature")
    width, height = WIDTH / 2 - 100, 24 * MM

    def paint(painter: QPainter) -> None:
        for i, name in enumerate(names):
            left = i * (WIDTH / 2 + 100)
            area = QRectF(left, 0, width, PrintSize.BODY)
            draw_text(painter, area, name, PrintSize.BODY, bold=True)
            line = height - 1.6 * PrintSize.SMALL
            painter.setPen(line_pen(LIGHT.text))
            painter.drawLine(round(left), round(line), round(left + width), round(line))
            area = QRectF(left, line + 15, width, PrintSize.SMALL)
            draw_text(painter, area, below, PrintSize.SMALL, LIGHT.muted)

    return Block(paint, height, space=200)
