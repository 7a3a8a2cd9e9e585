"""The figures of a check or a part, and its points: what the command prints, too."""

from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen.messages import Message
from lightpen_app.look.layouts import fill, vertical_layout
from lightpen_app.look.sentences import worded
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.widgets.number_table import Figures, NumberTable
from lightpen_app.widgets.page_scroll import PageScroll
from lightpen_app.widgets.translated import Translated
from lightpen_extensions.measure.session.session import SessionSetup, SessionState
from lightpen_extensions.measure.tasks.task import ResultTable, points_table

MOST_TABLES = 3  # of a task


class FiguresView(Translated, QWidget):
    """A table of figures below its title, and sentences below it."""

    def __init__(self) -> None:
        super().__init__()
        self._value: ResultTable | None = None

        # Widgets
        self._head = text_label(TextSize.SMALL, Tone.QUIET)
        self._table = NumberTable()
        self._table.set_letters(TextSize.SMALL)
        self._notes = text_label(TextSize.BODY, Tone.QUIET)

        # Layout
        vertical_layout(self, self._head, self._table, self._notes, spacing=GRID // 2)

        self._retranslate()

    def set_value(self, value: ResultTable | None) -> None:
        """Show another table, or none."""
        self._value = value
        self._retranslate()

    @override
    def _retranslate(self) -> None:
        value = self._value
        self.setVisible(value is not None)
        if value is None:
            return
        title = worded(value.title)
        self._head.setText(title)
        self._table.setAccessibleName(title)
        self._table.set_value(figures_of(value))
        self._table.setVisible(bool(value.rows))
        self._notes.setText(" ".join(map(worded, value.notes)))
        self._notes.setVisible(bool(value.notes))


class DetailsView(PageScroll):
    """Scrolls through the tables of a session."""

    def __init__(self) -> None:
        super().__init__()
        self._tables = tuple(FiguresView() for _ in range(MOST_TABLES))
        content = QWidget()
        layout = vertical_layout(content, margins=GRID)
        fill(layout, *self._tables, 1)
        self.setWidget(content)

    def set_value(self, setup: SessionSetup | None, state: SessionState | None) -> None:
        """Show a session; None for none."""
        tables: tuple[ResultTable, ...] = ()
        if setup is not None and state is not None:
            tables = (points_table(state.touches),)
            if state.found is not None:
                tables = setup.task.tables(state.found, setup.conditions)
        for index, view in enumerate(self._tables):
            view.set_value(tables[index] if index < len(tables) else None)


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


def _words(name: Message | str) -> str:
    return name if isinstance(name, str) else worded(name)
