"""Rings for the spots of a live image."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QTransform
from PySide6.QtWidgets import QButtonGroup, QWidget

from lightpen.arrays import BoolArray, FloatArray
from lightpen.live.pipeline import LiveImage
from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.look.theme import GRID, Tone, font
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.image_view import Marker

RING = 1.4  # times the radius of its spot
CLEARANCE = 2.0  # image px between spot and ring, at least


def live_markers(seen: LiveImage) -> tuple[Marker, ...]:
    """Return a ring for each spot, numbered for LEDs.

    Spots that are no LED are dashed; without intrinsics and pen file this is unknown,
    and all rings are solid.
    """
    spots = seen.spots
    numbers = led_numbers(seen)
    radii = RING * np.sqrt(spots.areas / np.pi) + CLEARANCE
    angles = _free_angles(spots.centers)
    other = Tone.ACTIVE if seen.detection is None else Tone.WARN
    return tuple(
        Marker(
            x,
            y,
            radius,
            numbers.get(i, ""),
            tone=Tone.GOOD if i in numbers else other,
            label_angle=angle,
        )
        for i, ((x, y), radius, angle) in enumerate(
            zip(spots.centers.tolist(), radii.tolist(), angles.tolist(), strict=True)
        )
    )


def mask_markers(mask: FloatArray) -> Iterator[Marker]:
    """Yield a crossed circle for each row x, y, radius of an (M, 3) mask, px."""
    for x, y, radius in mask.tolist():
        yield Marker(x, y, radius, tone=Tone.QUIET, crossed=True)


def stray_markers(circles: FloatArray, label: str) -> Iterator[Marker]:
    """Yield a ring for each row x, y, radius of (M, 3) stray lights, px."""
    for x, y, radius in circles.tolist():
        yield Marker(x, y, RING * radius, label, Tone.BAD, label_angle=0.0)


def _free_angles(places: FloatArray) -> FloatArray:
    """Return the direction with most room at each of (N, 2) places, rad."""
    offsets = places[:, None] - places[None]
    distances = np.linalg.norm(offsets, axis=-1)
    np.fill_diagonal(distances, np.inf)
    push = (offsets / np.maximum(distances, 1.0)[..., None] ** 3).sum(axis=1)
    angles: FloatArray = np.arctan2(push[:, 1], push[:, 0])
    return angles


def led_numbers(seen: LiveImage) -> dict[int, str]:
    """Return the number of the LED of each spot that is one."""
    if seen.detection is None or seen.detection.labels is None:
        return {}
    spot_of_led = seen.detection.labels.spot
    labelled: BoolArray = spot_of_led >= 0
    return {
        int(spot_of_led[led]): str(led + 1) for led in np.flatnonzero(labelled).tolist()
    }


TURNS = (-10.0, 10.0, -20.0, 20.0)  # of the words against the circle, degrees
FLAGS = int(Qt.AlignmentFlag.AlignVCenter | Qt.TextFlag.TextDontClip)
TILTED = 2.0  # px of shortage that upright words may have more than turned ones
DISTANCE = 1.085  # from the centre of the dial to the mark's; radius = 1


@dataclass(frozen=True, eq=False)
class CameraPosition:
    """Position of a camera."""

    middle: QPointF  # of the dial, px
    radius: float  # radius of the dial, px
    # In which direction from the middle, counter-clockwise from the right, rad.
    angle: float

    @property
    def place(self) -> QPointF:
        """Middle of the mark, px."""
        towards = QPointF(math.cos(self.angle), -math.sin(self.angle))
        return self.middle + towards * (self.radius * DISTANCE)


def draw_camera(
    painter: QPainter,
    room: QRectF,
    stand: CameraPosition,
    words: str,
    size: float,
    color: QColor,
) -> None:
    """Draw a camera that faces a dial, with a label inside a rectangle.

    The font size is in px.
    """
    radius = stand.radius
    body = 0.055 * radius
    painter.save()
    painter.translate(stand.place)
    painter.rotate(math.degrees(-stand.angle) + 90)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(color)
    painter.drawRoundedRect(
        QRectF(-1.5 * body, -0.5 * body, 3 * body, 1.6 * body), 3, 3
    )
    painter.drawRect(QRectF(-0.6 * body, -1.1 * body, 1.2 * body, 0.7 * body))
    painter.restore()

    painter.save()
    painter.setPen(color)
    painter.setFont(font(size))
    length = QFontMetricsF(painter.font()).horizontalAdvance(words) + 1
    away = 2 * body + GRID / 2
    right = QRectF(away, -size / 2, length, size)
    left = right.translated(-2 * away - length, 0)
    along = 90 - math.degrees(stand.angle % math.pi)  # the circle; never upside down
    turns = (0.0, along, *(along + each for each in TURNS))
    turn, box = min(
        ((turn, box) for turn in turns for box in (right, left)),
        key=lambda each: (
            _shortage(each[0], each[1], room, stand) + TILTED * bool(each[0])
        ),
    )
    painter.translate(stand.place)
    painter.rotate(turn)
    painter.drawText(box, FLAGS, words)
    painter.restore()


def _shortage(turn: float, box: QRectF, room: QRectF, stand: CameraPosition) -> float:
    """Return by how much a label leaves its rectangle or covers the dial, px.

    Their box is about the mark and is turned by an angle in degrees, clockwise.
    """
    place = QTransform.fromTranslate(stand.place.x(), stand.place.y()).rotate(turn)
    both = place.mapRect(box).united(room)
    outside = both.width() - room.width() + both.height() - room.height()
    back, _ = place.inverted()
    middle = back.map(stand.middle)
    x = min(max(middle.x(), box.left()), box.right())
    y = min(max(middle.y(), box.top()), box.bottom())
    covered = stand.radius - math.hypot(x - middle.x(), y - middle.y())
    return outside + max(covered, 0.0)


N_CAMERAS = 2


class CameraSwitch(Translated, QWidget):
    """A button for each camera; one is pressed."""

    value_changed = Signal(int)  # index of the camera to show

    def __init__(self) -> None:
        super().__init__()

        # Widgets
        self._buttons = [PushButton() for _ in range(N_CAMERAS)]
        self._group = QButtonGroup(self)
        for c, button in enumerate(self._buttons):
            button.setCheckable(True)
            self._group.addButton(button, c)
        self._buttons[0].setChecked(True)

        # Layout
        horizontal_layout(self, *self._buttons)

        # Connections
        self._group.idClicked.connect(self.value_changed)

        self._retranslate()

    def value(self) -> int:
        """Return the number of the camera that is shown, from 0."""
        return self._group.checkedId()

    def set_value(self, camera: int) -> None:
        """Show another camera as chosen."""
        self._buttons[camera].setChecked(True)

    def _retranslate(self) -> None:
        for number, button in enumerate(self._buttons, start=1):
            button.setText(self.tr("Camera {0}").format(number))
