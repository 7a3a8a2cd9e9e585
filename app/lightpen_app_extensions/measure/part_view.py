"""A part as it is probed, in space: points, features, deviations and the next point."""

from dataclasses import dataclass, field

import numpy as np
from PySide6.QtCore import QPointF, QSize, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen.model.rigid import rotation_from_vector
from lightpen_app.look.theme import GRID, colors_of
from lightpen_app.look.tooltips import set_tooltip
from lightpen_app.widgets.translated import Translated
from lightpen_extensions.measure.measuring.drawing import of_centres, outline_of
from lightpen_extensions.measure.session.session import SessionSetup, SessionState
from lightpen_extensions.measure.tasks.part import PART
from lightpen_extensions.measure.tasks.part_course import feature_so_far, fit_of

MARGIN = 0.1  # of the sides
DOT, TIP, GOAL = 3.0, 6.0, 9.0  # px, radii
MAGNIFIED = 200.0  # times a deviation is drawn
TURN = 0.01  # rad a pixel of the mouse
FROM_ABOVE = np.array([0.6, 0.0, 0.0])  # rotation vector of the first view


@dataclass(frozen=True, eq=False)
class PartValue:
    """Drawn content of a part, frame of the camera, mm."""

    points: FloatArray  # (N, 3), ball centres
    deviations: FloatArray  # (N, 3), from the feature to each point
    outlines: tuple[FloatArray, ...] = ()  # lines of the features
    # (M, 3), what is drawn as large as fits; empty for all of it
    focus: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    tip: FloatArray | None = None  # (3,), at present
    goal: FloatArray | None = None  # (3,), most informative next point


EMPTY = np.zeros((0, 3))
NOTHING = PartValue(EMPTY, EMPTY)


def part_value(setup: SessionSetup, state: SessionState) -> PartValue:
    """Return the probed points of a part, and its features once measured."""
    progress, found = state.progress(setup, PART), state.found_by(PART)
    touching = state.touching
    is_seen = bool(touching.held) and not touching.n_lost
    tip = touching.held[-1].tip_cam if is_seen else None
    if found is not None:
        part = found.part
        points, off = part.touches.points_cam, np.zeros((len(found.points), 3))
        for i, offset in enumerate(found.deviations()):
            off[i] = 0.0 if offset is None else offset
        outlines = [line for one in part.features.values() for line in outline_of(one)]
        return PartValue(points, off, tuple(outlines), tip=tip)
    runs = *progress.runs, progress.points
    shown = [EMPTY]
    offsets, lines = [EMPTY], list[FloatArray]()
    for planned, run in zip(setup.choices.features, runs, strict=False):
        _, fit = fit_of(planned, run, setup.instrument)
        shown.append(np.array([point.point_cam for point in run]).reshape(-1, 3))
        offsets.append(np.zeros_like(shown[-1]) if fit is None else fit.offsets)
        lines += [] if fit is None else outline_of(of_centres(fit, shown[-1]))
    feature = feature_so_far(setup.choices, progress, setup.conditions)
    next_touch = None if feature is None else feature.next_touch
    goal = None if next_touch is None else next_touch.point
    focus = [*shown[-1], *([] if goal is None else [goal])]
    if feature is not None and feature.fit is not None:
        focus += np.concatenate(outline_of(of_centres(feature.fit, shown[-1]))).tolist()
    return PartValue(
        np.concatenate(shown),
        np.concatenate(offsets),
        tuple(lines),
        np.array(focus).reshape(-1, 3) if len(shown[-1]) > 1 else EMPTY,
        tip,
        goal,
    )


class PartView(Translated, QWidget):
    """Draws a part in space; the mouse turns it."""

    def __init__(self) -> None:
        super().__init__()
        self._value = NOTHING
        self._turn = rotation_from_vector(FROM_ABOVE)
        self._pressed: QPointF | None = None
        policy = QSizePolicy.Policy.Expanding
        self.setSizePolicy(policy, policy)
        self._retranslate()

    def set_value(self, value: PartValue) -> None:
        """Draw another state."""
        self._value = value
        self._retranslate()
        self.update()

    @override
    def sizeHint(self) -> QSize:
        return QSize(48 * GRID, 40 * GRID)

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(24 * GRID, 24 * GRID)

    @override
    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._pressed = event.position()

    @override
    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._pressed is None:
            return
        way, self._pressed = event.position() - self._pressed, event.position()
        turn = rotation_from_vector(np.array([-way.y(), way.x(), 0.0]) * TURN)
        self._turn = turn @ self._turn
        self.update()

    @override
    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self._pressed = None

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        value, colors = self._value, colors_of(self.palette())
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.fillRect(self.rect(), QColor(colors.panel))
        marks = [each for each in (value.tip, value.goal) if each is not None]
        all_ = np.concatenate(
            [value.points, *value.outlines, *(m[None] for m in marks)]
        )
        if not len(all_):
            painter.setPen(QColor(colors.muted))
            place = Qt.AlignmentFlag.AlignCenter
            painter.drawText(self.rect(), place, self.tr("No points yet"))
            return
        flat = (value.focus if len(value.focus) else all_) @ self._turn.T
        low, high = flat[:, :2].min(axis=0), flat[:, :2].max(axis=0)
        room = np.array([self.width(), self.height()]) * (1 - 2 * MARGIN)
        scale = float((room / np.maximum(high - low, 1.0)).min())
        middle, center = (low + high) / 2, np.array([self.width(), self.height()]) / 2

        def seen(points: FloatArray) -> list[QPointF]:
            places = ((points @ self._turn.T)[:, :2] - middle) * scale + center
            return [QPointF(*place) for place in places.tolist()]

        painter.setPen(QPen(QColor(colors.accent), 1.5))
        for line in value.outlines:
            painter.drawPolyline(QPolygonF(seen(line)))
        ends = seen(value.points + MAGNIFIED * value.deviations)
        painter.setPen(QPen(QColor(colors.warn), 2))
        dots = seen(value.points)
        for dot, end in zip(dots, ends, strict=True):
            painter.drawLine(dot, end)
        painter.setPen(QPen(QColor(colors.window), 1))
        painter.setBrush(QColor(colors.text))
        for dot in dots:
            painter.drawEllipse(dot, DOT, DOT)
        painter.setBrush(QColor(0, 0, 0, 0))
        for mark, color, radius in (
            (value.tip, colors.good, TIP),
            (value.goal, colors.pointer, GOAL),
        ):
            if mark is not None:
                painter.setPen(QPen(QColor(color), 3))
                painter.drawEllipse(seen(mark[None])[0], radius, radius)

    @override
    def _retranslate(self) -> None:
        words = self.tr("The part in space: {0} points, {1} lines of features")
        self.setAccessibleName(
            words.format(len(self._value.points), len(self._value.outlines))
        )
        set_tooltip(
            self,
            self.tr(
                "Deviations are drawn {0} times as large. Drag to turn the part."
            ).format(round(MAGNIFIED)),
        )
