"""A part as it is probed, in space: points, features and deviations."""

from dataclasses import dataclass, field, replace
from itertools import chain

import numpy as np
from PySide6.QtCore import QPointF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen.model.rigid import Posture, posture_of, rotation_from_vector
from lightpen_app.look.layouts import horizontal_layout, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, colors_of
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import FittedText
from lightpen_app.widgets.posture_dial import DialValue, PostureDial, field_of
from lightpen_app_extensions.measure.check_list import BandChart
from lightpen_extensions.measure.measuring.report import of_centres, outline_of
from lightpen_extensions.measure.session import SessionSetup, SessionState
from lightpen_extensions.measure.tasks.part import PART, feature_so_far, fit_of
from lightpen_extensions.measure.tasks.task import Band

MARGIN = 0.1  # of the sides
DOT, TIP = 3.0, 6.0  # px, radii
MAGNIFIED = 200.0  # times a deviation is drawn
FROM_ABOVE = rotation_from_vector(np.array([0.6, 0.0, 0.0]))  # of the view


@dataclass(frozen=True, eq=False)
class PartValue:
    """Drawn content of a part, frame of the camera, mm."""

    points: FloatArray  # (N, 3), ball centres
    deviations: FloatArray  # (N, 3), from the feature to each point
    outlines: tuple[FloatArray, ...] = ()  # lines of the features
    # (M, 3), what is drawn as large as fits; empty for all of it
    focus: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    tip: FloatArray | None = None  # (3,), at present


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
    focus = list(shown[-1])
    if feature is not None and feature.fit is not None:
        focus += np.concatenate(outline_of(of_centres(feature.fit, shown[-1]))).tolist()
    return PartValue(
        np.concatenate(shown),
        np.concatenate(offsets),
        tuple(lines),
        np.array(focus).reshape(-1, 3) if len(shown[-1]) > 1 else EMPTY,
        tip,
    )


class PartView(Translated, QWidget):
    """Draws a part in space."""

    def __init__(self) -> None:
        super().__init__()
        self._value = NOTHING
        policy = QSizePolicy.Policy.Expanding
        self.setSizePolicy(policy, policy)
        words = self.tr("Deviations are drawn {0} times as large.")
        self.say(self, tip=words.format(round(MAGNIFIED)))

    def set_value(self, value: PartValue) -> None:
        """Draw another state."""
        self._value = value
        words = self.tr("The part in space: {0} points, {1} lines of features")
        self.setAccessibleName(words.format(len(value.points), len(value.outlines)))
        self.update()

    @override
    def sizeHint(self) -> QSize:
        return QSize(48 * GRID, 40 * GRID)

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(24 * GRID, 24 * GRID)

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        value, colors = self._value, colors_of(self.palette())
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.fillRect(self.rect(), QColor(colors.panel))
        tip = EMPTY if value.tip is None else value.tip[None]
        all_ = np.concatenate([value.points, *value.outlines, tip])
        if not len(all_):
            painter.setPen(QColor(colors.muted))
            place = Qt.AlignmentFlag.AlignCenter
            painter.drawText(self.rect(), place, self.tr("No points yet"))
            return
        flat = (value.focus if len(value.focus) else all_) @ FROM_ABOVE.T
        low, high = flat[:, :2].min(axis=0), flat[:, :2].max(axis=0)
        room = np.array([self.width(), self.height()]) * (1 - 2 * MARGIN)
        scale = float((room / np.maximum(high - low, 1.0)).min())
        middle, center = (low + high) / 2, np.array([self.width(), self.height()]) / 2

        def seen(points: FloatArray) -> list[QPointF]:
            places = ((points @ FROM_ABOVE.T)[:, :2] - middle) * scale + center
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
        painter.setPen(QPen(QColor(colors.good), 3))
        for mark in seen(tip):
            painter.drawEllipse(mark, TIP, TIP)


PICTURE_HEIGHT, LOW_PICTURE_HEIGHT = 18 * GRID, 9 * GRID  # px, at least


@dataclass(frozen=True, eq=False)
class FigureValue:
    """Content of the figure."""

    title: str = ""  # what is probed now
    live: str = ""  # the deviation at present, or what the check is for
    picture: PartValue | DialValue | None = None  # None once all is probed
    bands: tuple[Band, ...] = field(default=())
    action: str = ""  # label of the button that begins the check


class FigurePanel(QWidget):
    """Shows the figure."""

    asked = Signal()  # the check is to be done now

    def __init__(self) -> None:
        super().__init__()
        self._value, self._is_low = FigureValue(), False

        # Widgets
        self._title = FittedText(TextSize.TITLE, wraps=False)
        self._live = FittedText(TextSize.TITLE, least=TextSize.BODY)
        self._do = PushButton()
        self._part, self._dial = PartView(), PostureDial()
        self._bands = BandChart()

        # Layout
        layout = vertical_layout(self, margins=(GRID, GRID // 2, GRID, GRID // 2))
        cells = (self._title, 1), (self._live, 1), self._do
        self.head = horizontal_layout(layout, *cells)  # more of it may be added
        for picture in (self._part, self._dial):
            layout.addWidget(picture, 3)
        layout.addWidget(self._bands, 1)

        # Connections
        self._do.clicked.connect(self.asked)

    def set_low(self, *, low: bool) -> None:
        """Show either the picture or the values, and what is nowhere else; or all."""
        self._is_low = low
        for picture in (self._part, self._dial):
            picture.setMinimumHeight(LOW_PICTURE_HEIGHT if low else PICTURE_HEIGHT)
        for words in (self._title, self._live):
            words.setHidden(low)
        self.set_value(self._value)

    def set_value(self, value: FigureValue) -> None:
        """Show another moment."""
        self._value = value
        self._title.set_text(value.title)
        self._live.set_text(value.live, bold=False)
        self._do.setText(value.action)
        self._do.setVisible(bool(value.action))
        picture, bands = value.picture, value.bands
        if self._is_low and picture is not None and bands:
            picture, bands = (picture, ()) if value.live else (None, bands)
        self._part.setVisible(isinstance(picture, PartValue))
        self._dial.setVisible(isinstance(picture, DialValue))
        if isinstance(picture, PartValue):
            self._part.set_value(picture)
        elif isinstance(picture, DialValue):
            self._dial.set_value(picture)
        self._bands.set_bands(bands)


def posture_value(setup: SessionSetup, state: SessionState) -> DialValue:
    """Return the postures of the pen at the points of a check, and the present one."""
    points, pen = chain(*state.runs, state.touches), setup.instrument.pen
    held = () if state.touching.n_lost else state.touching.held
    live = posture_of(pen, held[-1].frame.rotation) if held else None
    dial = dial_of([posture_of(pen, point.rotation) for point in points], live)
    goal = setup.task.hand(setup.choices, len(state.runs), len(state.touches))
    return replace(dial, target=Posture(goal.tilt, goal.direction, 0.0))


def dial_of(touched: list[Posture], posture: Posture | None) -> DialValue:
    """Return a dial with each field full that has a probed point."""
    counts = np.zeros((3, 8), dtype=np.int64)
    for each in touched:
        ring, sector = field_of(each)
        counts[ring, sector] += 1
    n_upright = int(counts[0].sum())
    return DialValue(
        counts=counts[1:],
        needed=np.minimum(counts[1:], 1),
        n_upright=n_upright,
        n_upright_needed=min(n_upright, 1),
        posture=posture,
    )
