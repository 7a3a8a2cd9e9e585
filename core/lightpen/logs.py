"""The log of the program: level and destinations.

Every module logs by its own logger name. Whoever logs does not wait for a disk: its own
thread writes the lines, to a file that several processes may share, and
keeps the last ones in memory for reports.
"""

import logging
import os
import sys
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from logging.handlers import QueueHandler, QueueListener, RotatingFileHandler
from pathlib import Path
from queue import SimpleQueue
from typing import Any, TextIO

from typing_extensions import override

from lightpen.errors import UsageError
from lightpen.local_time import local_time

LEVELS = {
    "debug": logging.DEBUG,
    "info": logging.INFO,
    "warning": logging.WARNING,
    "error": logging.ERROR,
}
LEVEL_VARIABLE = "LIGHTPEN_LOG_LEVEL"
OUR_LOGGERS = (
    "lightpen",
    "lightpen_extensions",
    "lightpen_app",
)  # others log warnings and errors
LINE = "%(asctime)s %(levelname)s %(process)d %(threadName)s %(name)s: %(message)s"
MAX_BYTES = 1_000_000  # of a file, after which a new one is begun
N_OLD_FILES = 5
N_RECENT = 200  # lines kept in memory
LONGEST_WAIT = 2.0  # s for the last lines to be written

_recent: deque[str] = deque(maxlen=N_RECENT)
_logger = logging.getLogger(__name__)


def log_file(data: Path) -> Path:
    """Return the newest file of the log in a data folder."""
    return data / "logs" / "lightpen.log"


def log_level(name: str | None) -> int:
    """Return the level of a name in `LEVELS`, or of the environment without one."""
    name = name or os.environ.get(LEVEL_VARIABLE) or "info"
    try:
        return LEVELS[name.lower()]
    except KeyError:
        raise UsageError(
            "log.no-such-level",
            variable=LEVEL_VARIABLE,
            found=name,
            levels=", ".join(LEVELS),
        ) from None


@contextmanager
def running_log(level: int, *, is_verbose: bool = False) -> Iterator[None]:
    """Log while the body runs, and the exception that ends it; nested, do nothing.

    If verbose, the lines also go to standard error.
    """
    if _queue_handler() is not None:
        yield
        return
    _recent.clear()
    handler = _LogQueueHandler(
        [logging.StreamHandler(sys.stderr)] if is_verbose else []
    )
    logging.getLogger().addHandler(handler)
    for name in OUR_LOGGERS:
        logging.getLogger(name).setLevel(level)
    try:
        yield
    except Exception:
        _logger.critical("ended by an exception", exc_info=True)
        raise
    finally:
        end_log()


def end_log() -> None:
    """Write the lines that wait, in a limited time, and log no more."""
    handler = _queue_handler()
    if handler is None:
        return
    handler.writer.stop()
    logging.getLogger().removeHandler(handler)
    for name in OUR_LOGGERS:
        logging.getLogger(name).setLevel(logging.NOTSET)


def write_log_to(data: Path) -> None:
    """Write the lines from now on to a file in a data folder, while a log is running.

    A missing folder is created. A folder that cannot be written is only reported in the
    last line in memory.
    """
    handler = _queue_handler()
    if handler is not None:
        handler.writer.handlers += (_LogFile(log_file(data)),)


def recent_lines() -> tuple[str, ...]:
    """Return the last lines of the log that runs, or ran last, the newest last."""
    return tuple(_recent)


def _queue_handler() -> "_LogQueueHandler | None":
    handlers = logging.getLogger().handlers
    return next((each for each in handlers if isinstance(each, _LogQueueHandler)), None)


class _LogQueueHandler(QueueHandler):
    """Formats each record, keeps the last ones and queues them for the writer."""

    def __init__(self, handlers: list[logging.Handler]) -> None:
        queue: SimpleQueue[Any] = SimpleQueue()
        super().__init__(queue)
        self.setFormatter(_Lines(LINE))
        self.writer = _Writer(queue, *handlers)
        self.writer.start()

    @override
    def prepare(self, record: logging.LogRecord) -> logging.LogRecord:
        prepared: logging.LogRecord = super().prepare(record)
        _recent.append(prepared.msg)
        return prepared


class _Lines(logging.Formatter):
    @override
    def formatTime(self, record: logging.LogRecord, datefmt: str | None = None) -> str:
        moment = local_time(datetime.fromtimestamp(record.created, UTC))
        return moment.isoformat(timespec="milliseconds")


class _Writer(QueueListener):
    def __init__(self, queue: "SimpleQueue[Any]", *handlers: logging.Handler) -> None:
        super().__init__(queue, *handlers)
        self._waiting = queue

    @override
    def stop(self) -> None:
        """End after the lines that wait, unless the disk does not answer."""
        thread, self._thread = self._thread, None
        if thread is None:
            return
        self.enqueue_sentinel()
        thread.join(LONGEST_WAIT)
        if not thread.is_alive():
            while not self._waiting.empty():  # that these lines cannot be written
                self.handle(self._waiting.get())
            for handler in self.handlers:
                handler.close()


class _LogFile(RotatingFileHandler):
    """A file of limited size that several processes write to."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            path,
            maxBytes=MAX_BYTES,
            backupCount=N_OLD_FILES,
            encoding="utf-8",
            errors="backslashreplace",
            delay=True,
        )
        self._is_failing = False

    @override
    def _open(self) -> TextIO:  # type: ignore[override]
        Path(self.baseFilename).parent.mkdir(parents=True, exist_ok=True)
        return super()._open()

    @override
    def shouldRollover(self, record: logging.LogRecord) -> bool:
        if self.stream is not None and self._was_renamed(self.stream):
            self._release()
        return bool(super().shouldRollover(record))

    @override
    def doRollover(self) -> None:
        """Begin a new file, or keep this one if another process has it open."""
        self._release()
        path = Path(self.baseFilename)
        with suppress(OSError):
            # First, as it may fail: the old files then stay where they are.
            full = path.replace(f"{path}.full")
            for number in range(N_OLD_FILES - 1, 0, -1):
                with suppress(FileNotFoundError):
                    Path(f"{path}.{number}").replace(f"{path}.{number + 1}")
            full.replace(f"{path}.1")

    @override
    def handleError(self, record: logging.LogRecord) -> None:
        """Report once that the file cannot be written; logging ends no program."""
        if not self._is_failing:
            self._is_failing = True
            reason = sys.exc_info()[1]
            _logger.warning("%s cannot be written: %s", self.baseFilename, reason)

    def _was_renamed(self, stream: TextIO) -> bool:
        """Return whether another process has begun a new file."""
        try:
            newest = Path(self.baseFilename).stat()
        except FileNotFoundError:
            return True
        return not os.path.samestat(newest, os.fstat(stream.fileno()))

    def _release(self) -> None:
        if self.stream is not None:
            self.stream.close()
            self.stream = None
