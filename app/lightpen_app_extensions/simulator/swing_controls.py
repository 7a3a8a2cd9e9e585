"""Buttons for the simulated operator, where the pen is simulated."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMenu
from typing_extensions import override

from lightpen.live.sources import Operator
from lightpen_app.face import SimulatorControls
from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.look.theme import GRID, set_styled
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fitting import NO_ROOM, ResponsiveLayout
from lightpen_app.work.live_view import LiveView

SLIP_MM, SLIP_S = 0.5, 1.5
COVER_S = 2.0


class SwingSimulatorControls(ResponsiveLayout, SimulatorControls):
    """Lets the simulated operator do things; hidden with a real pen."""

    narrow_below = 100 * GRID  # px; then its buttons are closer together

    def __init__(self, live: LiveView) -> None:
        super().__init__(live)
        self.setProperty("area", "panel")
        self._room = NO_ROOM  # so that its least size at first widens no window
        self._led: Operator | None = None  # that was set to seat the tip and follow

        # Widgets
        self._follow = PushButton(checkable=True)
        self._more = self.make_button(
            self.tr("Other movements"),
            tip=self.tr("What else the simulated operator can do with the pen"),
        )
        self._more.setProperty("menu", True)
        menu = QMenu(self._more)
        menu.setToolTipsVisible(True)
        acts = (
            lambda: self._command(lambda hand: hand.seat()),
            self._on_swing_clicked,
            self._on_hold_clicked,
            lambda: self._command(lambda hand: hand.lift()),
            lambda: self._command(lambda hand: hand.move_away()),
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
            self.tr("Seats the tip in the cone"),
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
        self._refresh()

    @override
    def invite(self) -> None:
        if self._live.operator is not None and not self.follows():
            self._follow.setChecked(True)

    @override
    def set_inviting(self, inviting: bool) -> None:
        set_styled(self._follow, "inviting", "true" if inviting else "")

    def follows(self) -> bool:
        """Return whether the operator follows the swing."""
        return self._follow.isChecked()

    @override
    def _refresh(self) -> None:
        self._follow.setText(
            self.tr("Simulated swing")
            if self._room.is_narrow
            else self.tr("Let the simulated operator swing")
        )
        tip = self.tr("Seats the tip and follows the arrow automatically")
        self._follow.set_why_not("", tip)

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
        self._led = self._live.operator
        self._live.set_following(True)
        self._command(lambda hand: hand.seat())

    def _on_swing_clicked(self) -> None:
        self._follow.setChecked(False)
        self._command(lambda hand: hand.swing())

    def _on_hold_clicked(self) -> None:
        self._follow.setChecked(False)
        self._command(lambda hand: hand.hold())
