"""The live stream in the window: its dialog, its settings, and what is told of it."""

from dataclasses import dataclass
from functools import partial

from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen_app.face import MenuEntry, Service
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import Tone
from lightpen_app.widgets.sign_label import StatusMessage
from lightpen_app.work.workbench import Workbench
from lightpen_app_extensions.measure.verification_run import VerificationRun
from lightpen_app_extensions.stream.stream_dialog import StreamDialog, StreamState
from lightpen_app_extensions.stream.streaming import Streaming
from lightpen_extensions.measure.tasks.part import PART
from lightpen_extensions.stream.points import points_of
from lightpen_extensions.stream.server import StreamPlace

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
        for part in workbench.parts:
            if isinstance(part, VerificationRun):
                part.changed.connect(partial(self._stream_points, part))

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

    def _stream_points(self, run: VerificationRun) -> None:
        status, stream = run.status, self.streaming.stream
        if not stream.is_heard or status.setup is None or status.state is None:
            return
        if status.setup.task is PART:
            stream.set_points(points_of(status.setup, status.state))

    def _show(self) -> None:
        streaming, notices = self.streaming, self._notices
        if not streaming.fault:
            notices.withdraw(streaming)
        elif streaming.fault != notices.text(streaming):
            notices.notify(streaming, streaming.fault)
        if self._dialog is not None:
            state = StreamState(streaming.status, streaming.has_tip, streaming.fault)
            self._dialog.set_state(state)
        self.remark_changed.emit()
