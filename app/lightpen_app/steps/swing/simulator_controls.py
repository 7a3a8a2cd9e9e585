"""Buttons for the simulated operator, where the pen is simulated."""

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
from PySide6.QtWidgets import QMenu, QWidget
from typing_extensions import override

from lightpen.live.sources import Operator
from lightpen.model.rigid import Posture
from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.look.theme import GRID, colors_of
from lightpen_app.look.words import set_tooltip
from lightpen_app.steps.simulator_controls import SimulatorControls, set_words
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fitting import NO_ROOM, ResponsiveLayout
from lightpen_app.widgets.posture_dial import (
    MAX_TURN,
    PostureDial,
    place_of,
    posture_at,
)
from lightpen_app.work.live_view import LiveView

SLIP_MM, SLIP_S = 0.5, 1.5
COVER_S = 2.0


class SwingSimulatorControls(ResponsiveLayout, SimulatorControls):
    """Lets the simulated operator do things; hidden with a real pen."""

    narrow_below = 100 * GRID  # px; then its buttons are closer together
    led_by_itself = Signal()  # from now on the pen is not where the user wanted it last

    def __init__(self, live: LiveView, parent: QWidget | None = None) -> None:
        super().__init__(live, parent)
        self.setProperty("area", "panel")
        self._room = NO_ROOM  # so that its least size at first widens no window
        self._led: Operator | None = None  # that was set to seat the tip and follow

        # Widgets
        self._follow = PushButton(checkable=True)
        self._follow.setProperty("inviting", True)
        others = self.tr("What else the simulated operator can do with the pen")
        self._more = self.make_button(self.tr("Other movements"), tip=others)
        self._more.setAccessibleDescription(others)
        self._more.setProperty("menu", True)
        menu = QMenu(self._more)
        menu.setToolTipsVisible(True)
        acts = (
            lambda: self._command(lambda hand: hand.seat()),
            self._on_swing_clicked,
            self._on_hold_clicked,
            lambda: self._command(lambda hand: hand.lift()),
            lambda: self._command(lambda hand: hand.leave()),
            lambda: self._command(lambda hand: hand.slip(SLIP_MM, SLIP_S)),
            lambda: self._command(lambda hand: hand.cover(COVER_S)),
        )
        words = (
            self.tr("Seat"),
            self.tr("Swing"),
            self.tr("Hold"),
            self.tr("Lift"),
            self.tr("Leave"),
            self.tr("Slip"),
            self.tr("Cover"),
        )
        tips = (
            self.tr("Seats the tip in the cone; then drag the dot of the dial"),
            self.tr("Swings the pen about the cone regardless of the arrow"),
            self.tr("Holds the pen still"),
            self.tr("Lifts the tip out of the cone"),
            self.tr("Moves the pen out of the image"),
            self.tr("Lets the tip slip by {0} mm for a moment").format(SLIP_MM),
            self.tr("Covers the LEDs for a moment"),
        )
        for act, text, tip in zip(acts, words, tips, strict=True):
            self.say(menu.addAction("", act), text, tip=tip)
        self._more.setMenu(menu)

        # Layout
        margins = (GRID, GRID // 2, GRID, GRID // 2)
        horizontal_layout(self, self._follow, 1, self._more, margins=margins)

        # Connections
        self._follow.toggled.connect(self._on_follow_toggled)
        for each in (self._follow, self._more):
            # A click leaves Space and Enter to the swing.
            each.setFocusPolicy(Qt.FocusPolicy.TabFocus)

        self.say(self, self.tr("Simulated pen"))
        self._use_room()
        self._follow_connection()

    @override
    def _use_room(self) -> None:
        self._retranslate()

    def lean(self, posture: Posture) -> None:
        """Hold the pen as the user requests, instead of following the swing."""
        self._lead_by_hand()
        tilt, direction, turn = posture.tilt, posture.direction, posture.turn
        self._command(lambda operator: operator.lean(tilt, direction, turn))

    def invite(self) -> None:
        """Let the operator swing, as the button invites to."""
        if self._live.operator is not None and not self.follows():
            self._follow.setChecked(True)

    def follows(self) -> bool:
        """Return whether the operator follows the swing."""
        return self._follow.isChecked()

    @override
    def _retranslate(self) -> None:
        set_words(
            self._follow,
            self.tr("Simulated swing")
            if self._room.is_narrow
            else self.tr("Let the simulated operator swing"),
            self.tr("Seats the tip and follows the arrow automatically"),
        )

    def _lead_by_hand(self) -> None:
        self._follow.setChecked(False)

    @override
    def _follow_connection(self) -> None:
        super()._follow_connection()
        if self.follows() and self._live.operator is not self._led:
            self._lead()  # of a camera that was opened again

    def _on_follow_toggled(self, follows: bool) -> None:
        if follows:
            self._lead()
        else:
            self._live.set_following(False)
            self._led = None

    def _lead(self) -> None:
        self.led_by_itself.emit()
        self._led = self._live.operator
        self._live.set_following(True)
        self._command(lambda hand: hand.seat())

    def _on_swing_clicked(self) -> None:
        self._lead_by_hand()
        self.led_by_itself.emit()
        self._command(lambda hand: hand.swing())

    def _on_hold_clicked(self) -> None:
        self._lead_by_hand()
        self._command(lambda hand: hand.hold())


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
