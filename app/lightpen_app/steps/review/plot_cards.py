"""Framed plots side by side, each with a menu to enlarge and save it."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QAction, QMouseEvent
from PySide6.QtWidgets import QFrame, QMenu, QToolButton, QWidget
from typing_extensions import override

from lightpen.formats.files import write_whole
from lightpen_app.look.layouts import grid_layout
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.controls import ask_file
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.figure import Figure
from lightpen_app.work.chosen_files import SavePlace
from lightpen_app.work.job import Job

N_COLUMNS = 2  # of a grid


class NamedPicture(NamedTuple):
    """A plot as PNG, with the end of its file name."""

    name: str
    data: bytes


class PlotCard(Translated, QFrame):
    """A framed plot with a menu: enlarge, copy, save.

    ``file_stem`` is offered as the name of a saved file.
    """

    # Enlarge the plot over its neighbours, or reduce it again.
    enlarge_toggled = Signal(bool)
    saved = Signal(str)  # text for the user: where
    failed = Signal(str)  # text for the user

    def __init__(self, plot: Figure, file_stem: str) -> None:
        super().__init__()
        self.plot = plot
        self._file_stem = file_stem
        self._place: SavePlace | None = None
        self.setProperty("area", "panel")

        self._is_needed = True

        # Widgets
        self._menu = QMenu(self)
        self._enlarge = self.say(QAction(self, checkable=True), self.tr("Enlarge"))
        self._save_png = self.say(QAction(self), self.tr("Save picture (PNG)"))
        self._save_csv = self.say(QAction(self), self.tr("Save numbers (CSV)"))
        self._menu.addActions([self._enlarge, self._save_png, self._save_csv])
        self._button = self.say(QToolButton(), tip=self.tr("Enlarge or save this plot"))
        self._button.setText("\N{HORIZONTAL ELLIPSIS}")
        self._button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self._button.setProperty("role", "more")
        self._button.setMenu(self._menu)

        # Layout
        layout = grid_layout(self, margins=GRID // 2)
        layout.addWidget(plot, 0, 0)
        corner = Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignRight
        layout.addWidget(self._button, 0, 0, corner)

        # Connections
        self._enlarge.toggled.connect(self.enlarge_toggled)
        self._save_png.triggered.connect(lambda _=False: self._ask_place(".png"))
        self._save_csv.triggered.connect(lambda _=False: self._ask_place(".csv"))
        plot.titled.connect(self._retranslate)

        self._retranslate()

    @property
    def is_needed(self) -> bool:
        """Whether there is something to show."""
        return self._is_needed

    def set_needed(self, needed: bool) -> None:
        """Show the plot, or hide it where there is nothing to show."""
        if needed is not self._is_needed:
            self._is_needed = needed
            self.setVisible(needed)

    def set_place(self, place: SavePlace) -> None:
        """Set the folder for saving."""
        self._place = place

    def picture(self) -> NamedPicture:
        """Return the plot for saving beside others."""
        return NamedPicture(f"{self._file_stem}.png", self.plot.png(self._mark()))

    def actions_offered(self) -> Sequence[QAction]:
        """Return the actions of the menu: enlarge, save as PNG, save as CSV."""
        return self._enlarge, self._save_png, self._save_csv

    def save(self, path: Path) -> None:
        """Save by suffix: numbers as CSV, else a picture."""
        is_table = path.suffix.lower() == ".csv"
        data = self.plot.csv() if is_table else self.plot.png(self._mark())
        job = Job(lambda _: write_whole(path, data), self)
        text = self.tr("Saved as {0}").format(path)
        job.start(lambda _: self.saved.emit(text), self.failed)

    @override
    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        self._enlarge.toggle()

    def _mark(self) -> str:
        return "" if self._place is None else self._place.mark()

    def _ask_place(self, suffix: str) -> None:
        path = Path(self._file_stem + suffix)
        if self._place is not None:
            path = self._place.folder() / f"{self._place.stem()}_{path}"
        ask_file(self, self.tr("Save plot"), path, self._on_place_chosen)

    def _on_place_chosen(self, path: Path) -> None:
        if self._place is not None:
            self._place.remember(path.parent)
        self.save(path)

    def _retranslate(self) -> None:
        words = f"{self.plot.accessibleName()}: {self._button.toolTip()}"
        self._button.setAccessibleName(words)


class PlotGrid(QWidget):
    """Plots side by side; one can be enlarged to the whole area."""

    saved = Signal(str)  # as of any of the cards
    failed = Signal(str)

    def __init__(self, cards: Sequence[PlotCard]) -> None:
        super().__init__()
        self._cards = tuple(cards)

        # Layout
        layout = grid_layout(self)
        for i, card in enumerate(self._cards):
            layout.addWidget(card, *divmod(i, N_COLUMNS))

        # Connections
        for card in self._cards:
            card.enlarge_toggled.connect(self._on_enlarge_toggled)
            card.saved.connect(self.saved)
            card.failed.connect(self.failed)

    def cards(self) -> Sequence[PlotCard]:
        """Return the plots with their menus."""
        return self._cards

    def _on_enlarge_toggled(self, enlarged: bool) -> None:
        for card in self._cards:
            shown = card.is_needed and not enlarged
            card.setVisible(card is self.sender() or shown)
