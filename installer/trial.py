"""The program as an installer leaves it on a machine, and what is found of it."""

import json
import re
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from installer.machine import Machine
from installer.wine.prefix import CommandResult

UNINSTALL = r"HKCU\Software\Microsoft\Windows\CurrentVersion\Uninstall\Lightpen"
UNINSTALL_ALL = UNINSTALL.replace("HKCU", "HKLM")
CLASSES = r"HKCU\Software\Classes"
IMAGE, CONSOLE = "Lightpen.exe", r"bin\lightpen.exe"
PATIENCE_S = 120.0


@dataclass(frozen=True)
class Trial:
    """An installation in its usual place, and what of it was not as it must be."""

    machine: Machine
    setup: Path
    faults: list[str] = field(default_factory=list)

    @property
    def folder(self) -> Path:
        """Return where the program is installed."""
        return self.local / "Programs" / "Lightpen"

    @property
    def folder_of_all(self) -> Path:
        """Return where it is installed for all users."""
        return self.machine.shared / "Program Files" / "Lightpen"

    @property
    def keys(self) -> Path:
        """Return where the program keeps the keys of stations."""
        return self.local / "lightpen-keys"

    @property
    def local(self) -> Path:
        """Return the folder of the user's data of programs."""
        return self.machine.home / "AppData" / "Local"

    @property
    def data(self) -> Path:
        """Return where the program keeps records, results and settings."""
        return self.local / "lightpen"

    def remains(self) -> list[str]:
        """Return what of the program is on the machine: places and registry keys."""
        keys = (UNINSTALL, UNINSTALL_ALL)
        places = (self.folder, self.folder_of_all, self.data, self.keys)
        return [
            *(str(place) for place in places if place.exists()),
            *(key for key in keys if self.value(key, "DisplayName")),
        ]

    def expect(self, what: str, is_so: bool, otherwise: object = "") -> None:
        """Note whether something is as it must be, and print it."""
        print(f"{'ok  ' if is_so else 'FAIL'} {what}", flush=True)
        if not is_so:
            self.faults.append(what)
            print(f"     {otherwise}", file=sys.stderr, flush=True)

    def install(
        self, *options: str, setup: Path | None = None, place: str = ""
    ) -> CommandResult:
        """Install in silence, and wait for the end.

        Parameters
        ----------
        place : str
            Another folder than the usual one, as Windows names it.
        """
        path = self.machine.windows_path(setup or self.setup)
        target = last_option("/D", place) if place else []
        outcome = self.machine.run([path, "/S", *options, *target])
        self.machine.await_end()
        return outcome

    def uninstall(self, *options: str) -> CommandResult:
        """Uninstall in silence, and wait for the end."""
        outcome = self.machine.run([self.program("uninstall.exe"), "/S", *options])
        self.machine.await_end()
        return outcome

    def program(self, name: str = IMAGE) -> str:
        """Return the path of an installed program."""
        return self.machine.windows_path(self.folder / name)

    def console(self, *words: str, folder: Path | None = None) -> CommandResult:
        """Run the command line."""
        return self.machine.run([self.program(CONSOLE), *words], folder=folder)

    @property
    def settings(self) -> Path:
        """Return the file of the user's settings."""
        return self.data / "lightpen.json"

    def start_window(self) -> "subprocess.Popen[bytes]":
        """Open the program's window for a user who has set nothing, seen nowhere."""
        for file in (self.settings, self._sample):
            file.unlink(missing_ok=True)
        return self.machine.start([self.program()])

    def await_window(self) -> bool:
        """Wait until the window serves, and return whether it came to that.

        The files of the simulated camera are written by a job that the running window
        starts: then it has been shown, and its events are seen to.
        """
        return await_so(self._sample.exists)

    @property
    def _sample(self) -> Path:
        return self.data / "simulated" / "pen.json"

    def end_programs(self) -> None:
        """End the program whose window is open."""
        self.machine.run(["taskkill", "/f", "/im", IMAGE])
        self.machine.await_end()

    def value(self, key: str, name: str = "") -> str:
        """Return a text of the registry; empty if there is none."""
        words = ["/v", name] if name else ["/ve"]
        outcome = self.machine.run(["reg", "query", key, *words])
        found = re.search(r"REG_\w+[ \t]+(.*?)\s*$", outcome.output, re.MULTILINE)
        return found[1] if found is not None and outcome.status == 0 else ""

    def self_test(self) -> dict[str, Any]:
        """Run the self-test, and return its report."""
        file = self.machine.drive / "report 1.json"
        self.machine.run(
            [self.program(), "--self-test", self.machine.windows_path(file)]
        )
        if not file.exists():
            return {"ok": False, "checks": []}
        report: dict[str, Any] = json.loads(file.read_text("utf-8"))
        for each in (file, file.with_suffix(".png")):
            each.unlink(missing_ok=True)
        return report


def last_option(name: str, place: str) -> list[str]:
    """Return the words of an option of NSIS that takes the rest of the line.

    That must not be quoted, as one word with blanks would be.
    """
    return f"{name}={place}".split(" ")


def await_so(is_so: Callable[[], bool], timeout_s: float = PATIENCE_S) -> bool:
    """Wait until something is so, and return whether it came to that."""
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        if is_so():
            return True
        time.sleep(0.1)
    return is_so()
