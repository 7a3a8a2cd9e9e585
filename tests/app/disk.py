"""What the thread of the windows does with files of the user."""

import os
import sys
import tempfile
from functools import cache
from pathlib import Path
from threading import get_ident, main_thread
from types import FrameType

import lightpen_app

TOUCHES = {
    *("open", "sqlite3.connect", "os.listdir", "os.scandir", "os.mkdir"),
    *("os.remove", "os.rename", "os.link", "os.rmdir", "shutil.copyfile"),
}
APP = str(Path(lightpen_app.__file__).parent) + os.sep
# Before there is a window, after a bug, where the program tries or installs itself, and
# files of its own.
MAY = tuple(
    str(Path(APP) / name)
    for name in (
        *("work/settings_store.py", "crash.py", "self_test"),
        *("look/sounds.py", "look/theme.py", "paper/printing.py"),
    )
)
USERS = str(Path(tempfile.gettempdir()).resolve()) + os.sep  # where tests put files
SOURCES = str(Path(__file__).parents[2]) + os.sep


class DiskWatch:
    """Notes each file of the user that the program touches on the main thread.

    Python has no way to take out what listens to it, so there is one for all tests.
    """

    def __init__(self) -> None:
        self._seen: list[str] = []
        sys.addaudithook(self._hear)

    def take(self) -> list[str]:
        """Return what was touched since it was asked last."""
        seen, self._seen = self._seen, []
        return seen

    def _hear(self, event: str, values: tuple[object, ...]) -> None:
        if event not in TOUCHES or get_ident() != main_thread().ident:
            return
        path = str(values[0])
        if not path.startswith(USERS) or path.startswith(SOURCES):
            return
        place = _place_in_program(sys._getframe(1))
        if place:
            self._seen.append(f"{event} {path} by {place}")


@cache
def disk_watch() -> DiskWatch:
    """Return the one of this process."""
    return DiskWatch()


def _place_in_program(frame: FrameType | None) -> str:
    """Return where the program does what it does; nothing where a test does."""
    place = ""
    while frame is not None:
        file = frame.f_code.co_filename
        if file.startswith((*MAY, "<frozen importlib")):
            return ""
        if file.startswith(APP) and not place:
            place = f"{file.removeprefix(APP)}:{frame.f_lineno}"
        frame = frame.f_back
    return place
