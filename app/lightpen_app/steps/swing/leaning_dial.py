"""A posture dial that tilts a simulated pen by mouse and keys."""

import math
from dataclasses import replace

import numpy as np
from PySide6.QtCore import QPointF, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QWheelEvent,
)
from typing_extensions import override

from lightpen.model.posture import Posture
from lightpen_app.look.theme import colors_of
from lightpen_app.look.tooltips import set_tooltip
from lightpen_app.widgets.posture_dial import (
    MAX_TURN,
    PostureDial,
    place_of,
    posture_at,
)

KEY_STEP = 0.08  # of the radius
TURN_STEP = math.radians(5)
UPRIGHT = Posture(0.0, 0.0, 0.0)


class LeaningDial(PostureDial):
    """A dial on which a simulated pen is tilted.

    The mouse leans it to where it is dragged. The wheel, or a drag with Shift, turns it
    about its own axis; so does a drag of the bar. The arrow keys lean it, comma and
    full stop turn it, Home puts it upright.
    """

    leaned = Signal(object)  # Posture: the user wants the pen held so

    def __init__(self) -> None:
        super().__init__()
        self._is_interactive = False
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self._target: Posture | None = None  # what the user wanted last
        self._turns_at: float | None = None  # where a drag that turns began, px

    def set_interactive(self, interactive: bool) -> None:
        """Set whether the user can tilt the pen."""
        if interactive == self._is_interactive:
            return
        self._is_interactive = interactive
        self._retranslate()

    def forget_target(self) -> None:
        """Begin at the detected posture."""
        self._target = None

    @override
    def mousePressEvent(self, event: QMouseEvent) -> None:
        if not self._is_interactive:
            super().mousePressEvent(event)
            return
        _, _, bar = self._places()
        shift = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        turns = shift or event.position().y() >= bar.top()
        self._turns_at = event.position().x() if turns else None
        self.mouseMoveEvent(event)

    @override
    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if not self._is_interactive:
            super().mouseMoveEvent(event)
        elif self._turns_at is None:
            self._lean_to(event.position())
        else:
            moved = event.position().x() - self._turns_at
            self._turns_at = event.position().x()
            _, radius, _ = self._places()
            self._turn_by(moved / radius * MAX_TURN)

    @override
    def wheelEvent(self, event: QWheelEvent) -> None:
        if not self._is_interactive:
            super().wheelEvent(event)
            return
        self._turn_by(event.angleDelta().y() / 120 * TURN_STEP)
        event.accept()

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        moves = {
            Qt.Key.Key_Right: (KEY_STEP, 0.0),
            Qt.Key.Key_Up: (0.0, KEY_STEP),
            Qt.Key.Key_Left: (-KEY_STEP, 0.0),
            Qt.Key.Key_Down: (0.0, -KEY_STEP),
        }
        turns = {Qt.Key.Key_Comma: -TURN_STEP, Qt.Key.Key_Period: TURN_STEP}
        key = Qt.Key(event.key())
        if not self._is_interactive:
            super().keyPressEvent(event)
        elif key in moves:
            self._move_by(*moves[key])
        elif key in turns:
            self._turn_by(turns[key])
        elif key == Qt.Key.Key_Home:
            self._want(UPRIGHT)
        else:
            super().keyPressEvent(event)

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        if self.hasFocus():
            painter = QPainter(self)
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.setPen(QPen(QColor(colors_of(self.palette()).accent), 2))
            middle, radius, _ = self._places()
            painter.drawEllipse(middle, 1.02 * radius, 1.02 * radius)

    @override
    def _retranslate(self) -> None:
        super()._retranslate()
        set_tooltip(
            self,
            self.tr(
                "Drag or use the arrow keys to tilt the simulated pen. Wheel or "
                "keys , and . turn it about its own axis."
            )
            if self._is_interactive
            else "",
        )

    def _held(self) -> Posture:
        return self._target or self.value().posture or UPRIGHT

    def _want(self, posture: Posture) -> None:
        self._target = posture
        self.leaned.emit(posture)

    def _lean_to(self, place: QPointF) -> None:
        middle, radius, _ = self._places()
        at = (place.x() - middle.x()) / radius, (middle.y() - place.y()) / radius
        self._want(posture_at(at, self._held().turn, self.value().heading))

    def _move_by(self, right: float, up: float) -> None:
        held, heading = self._held(), self.value().heading
        x, y = place_of(held, heading)
        self._want(posture_at((x + right, y + up), held.turn, heading))

    def _turn_by(self, angle: float) -> None:
        held = self._held()
        turn = float(np.clip(held.turn + angle, -MAX_TURN, MAX_TURN))
        self._want(replace(held, turn=turn))
