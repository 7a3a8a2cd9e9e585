"""Python's garbage collector, restricted to the GUI thread; freed memory.

The collector runs in whatever thread happens to allocate. It may free a Qt object there
whose thread is another one, and Qt ends the program (PYSIDE-810).

Freed memory is returned to the system now and then, see `release_freed_memory`.
"""

import gc

from PySide6.QtCore import QObject, QTimer

from lightpen.formats.decoding import release_freed_memory

PERIOD_MS, RELEASE_PERIOD_MS = 500, 2_000
LIMITS = (700, 10, 10)  # of the generations: objects, and collections of the younger


class GarbageCollector(QObject):
    """Collects garbage in the thread that makes it, and in no other."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        gc.disable()
        gc.freeze()  # present objects stay: no search delays the window
        for period_ms, action in (
            (PERIOD_MS, collect_if_due),
            (RELEASE_PERIOD_MS, release_freed_memory),
        ):
            timer = QTimer(self, interval=period_ms)
            timer.timeout.connect(action)
            timer.start()


def collect_if_due() -> None:
    """Collect the oldest generation that has grown beyond its threshold."""
    for generation in (2, 1, 0):
        if gc.get_count()[generation] > LIMITS[generation]:
            gc.collect(generation)
            return
