"""Results of a task, and its points during probing: tables and a picture."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np
from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QWidget
from typing_extensions import override

from lightpen.messages import Message
from lightpen.model.posture import Posture, posture_of
from lightpen.verification.session.session_state import SessionSetup, SessionState
from lightpen.verification.tasks.part import PART
from lightpen.verification.tasks.registry import AnyTask
from lightpen.verification.tasks.task import ResultTable
from lightpen_app.look.layouts import (
    fill,
    horizontal_layout,
    set_stacked,
    vertical_layout,
)
from lightpen_app.look.sentences import worded
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.steps.verify.part_view import PartView, part_value
from lightpen_app.widgets.number_table import Figures, NumberTable
from lightpen_app.widgets.page_scroll import PageScroll, ShrinkingScrollContent
from lightpen_app.widgets.posture_dial import DialValue, PostureDial, field_of
from lightpen_app.widgets.responsive_layout import NO_ROOM, ResponsiveLayout
from lightpen_app.widgets.translated import Translated

MOST_TABLES = 2  # of a task; others are only printed
HEAD_HEIGHT, ROW_HEIGHT = 7 * GRID, 3 * GRID  # px, of the points during probing
NOWHERE = Qt.AlignmentFlag(0)  # but all over
LEAST_HEIGHT = 16 * GRID  # px, of the results
USUAL_WIDTH = 84 * GRID  # px, with less the tables of a part have small letters
DIAL_SIZE = 22 * GRID  # px
PICTURE_SHARE, LARGE_PICTURE_SHARE, TABLES_SHARE = 5, 9, 13  # of the width


@dataclass(frozen=True)
class TaskPicture:
    """A picture of a task beside its figures."""

    make: Callable[[], Any]  # returns the widget, which has `set_value`
    # Returns the value to show.
    value: Callable[[SessionSetup, SessionState, AnyTask], Any]


def posture_value(setup: SessionSetup, state: SessionState, task: AnyTask) -> DialValue:
    """Return the postures of the pen at the points of a task, and the present one."""
    progress, found = state.progress(setup, task), state.found_by(task)
    points = [*chain.from_iterable(progress.runs), *progress.points]
    if found is not None and not points:
        points = list(found.probed)
    if not (points or state.task(setup) is task):
        return DialValue()
    pen = setup.instrument.pen
    dial = dial_of(
        [posture_of(pen, point.rotation) for point in points],
        live_posture(setup, state),
    )
    if state.task(setup) is not task:
        return dial
    options = setup.choices.options_of(task)
    goal = task.hand(options, len(progress.runs), len(progress.points))
    return replace(dial, target=Posture(goal.tilt, goal.direction, 0.0))


def _dial() -> PostureDial:
    dial = PostureDial()
    dial.setMinimumSize(DIAL_SIZE, DIAL_SIZE)
    return dial


PICTURES = {PART.kind: TaskPicture(PartView, part_value)}
POSTURES = TaskPicture(_dial, posture_value)


class FiguresView(Translated, QWidget):
    """A table of figures below its title, and sentences below it."""

    def __init__(self) -> None:
        super().__init__()
        self._value: ResultTable | None = None

        # Widgets
        self._head = text_label(TextSize.SMALL, Tone.QUIET)
        self._table = NumberTable()
        self._notes = text_label(TextSize.BODY, Tone.QUIET)
        self._notes.setWordWrap(True)

        # Layout
        vertical_layout(
            self, self._head, self._table, self._notes, 1, spacing=GRID // 2
        )

        self._retranslate()

    def set_value(self, value: ResultTable | None) -> None:
        """Show another table, or none."""
        self._value = value
        self._retranslate()

    def set_letters(self, size: TextSize) -> None:
        """Show the figures larger, for a large window, smaller or as usual."""
        self._table.set_letters(size)

    @override
    def _retranslate(self) -> None:
        value = self._value
        self.setVisible(value is not None)
        if value is None:
            return
        title = worded(value.title)
        self._head.setText(title)
        self._head.setVisible(bool(value.rows))
        self._table.setAccessibleName(title)
        self._table.set_value(figures_of(value))
        self._table.setVisible(bool(value.rows))
        self._notes.setText(" ".join(map(worded, value.notes)))
        self._notes.setVisible(bool(value.notes))


class TaskFinding(ResponsiveLayout, QWidget):
    """Shows the figures of a task, and the picture that it may have."""

    narrow_below = 116 * GRID  # px; then one table is below the other
    large_from = QSize(160 * GRID, 80 * GRID)  # px; then all is larger

    def __init__(self, task: AnyTask) -> None:
        super().__init__()
        self._task = task
        if task is PART:
            self.narrow_below = 125 * GRID
        self._room = NO_ROOM  # so that its least size at first widens no window
        self._is_found = False

        # Widgets
        usual = POSTURES if task.shows_postures else None
        self._picture = PICTURES.get(task.kind, usual)
        self._pictured = None if self._picture is None else self._picture.make()
        self._tables = tuple(FiguresView() for _ in range(MOST_TABLES))

        # Layout: only tables scroll; tables of a part are as wide as the page and have
        # the picture below
        results, scroll = QWidget(), PageScroll()
        scroll.setMinimumHeight(LEAST_HEIGHT)
        self._side = horizontal_layout(results, *self._tables, spacing=2 * GRID)
        is_part = task is PART
        content = QWidget() if is_part else results
        scroll.setWidget(ShrinkingScrollContent(content))
        self._columns = horizontal_layout(
            content if is_part else self, spacing=2 * GRID
        )
        if self._pictured is not None:
            fill(self._columns, self._pictured)
        fill(self._columns, (results if is_part else scroll, TABLES_SHARE))
        if is_part:
            vertical_layout(self, scroll)
        self._use_room()

    @override
    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._set_letters()

    def _set_letters(self) -> None:
        is_tight = self._task is PART and self.width() < USUAL_WIDTH
        usual = TextSize.SMALL if is_tight else TextSize.BODY
        for table in self._tables:
            table.set_letters(TextSize.LEAD if self._room.is_large else usual)

    def set_value(self, setup: SessionSetup | None, state: SessionState | None) -> None:
        """Show a session; None for none."""
        tables: tuple[ResultTable, ...] = ()
        is_found = state is not None and state.done is self._task
        if is_found is not self._is_found:
            self._is_found = is_found
            self._use_room()
        if setup is not None and state is not None:
            tables = self._figures(setup, state)
            if self._pictured is not None and self._picture is not None:
                value = self._picture.value(setup, state, self._task)
                self._pictured.set_value(value)
        if is_found and self._task is not PART:  # the points are in the report
            tables = tuple(each for each in tables if not _is_of_points(each))
        for index, view in enumerate(self._tables):
            view.set_value(tables[index] if index < len(tables) else None)

    def _figures(
        self, setup: SessionSetup, state: SessionState
    ) -> tuple[ResultTable, ...]:
        task, found = self._task, state.found_by(self._task)
        if found is not None:
            return task.tables(found, setup.conditions)
        options = setup.choices.options_of(task)
        tables = task.figures_so_far(
            options, state.progress(setup, task), setup.conditions
        )
        latest = max((self.height() - HEAD_HEIGHT) // ROW_HEIGHT, 1)
        return tuple(
            replace(each, rows=each.rows[-latest:]) if _is_of_points(each) else each
            for each in tables
        )

    @override
    def _use_room(self) -> None:
        direction = QBoxLayout.Direction
        is_narrow, is_part = self._room.is_narrow, self._task is PART
        is_stacked = is_narrow or is_part  # its tables are wide
        set_stacked(self._side, is_stacked)
        self._columns.setDirection(
            direction.BottomToTop
            if is_narrow and is_part and self._is_found
            else direction.LeftToRight
        )
        self._side.setStretch(0, 0 if is_stacked else 1)
        self._side.setStretch(1, 1)
        is_large = self._room.is_large
        self._set_letters()
        if self._pictured is not None:
            share = LARGE_PICTURE_SHARE if is_large else PICTURE_SHARE
            self._columns.setStretch(0, share)
            is_short = is_narrow and not is_part
            side = Qt.AlignmentFlag.AlignTop if is_short else NOWHERE
            self._columns.setAlignment(self._pictured, side)


def figures_of(table: ResultTable) -> Figures:
    """Return a table with its words in the language that is chosen."""
    return Figures(
        tuple(map(_words, table.columns)) if table.rows else (),
        tuple(_words(row.name) for row in table.rows),
        tuple(
            (
                *row.texts(),
                *([_words(row.remark)] if len(row.values) < len(table.columns) else ()),
            )
            for row in table.rows
        ),
    )


def dial_of(touched: list[Posture], posture: Posture | None) -> DialValue:
    """Return a dial with each field full that has a probed point."""
    counts = np.zeros((3, 8), dtype=np.int64)
    for each in touched:
        ring, sector = field_of(each)
        counts[ring, sector] += 1
    n_upright = int(counts[0].sum())
    return DialValue(
        counts=counts[1:],
        needed=np.minimum(counts[1:], 1),
        n_upright=n_upright,
        n_upright_needed=min(n_upright, 1),
        posture=posture,
    )


def live_posture(setup: SessionSetup, state: SessionState) -> Posture | None:
    """Return the present posture, if detected."""
    touching = state.touching
    if not touching.held or touching.n_lost:
        return None
    return posture_of(setup.instrument.pen, touching.held[-1].frame.rotation)


def _is_of_points(table: ResultTable) -> bool:
    name = table.rows[0].name if table.rows else ""
    return isinstance(name, Message) and name.code == "table.point"


def _words(name: Message | str) -> str:
    return name if isinstance(name, str) else worded(name)
