"""Python's garbage collector, restricted to the GUI thread.

The collector runs in whatever thread happens to allocate. It may free a Qt object there
whose thread is another one, and Qt ends the program (PYSIDE-810).
"""

import gc

from PySide6.QtCore import QObject, QTimer

PERIOD_MS = 500
LIMITS = (700, 10, 10)  # of the generations: objects, and collections of the younger


class GarbageCollector(QObject):
    """Collects garbage in the thread that makes it, and in no other."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        gc.disable()
        gc.collect()
        gc.freeze()  # what is there now stays: the window is not to wait for a search
        self._timer = QTimer(self)
        self._timer.setInterval(PERIOD_MS)
        self._timer.timeout.connect(collect_if_due)
        self._timer.start()


def collect_if_due() -> None:
    """Collect the oldest generation that has grown beyond its threshold."""
    for generation in (2, 1, 0):
        if gc.get_count()[generation] > LIMITS[generation]:
            gc.collect(generation)
            return
