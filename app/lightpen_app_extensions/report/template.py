"""Fills the template of a report, which holds texts, tables and plots in their order.

A language has a file, a kind of report a section of it. Its paragraphs are apart by
blank lines, and begin with a mark of their size or with what they show:

    :facts COLUMNS       names and values, a line each
    :table NAME WIDTHS   columns, > right-aligned, titles, and rows below those of NAME
    :small NAME WIDTHS   the same in small letters
    :charts HEIGHT NAMES plots side by side, mm high
    :draw NAME           what is made by the program
    :include SECTION     another section
    :keep, :free         what is between stands on one page

A line is left out if one of its values is None; an empty value is a condition that is
met, or a fact that is not stated. What is filled in becomes HTML, as `QTextDocument`
shows it.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from enum import IntEnum
from functools import cache
from html import escape

import pyqtgraph as pg
from PySide6.QtCore import QBuffer, QCoreApplication, QIODevice, QPoint
from PySide6.QtGui import QFont, QFontMetricsF, QPainter, QPicture

from lightpen.model.names import Laboratory
from lightpen.record.calibrations import TracedItem
from lightpen.record.library.entered_files import EntryPlace
from lightpen.record.library.tip_library import ItemKind
from lightpen_app.look.languages import OWN_NAME, listed, own_name
from lightpen_app.look.theme import LIGHT, TextSize, font, palette_of, scaled
from lightpen_app.widgets.figure import Figure
from lightpen_resources import RESOURCES

translate = QCoreApplication.translate

REPORTS = RESOURCES / "reports"
FIELD = re.compile(r"\{(\w+)\}")
SECTION = re.compile(r"^\[(\w+)\]$", re.MULTILINE)
BOLD = "* "
MARKS = {  # of a paragraph: its tag and its class
    "= ": ("h1", ""),
    "~ ": ("p", "lead"),
    "# ": ("h2", ""),
    "## ": ("h3", ""),
    ", ": ("p", "remark"),
    ". ": ("p", "small"),
    BOLD: ("p", "strong"),
}
ANCHOR = "<a></a>"  # at the beginning of a part, where `pages` looks for it
MM = 720 / 25.4  # in dots, ten to a point, so that text is measured as printed
WIDTH = 178 * MM  # of what is on a page
GAP = 160.0  # between plots side by side, dots


class PrintSize(IntEnum):
    """Sizes of letters, dots."""

    SMALL = 68
    BODY = 82
    HEADING = 108
    TITLE = 190


@dataclass(frozen=True)
class Drawn:
    """The strokes of a plot, without a widget, so that any thread can draw them."""

    strokes: bytes  # as `QPicture` stores them
    width: int  # px of the plot

    def paint(self, painter: QPainter, width: float) -> None:
        """Draw it from the origin, as wide as stated."""
        picture, strokes = QPicture(), QBuffer()
        strokes.setData(self.strokes)
        strokes.open(QIODevice.OpenModeFlag.ReadOnly)
        picture.load(strokes)
        # A picture enlarges what is drawn by the resolution of the device.
        own = painter.device().logicalDpiX() / picture.logicalDpiX()
        painter.scale(width / self.width / own, width / self.width / own)
        picture.play(painter)


def drawn(figure: Figure, width: float, height: float) -> Drawn:
    """Return a plot as it is printed, width x height in dots, with small letters."""
    dots = PrintSize.SMALL / scaled(TextSize.SMALL)  # a pixel
    figure.setPalette(palette_of(LIGHT))
    figure.resize(round(width / dots), round(height / dots))
    figure.grab()  # lays it out
    for view in figure.findChildren(pg.PlotWidget):
        view.getPlotItem().layout.activate()  # its axes made room for their numbers
        for item in view.scene().items():
            if isinstance(item, pg.ScatterPlotItem):
                item.setExportMode(True, {})  # strokes instead of pixels
    picture, strokes = QPicture(), QBuffer()
    painter = QPainter(picture)
    figure.render(painter, QPoint())
    painter.end()
    strokes.open(QIODevice.OpenModeFlag.WriteOnly)
    picture.save(strokes)
    return Drawn(bytes(strokes.data().data()), figure.width())


@dataclass(frozen=True)
class Piece:
    """A part of a report as HTML, with one `ANCHOR`."""

    html: str
    keeps: bool = False  # whether the beginning of the next is kept on the same page
    plots: Mapping[str, Drawn] = field(default_factory=dict)  # by names in the HTML


@dataclass(frozen=True)
class Content:
    """What a template is filled with, by the names in it."""

    texts: Mapping[str, str | None]
    tables: Mapping[str, Sequence[Sequence[str]]] = field(default_factory=dict)
    strong: Mapping[str, Sequence[int]] = field(default_factory=dict)  # bold rows
    charts: Mapping[str, Figure] = field(default_factory=dict)
    drawn: Mapping[str, Sequence[Piece]] = field(default_factory=dict)


def print_font(size: float, *, bold: bool = False) -> QFont:
    """Return the program's font for printing, without screen hinting."""
    result = font(float(size), bold=bold)
    result.setHintingPreference(QFont.HintingPreference.PreferNoHinting)
    return result


def printed_text(text: str) -> str:
    """Return a text with characters missing in all fonts replaced by their codes."""
    return text if text.isascii() else "".join(map(_printed, text))


@cache
def _printed(character: str) -> str:
    metrics = QFontMetricsF(print_font(PrintSize.BODY))
    if character.isspace() or metrics.inFontUcs4(ord(character)):
        return character
    return f"[U+{ord(character):04X}]"


def markup(text: str) -> str:
    """Return a text as HTML."""
    return escape(printed_text(text), quote=False).replace("\n", "<br>")


def paragraph(text: str, mark: str = "") -> Piece:
    """Return words, with a mark of the template; a heading keeps what follows."""
    tag, name = MARKS.get(mark, ("p", ""))
    html = f'<{tag} class="{name}">{ANCHOR}{markup(text)}</{tag}>'
    return Piece(html, keeps=tag in ("h2", "h3"))


def facts(rows: Sequence[tuple[str, str]], n_columns: int = 2) -> tuple[Piece, ...]:
    """Return names with their values, side by side in columns."""
    name, value = (
        share / n_columns for share in ((44, 56) if n_columns > 1 else (22, 78))
    )
    cells = [
        f'<td class="name" width="{name}%">{markup(words)}</td>'
        f'<td class="fact" width="{value}%">{markup(text)}</td>'
        for words, text in rows
    ]
    starts = range(0, len(rows), n_columns)
    return _table_of("", ["".join(cells[i : i + n_columns]) for i in starts])


def table(
    titles: Sequence[str],
    widths: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    strong: Sequence[int] = (),
    name: str = "",
) -> tuple[Piece, ...]:
    """Return a table whose header is repeated on each page; strong rows are bold.

    The widths are shares; what begins with > is right-aligned. The class of the cells
    is ``name``.
    """
    shares = [float(each.lstrip(">")) for each in widths]

    def line(cells: Sequence[str], kind: str) -> str:
        return "".join(
            f'<td class="{kind} {name}" width="{100 * share / sum(shares)}%" '
            f'align="{"right" if width[0] == ">" else "left"}">{markup(cell)}</td>'
            for cell, width, share in zip(cells, widths, shares, strict=True)
        )

    lines = [
        line(row, "strong" if i in strong else "row") for i, row in enumerate(rows)
    ]
    return _table_of(line(titles, "head"), lines)


def _table_of(head: str, lines: Sequence[str]) -> tuple[Piece, ...]:
    if not lines:
        return ()
    first = lines[0].replace(">", f">{ANCHOR}", 1)
    body = "".join(f"<tr>{line}</tr>" for line in (first, *lines[1:]))
    head = f"<thead><tr>{head}</tr></thead>" if head else ""
    return (Piece(f'<table width="100%" cellspacing="0">{head}{body}</table>'),)


def charts(plots: Mapping[str, Figure], height: float) -> tuple[Piece, ...]:
    """Return plots side by side, dots high."""
    if not plots:
        return ()
    width = (WIDTH - (len(plots) - 1) * GAP) / len(plots)
    images = "".join(
        f'<td><img src="{name}" width="{width}" height="{height}"></td>'
        for name in plots
    )
    (part,) = _table_of("", [images])
    made = {name: drawn(plot, width, height) for name, plot in plots.items()}
    return (replace(part, plots=made),)


def signatures(by: str) -> Piece:
    """Return the fields for signatures, the first with a title."""
    below = markup(translate("paper", "Name, date, signature"))
    names = "".join(
        f'<td class="signed" width="44%"><b>{markup(name)}</b></td><td></td>'
        for name in (by, translate("paper", "Checked by"))
    )
    fields = f'<td class="signature">{below}</td><td></td>' * 2
    return _table_of("", [names, fields])[0]


def fill_template(section: str, content: Content) -> tuple[Piece, ...]:
    """Return the parts of a section in the language of the window."""
    parts: list[Piece] = []
    keeps = False
    for stanza in _sections(translate("language", OWN_NAME))[section].split("\n\n"):
        head, *lines = stanza.splitlines()
        command, *words = head.split(" ")
        if command in (":keep", ":free"):
            keeps = command == ":keep"
            continue
        new = _parts(stanza, command, words, lines, content)
        parts += (replace(each, keeps=True) for each in new) if keeps else new
    return tuple(parts)


def condition(is_met: object) -> str | None:
    """Return the value on which lines of a template depend."""
    return "" if is_met else None


def cells(texts: Iterable[str]) -> str:
    """Return the text of several cells of a row."""
    return " | ".join(texts)


@cache
def _sections(name: str) -> dict[str, str]:
    """Return the sections of the language that calls itself by a name."""
    files = {own_name(file.stem): file for file in REPORTS.glob("*.txt")}
    _, *parts = SECTION.split(files[name].read_text(encoding="utf-8"))
    return {
        name: text.strip() for name, text in zip(parts[::2], parts[1::2], strict=True)
    }


def _parts(
    stanza: str,
    command: str,
    words: Sequence[str],
    lines: Sequence[str],
    content: Content,
) -> Iterable[Piece]:
    match command:
        case ":include":
            return fill_template(words[0], content)
        case ":draw":
            return content.drawn[words[0]]
        case ":charts":
            there = {n: content.charts[n] for n in words[1:] if n in content.charts}
            return charts(there, float(words[0]) * MM)
        case ":facts":
            n_columns, *name = words
            rows = [row for each in name for row in content.tables[each]]
            rows += [_cells(line, 1) for line in _filled(lines, content)]
            unstated = translate("paper", "not stated")
            return facts(
                [(name, text or unstated) for name, text in rows], int(n_columns)
            )
        case ":table" | ":small":
            return _table(command[1:], words[0], words[1:], lines, content)
    if command.startswith(":"):
        raise ValueError(f"A template must have known commands, got {command}.")
    mark = next((each for each in MARKS if stanza.startswith(each)), "")
    texts = list(_filled(stanza.removeprefix(mark).splitlines(), content))
    return [paragraph(" ".join(texts), mark)] if texts else ()


def _table(
    kind: str, name: str, widths: Sequence[str], lines: Sequence[str], content: Content
) -> tuple[Piece, ...]:
    """Return a table of the rows of its name, and of lines below its titles."""
    title, *below = lines
    rows, strong = list(content.tables.get(name, ())), [*content.strong.get(name, ())]
    for line in _filled(below, content):
        if line.startswith(BOLD):
            strong.append(len(rows))
        rows.append(_cells(line.removeprefix(BOLD)))
    return table(_cells(title), widths, rows, strong=strong, name=kind)


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
