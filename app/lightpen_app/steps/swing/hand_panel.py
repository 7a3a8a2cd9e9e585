"""Buttons for the simulated operator, where the pen is simulated."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QToolButton, QWidget
from typing_extensions import override

from lightpen.model.posture import Posture
from lightpen.simulator.hand import Operator
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.rearranged import NO_ROOM, Rearranged
from lightpen_app.widgets.translated import Translated
from lightpen_app.work.live_view import LiveView

SLIP_MM, SLIP_S = 0.5, 1.5
COVER_S = 2.0


class HandPanel(Rearranged, Translated, QFrame):
    """Lets the simulated operator do things; hidden with a real pen.

    Parameters
    ----------
    live : LiveView
        Whose operator it is.

    Signals
    -------
    led_by_itself()
        From now on the pen is not where the user wanted it last.
    """

    narrow_below = 100 * GRID  # px; then its buttons are closer together
    led_by_itself = Signal()

    def __init__(self, live: LiveView, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("area", "panel")
        self._room = NO_ROOM  # so that its least size at first widens no window
        self._live = live
        self._led: Operator | None = None  # who was told to seat the tip and follow

        # Widgets
        self._follow = PushButton()
        self._follow.setCheckable(True)
        self._follow.setProperty("inviting", True)
        self._seat = QToolButton()
        self._swing = QToolButton()
        self._hold = QToolButton()
        self._lift = QToolButton()
        self._leave = QToolButton()
        self._slip = QToolButton()
        self._cover = QToolButton()

        # Layout
        self._layout = layout = QHBoxLayout(self)
        layout.setContentsMargins(GRID, GRID // 2, GRID, GRID // 2)
        layout.addWidget(self._follow)
        layout.addStretch(1)
        for button in self._commands():
            layout.addWidget(button)

        for each in (self._follow, *self._commands()):
            # A click leaves Space and Enter to the swing.
            each.setFocusPolicy(Qt.FocusPolicy.TabFocus)

        # Connections
        self._follow.toggled.connect(self._on_follow_toggled)
        self._seat.clicked.connect(self._on_seat_clicked)
        self._swing.clicked.connect(self._on_swing_clicked)
        self._hold.clicked.connect(self._on_hold_clicked)
        self._lift.clicked.connect(self._on_lift_clicked)
        self._leave.clicked.connect(self._on_leave_clicked)
        self._slip.clicked.connect(self._on_slip_clicked)
        self._cover.clicked.connect(self._on_cover_clicked)
        live.connection_changed.connect(self._on_connection_changed)

        self._use_room()
        self._retranslate()
        self._on_connection_changed()

    @override
    def _use_room(self) -> None:
        self._layout.setSpacing(GRID // 2 if self._room.is_narrow else GRID)

    def lean(self, posture: Posture) -> None:
        """Hold the pen as the user wants, who leads it from now on."""
        self._lead_by_hand()
        if operator := self._operator:
            operator.lean(posture.tilt, posture.direction, posture.turn)

    def follows(self) -> bool:
        """Return whether the operator does what the swing asks for."""
        return self._follow.isChecked()

    def _retranslate(self) -> None:
        """Set the texts anew."""
        self.setAccessibleName(self.tr("Simulated pen"))
        for button, text, tip in (
            (
                self._follow,
                self.tr("Let the simulated operator swing"),
                self.tr("It seats the tip and follows the arrow by itself."),
            ),
            (
                self._seat,
                self.tr("Seat"),
                self.tr("Put the tip into the cone; then drag the dot of the dial."),
            ),
            (
                self._swing,
                self.tr("Swing"),
                self.tr("Swing the pen round the cone, whatever the arrow says."),
            ),
            (self._hold, self.tr("Hold"), self.tr("Hold the pen still as it is.")),
            (self._lift, self.tr("Lift"), self.tr("Take the tip out of the cone.")),
            (
                self._leave,
                self.tr("Leave"),
                self.tr("Take the pen out of the image."),
            ),
            (
                self._slip,
                self.tr("Slip"),
                self.tr("Let the tip slip by {0} mm for a moment.").format(SLIP_MM),
            ),
            (
                self._cover,
                self.tr("Cover"),
                self.tr("Hold a hand before the LEDs for a moment."),
            ),
        ):
            button.setText(text)
            button.setToolTip(tip)
            button.setAccessibleDescription(tip)

    @property
    def _operator(self) -> Operator | None:
        return self._live.operator

    def _commands(self) -> tuple[QToolButton, ...]:
        return (
            self._seat,
            self._swing,
            self._hold,
            self._lift,
            self._leave,
            self._slip,
            self._cover,
        )

    def _lead_by_hand(self) -> None:
        self._follow.setChecked(False)

    def _on_connection_changed(self) -> None:
        self.setVisible(self._operator is not None)
        if self.follows() and self._operator is not self._led:
            self._lead()  # of a camera that was opened anew

    def _on_follow_toggled(self, follows: bool) -> None:
        if follows:
            self._lead()
        else:
            self._live.set_following(False)
            self._led = None

    def _lead(self) -> None:
        self.led_by_itself.emit()
        self._led = self._operator
        self._live.set_following(True)
        if self._led is not None:
            self._led.seat()

    def _on_seat_clicked(self) -> None:
        if operator := self._operator:
            operator.seat()

    def _on_swing_clicked(self) -> None:
        self._lead_by_hand()
        self.led_by_itself.emit()
        if operator := self._operator:
            operator.swing()

    def _on_hold_clicked(self) -> None:
        self._lead_by_hand()
        if operator := self._operator:
            operator.hold()

    def _on_lift_clicked(self) -> None:
        if operator := self._operator:
            operator.lift()

    def _on_leave_clicked(self) -> None:
        if operator := self._operator:
            operator.leave()

    def _on_slip_clicked(self) -> None:
        if operator := self._operator:
            operator.slip(SLIP_MM, SLIP_S)

    def _on_cover_clicked(self) -> None:
        if operator := self._operator:
            operator.cover(COVER_S)
