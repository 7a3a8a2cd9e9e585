"""Signals of the system that ask the program to end, as Ctrl-C does."""

import signal
from types import FrameType, TracebackType
from typing import Self

from PySide6.QtCore import QObject, QTimer, Signal

END_SIGNALS = (signal.SIGINT, signal.SIGTERM)
TICK_MS = 100


class EndSignals(QObject):
    """Handles these signals within a context.

    Python runs signal handlers between its own instructions; as there are none while Qt
    waits, a timer provides some.
    """

    # The number of the first signal, emitted from the event loop, so that nothing is
    # cut off in its midst.
    came = Signal(int)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.number = 0  # of the first signal; 0 before
        self._timer = QTimer(self, interval=TICK_MS)

        # Connections
        self._timer.timeout.connect(self._on_tick)

    def __enter__(self) -> Self:
        heard = [n for n in END_SIGNALS if signal.getsignal(n) is not signal.SIG_IGN]
        self._before = {number: signal.getsignal(number) for number in heard}
        for number in heard:
            signal.signal(number, self._note)
        self._timer.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._timer.stop()
        for number, handler in self._before.items():
            signal.signal(number, handler or signal.SIG_DFL)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.number = self.number or number

    def _on_tick(self) -> None:
        if self.number:
            self._timer.stop()
            self.came.emit(self.number)
