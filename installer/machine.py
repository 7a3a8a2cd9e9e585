"""The Windows that an installer is tried on: in a Wine prefix, or the one that is."""

import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Protocol, Self

from installer.launchers import tool
from installer.places import IS_WINDOWS
from installer.wine.prefix import CHINESE, CommandResult, Prefix

VOLATILE = ("/Temp/", "/Recent/", "/Microsoft/", "/windows/")
WORD = "lightpen"
USER = "Jörg 王"  # whom a Windows of another language cannot spell
PLATFORM = "QT_QPA_PLATFORM"
TEMPORARY = "AppData/Local/Temp"
SHELL_KEY = (
    r"HKCU\Software\Microsoft\Windows\CurrentVersion\Explorer\User Shell Folders"
)
SHELL_FOLDERS = {
    "AppData": "AppData/Roaming",
    "Desktop": "Desktop",
    "Local AppData": "AppData/Local",
    "Personal": "Documents",
    "Programs": "AppData/Roaming/Microsoft/Windows/Start Menu/Programs",
    "Start Menu": "AppData/Roaming/Microsoft/Windows/Start Menu",
}


class Machine(Protocol):
    """Runs Windows programs, and shows what they leave behind."""

    @property
    def home(self) -> Path:
        """Return the user's folder."""

    @property
    def drive(self) -> Path:
        r"""Return the folder for files of a trial, which is ``C:\`` under Wine."""

    @property
    def shared(self) -> Path:
        r"""Return the folder that is ``C:\``."""

    def windows_path(self, path: Path) -> str:
        """Return the path of a file or folder as its programs see it."""

    def run(
        self,
        words: Sequence[str],
        *,
        folder: Path | None = None,
        timeout_s: float = ...,
    ) -> CommandResult:
        """Run a program to its end."""

    def start(
        self, words: Sequence[str], folder: Path | None = None
    ) -> subprocess.Popen[bytes]:
        """Start a program, and return at once."""

    def with_display(self, display: str) -> Self:
        """Return the machine with its windows on a screen."""

    def with_platform(self, platform: str) -> Self:
        """Return the machine with Qt drawing through a platform of that name."""

    def in_chinese(self, locales: Path) -> Self:
        """Return the machine with a Chinese Windows, by a folder for its locale."""

    def open_document(self, path: Path) -> None:
        """Open a file as a double click does."""

    def await_end(self) -> None:
        """Wait until what was started has ended, as far as that can be told."""

    def files(self) -> frozenset[str]:
        """Return the files and folders that an installation could leave behind."""

    def registry(self) -> frozenset[str]:
        """Return what of the registry is of the program."""


@dataclass(frozen=True)
class WineMachine(Prefix):
    """A prefix as a machine."""

    def make_user(self) -> None:
        """Let the user's folders be those of `user`, whoever runs Wine."""
        home = self.home
        home.mkdir()
        for place, folder in SHELL_FOLDERS.items():
            (home / folder).mkdir(parents=True, exist_ok=True)
            path = self.windows_path(home / folder)
            words = ["reg", "add", SHELL_KEY, "/v", place, "/d", path, "/f"]
            self.run(words).require_success()
        (home / TEMPORARY).mkdir()
        for variable in ("TEMP", "TMP"):
            self._set_variable(variable, self.windows_path(home / TEMPORARY))
        self.await_end()

    @property
    def shared(self) -> Path:
        r"""Return the folder that is ``C:\``."""
        return self.drive

    def with_display(self, display: str) -> Self:
        """Return the machine with its windows on an X server."""
        return replace(self, display=display)

    def with_platform(self, platform: str) -> Self:
        """Return itself: the choice is kept in the registry, with the user's own.

        Wine keeps the variables of Qt that it finds outside away from its programs.
        """
        self._set_variable(PLATFORM, platform)
        return self

    def in_chinese(self, locales: Path) -> Self:
        """Return the machine with a Chinese Windows, by a folder for its locale."""
        words = ["-i", "zh_CN", "-f", "UTF-8", str(locales / CHINESE)]
        subprocess.run([tool("localedef"), *words], check=True)
        return replace(self, locales=locales)

    def open_document(self, path: Path) -> None:
        """Open a file as a double click does."""
        # Not waited for: the program that opens holds the end of the output.
        self.start(["start", self.windows_path(path)])

    def _set_variable(self, name: str, value: str) -> None:
        words = ["reg", "add", r"HKCU\Environment", "/v", name, "/d", value, "/f"]
        self.run(words).require_success()

    def files(self) -> frozenset[str]:
        """Return all files but those of Windows itself and temporary ones."""
        found = (f"/{path.relative_to(self.folder)}" for path in self.drive.rglob("*"))
        return frozenset(
            name for name in found if not any(word in name for word in VOLATILE)
        )

    def registry(self) -> frozenset[str]:
        """Return the keys and values with the program's name in them."""
        self.await_end()
        files = (self.folder / "user.reg", self.folder / "system.reg")
        text = "\n".join(file.read_text("utf-8", errors="replace") for file in files)
        found = set()
        for block in re.split(r"\n(?=\[)", text):
            head, *lines = block.splitlines()
            key = head.partition("]")[0].replace("\\\\", "\\")
            if WORD in key.lower():
                found.add(key)
            found |= {f"{key} {line}" for line in lines if WORD in line.lower()}
        return frozenset(found)


@dataclass(frozen=True)
class OwnMachine:
    """The Windows that this runs on.

    Attributes
    ----------
    drive : Path
        A folder of its own, for all files that are not the program's.
    platform : str
        Through which Qt draws.
    """

    drive: Path
    platform: str = "offscreen"

    @property
    def home(self) -> Path:
        """Return the user's folder."""
        return Path.home()

    @property
    def shared(self) -> Path:
        r"""Return the folder that is ``C:\``."""
        return Path("C:\\")

    def windows_path(self, path: Path) -> str:
        """Return the path as it is."""
        return str(path)

    def run(
        self,
        words: Sequence[str],
        *,
        folder: Path | None = None,
        timeout_s: float = 1800.0,
    ) -> CommandResult:
        """Run a program to its end."""
        began = time.monotonic()
        process = self.start(words, folder)
        output, _ = process.communicate(timeout=timeout_s)
        return CommandResult(
            tuple(words),
            process.returncode,
            output.decode("utf-8", errors="replace"),
            time.monotonic() - began,
        )

    def start(
        self, words: Sequence[str], folder: Path | None = None
    ) -> subprocess.Popen[bytes]:
        """Start a program, and return at once."""
        return subprocess.Popen(
            list(words),
            cwd=folder,
            env=os.environ | {"LIGHTPEN_NO_DIALOG": "1", PLATFORM: self.platform},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )

    def with_display(self, display: str) -> Self:
        """Return the machine as it is: it has a screen."""
        return self

    def with_platform(self, platform: str) -> Self:
        """Return the machine with Qt drawing through a platform of that name."""
        return replace(self, platform=platform)

    def in_chinese(self, locales: Path) -> Self:
        """Return the machine as it is: its language is the user's."""
        return self

    def open_document(self, path: Path) -> None:
        """Open a file as a double click does."""
        if sys.platform == "win32":
            os.environ[PLATFORM] = self.platform
            os.startfile(path)

    def await_end(self) -> None:
        """Give the uninstaller, which works from a copy of itself, time to end."""
        time.sleep(10.0)

    def files(self) -> frozenset[str]:
        """Return the files of the user's data that have the program's name."""
        places = (self.home / "AppData", self.home / "Desktop")
        found = (path for place in places for path in place.rglob(f"*{WORD}*"))
        names = (path.as_posix() for path in found)
        return frozenset(name for name in names if "/Temp/" not in name)

    def registry(self) -> frozenset[str]:
        """Return the keys and values with the program's name in them."""
        lines: list[str] = []
        for root in ("HKCU", "HKLM"):
            words = ["reg", "query", rf"{root}\Software", "/s", "/f", WORD]
            lines += self.run(words).output.splitlines()
        return frozenset(line for line in lines if WORD in line.lower())


@contextmanager
def fresh_machine(platform: str) -> Iterator[Machine]:
    """Give a machine on which nothing was installed; under Wine it is gone afterwards.

    Parameters
    ----------
    platform : str
        Through which Qt draws.
    """
    if IS_WINDOWS:
        with TemporaryDirectory(prefix="lightpen-machine-") as name:
            yield OwnMachine(Path(name), platform)
        return
    made = Prefix.for_builds()
    made.await_end()
    with TemporaryDirectory(prefix="lightpen-machine-") as name:
        folder = Path(name) / "prefix"
        without = shutil.ignore_patterns("Temp")
        shutil.copytree(made.folder, folder, symlinks=True, ignore=without)
        machine = WineMachine(folder, user=USER)
        machine.make_user()
        machine.with_platform(platform)
        try:
            yield machine
        finally:
            machine.end_all()
            machine.await_end()
