"""The uncertainty budget as horizontal bars, the same on the screen and on paper."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from PySide6.QtCore import QCoreApplication, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QPen

from lightpen.estimation.uncertainty.budget import ContributionName
from lightpen_app.look.phrases import share_text
from lightpen_app.look.theme import Colors

translate = QCoreApplication.translate

THICKNESS = 0.7  # of the lines of text, for a bar
GAP = 0.5  # of the height of the letters, beside a bar
MIDDLE = Qt.AlignmentFlag.AlignVCenter


@dataclass(frozen=True)
class BudgetBar:
    """A part of U along the weakest direction, or the whole."""

    name: str
    value: float  # U (k = 2), mm
    assumed: bool = False


@dataclass(frozen=True)
class BudgetFigure:
    """Bars, the largest first, that is the whole; and the limit, mm."""

    bars: tuple[BudgetBar, ...] = ()
    limit: float | None = None


@dataclass(frozen=True)
class Drawing:
    """How a figure is drawn: its letters, colours and lines."""

    font: QFont
    bold: QFont
    colors: Colors
    line: float  # width
    text: Callable[[float], str]  # of a length in mm


def budget_figure(
    shares: Iterable[tuple[ContributionName, float, bool]],
    whole: float,
    limit: float | None,
) -> BudgetFigure:
    """Return the figure of shares (name, U in mm, whether assumed) of the whole U."""
    bars = [BudgetBar(share_text(name), u, assumed) for name, u, assumed in shares]
    bars.sort(key=lambda bar: -bar.value)
    combined = BudgetBar(translate("BudgetFigure", "combined"), whole)
    return BudgetFigure((combined, *bars), limit)


def paint_budget(
    painter: QPainter, area: QRectF, figure: BudgetFigure, drawing: Drawing
) -> None:
    """Draw a bar for each source with its value; assumed ones are hollow."""
    metrics, bold = QFontMetricsF(drawing.font), QFontMetricsF(drawing.bold)
    colors, texts = drawing.colors, [_value_text(bar, drawing) for bar in figure.bars]
    line, gap = metrics.height(), GAP * metrics.height()
    left = area.left() + gap + max(bold.horizontalAdvance(b.name) for b in figure.bars)
    right = area.right() - gap - max(map(bold.horizontalAdvance, texts))
    head = 0.0 if figure.limit is None else line
    step = min((area.height() - head) / len(figure.bars), 2 * line)
    reach = max([bar.value for bar in figure.bars] + [figure.limit or 0.0]) or 1.0
    scale = max(right - left, 1.0) / reach
    for i, (bar, text) in enumerate(zip(figure.bars, texts, strict=True)):
        top = area.top() + head + i * step
        is_beyond = i == 0 and figure.limit is not None and bar.value > figure.limit
        color = QColor(colors.bad if is_beyond else colors.accent)
        thickness = min(THICKNESS * line, 0.8 * step)
        length = max(scale * bar.value, drawing.line)
        place = QRectF(left, top + (step - thickness) / 2, length, thickness)
        painter.setPen(QPen(color, drawing.line))
        painter.setBrush(QColor(colors.panel) if bar.assumed else color)
        painter.drawRect(place)
        painter.setFont(drawing.font if i else drawing.bold)
        painter.setPen(QColor(colors.text))
        name = QRectF(area.left(), top, left - gap - area.left(), step)
        painter.drawText(name, Qt.AlignmentFlag.AlignRight | MIDDLE, bar.name)
        beside = QRectF(place.right() + gap, top, area.right() - place.right(), step)
        painter.drawText(beside, Qt.AlignmentFlag.AlignLeft | MIDDLE, text)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    if figure.limit is None:
        return
    x = left + scale * figure.limit
    painter.setFont(drawing.font)
    limit = translate("BudgetFigure", "limit {0}").format(drawing.text(figure.limit))
    width = metrics.horizontalAdvance(limit) + 1
    start = min(max(x - width / 2, area.left()), area.right() - width)
    painter.setPen(QColor(colors.muted))
    painter.drawText(QRectF(start, area.top(), width, line), MIDDLE, limit)
    painter.setPen(QPen(QColor(colors.text), drawing.line, Qt.PenStyle.DashLine))
    bottom = area.top() + head + len(figure.bars) * step
    painter.drawLine(QPointF(x, area.top() + head), QPointF(x, bottom))


def _value_text(bar: BudgetBar, drawing: Drawing) -> str:
    text = drawing.text(bar.value)
    if not bar.assumed:
        return text
    return translate("BudgetFigure", "{0}, assumed").format(text)
