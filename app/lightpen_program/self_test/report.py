"""The report of a self-test."""

import json
import platform
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from threading import Lock


class SelfTestError(Exception):
    """A test failed; the text says why."""


@dataclass(frozen=True)
class Check:
    """Result of one check."""

    name: str
    ok: bool
    found: str  # result or fault
    seconds: float


@dataclass(frozen=True)
class Tip:
    """The tip that the wizard found, and the true one: x, y, z, pen frame, mm."""

    found_mm: list[float]
    true_mm: list[float]
    expanded_uncertainty_mm: list[float]


@dataclass
class Report:
    """Grows with each check, and can be written at any time, from any thread."""

    file: Path
    checks: list[Check] = field(default_factory=list)
    tip: Tip | None = None
    screenshot: str = ""
    versions: dict[str, str] = field(default_factory=dict)
    is_complete: bool = False
    last_lines: Callable[[], Sequence[str]] = tuple  # of the log
    doing: Callable[[], str] = str  # returns the current step
    # Where each thread was when the test was given up, by its name.
    threads: Mapping[str, Sequence[str]] = field(default_factory=dict)
    _lock: Lock = field(default_factory=Lock)

    @property
    def ok(self) -> bool:
        """Whether all was tried and all is well."""
        return self.is_complete and all(check.ok for check in self.checks)

    @contextmanager
    def check(self, name: str) -> Iterator[list[str]]:
        """Run a test; its body appends the findings.

        What goes wrong is noted before it is raised again.
        """
        found: list[str] = []
        began = time.monotonic()
        ok = False
        try:
            yield found
            ok = True
        finally:
            if not ok:
                found = [traceback.format_exc()]
            seconds = round(time.monotonic() - began, 3)
            self.checks.append(Check(name, ok, "; ".join(found), seconds))

    def write(self) -> None:
        """Write the present findings."""
        entries = {
            "ok": self.ok,
            "system": platform.platform(),
            "executable": sys.executable,
            "versions": self.versions,
            "checks": [asdict(check) for check in self.checks],
            "tip": None if self.tip is None else asdict(self.tip),
            "screenshot": self.screenshot,
            "log": list(self.last_lines()),
            "doing": self.doing(),
            "threads": self.threads,
        }
        with self._lock:
            text = json.dumps(entries, indent=1, ensure_ascii=False)
            # A path need not be text; its bytes are then written as JSON escapes them.
            self.file.write_text(
                text + "\n", encoding="utf-8", errors="backslashreplace"
            )
