"""Start the wizard, print the seconds from the start of the process, and end.

The window counts as usable when it is painted, its timers run, and it has answered a
key.
"""

import os
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")


def main() -> int:
    """Start, print, and return the exit status."""
    from lightpen_app.plain_import import use_plain_import

    use_plain_import()
    from PySide6.QtCore import QEvent, QObject, Qt, QTimer
    from PySide6.QtGui import QKeyEvent
    from PySide6.QtWidgets import QApplication

    from lightpen_app.application import Wizard, make_application
    from lightpen_app.wizard_pages import make_pages
    from lightpen_app.work.settings import Settings

    application = make_application(sys.argv[:1])
    with tempfile.TemporaryDirectory() as folder:
        settings = Settings(Path(folder) / "lightpen.json")
        wizard = Wizard(application, make_pages, settings, Path(folder))
        wizard.window.show()
        wizard.workbench.start()

        def answer(window: QObject) -> None:
            for kind in (QEvent.Type.KeyPress, QEvent.Type.KeyRelease):
                none = Qt.KeyboardModifier.NoModifier
                QApplication.sendEvent(window, QKeyEvent(kind, Qt.Key.Key_Tab, none))
            print(_age_s())
            wizard.window.close()

        def settle() -> None:
            QTimer.singleShot(0, lambda: answer(wizard.window))

        QTimer.singleShot(0, settle)
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
