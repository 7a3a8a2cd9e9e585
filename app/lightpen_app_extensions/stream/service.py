"""The stream of positions in the window: its dialog and its server."""

from dataclasses import dataclass

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtWidgets import QCheckBox, QDialog, QDialogButtonBox, QFormLayout, QWidget
from typing_extensions import override

from lightpen.cameras.pairing import Clock
from lightpen.errors import LightpenError
from lightpen.local_time import local_now
from lightpen.record.calibrations import with_status
from lightpen.record.results.result_folder import FolderArchive
from lightpen.swing.preparation import Preparation
from lightpen_app.face import MenuEntry, Service
from lightpen_app.look.layouts import fill, vertical_layout
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.widgets.fields import ChoiceField, Translated
from lightpen_app.widgets.fitting import FittedWindow
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.work.job import Job, LatestJob, Report
from lightpen_app.work.workbench import Workbench
from lightpen_extensions.measure.probing.current_tip import read_tip_in_force
from lightpen_extensions.stream.messages import StreamedTip, tip_metadata
from lightpen_extensions.stream.server import (
    LAST_PORT,
    LOOPBACK,
    PoseStream,
    StreamPlace,
    StreamStatus,
)

EVERYWHERE = "0.0.0.0"  # every network of the computer
FIRST_PORT = 1024  # of those that take no administrator


class StreamDialog(FittedWindow, Translated, QDialog):
    """Shows and changes the address of the stream."""

    # bool, StreamPlace: the user chose otherwise: whether it is on, and where
    value_changed = Signal(bool, object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.say(self, self.tr("Live stream"))

        # Widgets
        self._lead = self.say(
            text_label(TextSize.BODY),
            self.tr(
                "Sends pose and tip live by OpenIGTLink to other programs such as "
                "3D Slicer."
            ),
        )
        self._on = self.say(QCheckBox(), self.tr("Stream pose and tip"))
        self._address = ChoiceField()
        self._address.setEditable(True)
        self._address.addItems([LOOPBACK, EVERYWHERE])
        self._port = NumberField("", (FIRST_PORT, LAST_PORT), 0)
        whose = self.tr(
            "{0} for this computer only, {1} for all networks, or an address of this "
            "computer."
        ).format(LOOPBACK, EVERYWHERE)
        self._reach = SignLabel()
        self._state = SignLabel()
        close = QDialogButtonBox.StandardButton.Close
        self._buttons = QDialogButtonBox(close)
        self.say(self._buttons.button(close), self.tr("Close"))

        # Layout
        layout = vertical_layout(self, self._lead, spacing=2 * GRID, margins=3 * GRID)
        form = QFormLayout()
        layout.addLayout(form)
        form.setHorizontalSpacing(2 * GRID)
        address, port = self.tr("Address"), self.tr("Port")
        form.addRow(self.make_label(self._address, address, tip=whose), self._address)
        form.addRow(self.make_label(self._port, port), self._port)
        fill(layout, self._reach, self._on, self._state, self._buttons)
        self.setMinimumWidth(72 * GRID)

        # Connections
        self._on.clicked.connect(self._on_toggled)
        self._address.currentTextChanged.connect(self._refresh)
        self._port.textEdited.connect(self._refresh)
        self._buttons.rejected.connect(self.reject)

        self._refresh()

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

    def set_state(self, state: StatusMessage) -> None:
        """Show the state of the stream."""
        self._state.set_value(state)

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

    def _on_toggled(self, is_on: bool) -> None:
        self._refresh()
        self.value_changed.emit(is_on, self.place())


class Streaming(QObject):
    """Opens and closes the stream and updates its tip.

    ``clock`` is the clock of the cameras.
    """

    changed = Signal()  # `has_tip`, `fault` or the status of `stream` is different
    _status_changed = Signal()

    def __init__(
        self, archive: FolderArchive, clock: Clock, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._archive = archive
        self._preparation = Preparation()
        self._wanted: StreamPlace | None = None
        self._opened: StreamPlace | None = None  # that is open, or was tried
        self._opening: Job | None = None
        self._reading = LatestJob(self)
        self.has_tip = False  # whether the place of a tip is streamed, too
        self.fault = ""  # why the stream is unavailable
        # It takes every image, on the thread of the pipeline.
        self.stream = PoseStream(clock, lambda status: self._status_changed.emit())

        # Connections
        self._status_changed.connect(self.changed, Qt.ConnectionType.QueuedConnection)

    @property
    def status(self) -> StreamStatus:
        """Address and number of clients."""
        return self.stream.status

    def want(self, place: StreamPlace | None) -> None:
        """Stream to an address; None stops the stream."""
        self._wanted = place
        self._follow()

    def choose(self, preparation: Preparation) -> None:
        """Set the selected pen and tip, and their files."""
        is_same = _what_counts(preparation) == _what_counts(self._preparation)
        self._preparation = preparation
        if not is_same:
            self.read_tip()

    def read_tip(self) -> None:
        """Read the current tip, which may have changed."""
        self._reading.cancel()
        if self._wanted is None:
            return
        archive, preparation = self._archive, self._preparation
        self._reading.start(lambda _: _tip(archive, preparation), self._on_tip_read)

    def shut_down(self) -> None:
        """Open no stream any more; a job that ends later starts none."""
        self._wanted = self._opened = None

    def await_end(self, timeout_s: float) -> bool:
        """Close the stream after all jobs have ended, and return whether it is."""
        self.stream.close()
        return True

    def _follow(self) -> None:
        """Open or close the stream in a job, since names are looked up."""
        if self._opening is not None or self._wanted == self._opened:
            return
        self._opened = place = self._wanted
        stream = self.stream

        def follow(_: Report) -> None:
            stream.close()
            if place is not None:
                stream.open(place)

        self._set_fault("")
        self._opening = job = Job(follow, self)
        job.start(failed=self._set_fault, ended=self._on_opening_ended)

    def _set_fault(self, fault: str) -> None:
        self.fault = fault
        self.changed.emit()

    def _on_opening_ended(self) -> None:
        self._opening = None
        self._follow()
        self.read_tip()
        self.changed.emit()

    def _on_tip_read(self, tip: StreamedTip | None) -> None:
        self.stream.set_tip(tip)
        self.has_tip = tip is not None
        self.changed.emit()


def _what_counts(preparation: Preparation) -> tuple[object, ...]:
    return (
        preparation.names,
        preparation.origin,
        preparation.second is None,
        preparation.camera_file,
        preparation.pen_file,
    )


def _tip(archive: FolderArchive, preparation: Preparation) -> StreamedTip | None:
    """Return the current tip; None if it is unknown or unusable."""
    if preparation.camera_file is None or preparation.pen_file is None:
        return None
    try:
        tip = read_tip_in_force(archive, preparation)
    except LightpenError:  # the step Verify says why
        return None
    metadata = tip_metadata(with_status(tip.calibration, local_now()))
    return StreamedTip(tip.names, tip.instrument, metadata)


KEY = "stream"


@dataclass(frozen=True)
class StreamChoice:
    """Whether other programs may follow the pen, and where; see `StreamPlace`."""

    is_on: bool = False
    address: str = StreamPlace.address
    port: int = StreamPlace.port

    @property
    def place(self) -> StreamPlace:
        """The address of the stream."""
        return StreamPlace(self.address, self.port)


class StreamService(Service):
    """Streams pose and tip while the user wants it, and says so on every page."""

    def __init__(self, workbench: Workbench) -> None:
        super().__init__(workbench)
        self._settings, self._notices = workbench.settings, workbench.notifications
        self._selection = workbench.selection
        archive, clock = workbench.run.archive, workbench.around.clock
        self.streaming = Streaming(archive, clock, self)
        self._dialog: StreamDialog | None = None

        # Connections
        workbench.live.add_listener(self.streaming.stream)
        workbench.parts.append(self.streaming)
        workbench.selection.changed.connect(self._on_selected)
        workbench.run.result_changed.connect(self.streaming.read_tip)
        self.streaming.changed.connect(self._show)

        self._on_selected()
        self._follow()

    @property
    def choice(self) -> StreamChoice:
        """What the user chose."""
        return self._settings.of_extension(KEY, StreamChoice())

    @override
    def menu_entries(self) -> tuple[MenuEntry, ...]:
        return (MenuEntry(lambda: self.tr("Live stream..."), self._open_dialog),)

    @override
    def remark(self) -> StatusMessage:
        status = self.streaming.status
        if status.place is None:
            return StatusMessage()
        text = self.tr("Live stream at {0}, clients: {1}").format(
            status.place, status.n_clients
        )
        if status.n_slow:
            text += " " + self.tr("({0} of them miss images)").format(status.n_slow)
        is_fine = status.place.is_local and not status.n_slow
        return StatusMessage(text, Sign.RING, Tone.ACTIVE if is_fine else Tone.WARN)

    def _open_dialog(self, window: QWidget) -> None:
        if self._dialog is None:
            self._dialog = StreamDialog(window)
            self._dialog.value_changed.connect(self._on_chosen)
            self._show()
        choice = self.choice
        self._dialog.set_value(is_on=choice.is_on, place=choice.place)
        self._dialog.open()

    def _on_chosen(self, is_on: bool, place: StreamPlace) -> None:
        choice = StreamChoice(is_on, place.address, place.port)
        self._settings.set_of_extension(KEY, choice)
        self._follow()

    def _follow(self) -> None:
        """Start the stream of pen poses if it is enabled, else end it."""
        choice = self.choice
        self.streaming.want(choice.place if choice.is_on else None)

    def _on_selected(self) -> None:
        self.streaming.choose(self._selection.preparation)

    def _show(self) -> None:
        streaming, notices = self.streaming, self._notices
        if not streaming.fault:
            notices.withdraw(streaming)
        elif streaming.fault != notices.text(streaming):
            notices.notify(streaming, streaming.fault)
        if self._dialog is not None:
            self._dialog.set_state(self._state())
        self.remark_changed.emit()

    def _state(self) -> StatusMessage:
        streaming, status = self.streaming, self.streaming.status
        if streaming.fault:
            return StatusMessage.fault(streaming.fault)
        if status.place is None:
            return StatusMessage()
        text = self.tr("Active at {0}. Clients: {1}")
        text = text.format(status.place, status.n_clients)
        if not streaming.has_tip:
            text += " " + self.tr("Only the pose is sent; there is no current tip.")
        return StatusMessage.good(text)
