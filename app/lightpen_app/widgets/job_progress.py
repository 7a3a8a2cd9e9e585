"""Progress of a long job: a bar with percentage and time left, and Cancel."""

from PySide6.QtCore import QTimer, Signal
from PySide6.QtWidgets import QProgressBar, QWidget

from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.look.theme import GRID
from lightpen_app.look.time_left import TimeLeft
from lightpen_app.look.tooltips import set_tooltip
from lightpen_app.look.words import PARTED
from lightpen_app.widgets.translated import Translated

STEPS = 1000


class JobProgress(Translated, QWidget):
    """Shows how far a job is; hidden while none runs.

    A job that is done within ``patience_ms`` is not shown.
    """

    cancelled = Signal()

    def __init__(self, patience_ms: int = 0) -> None:
        super().__init__()
        self._time_left = TimeLeft()
        self._is_running = False

        # Widgets
        self._bar = self.say(QProgressBar(maximum=STEPS), self.tr("Progress"))
        self._cancel = self.make_button(self.tr("Cancel"), self._on_cancel_clicked)
        self._patience = QTimer(self, singleShot=True, interval=patience_ms)

        # Layout
        horizontal_layout(self, (self._bar, 1), self._cancel, spacing=2 * GRID)
        self.hide()

        # Connections
        self._patience.timeout.connect(self.show)

    @property
    def is_running(self) -> bool:
        """Whether a job runs."""
        return self._is_running

    def words(self) -> str:
        """Return what is written on the bar."""
        return self._bar.text()

    def begin(self) -> None:
        """Show that a job has begun."""
        self._is_running = True
        self._time_left.restart()
        self.set_fraction(0.0)
        if self._patience.interval():
            self._patience.start()
        else:
            self.show()

    def set_fraction(self, fraction: float) -> None:
        """Show how far the job is, 0 to 1."""
        self._bar.setValue(round(STEPS * fraction))
        parts = f"{fraction:.0%}", self._time_left.text(fraction)
        self._bar.setFormat(PARTED.join(filter(None, parts)))

    def end(self) -> None:
        """Show that the job has ended."""
        self._is_running = False
        self._patience.stop()
        self.hide()

    def set_running(self, is_running: bool) -> None:
        """Show whether a job runs."""
        if is_running and not self._is_running:
            self.begin()
        elif not is_running:
            self.end()

    def take_focus(self) -> None:
        """Give the focus to Cancel."""
        self._cancel.setFocus()

    def set_cancel_tooltip(self, text: str) -> None:
        """Say what stays when the job is cancelled."""
        set_tooltip(self._cancel, text)

    def _on_cancel_clicked(self) -> None:
        self.end()
        self.cancelled.emit()
