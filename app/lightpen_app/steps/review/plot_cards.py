"""Framed plots."""

from PySide6.QtWidgets import QFrame

from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.figure import Figure


class PlotCard(QFrame):
    """A framed plot."""

    def __init__(self, plot: Figure) -> None:
        super().__init__()
        self.plot = plot
        self.setProperty("area", "panel")

        # Layout
        vertical_layout(self, plot, margins=GRID // 2)
