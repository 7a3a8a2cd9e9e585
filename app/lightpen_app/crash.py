"""Handling of internal errors: a report is written and the program continues.

An uncaught exception does not end the program: captured images are on the disk, and the
operator is informed in one sentence. A crash inside a library, which ends the program,
leaves its trace in a file that the next report points to.
"""

import faulthandler
import logging
import platform
import sys
import threading
import traceback
from datetime import datetime
from pathlib import Path
from types import TracebackType

from PySide6.QtCore import QObject, Signal, qVersion

from lightpen.local_time import local_now
from lightpen.logs import recent_lines

PACKAGES = (
    "lightpen",
    "PySide6_Essentials",
    "pyqtgraph",
    "numpy",
    "opencv-python-headless",
)
MAX_REPORTS = 20  # of one run; a bug in a paint event would fill the disk
NATIVE_FILE = "library-crash.txt"

_logger = logging.getLogger(__name__)


class CrashHook(QObject):
    """Writes a report of every uncaught exception, of each kind once."""

    # Path of the report, or "" if the disk took none. Emitted on any thread; connected
    # objects of the GUI get it on theirs.
    reported = Signal(str)

    def __init__(self, folder: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._folder = folder
        self._lock = threading.Lock()
        self._seen: set[str] = set()
        self._previous = sys.excepthook, threading.excepthook

    def install(self) -> None:
        """Handle uncaught exceptions on all threads."""
        self._previous = sys.excepthook, threading.excepthook
        sys.excepthook = self.report
        threading.excepthook = self._report_thread
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            # The file stays open: a crashing process cannot open one.
            self._native = (self._folder / NATIVE_FILE).open("a", encoding="utf-8")
        except OSError:
            return  # without a folder there is nothing to write to
        faulthandler.enable(self._native)

    def remove(self) -> None:
        """Give the hooks back."""
        sys.excepthook, threading.excepthook = self._previous
        if faulthandler.is_enabled() and hasattr(self, "_native"):
            faulthandler.disable()
            self._native.close()

    def report(
        self,
        kind: type[BaseException],
        error: BaseException,
        trace: TracebackType | None,
    ) -> None:
        """Write a report, unless the same one was written in this run."""
        if issubclass(kind, KeyboardInterrupt):
            sys.__excepthook__(kind, error, trace)
            return
        text = "".join(traceback.format_exception(kind, error, trace))
        with self._lock:
            if text in self._seen or len(self._seen) >= MAX_REPORTS:
                return
            self._seen.add(text)
            number = len(self._seen)
        _logger.critical("exception that nobody caught:\n%s", text)
        if sys.stderr is not None:
            sys.stderr.write(text)
        self.reported.emit(self._write(text, number))

    def _report_thread(self, arguments: threading.ExceptHookArgs) -> None:
        if arguments.exc_value is not None:
            self.report(
                arguments.exc_type, arguments.exc_value, arguments.exc_traceback
            )

    def _write(self, text: str, number: int) -> str:
        now = local_now()
        log = "\n".join(("The last lines of the log:", *recent_lines(), ""))
        path = self._folder / f"crash-{now:%Y%m%d-%H%M%S}-{number}.txt"
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            path.write_text(
                _without_home(f"{_circumstances(now)}\n\n{text}\n{log}"),
                encoding="utf-8",
                errors="backslashreplace",
            )
        except OSError:
            return ""
        return str(path)


def _without_home(text: str) -> str:
    """Return a text in which the home folder, and so the user's name, is ``~``."""
    home = str(Path.home())
    # A Windows path may stand in the text of an exception with doubled backslashes.
    for path in (home, home.replace("\\", "\\\\"), home.replace("\\", "/")):
        if len(path) > 1:
            text = text.replace(path, "~")
    return text


def versions() -> dict[str, str]:
    """Return the versions of the program, first, and of its libraries."""
    # Imported here, as it imports an e-mail library and would delay the start.
    from importlib.metadata import PackageNotFoundError, version

    found: dict[str, str] = {}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found | {"Python": platform.python_version(), "Qt": qVersion()}


def _circumstances(now: datetime) -> str:
    lines = [f"time: {now.isoformat(timespec='seconds')}"]
    lines.append(f"system: {platform.platform()}")
    lines.extend(f"{name}: {number}" for name, number in versions().items())
    lines.append(f"thread: {threading.current_thread().name}")
    return "\n".join(lines)
