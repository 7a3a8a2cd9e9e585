"""The plots of a calibration from its file."""

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QCoreApplication, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter

from lightpen.arrays import FloatArray
from lightpen.estimation.reports.calibration_record import CalibrationRecord
from lightpen.model.coverage import N_DIRECTIONS, TILT_RINGS
from lightpen.record.recomputing import ReestimatedPoses
from lightpen_app.look.figures import (
    MANY,
    Drawing,
    arrow_lines,
    arrow_scale,
    budget_figure,
    cell_means,
    paint_budget,
)
from lightpen_app.look.theme import LIGHT
from lightpen_app.look.words import AXES, MICROMETRES, micrometres_text
from lightpen_app.print_report.blocks import (
    CENTER,
    HAIRLINE,
    PrintSize,
    draw_text,
    line_pen,
    print_font,
)
from lightpen_app.print_report.charts import (
    LABEL_ROOM,
    LETTERS,
    AxisWords,
    Chart,
    Mark,
    Plane,
    PlotRange,
    padded_range,
    paint_axes,
    paint_bars,
    paint_crosses,
    paint_dots,
    paint_line,
)

translate = QCoreApplication.translate

HEADROOM = 1.6  # times the largest misfit of a used image; worse ones are at the edge
STEADY = 8.0  # times the last U, beyond which a tip by few images is left out
FARTHEST = 40.0  # degrees of tilt that are shown
N_BINS = 31


def misfit_chart(calibration: CalibrationRecord) -> Chart:
    """Return the misfit of each image; one that takes no part is a cross."""
    misfits = np.array([f.rms_px for f in calibration.frames], dtype=np.float64)
    used = np.array([f.used for f in calibration.frames], dtype=bool)
    numbers = np.arange(1.0, len(misfits) + 1)
    top = HEADROOM * float(np.nanmax(misfits[used], initial=1e-6))
    heights = np.where(np.isfinite(misfits), np.minimum(misfits, top), top)
    shown = padded_range(numbers, np.append(heights, 0.0), from_zero=True)

    def paint(painter: QPainter, area: QRectF) -> None:
        plane = paint_axes(painter, area, shown, AxisWords(_image_number()))
        paint_dots(painter, plane, numbers[used], heights[used])
        paint_crosses(painter, plane, numbers[~used], heights[~used])

    return Chart(translate("paper", "RMS residual per image / px"), paint)


def led_chart(calibration: CalibrationRecord) -> Chart:
    """Return the residuals of each LED."""
    rms = np.array([led.rms_px for led in calibration.leds], dtype=np.float64)
    means = np.array([led.mean_px for led in calibration.leds], dtype=np.float64)
    labels = tuple(str(led.led) for led in calibration.leds)
    values = (rms, means[:, 0], means[:, 1])
    names = (
        translate("paper", "rms"),
        translate("paper", "mean x"),
        translate("paper", "mean y"),
    )
    title = translate("paper", "Residuals by LED / px")
    words = AxisWords(translate("paper", "LED"), labels)
    return _bar_chart(title, labels, values, names, words)


def budget_chart(calibration: CalibrationRecord) -> Chart:
    """Return the parts of U along its weakest direction."""
    figure = budget_figure(
        (
            (share.name, share.weakest_expanded_uncertainty_mm, share.assumed)
            for share in calibration.uncertainty.shares
        ),
        calibration.weakest_direction.expanded_uncertainty_mm,
        calibration.verdict.limits.max_uncertainty_mm,
    )
    letters = print_font(PrintSize.BODY), print_font(PrintSize.BODY, bold=True)
    drawing = Drawing(*letters, LIGHT, HAIRLINE, micrometres_text)

    def paint(painter: QPainter, area: QRectF) -> None:
        paint_budget(painter, area, figure, drawing)

    title = translate("paper", "U (k = 2) by source, weakest direction / µm")
    return Chart(title, paint)


def tips_chart(calibration: CalibrationRecord) -> Chart:
    """Return the tip by each image minus the cone, camera frame."""
    tips = np.array([f.tip_cam_mm for f in calibration.frames], dtype=np.float64)
    used = np.array([f.used for f in calibration.frames], dtype=bool)
    away = MICROMETRES * (tips[used] - np.array(calibration.cone_cam_mm))
    numbers = np.arange(1.0, len(used) + 1)[used]
    shown = padded_range(numbers, away)

    def paint(painter: QPainter, area: QRectF) -> None:
        plane = paint_axes(painter, area, shown, AxisWords(_image_number()))
        for series in (2, 0, 1):  # depth scatters most, and is drawn first
            paint_dots(painter, plane, numbers, away[:, series], series)

    title = translate("paper", "Tip per image relative to the cone / µm")
    return Chart(title, paint, ("u", "v", "w"), Mark.DOT)


def running_chart(reestimated: ReestimatedPoses, tip: FloatArray) -> Chart:
    """Return the convergence of the tip (3,), mm, with the images."""
    steady = _steady(reestimated)
    numbers = reestimated.numbers[steady].astype(np.float64)
    away = MICROMETRES * (reestimated.tips[steady] - tip)
    title = translate("paper", "Tip from the first n images minus result / µm")
    return _line_chart(title, numbers, away, AXES)


def certainty_chart(reestimated: ReestimatedPoses, limit: float) -> Chart:
    """Return U (k = 2) over the number of images, with its limit, mm."""
    steady = _steady(reestimated)
    numbers = reestimated.numbers[steady].astype(np.float64)
    values = MICROMETRES * reestimated.uncertainties[steady]
    title = translate("paper", "U (k = 2) from the first n images / µm")
    return _line_chart(title, numbers, values, AXES, MICROMETRES * limit)


def residual_chart(reestimated: ReestimatedPoses) -> Chart:
    """Return the residuals as enlarged arrows at their image positions."""
    starts, vectors = reestimated.points, reestimated.residuals
    if len(starts) > MANY:
        starts, vectors = cell_means(starts, vectors)
    low, high = reestimated.points.min(axis=0), reestimated.points.max(axis=0)
    scale = arrow_scale(vectors, float(high[0] - low[0]))
    x, y = arrow_lines(starts, vectors * scale)

    def paint(painter: QPainter, area: QRectF) -> None:
        room = area.adjusted(0, 0, 0, -LABEL_ROOM)
        width, height = (1.1 * (high - low)).tolist()
        times = min(room.width() / width, room.height() / height)
        middle = (high + low) / 2
        painter.save()
        painter.translate(room.center())
        painter.setPen(line_pen(LIGHT.edge))
        frame = QRectF(0, 0, times * width, times * height)
        frame.moveCenter(QPointF(0, 0))
        painter.drawRect(frame)
        painter.setPen(line_pen(LIGHT.accent, 6))
        right, down = times * (x - middle[0]), times * (y - middle[1])
        ends = [QPointF(*p) for p in zip(right.tolist(), down.tolist(), strict=True)]
        painter.drawLines(ends)
        painter.restore()

    title = translate("paper", "Residuals over the image \xd7 {0}").format(f"{scale:g}")
    return Chart(title, paint)


def histogram_chart(reestimated: ReestimatedPoses) -> Chart:
    """Return the histogram of the residuals with the normal curve."""
    values = reestimated.residuals.ravel()
    reach = float(np.abs(values).max(initial=1e-6))
    counts, edges = np.histogram(values, N_BINS, (-reach, reach))
    sigma, step = float(np.sqrt(np.mean(values**2))) or 1.0, edges[1] - edges[0]
    fine = np.linspace(-reach, reach, 200)
    density = np.exp(-0.5 * (fine / sigma) ** 2) / (sigma * np.sqrt(2 * np.pi))
    curve = len(values) * step * density
    tops = np.concatenate([[0.0], counts, curve])
    shown = padded_range(edges, tops, from_zero=True)

    def paint(painter: QPainter, area: QRectF) -> None:
        words = AxisWords(translate("paper", "residual / px"))
        plane = paint_axes(painter, area, shown, words)
        painter.setPen(line_pen(LIGHT.accent, HAIRLINE))
        painter.setBrush(QColor(LIGHT.partial))
        for left, right, count in zip(edges[:-1], edges[1:], counts, strict=True):
            corners = plane.points(np.array([left, right]), np.array([0.0, count]))
            painter.drawRect(QRectF(*corners))
        paint_line(painter, plane, fine, curve, color=LIGHT.text)

    return Chart(translate("paper", "Histogram of residuals with normal fit"), paint)


def posture_chart(reestimated: ReestimatedPoses) -> Chart:
    """Return the plot of the pen tilts from above, with the camera below."""
    tilts, directions = np.degrees(reestimated.tilts), reestimated.directions
    right, away = tilts * np.cos(directions), tilts * np.sin(directions)
    reach = float(np.max(tilts, initial=FARTHEST))

    def paint(painter: QPainter, area: QRectF) -> None:
        plane = _paint_dial(painter, area, reach)
        paint_dots(painter, plane, right, away)

    return Chart(translate("paper", "Postures: tilt / \xb0"), paint)


def coverage_chart(calibration: CalibrationRecord) -> Chart:
    """Return the number of images in each field of the dial."""
    coverage = calibration.coverage
    inner, outer = np.degrees(TILT_RINGS)
    places = [(0.0, 0.0, coverage.upright)]
    for radius, counts in (
        ((inner + outer) / 2, coverage.leaning),
        ((outer + FARTHEST) / 2, coverage.leaning_far),
    ):
        for direction, count in enumerate(counts):
            angle = 2 * np.pi * direction / N_DIRECTIONS
            right, away = radius * np.cos(angle), radius * np.sin(angle)
            places.append((float(right), float(away), count))

    def paint(painter: QPainter, area: QRectF) -> None:
        plane = _paint_dial(painter, area, FARTHEST)
        for right, away, count in places:
            center = plane.point(right, away)
            label = QRectF(center.x() - 100, center.y() - 0.65 * LETTERS, 200, LETTERS)
            color = LIGHT.text if count else LIGHT.bad
            draw_text(painter, label, str(count), LETTERS, color, CENTER, bold=True)

    return Chart(translate("paper", "Images per field"), paint)


def _bar_chart(
    title: str,
    labels: Sequence[str],
    values: Sequence[FloatArray],
    names: Sequence[str],
    words: AxisWords,
) -> Chart:
    heights = np.concatenate([[0.0], *values])
    tall = padded_range(np.zeros(1), heights, from_zero=True)
    shown = PlotRange(-0.6, len(labels) - 0.4, tall.y_low, tall.y_high)

    def paint(painter: QPainter, area: QRectF) -> None:
        paint_bars(painter, paint_axes(painter, area, shown, words), values)

    return Chart(title, paint, tuple(names), Mark.BAR)


def _line_chart(
    title: str,
    numbers: FloatArray,
    values: FloatArray,
    names: Sequence[str],
    limit: float | None = None,
) -> Chart:
    """Return curves of values (N, 3) over numbers (N,), and a line at a limit."""
    heights = values.ravel() if limit is None else np.append(values, [0.0, limit])
    shown = padded_range(numbers, heights, from_zero=limit is not None)

    def paint(painter: QPainter, area: QRectF) -> None:
        plane = paint_axes(painter, area, shown, AxisWords(_image_number()))
        if limit is not None:
            ends = np.array([shown.x_low, shown.x_high])
            level = np.full(2, limit)
            paint_line(painter, plane, ends, level, color=LIGHT.bad)
        for series in range(len(names)):
            paint_line(painter, plane, numbers, values[:, series], series)

    return Chart(title, paint, tuple(names))


def _paint_dial(painter: QPainter, area: QRectF, reach: float) -> Plane:
    """Draw the rings and sectors of the dial, and return where to draw."""
    side = min(area.width(), area.height() - LABEL_ROOM)
    square = QRectF(area.center().x() - side / 2, area.top(), side, side)
    plane = Plane(square, PlotRange(-reach, reach, -reach, reach))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setPen(line_pen(LIGHT.edge))
    center = square.center()
    for tilt in (*np.degrees(TILT_RINGS).tolist(), FARTHEST):
        radius = side / 2 * tilt / reach
        painter.drawEllipse(center, radius, radius)
    inner = side / 2 * float(np.degrees(TILT_RINGS[0])) / reach
    for direction in range(N_DIRECTIONS):
        angle = 2 * np.pi * (direction + 0.5) / N_DIRECTIONS
        ray = QPointF(float(np.cos(angle)), float(-np.sin(angle)))
        painter.drawLine(center + ray * inner, center + ray * side / 2)
    below = QRectF(area.left(), square.bottom() + 20, area.width(), LETTERS)
    words = translate("paper", "towards the camera")
    draw_text(painter, below, words, LETTERS, LIGHT.muted, CENTER)
    return plane


def _steady(reestimated: ReestimatedPoses) -> FloatArray:
    """Return the mask of the running tips that are certain enough to draw, (M,)."""
    last = reestimated.uncertainties[-1].max()
    worst = reestimated.uncertainties.max(axis=1)
    return np.asarray(worst <= STEADY * last)


def _image_number() -> str:
    return translate("paper", "image")
