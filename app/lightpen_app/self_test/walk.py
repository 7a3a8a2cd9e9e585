"""The wizard goes by itself from a recorded swing to its accepted tip."""

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal

from lightpen_app.application import Wizard
from lightpen_app.self_test.report import SelfTestError

TICK_MS = 50


class Walk(QObject):
    """Opens an interrupted swing, ends it, reviews it and accepts its tip.

    Signals
    -------
    ended()
        The tip is accepted.
    """

    ended = Signal()

    def __init__(self, wizard: Wizard, swing: Path) -> None:
        super().__init__(wizard)
        self._window = wizard.window
        self._workbench = wizard.workbench
        self._swing = swing
        self._next: Callable[[], bool] = self._open
        self._timer = QTimer(self)
        self._timer.setInterval(TICK_MS)
        self._timer.timeout.connect(self._on_tick)

    def start(self) -> None:
        """Begin on the first page."""
        self._timer.start()

    def _on_tick(self) -> None:
        if self._next():
            self._timer.stop()
            self.ended.emit()

    def _open(self) -> bool:
        if self._workbench.preparation.image_size is not None:
            self._workbench.swing_wanted.emit(self._swing)
            self._next = self._finish
        return False

    def _finish(self) -> bool:
        status = self._workbench.run.status
        is_whole = status.verdict is not None  # its tip was computed at once
        if self._window.page().key == "swing" and (status.is_capturing or is_whole):
            if not is_whole:
                self._workbench.run.runner.finish()
            self._next = self._review
        return False

    def _review(self) -> bool:
        status = self._workbench.run.status
        if status.verdict is None:
            return False
        if not status.verdict.can_be_accepted:
            raise SelfTestError(f"The tip cannot be accepted: {status.verdict}.")
        return self._press_on("swing", self._accept)

    def _accept(self) -> bool:
        return self._press_on("review", self._end)

    def _end(self) -> bool:
        return self._workbench.run.status.result is not None

    def _press_on(self, key: str, then: Callable[[], bool]) -> bool:
        """Press the main button of a page once it can be, and go on."""
        page = self._window.page()
        if page.key == key and not page.main_action().why_not:
            self._window.press_main()
            self._next = then
        return False
