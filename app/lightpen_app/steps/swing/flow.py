"""When a swing begins, waits, goes on and is left, without its user pressing a key."""

from PySide6.QtCore import QObject, Signal

from lightpen.cameras.worker import Connection
from lightpen.errors import FileError, LightpenError
from lightpen.swing.state import Pause
from lightpen_app.look.phrases import lack_text
from lightpen_app.look.sentences import worded
from lightpen_app.work.workbench import Workbench


class SwingFlow(QObject):
    """Begins a swing as soon as images come, and keeps it going.

    A swing is paused while its page is not shown, and goes on with the page.

    Parameters
    ----------
    workbench : Workbench

    Signals
    -------
    changed()
        `refusal` or `is_troubled` is different.
    troubled(str)
        A sentence to be read; empty where none is any more.
    """

    changed = Signal()
    troubled = Signal(str)

    def __init__(self, workbench: Workbench, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._workbench = workbench
        self._run, self._live = workbench.run, workbench.live
        self._is_shown = False
        self._paused_by_leaving = False
        self._pause_is_wished = False
        self._refusal = ""
        self._is_troubled = False
        self._known_swing = self._run.record_folder
        self._begun_with = workbench.preparation

        # Connections
        workbench.changed.connect(self._go_on)
        self._run.changed.connect(self._on_run_changed)
        self._live.connection_changed.connect(self._go_on)
        self._live.troubled.connect(self._on_troubled)

    @property
    def refusal(self) -> str:
        """Why no swing could begin, a sentence; else empty."""
        return self._refusal

    @property
    def is_troubled(self) -> bool:
        """Whether the swing was paused because an image could not be recorded."""
        return self._is_troubled

    @property
    def has_other_choices(self) -> bool:
        """Whether something else was chosen since the swing began, or was kept."""
        goes_on = self._begun_with.swings_like(self._workbench.preparation)
        return self._run.is_capturing and not goes_on

    def keep_choices(self) -> None:
        """Go on with what the swing began with: `has_other_choices` is settled."""
        self._begun_with = self._workbench.preparation

    def enter(self) -> None:
        """Begin or go on: the page is shown."""
        self._is_shown = True
        self._refusal = ""
        if self._run.result is not None:  # nothing more belongs to that swing
            self._run.abandon()
        if self._paused_by_leaving:
            self._paused_by_leaving = False
            self._resume()
        self._go_on()

    def leave(self) -> None:
        """Pause what is captured: the page is hidden."""
        self._is_shown = False
        if self._run.is_capturing and not self._is_paused:
            self._paused_by_leaving = True
            self._pause()

    def toggle_pause(self) -> None:
        """Pause, or go on after a pause."""
        if self._is_paused:
            self._resume()
        elif self._run.is_capturing:
            self._pause()

    def start_over(self) -> None:
        """Set the swing aside and begin anew, with what is chosen now."""
        lacks = self._workbench.preparation.lacks()
        if lacks:
            self.troubled.emit(lack_text(lacks[0]))
            return
        try:
            if self._run.state is not None and self._run.result is None:
                self._run.set_aside()
            else:
                self._run.abandon()
        except FileError as error:
            self.troubled.emit(worded(error.sentence))
            return
        self._refusal = ""
        self._go_on()

    def try_again(self) -> None:
        """Open the camera again, or begin where it was refused."""
        self._refusal = ""
        if self._live.connection is Connection.CLOSED:
            self._workbench.open_camera()
        self._go_on()
        self.changed.emit()

    @property
    def _is_paused(self) -> bool:
        state = self._run.state
        return state is not None and state.pause is Pause.BY_USER

    def _pause(self) -> None:
        self._pause_is_wished = True
        self._run.pause()

    def _resume(self) -> None:
        self._pause_is_wished = False
        self._run.resume()

    def _go_on(self) -> None:
        """Begin a swing if there is none and all is there for it."""
        streams = self._live.connection is Connection.STREAMING
        lacks = self._workbench.preparation.lacks()
        is_due = self._is_shown and streams and not lacks and not self._refusal
        if self._run.state is not None or not is_due:
            return
        try:
            self._run.begin(self._workbench.preparation)
        except LightpenError as error:
            self._refusal = worded(error.sentence)
            self.troubled.emit(self._refusal)
            self.changed.emit()
            return
        self.troubled.emit("")

    def _on_run_changed(self) -> None:
        folder = self._run.record_folder
        if folder != self._known_swing:
            self._known_swing = folder
            self._begun_with = self._workbench.preparation
            self._paused_by_leaving = self._pause_is_wished = False
        if self._run.is_capturing and not (self._is_shown or self._pause_is_wished):
            self._paused_by_leaving = True
            self._pause()
        if self._is_troubled and not self._is_paused:
            self._is_troubled = False
            self.changed.emit()

    def _on_troubled(self) -> None:
        if self._is_paused and not self._pause_is_wished:
            self._is_troubled = True
            self.changed.emit()
