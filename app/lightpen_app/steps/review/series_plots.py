"""Plots of few values: bars side by side, curves with marks, and postures as dots."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QAction, QMouseEvent
from PySide6.QtWidgets import QFrame, QGraphicsEllipseItem, QMenu, QToolButton, QWidget
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen.formats.files import write_whole
from lightpen.model.coverage import N_DIRECTIONS, TILT_RINGS
from lightpen_app.look.layouts import grid_layout
from lightpen_app.look.theme import GRID, colors_of
from lightpen_app.steps.review.residual_plots import SquarePlot
from lightpen_app.widgets.controls import ask_file
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.figure import Axes, Column, Figure
from lightpen_app.widgets.plots import DASHES, LINE, SYMBOL, SYMBOLS, TONES, Curve, Plot
from lightpen_app.work.chosen_files import SavePlace
from lightpen_app.work.job import Job

GROUP = 0.8  # of the room for a label, that its bars fill
FARTHEST = 36.0  # degrees of tilt that are always shown


class NamedPlot(Plot):
    """A plot of one or more series; several are named beside the title."""

    def __init__(self, axes: Axes, series: Sequence[Curve]) -> None:
        self._columns_of_series = tuple(each.column for each in series)
        self._names = tuple(each.name for each in series)
        super().__init__(axes)

    def names(self) -> tuple[str, ...]:
        """Return the names of the series."""
        return self._names

    def set_names(self, names: Sequence[str]) -> None:
        """Name the series in another language."""
        self._names = tuple(names)
        self._restyle()

    @override
    def _named_curves(self) -> tuple[str, ...]:
        return self._names if len(self._names) > 1 else ()

    def _named(self, *values: FloatArray) -> dict[str, Column]:
        """Return the values of each series by its column."""
        return dict(zip(self._columns_of_series, values, strict=True))


class BarPlot(NamedPlot):
    """A group of bars for each label, one bar a series, in their order.

    ``label_column`` is the column of labels in the CSV file.
    """

    def __init__(self, axes: Axes, series: Sequence[Curve], label_column: str) -> None:
        self._bars: list[pg.BarGraphItem] = []
        super().__init__(axes, series)
        self._label_column = label_column
        for _ in series:
            bars = pg.BarGraphItem(x=[0.0], height=[0.0], width=1.0)
            self._item.addItem(bars)
            self._bars.append(bars)

        self._restyle()

    def set_data(self, labels: Sequence[str], *values: FloatArray) -> None:
        """Show values (N,) of each series for N labels; NaN leaves a gap."""
        places = np.arange(len(labels), dtype=np.float64)
        width = GROUP / len(self._bars)
        for i, (bars, value) in enumerate(zip(self._bars, values, strict=True)):
            offset = (i - (len(self._bars) - 1) / 2) * width
            bars.setOpts(
                x=places + offset, height=np.nan_to_num(value), width=0.9 * width
            )
        self._item.getAxis("bottom").setTicks([list(enumerate(labels))])
        self._columns = {self._label_column: tuple(labels), **self._named(*values)}
        edges = np.array([-0.5, len(labels) - 0.5])
        self._fit(edges, np.concatenate(values), y_zero=True)

    @override
    def _restyle(self) -> None:
        super()._restyle()
        colors = colors_of(self.palette())
        for bars, tone in zip(self._bars, TONES, strict=False):
            bars.setOpts(pen=pg.mkPen(None), brush=pg.mkBrush(colors.tone(tone)))


class LinePlot(NamedPlot):
    """Values with marks, joined by lines, over iterations; at most three."""

    has_symbols = True

    def __init__(self, axes: Axes, curves: Sequence[Curve]) -> None:
        self._curves: list[pg.PlotDataItem] = []
        super().__init__(axes, curves)
        for _, symbol in zip(curves, SYMBOLS, strict=False):
            curve = pg.PlotDataItem(symbol=symbol, symbolSize=SYMBOL)
            self._item.addItem(curve)
            self._curves.append(curve)
        self._restyle()

    def set_data(
        self, x: FloatArray, *values: FloatArray, until: float = np.inf
    ) -> None:
        """Show values (N,) of each curve over x (N,), shown up to a limit.

        The CSV file holds them all.
        """
        for curve, value in zip(self._curves, values, strict=True):
            curve.setData(x, value)
        self._columns = {"iteration": x, **self._named(*values)}
        self._fit(x[x <= until], np.concatenate(values))

    @override
    def _restyle(self) -> None:
        super()._restyle()
        colors = colors_of(self.palette())
        for curve, tone, dash in zip(self._curves, TONES, DASHES, strict=False):
            curve.setPen(pg.mkPen(colors.tone(tone), width=LINE, style=dash))
            curve.setSymbolPen(pg.mkPen(None))
            curve.setSymbolBrush(pg.mkBrush(colors.tone(tone)))


class PosturePlot(SquarePlot):
    """Tilt of the pen in each image, seen from above with the camera below."""

    def __init__(self, axes: Axes) -> None:
        self._dots: pg.ScatterPlotItem | None = None
        super().__init__(axes)
        self._rings = []
        for tilt in (*np.degrees(TILT_RINGS), FARTHEST):
            ring = QGraphicsEllipseItem(-tilt, -tilt, 2 * tilt, 2 * tilt)
            self._item.addItem(ring)
            self._rings.append(ring)
        self._spokes = pg.PlotCurveItem(*_spokes(), connect="pairs")
        self._item.addItem(self._spokes)
        self._dots = pg.ScatterPlotItem(pxMode=True, size=6)
        self._item.addItem(self._dots)
        self._restyle()

    def set_data(self, tilts: FloatArray, directions: FloatArray) -> None:
        """Show postures by tilt (N,) and direction (N,), rad."""
        assert self._dots is not None
        degrees = np.degrees(tilts)
        right, away = degrees * np.cos(directions), degrees * np.sin(directions)
        self._dots.setData(right, away)
        self._columns = {
            "tilt_deg": degrees,
            "direction_deg": np.degrees(directions),
            "right_deg": right,
            "away_deg": away,
        }
        reach = float(np.max(degrees, initial=FARTHEST))
        self.set_range(QRectF(-reach, -reach, 2 * reach, 2 * reach))

    @override
    def _restyle(self) -> None:
        super()._restyle()
        if self._dots is None:
            return
        colors = colors_of(self.palette())
        line = pg.mkPen(colors.edge, width=1)
        line.setCosmetic(True)
        for ring in self._rings:
            ring.setPen(line)
        self._spokes.setPen(line)
        self._dots.setPen(pg.mkPen(None))
        self._dots.setBrush(pg.mkBrush(colors.accent))


def _spokes() -> tuple[FloatArray, FloatArray]:
    """Return the borders of the eight directions, as pairs of ends."""
    sector = 2 * np.pi / N_DIRECTIONS
    angles = np.repeat((np.arange(N_DIRECTIONS) + 0.5) * sector, 2)
    radii = np.tile([np.degrees(TILT_RINGS[0]), FARTHEST], N_DIRECTIONS)
    return radii * np.cos(angles), radii * np.sin(angles)


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
