"""The entries of the archive as a table, the newest first, read on demand."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, datetime, time, timedelta
from itertools import chain, islice
from typing import Any

from PySide6.QtCore import QItemSelectionModel, QModelIndex, Qt, Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QWidget
from typing_extensions import override

from lightpen.archive.chains import Kind
from lightpen.archive.history import (
    EntryFilter,
    KnownNames,
    Line,
    known_names,
    lines,
    n_wanted,
)
from lightpen.archive.logbook import Logbook, ReplicationState
from lightpen.local_time import local_time
from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.look.theme import GRID, TextSize, Tone, colors_of, set_size
from lightpen_app.look.words import mm_text, moment_text, plain_tooltip, shortened
from lightpen_app.steps.history.entry_panel import (
    EventText,
    kind_text,
    line_tone,
    type_and_state_text,
    verdict_text,
)
from lightpen_app.widgets.fields import ChoiceField, DateField, Translated
from lightpen_app.widgets.tables import RIGHT, ROW_HEIGHT, Index, RowTable, TitledModel

# The keys of the columns, as the settings name them.
COLUMNS = [
    "when",
    "station",
    "pen",
    "tip",
    "type",
    "verdict",
    "x",
    "y",
    "z",
    "u",
    "operator",
    "notes",
]
WHEN, STATION, PEN, TIP, WHAT, VERDICT, X, Y, Z, U, BY, WORDS = range(len(COLUMNS))
NUMBERS = (X, Y, Z, U)
NAMES = (STATION, PEN, TIP, BY)
LONGEST_NAME = 16  # letters of a name that are shown
WIDEST = 26 * GRID  # px, of a column
LEAST_ROWS = 3
MOST_SELECTED = 1000  # lines that are compared
BLOCK = 200  # lines that are read at one time


@dataclass(frozen=True)
class FirstEntries:
    """The first data read for a filter."""

    n_lines: int
    first: tuple[Line, ...]  # the newest
    names: KnownNames
    # Replication to the server; None without a server.
    delivery: ReplicationState | None


def first_entries(wanted: EntryFilter, logbook: Logbook) -> FirstEntries:
    """Return the number of the entries wanted and the newest of them."""
    database = logbook.database
    return FirstEntries(
        n_wanted(database, wanted),
        lines(database, wanted, 0, BLOCK),
        known_names(database),
        logbook.delivery(),
    )


class HistoryModel(TitledModel):
    """One row for each entry; more are read when the last is seen."""

    n_columns = WORDS + 1
    more_wanted = Signal(int)  # how many lines there are already

    def __init__(self, kind_of: EventText) -> None:
        super().__init__()
        self._kind_of = kind_of
        self._n_lines = 0
        self._lines: list[Line] = []

    def set_lines(self, n_lines: int, first: Sequence[Line]) -> None:
        """Show other entries; the newest are read already."""
        self.beginResetModel()
        self._n_lines, self._lines = n_lines, list(first)
        self.endResetModel()

    def add_lines(self, first: int, found: Sequence[Line]) -> None:
        """Add the lines after as many others; such as were added are passed over."""
        if first == len(self._lines) and found:
            self.beginInsertRows(QModelIndex(), first, first + len(found) - 1)
            self._lines += found
            self.endInsertRows()

    def line(self, row: int) -> Line:
        """Return a line."""
        return self._lines[row]

    @override
    def rowCount(self, parent: Index | None = None) -> int:
        return 0 if parent is not None and parent.isValid() else len(self._lines)

    @override
    def canFetchMore(self, parent: Index) -> bool:
        return len(self._lines) < self._n_lines

    @override
    def fetchMore(self, parent: Index) -> None:
        self.more_wanted.emit(len(self._lines))

    @override
    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        column = index.column()
        if role == Qt.ItemDataRole.TextAlignmentRole and column in NUMBERS:
            return RIGHT
        if role in (Qt.ItemDataRole.DisplayRole, Qt.ItemDataRole.ToolTipRole):
            text = _text(self.line(index.row()), column, self._kind_of)
            if role == Qt.ItemDataRole.ToolTipRole:
                return plain_tooltip(text)
            return shortened(text, LONGEST_NAME) if column in NAMES else text
        if role == Qt.ItemDataRole.ForegroundRole and column in (WHAT, VERDICT):
            tone = line_tone(self.line(index.row()), column == VERDICT)
            widget = self.parent()
            assert isinstance(widget, QWidget)
            return (
                None if tone is Tone.PLAIN else colors_of(widget.palette()).tone(tone)
            )
        return None

    @override
    def titles(self) -> tuple[str, ...]:
        return (
            self.tr("When"),
            self.tr("Station"),
            self.tr("Pen"),
            self.tr("Tip"),
            self.tr("Entry type"),
            self.tr("Verdict"),
            self.tr("x / mm"),
            self.tr("y / mm"),
            self.tr("z / mm"),
            self.tr("U / mm"),
            self.tr("Operator"),
            self.tr("Notes"),
        )

    @override
    def side(self, column: int) -> Qt.AlignmentFlag:
        is_number = column in NUMBERS
        return Qt.AlignmentFlag.AlignRight if is_number else Qt.AlignmentFlag.AlignLeft


class HistoryTable(Translated, RowTable):
    """Shows the entries, of which several can be selected."""

    more_wanted = Signal(int)  # lines after as many others
    selection_changed = Signal()  # other lines are current or selected
    columns_changed = Signal()  # the user chose other columns

    def __init__(self, kind_of: EventText) -> None:
        self._model = HistoryModel(kind_of)
        super().__init__(self._model)
        self.say(self, self.tr("Archive entries (newest first)"))
        self._model.setParent(self)
        self._is_of_one_station = False
        for scrolls in (self.setVerticalScrollMode, self.setHorizontalScrollMode):
            scrolls(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self._shown = tuple(QAction(self, checkable=True) for _ in range(WORDS))
        for each in (self, self.horizontalHeader()):
            each.setContextMenuPolicy(Qt.ContextMenuPolicy.ActionsContextMenu)
            each.addActions(self._shown)
        self.setMinimumHeight((LEAST_ROWS + 2) * ROW_HEIGHT)
        across = self.horizontalHeader()
        across.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        across.setResizeContentsPrecision(0)  # by the rows that are seen
        across.setMaximumSectionSize(WIDEST)
        for each in (self, across):
            set_size(each, TextSize.SMALL)

        # Connections
        for action in self._shown:
            action.setChecked(True)
            action.toggled.connect(self._show_columns)
            action.triggered.connect(self.columns_changed)
        self._model.more_wanted.connect(self.more_wanted)
        chosen = self.selectionModel()
        chosen.currentRowChanged.connect(self.selection_changed)
        chosen.selectionChanged.connect(self.selection_changed)

        self._refresh()

    def set_lines(self, n_lines: int, first: Sequence[Line]) -> None:
        """Show other entries; the newest of them is current."""
        self._model.set_lines(n_lines, first)
        self.scrollToTop()
        if first:
            flags = QItemSelectionModel.SelectionFlag
            self.selectionModel().setCurrentIndex(
                self._model.index(0, WHEN), flags.ClearAndSelect | flags.Rows
            )
        else:
            self.selection_changed.emit()

    def add_lines(self, first: int, found: Sequence[Line]) -> None:
        """Show more lines, after as many others."""
        self._model.add_lines(first, found)

    def set_stations(self, stations: Sequence[str]) -> None:
        """Take over which stations the entries are of."""
        self._is_of_one_station = len(stations) <= 1
        self._show_columns()

    def hidden_columns(self) -> tuple[str, ...]:
        """Return the keys of the columns that the user does not want to see."""
        shown = zip(COLUMNS, self._shown, strict=False)
        return tuple(key for key, action in shown if not action.isChecked())

    def set_hidden_columns(self, hidden: Sequence[str]) -> None:
        """Hide columns by their keys; all others are shown."""
        for key, action in zip(COLUMNS, self._shown, strict=False):
            action.setChecked(key not in hidden)

    def current(self) -> Line | None:
        """Return the current line."""
        at = self.currentIndex()
        return self._model.line(at.row()) if at.isValid() else None

    def selected(self) -> tuple[Line, ...]:
        """Return the selected lines, unless they are many."""
        ranges = self.selectionModel().selection()
        parts = map(ranges.at, range(ranges.count()))
        rows = chain.from_iterable(range(r.top(), r.bottom() + 1) for r in parts)
        return tuple(map(self._model.line, islice(sorted(rows), MOST_SELECTED)))

    def _show_columns(self) -> None:
        """Hide what the user does not want, and the station where there is only one."""
        for column, action in enumerate(self._shown):
            is_alone = column == STATION and self._is_of_one_station
            self.setColumnHidden(column, is_alone or not action.isChecked())

    @override
    def _refresh(self) -> None:
        for action, title in zip(self._shown, self._model.titles(), strict=False):
            action.setText(title)
        self.show_other_words()


def _text(line: Line, column: int, kind_of: EventText) -> str:
    if column == WHAT:
        return type_and_state_text(line, kind_of)
    if line.entry is None:
        return ""
    event = line.entry.entry.event
    names = event.names
    if column == WHEN:
        return moment_text(event.at)
    if column == VERDICT:
        return verdict_text(event.grade)
    if column in NUMBERS:
        return _number(line, column)
    words = {
        STATION: names.station,
        PEN: names.pen,
        TIP: names.tip,
        BY: names.operator,
        WORDS: event.reason,
    }
    return words[column]


def _number(line: Line, column: int) -> str:
    """Return a coordinate of the tip, or the largest U."""
    assert line.entry is not None
    event = line.entry.entry.event
    tip, uncertainty = event.tip_pen_mm, event.expanded_uncertainty_mm
    if tip is None or uncertainty is None:
        return ""
    if column == U:
        return mm_text(max(uncertainty))
    return mm_text(tip[column - X])


LEAST_DATE, DATE_WIDTH = 14 * GRID, 17 * GRID
LEAST_CHOICE = 11 * GRID  # px; six fields fit a window of 800 px


class FilterBar(Translated, QWidget):
    """Four lists and two days."""

    value_changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._known = KnownNames()

        # Widgets: the order of making them is the order of the Tab key
        self._pen, self._tip, self._station = _choice(), _choice(), _choice()
        self._kind = _choice()
        for kind in Kind:
            self._kind.addItem("", kind)
        self._choices = (self._pen, self._tip, self._station, self._kind)
        self._begin, self._end = DateField(), DateField()
        fields = (*self._choices, self._begin, self._end)
        texts = (
            self.tr("Pen"),
            self.tr("Tip"),
            self.tr("Station"),
            self.tr("Entry type"),
            self.tr("From"),
            self.tr("To"),
        )

        # Layout
        layout = horizontal_layout(self)
        hints = 4 * ("",) + 2 * (self.tr("any day"),)
        for field, text, hint in zip(fields, texts, hints, strict=True):
            self.make_field(layout, field, text, hint=hint, stretch=1)
        for choice in self._choices:
            self.say_items(choice, (self.tr("All"),))
        for day in (self._begin, self._end):
            day.setMinimumWidth(LEAST_DATE)
            day.setMaximumWidth(DATE_WIDTH)

        # Connections
        self._pen.currentIndexChanged.connect(self._on_pen_changed)
        for choice in (self._tip, self._station, self._kind):
            choice.currentIndexChanged.connect(self.value_changed)
        for day in (self._begin, self._end):
            day.value_changed.connect(self.value_changed)

        self._refresh()

    def value(self) -> EntryFilter:
        """Return the filter; the last day is included."""
        end = self._end.value()
        named = (self._pen, self._tip, self._station)
        pen, tip, station = (choice.currentData() or "" for choice in named)
        kind = self._kind.currentData()
        return EntryFilter(
            pen,
            tip,
            station,
            kinds=(Kind(kind),) if kind else (),
            begin=_midnight(self._begin.value()),
            end=_midnight(None if end is None else end + timedelta(days=1)),
        )

    def set_known(self, known: KnownNames) -> None:
        """Set the known names; the selection is kept."""
        if known == self._known:
            return
        self._known = known
        _list(self._pen, known.pens)
        _list(self._station, known.stations)
        self._list_tips()

    def _list_tips(self) -> None:
        _list(self._tip, self._known.tips_of(self._pen.currentData() or ""))

    def _on_pen_changed(self) -> None:
        self._list_tips()
        self.value_changed.emit()

    def _refresh(self) -> None:
        for i, kind in enumerate(Kind, start=1):
            self._kind.setItemText(i, kind_text(kind))


def _choice() -> ChoiceField:
    choice = ChoiceField()
    choice.addItem("", "")
    policy = ChoiceField.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
    choice.setSizeAdjustPolicy(policy)
    choice.setMinimumWidth(LEAST_CHOICE)
    return choice


def _list(choice: ChoiceField, names: Sequence[str]) -> None:
    """List names after the choice *all*; the selected one stays selected."""
    chosen = choice.currentData()
    blocked = choice.blockSignals(True)
    while choice.count() > 1:
        choice.removeItem(1)
    for name in filter(None, names):
        choice.addItem(shortened(name), name)
    choice.setCurrentIndex(max(0, choice.findData(chosen)))
    choice.blockSignals(blocked)


def _midnight(day: date | None) -> datetime | None:
    return None if day is None else local_time(datetime.combine(day, time()))
