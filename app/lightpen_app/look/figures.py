"""What is drawn alike on the screen and on paper: budget, arrows, images."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QCoreApplication, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPen

from lightpen.arrays import FloatArray, Image
from lightpen.estimation.uncertainty.budget import ContributionName
from lightpen_app.look.phrases import share_text
from lightpen_app.look.theme import Colors, TextSize, font
from lightpen_app.look.words import mm_text

MANY = 400  # arrows; more are shown as their means
N_CELLS = 20  # across; each shows the mean of its arrows


def cell_means(
    points: FloatArray, vectors: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the means of points (N, 2) and vectors (N, 2) in cells of the image."""
    low = points.min(axis=0)
    side = float(np.max(points.max(axis=0) - low)) / N_CELLS or 1.0
    columns, rows = ((points - low) / side).astype(np.int64).T
    _, cells = np.unique(rows * (N_CELLS + 1) + columns, return_inverse=True)
    counts = np.bincount(cells)
    means = [
        np.bincount(cells, weights=values) / counts
        for values in (*points.T, *vectors.T)
    ]
    return np.column_stack(means[:2]), np.column_stack(means[2:])


def arrow_lines(
    points: FloatArray, vectors: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the ends of shafts and heads as pairs, for one curve of them all.

    Arrows lead from points (N, 2) by vectors (N, 2); x and y are (6 N,).
    """
    tips = points + vectors
    ahead = vectors * 0.3
    aside = np.column_stack([-ahead[:, 1], ahead[:, 0]]) * 0.5
    strokes = (points, tips, tips, tips - ahead + aside, tips, tips - ahead - aside)
    lines = np.stack(strokes, axis=1).reshape(-1, 2)
    return lines[:, 0], lines[:, 1]


def arrow_scale(residuals: FloatArray, image_width: float) -> float:
    """Return the magnification for residuals (N, 2), px, on an image.

    Arrows then are about a thirtieth of its width; the factor is 1, 2 or 5 times a
    power of ten.
    """
    rms = float(np.sqrt(np.mean(np.sum(residuals**2, axis=1)))) if len(residuals) else 0
    if not rms > 0:
        return 1.0
    wanted = image_width / 30 / rms
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(power * max(step for step in (1, 2, 5) if step * power <= wanted))


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
    painter: QPainter, area: QRectF, figure: BudgetFigure, colors: Colors
) -> None:
    """Draw a bar for each source with its value; assumed ones are hollow."""
    letters, strong = font(TextSize.SMALL), font(TextSize.SMALL, bold=True)
    metrics, bold = QFontMetricsF(letters), QFontMetricsF(strong)
    texts = list(map(_value_text, figure.bars))
    line, gap = metrics.height(), GAP * metrics.height()
    left = area.left() + gap + max(bold.horizontalAdvance(b.name) for b in figure.bars)
    widths = list(map(bold.horizontalAdvance, texts))
    head = 0.0 if figure.limit is None else line
    step = min((area.height() - head) / len(figure.bars), 2 * line)
    room = area.right() - left
    reaches = [(figure.limit or 0.0, room)]
    for bar, width in zip(figure.bars, widths, strict=True):
        reaches.append((bar.value, room - gap - width))
    scale = min((max(px, 1.0) / reach for reach, px in reaches if reach), default=1.0)
    if figure.limit is not None:
        x = left + scale * figure.limit
        painter.setFont(letters)
        limit = translate("BudgetFigure", "limit {0}").format(mm_text(figure.limit))
        width = metrics.horizontalAdvance(limit) + 1
        start = min(max(x - width / 2, area.left()), area.right() - width)
        painter.setPen(QColor(colors.muted))
        painter.drawText(QRectF(start, area.top(), width, line), MIDDLE, limit)
        painter.setPen(QPen(QColor(colors.text), 1.0, Qt.PenStyle.DashLine))
        bottom = area.top() + head + len(figure.bars) * step
        painter.drawLine(QPointF(x, area.top() + head), QPointF(x, bottom))
    for i, (bar, text) in enumerate(zip(figure.bars, texts, strict=True)):
        top = area.top() + head + i * step
        is_beyond = i == 0 and figure.limit is not None and bar.value > figure.limit
        color = QColor(colors.bad if is_beyond else colors.accent)
        thickness = min(THICKNESS * line, 0.8 * step)
        length = max(scale * bar.value, 1.0)
        place = QRectF(left, top + (step - thickness) / 2, length, thickness)
        painter.setPen(QPen(color, 1.0))
        painter.setBrush(QColor(colors.panel) if bar.assumed else color)
        painter.drawRect(place)
        painter.setFont(letters if i else strong)
        painter.setPen(QColor(colors.text))
        name = QRectF(area.left(), top, left - gap - area.left(), step)
        painter.drawText(name, Qt.AlignmentFlag.AlignRight | MIDDLE, bar.name)
        beside = QRectF(place.right() + gap, top, widths[i], step)
        painter.fillRect(beside, QColor(colors.panel))  # over the line of the limit
        painter.drawText(beside, Qt.AlignmentFlag.AlignLeft | MIDDLE, text)
    painter.setBrush(Qt.BrushStyle.NoBrush)


def _value_text(bar: BudgetBar) -> str:
    text = mm_text(bar.value)
    if not bar.assumed:
        return text
    return translate("BudgetFigure", "{0}, assumed").format(text)


def pooled(image: Image, bits: int = 8) -> Image:
    """Return an 8-bit image of half the size, each pixel the brightest of four.

    Unlike averaging, this keeps the brightness of small LEDs. Images with more than 8
    used bits are reduced to the upper 8.
    """
    height, width = (size // 2 * 2 for size in image.shape)
    rows = np.maximum(image[0:height:2], image[1:height:2])
    half = np.maximum(rows[:, 0:width:2], rows[:, 1:width:2])
    if half.dtype == np.uint8:
        return half
    return (half >> max(bits - 8, 0)).astype(np.uint8)
