"""Settings of the live stream, with its address and clients."""

from dataclasses import dataclass, field

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QCheckBox, QDialog, QDialogButtonBox, QFormLayout, QWidget
from typing_extensions import override

from lightpen_app.look.layouts import fill, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.widgets.choice_field import ChoiceField
from lightpen_app.widgets.fitted_window import FittedWindow
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.widgets.sign_label import SignLabel, StatusMessage
from lightpen_app.widgets.translated import Translated
from lightpen_extensions.stream.server import (
    LAST_PORT,
    LOOPBACK,
    StreamPlace,
    StreamStatus,
)

EVERYWHERE = "0.0.0.0"  # every network of the computer
FIRST_PORT = 1024  # of those that take no administrator


@dataclass(frozen=True)
class StreamState:
    """State of the stream."""

    status: StreamStatus = field(default_factory=StreamStatus)
    # Whether the place of a tip is streamed, and not the pose alone.
    has_tip: bool = False
    fault: str = ""  # why the enabled stream cannot listen


class StreamDialog(FittedWindow, Translated, QDialog):
    """Shows and changes the address of the stream."""

    # bool, StreamPlace: the user chose otherwise: whether it is on, and where
    value_changed = Signal(bool, object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.say(self, self.tr("Live stream"))
        self._state = StreamState()

        # Widgets
        self._lead = self.say(
            text_label(TextSize.BODY),
            self.tr(
                "Sends pose and tip live by OpenIGTLink to other programs such as "
                "3D Slicer."
            ),
        )
        self._on = self.say(QCheckBox(), self.tr("Stream pose and tip"))
        self._address = self.say(
            ChoiceField(),
            self.tr("Address"),
            tip=self.tr(
                "{0} for this computer only, {1} for all networks, or an address of "
                "this computer."
            ).format(LOOPBACK, EVERYWHERE),
        )
        self._address.setEditable(True)
        self._address.addItems([LOOPBACK, EVERYWHERE])
        self._port = self.say(
            NumberField("", (FIRST_PORT, LAST_PORT), 0), self.tr("Port")
        )
        self._address_label = self.say(
            text_label(TextSize.SMALL, Tone.QUIET), self.tr("Address")
        )
        self._address_label.setBuddy(self._address)
        self._port_label = self.say(
            text_label(TextSize.SMALL, Tone.QUIET), self.tr("Port")
        )
        self._port_label.setBuddy(self._port)
        self._reach = SignLabel()
        self._state_label = SignLabel()
        self._buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)

        # Layout
        layout = vertical_layout(self, self._lead, spacing=2 * GRID, margins=3 * GRID)
        form = QFormLayout()
        layout.addLayout(form)
        form.setHorizontalSpacing(2 * GRID)
        form.addRow(self._address_label, self._address)
        form.addRow(self._port_label, self._port)
        fill(layout, self._reach, self._on, self._state_label, self._buttons)
        self.setMinimumWidth(72 * GRID)

        # Connections
        self._on.clicked.connect(self._on_toggled)
        self._address.currentTextChanged.connect(self._refresh)
        self._port.textEdited.connect(self._refresh)
        self._buttons.rejected.connect(self.reject)

        self._retranslate()

    def place(self) -> StreamPlace:
        """Return the address of the stream."""
        return StreamPlace(
            self._address.currentText().strip(), round(self._port.value())
        )

    def set_value(self, *, is_on: bool, place: StreamPlace) -> None:
        """Show the settings."""
        self._on.setChecked(is_on)
        self._address.setCurrentText(place.address)
        self._port.set_value(place.port)
        self._refresh()

    def set_state(self, state: StreamState) -> None:
        """Show the state of the stream."""
        self._state = state
        self._refresh()

    def _refresh(self) -> None:
        is_on = self._on.isChecked()
        for each in (self._address, self._port):
            each.setEnabled(not is_on)
        is_complete = (
            bool(self._address.currentText().strip()) and not self._port.reason()
        )
        self._on.setEnabled(is_on or is_complete)
        reach = StatusMessage()
        if not self.place().is_local:
            text = self.tr(
                "Every computer in this network can receive the data without "
                "signing in. A firewall may ask for permission."
            )
            reach = StatusMessage.warning(text)
        self._reach.set_value(reach)
        self._state_label.set_value(self._state_message() if is_on else StatusMessage())

    def _state_message(self) -> StatusMessage:
        state = self._state
        if state.fault:
            return StatusMessage.fault(state.fault)
        if state.status.place is None:
            return StatusMessage()
        text = self.tr("Active at {0}. Clients: {1}").format(
            state.status.place, state.status.n_clients
        )
        if not state.has_tip:
            text += " " + self.tr("Only the pose is sent; there is no current tip.")
        return StatusMessage.good(text)

    def _on_toggled(self, is_on: bool) -> None:
        self._refresh()
        self.value_changed.emit(is_on, self.place())

    @override
    def _retranslate(self) -> None:
        close = QDialogButtonBox.StandardButton.Close
        self._buttons.button(close).setText(self.tr("Close"))
        self._refresh()
