"""Fills the template of a report, which holds texts, tables and plots in their order.

A language has a file, a kind of report a section of it. Its paragraphs are apart by
blank lines, and begin with a mark of their size or with what they show:

    :facts COLUMNS       names and values, a line each
    :table WIDTHS        columns, > right-aligned, titles, and rows below
    :small WIDTHS        the same in small letters
    :chart HEIGHT NAME   a plot, mm high
    :draw NAME           what is made by the program
    :include SECTION     another section
    :sign                fields for signatures
    :keep, :free         what is between stands on one page

A line that begins with ``@PATH`` is repeated for each item of a list, which is then
``it``. A value is the path to it in the record, with how it is shown and what is shown
without it: ``{names.pen}``, ``{sigma_px:.4f px}``, ``{due?not stated}``:

    .4f, g, %Y ...       as Python formats it, and a unit
    by PATH              to the digits that this uncertainty warrants
    =TEXT, !TEXT         nothing; the line is left out if the value is not TEXT, or is
    *TEXT                makes the line bold if the value is TEXT

A line is left out if one of its values is not there. A vector takes a cell for each of
its values. What is filled in becomes HTML, as `QTextDocument` shows it.
"""

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import datetime
from enum import IntEnum
from functools import cache
from html import escape
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QBuffer, QCoreApplication, QIODevice, QPoint
from PySide6.QtGui import QFont, QFontMetricsF, QPainter, QPicture

from lightpen.detection.reasons import Reason
from lightpen.formats.own_json import StoredMessage
from lightpen.messages import Message
from lightpen_app.look.languages import OWN_NAME, own_name, worded
from lightpen_app.look.phrases import reason_text
from lightpen_app.look.theme import LIGHT, TextSize, font, palette_of, scaled
from lightpen_app.look.words import decimals_for, number_text
from lightpen_app.widgets.figure import Figure
from lightpen_resources import RESOURCES

translate = QCoreApplication.translate

REPORTS = RESOURCES / "reports"
FIELD = re.compile(r"\{([\w.]+)(?::([^}?]*))?(?:\?([^}]*))?\}")
DECIMALS = re.compile(r"\.(\d)f")
SECTION = re.compile(r"^\[(\w+)\]$", re.MULTILINE)
BOLD, EACH, BAR = "* ", "@", "\0"
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


def chart(name: str, plot: Figure, height: float) -> Piece:
    """Return a plot, dots high."""
    image = f'<td><img src="{name}" width="{WIDTH}" height="{height}"></td>'
    (part,) = _table_of("", [image])
    return replace(part, plots={name: drawn(plot, WIDTH, height)})


def signatures(names: Sequence[str], below: str) -> Piece:
    """Return the fields for signatures, with a title each."""
    cells = "".join(
        f'<td class="signed" width="44%"><b>{markup(name)}</b></td><td></td>'
        for name in names
    )
    fields = f'<td class="signature">{markup(below)}</td><td></td>' * len(names)
    return _table_of("", [cells, fields])[0]


@dataclass(frozen=True)
class Content:
    """What a template is filled with."""

    scope: Sequence[Any]  # objects that have the values; a name is of the first with it
    charts: Mapping[str, Figure] = field(default_factory=dict)
    drawn: Mapping[str, Sequence[Piece]] = field(default_factory=dict)


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


@cache
def _sections(name: str) -> dict[str, str]:
    """Return the sections of the template of a language, by its own name."""
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
        case ":sign":
            ((*names, below),) = _filled(lines, content.scope)
            return [signatures(names, below)]
        case ":chart":
            height, name = words
            plot = content.charts.get(name)
            return [] if plot is None else [chart(name, plot, float(height) * MM)]
        case ":facts":
            unstated = translate("paper", "not stated")
            named = [
                (name, ", ".join(text) or unstated)
                for name, *text in _filled(lines, content.scope)
            ]
            return facts(named, int(words[0]))
        case ":table" | ":small":
            titles, *rows = _filled(lines, content.scope)
            strong = [i for i, row in enumerate(rows) if row[0].startswith(BOLD)]
            rows = [[row[0].removeprefix(BOLD), *row[1:]] for row in rows]
            return table(titles, words, rows, strong=strong, name=command[1:])
    if command.startswith(":"):
        raise ValueError(f"A template must have known commands, got {command}.")
    mark = next((each for each in MARKS if stanza.startswith(each)), "")
    lines = stanza.removeprefix(mark).splitlines()
    texts = [", ".join(each) for each in _filled(lines, content.scope, "\n")]
    if stanza.startswith(EACH):
        return map(paragraph, texts)
    return [paragraph(" ".join(texts), mark)] if texts else ()


class _MissingError(Exception):
    """A value of a line is not there."""


def _filled(
    lines: Iterable[str], scope: Sequence[Any], bar: str = "|"
) -> Iterator[list[str]]:
    """Yield the cells of lines of which all values are there."""
    for line in lines:
        named = [scope]
        if line.startswith(EACH):
            path, line = line.removeprefix(EACH).split(" ", 1)
            items = enumerate(_value(path, scope) or (), 1)
            named = [({"it": each, "number": i}, *scope) for i, each in items]
        for names in named:
            with suppress(_MissingError):
                cells = [_text(each, names).strip() for each in line.split(bar)]
                yield BAR.join(cells).split(BAR)


def _text(line: str, scope: Sequence[Any]) -> str:
    def shown(found: re.Match[str]) -> str:
        path, form, instead = found.groups(default="")
        value = _value(path, scope)
        if form[:1] in ("=", "!", "*"):
            is_it = str("" if value in (None, (), []) else value) == form[1:]
            if form[0] == "*":
                return BOLD if is_it else ""
            if is_it is not (form[0] == "="):
                raise _MissingError
            return ""
        text = _formatted(value, form, scope)
        if text is None and found[3] is None:
            raise _MissingError
        return text or instead

    return FIELD.sub(shown, line)


def _value(path: str, scope: Sequence[Any]) -> Any:
    """Return what a path leads to; None if it ends early."""
    first, *names = path.split(".")
    for each in scope:
        if first in each if isinstance(each, Mapping) else hasattr(each, first):
            value = _part(each, first)
            for name in names:
                value = None if value is None else _part(value, name)
            return value
    raise KeyError(f"A template must have known names, got {first}.")


def _part(of: Any, name: str) -> Any:
    if isinstance(of, Mapping):
        return of.get(name)
    return of[int(name)] if name.isdigit() else getattr(of, name)


def _formatted(value: Any, form: str, scope: Sequence[Any]) -> str | None:
    """Return a value, or the values of a vector; None if one of them is missing."""
    is_vector = isinstance(value, (list, tuple, np.ndarray))
    values, forms = value if is_vector else [value], [form]
    if form.startswith("by "):
        sizes = np.array(_value(form[3:], scope), dtype=np.float64)
        forms = [f".{decimals_for(each)}f" for each in np.ravel(sizes).tolist()]
    texts = [_plain(x, forms[i % len(forms)]) for i, x in enumerate(values)]
    return None if None in texts else BAR.join(map(str, texts))


def _plain(value: Any, form: str) -> str | None:
    form, _, unit = form.partition(" ")
    match value:
        case Reason():
            return reason_text(value)
        case Message() | StoredMessage():
            return worded(value)
        case datetime():
            return f"{value:{form}}" if form else value.isoformat(" ", "seconds")
        case Mapping():
            return ", ".join(f"{k} {v}" for k, v in value.items() if v)
        case float() if math.isnan(value):
            return None
        case int() | float() if form:
            places = DECIMALS.fullmatch(form)
            text = number_text(value, int(places[1])) if places else f"{value:{form}}"
            return f"{text} {unit}".strip()
    return None if value is None else str(value)
