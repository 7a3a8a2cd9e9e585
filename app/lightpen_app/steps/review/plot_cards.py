"""Framed plots side by side, each of which can be enlarged."""

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QFrame, QToolButton, QWidget
from typing_extensions import override

from lightpen_app.look.layouts import grid_layout
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.figure import Figure

N_COLUMNS = 2  # of a grid
LEAST_HEIGHT = 25 * GRID  # px, of a plot with its title and axes


class PlotCard(Translated, QFrame):
    """A framed plot that its button, or a double click, enlarges."""

    # Enlarge the plot over its neighbours, or reduce it again.
    enlarge_toggled = Signal(bool)

    def __init__(self, plot: Figure) -> None:
        super().__init__()
        self.plot = plot
        self.setProperty("area", "panel")

        self._is_needed = True

        # Widgets
        self._enlarge = self.say(QToolButton(), tip=self.tr("Enlarge this plot"))
        self._enlarge.setCheckable(True)
        self._enlarge.setProperty("role", "more")

        # Layout
        layout = grid_layout(self, margins=GRID // 2)
        layout.addWidget(plot, 0, 0)
        corner = Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignRight
        layout.addWidget(self._enlarge, 0, 0, corner)

        # Connections
        self._enlarge.toggled.connect(self._retranslate)
        self._enlarge.toggled.connect(self.enlarge_toggled)
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

    @override
    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        self._enlarge.toggle()

    def _retranslate(self) -> None:
        self._enlarge.setText("\N{MINUS SIGN}" if self._enlarge.isChecked() else "+")
        words = f"{self.plot.accessibleName()}: {self._enlarge.toolTip()}"
        self._enlarge.setAccessibleName(words)


class PlotGrid(QWidget):
    """Plots side by side; one can be enlarged to the whole area."""

    def __init__(self, cards: Sequence[PlotCard]) -> None:
        super().__init__()
        self._cards = tuple(cards)

        # Layout
        layout = grid_layout(self)
        for i, card in enumerate(self._cards):
            layout.addWidget(card, *divmod(i, N_COLUMNS))
            card.plot.setMinimumHeight(LEAST_HEIGHT)

        # Connections
        for card in self._cards:
            card.enlarge_toggled.connect(self._on_enlarge_toggled)

    def cards(self) -> Sequence[PlotCard]:
        """Return the plots."""
        return self._cards

    def _on_enlarge_toggled(self, enlarged: bool) -> None:
        for card in self._cards:
            shown = card.is_needed and not enlarged
            card.setVisible(card is self.sender() or shown)
