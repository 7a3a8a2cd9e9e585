"""The uncertainty budget of a review."""

import numpy as np
from PySide6.QtCore import QRectF
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from typing_extensions import override

from lightpen_app.look.budget_figure import BudgetFigure, Drawing, paint_budget
from lightpen_app.look.quantities import mm_text
from lightpen_app.look.theme import GRID, TextSize, colors_of, font
from lightpen_app.widgets.figure import Axes, Figure


class BudgetPlot(Figure):
    """Shows the parts of U as horizontal bars, with its limit."""

    def __init__(self, axes: Axes) -> None:
        super().__init__()
        self._value = BudgetFigure()
        self.set_axes(axes)

    def value(self) -> BudgetFigure:
        """Return the figure that is shown."""
        return self._value

    def set_value(self, value: BudgetFigure) -> None:
        """Show another figure."""
        self._value = value
        self._columns = {
            "part": tuple(bar.name for bar in value.bars),
            "expanded_uncertainty_mm": np.array([bar.value for bar in value.bars]),
            "assumed": tuple(str(bar.assumed).lower() for bar in value.bars),
        }
        self.update()

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        colors, small = colors_of(self.palette()), font(TextSize.SMALL)
        with QPainter(self) as painter:
            painter.fillRect(self.rect(), QColor(colors.panel))
            painter.setPen(QColor(colors.text))
            painter.setFont(small)
            area = QRectF(self.rect()).adjusted(GRID // 2, GRID // 2, -GRID, -GRID)
            painter.drawText(area, self._axes.title)
            area.setTop(area.top() + 4 * GRID)
            if self._value.bars:
                bold = font(TextSize.SMALL, bold=True)
                drawing = Drawing(small, bold, colors, 1.0, mm_text)
                paint_budget(painter, area, self._value, drawing)

    @override
    def _restyle(self) -> None:
        self.update()
