"""Plot of the displacement of each LED of a pen over its swings."""

import numpy as np
import pyqtgraph as pg
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen_app.look.theme import Tone, colors_of
from lightpen_app.widgets.plots import Axes, Plot

DOT = 6  # px


class LedMovesPlot(Plot):
    """A line for each LED; a displaced one stands out."""

    def __init__(self) -> None:
        self._lines: list[pg.PlotDataItem] = []
        self._moved: tuple[int, ...] = ()
        super().__init__(Axes(""))

    def set_data(self, moves: FloatArray, moved: tuple[int, ...]) -> None:
        """Show the shifts of LEDs (N, L) at each swing, mm, NaN where not seen.

        ``moved`` are the numbers of those that moved against the others, from 1.
        """
        n_swings, n_leds = moves.shape
        while len(self._lines) < n_leds:
            line = pg.PlotDataItem(symbol="o", symbolSize=DOT, connect="finite")
            self._lines.append(line)
            self._item.addItem(line)
        x = np.arange(1.0, n_swings + 1)
        for j, line in enumerate(self._lines):
            line.setVisible(j < n_leds)
            if j < n_leds:
                line.setData(x, moves[:, j])
        self._moved = moved
        self._columns = {"swing": x}
        for j in range(n_leds):
            self._columns[f"led_{j + 1}_mm"] = moves[:, j]
        self._fit_numbered(n_swings, np.append(moves.ravel(), (0.0, 0.01)))
        self._restyle()

    @override
    def _restyle(self) -> None:
        super()._restyle()
        colors = colors_of(self.palette())
        for number, line in enumerate(self._lines, start=1):
            has_moved = number in self._moved
            color = colors.tone(Tone.BAD) if has_moved else colors.muted
            line.setPen(pg.mkPen(color, width=1))
            line.setSymbolBrush(pg.mkBrush(color))
            line.setSymbolPen(None)
            line.setZValue(1 if has_moved else 0)
