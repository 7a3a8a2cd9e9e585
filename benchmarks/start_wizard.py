"""Start the wizard, print the seconds from the start of the process, and end.

The window counts as usable when its first page is painted, its timers run, and it has
answered the Enter key. The second figure is the time of a processor until then.
"""

import os
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")


def main() -> int:
    """Start, print, and return the exit status."""
    from PySide6.QtCore import QEvent, QObject, Qt, QTimer
    from PySide6.QtGui import QKeyEvent
    from PySide6.QtWidgets import QApplication
    from typing_extensions import override

    from lightpen_app.application import Wizard, make_application
    from lightpen_app.work.settings import Settings
    from lightpen_program.extensions import faces

    class Paint(QObject):
        """Answers a key once the first page is painted."""

        @override
        def eventFilter(self, page: QObject, event: QEvent) -> bool:
            if event.type() == QEvent.Type.Paint:
                page.removeEventFilter(self)
                QTimer.singleShot(0, self.answer)
            return False

        def answer(self) -> None:
            for kind in (QEvent.Type.KeyPress, QEvent.Type.KeyRelease):
                none = Qt.KeyboardModifier.NoModifier
                event = QKeyEvent(kind, Qt.Key.Key_Return, none)
                QApplication.sendEvent(wizard.window, event)
            print(_age_s(), time.process_time())
            wizard.window.close()

    application = make_application(sys.argv[:1])
    with tempfile.TemporaryDirectory() as folder:
        settings = Settings(Path(folder) / "lightpen.json")
        wizard = Wizard(application, faces(), settings, Path(folder))
        paint = Paint()
        wizard.window.page().installEventFilter(paint)
        wizard.show()
        application.exec()
    return 0


def _age_s() -> float:
    """Return how long ago this process was started, s."""
    fields = Path("/proc/self/stat").read_text(encoding="ascii").rpartition(")")[2]
    started = int(fields.split()[19]) / os.sysconf("SC_CLK_TCK")
    up = float(Path("/proc/uptime").read_text(encoding="ascii").split()[0])
    return up - started


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    sys.exit(main())
