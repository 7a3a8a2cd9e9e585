"""``lightpen --self-test REPORT.json``: tests an installation."""

import importlib
import json
import logging
import os
import platform
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, field
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock, Timer
from traceback import extract_stack
from types import TracebackType

from PySide6.QtGui import QFont, QFontDatabase, QFontMetrics, QGuiApplication
from PySide6.QtWidgets import QApplication

from lightpen import calibrate, detect, find_images, read_camera, read_pen, reported
from lightpen.live.sources import SourceEnvironment
from lightpen.logs import recent_lines, running_log
from lightpen_app.application import Wizard, has_display, make_application
from lightpen_app.crash import versions
from lightpen_app.look.theme import FAMILIES, LIGHT, apply_theme, load_fonts
from lightpen_app.work.settings import Settings
from lightpen_extensions.simulator.camera import SkippingClock
from lightpen_extensions.simulator.scene_files import write_scene
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.simulator import SceneSimulator
from lightpen_extensions.simulator.swings import paper_camera
from lightpen_program.extensions import faces


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
    """The tip that was found, and the true one: x, y, z, pen frame, mm."""

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
            "threads": self.threads,
        }
        with self._lock:
            text = json.dumps(entries, indent=1, ensure_ascii=False)
            # A path need not be text; its bytes are then written as JSON escapes them.
            self.file.write_text(
                text + "\n", encoding="utf-8", errors="backslashreplace"
            )


FILE_LIST = "files.sha256"


def damaged_files(files: Path) -> tuple[str, ...]:
    """Return the files of a list that are missing, or not as they were built."""
    lines = files.read_text(encoding="utf-8").splitlines()
    entries = [line.split("  ", maxsplit=1) for line in lines]
    return tuple(
        name for digest, name in entries if _digest(files.parent / name) != digest
    )


def _digest(path: Path) -> str:
    try:
        return sha256(path.read_bytes()).hexdigest()
    except OSError:
        return "unreadable"


LONGEST = 600.0  # s, after which something hangs
UNWRITTEN, HUNG = 2, 3  # exit status
NEAR = 0.005  # mm from the true tip
MODULES = ("numpy", "cv2", "msgspec", "yaml", "argon2",
           "cryptography.hazmat.bindings._rust", "PySide6.QtWidgets",
           "PySide6.QtSvg", "pyqtgraph", "lightpen.cli",
           "lightpen_app.application")  # fmt: skip
# Drive cameras, reach an archive on a server, and read workbooks.
OPTIONAL = ("harvesters.core", "psycopg", "python_calamine")


def test_program(file: Path) -> int:
    """Test the installation, write a report, and return the exit status.

    The report is written in any case, with a picture of the window beside it.
    """
    report = Report(file)
    try:
        report.write()
    except OSError as error:
        _say(f"{file} cannot be written: {error.strerror}. Name another file.")
        return UNWRITTEN
    watchdog = Timer(LONGEST, _give_up, [report])
    watchdog.daemon = True
    watchdog.start()
    with ExitStack() as stack:
        stack.callback(report.write)
        stack.callback(watchdog.cancel)
        folder = Path(stack.enter_context(TemporaryDirectory(prefix="lightpen-试 ")))
        os.environ["LIGHTPEN_KEYS"] = str(folder / "keys")  # no key of the user's
        try:
            _test_all(report, folder, stack)
        except SelfTestError as failed:
            _say(str(failed))
    return 0 if report.ok else 1


def _test_all(report: Report, folder: Path, stack: ExitStack) -> None:
    with report.check("files") as found:
        found.append(_checked_files())
    stack.enter_context(running_log(logging.INFO))
    report.last_lines = recent_lines
    with report.check("imports") as found:
        there = (name for name in OPTIONAL if find_spec(name.partition(".")[0]))
        names = (*MODULES, *there)
        for name in names:
            importlib.import_module(name)
        found.append(", ".join(names))
    with report.check("window system") as found:
        desk = Desk(folder)
        report.versions.update(versions())
        found.append(QGuiApplication.platformName())
    with report.check("fonts") as found:
        found.append(desk.tested_fonts())
    with report.check("window") as found:
        picture = report.file.with_suffix(".png")
        found.append(desk.drawn_window(picture))
        report.screenshot = str(picture)
    with report.check("tip") as found:
        report.tip = tip = desk.found_tip()
        found.append(_judged(tip))
    report.is_complete = True


def _checked_files() -> str:
    files = Path(sys.prefix).parent / FILE_LIST  # of the installer, if it was used
    if not files.is_file():
        return "not put here by an installer: no list to check them by"
    damaged = damaged_files(files)
    if damaged:
        raise SelfTestError(
            f"Damaged or missing: {', '.join(damaged)}. Install the program again."
        )
    return f"as they were built, by {files}"


def _judged(tip: Tip) -> str:
    pairs = zip(tip.found_mm, tip.true_mm, strict=True)
    distance = sum((found - true) ** 2 for found, true in pairs) ** 0.5
    if distance > NEAR:
        raise SelfTestError(f"The tip is {distance:.6f} mm from the true one.")
    return f"{distance:.6f} mm from the true one"


def _say(text: str) -> None:
    if sys.stderr is not None:  # as it is without a console on Windows
        sys.stderr.write(f"lightpen: {text}\n")


def _give_up(report: Report) -> None:
    """End a process that hangs, from the thread of the watchdog, and report where."""
    names = {thread.ident: thread.name for thread in threading.enumerate()}
    report.threads = {
        names.get(ident, str(ident)): [str(each) for each in extract_stack(frame)]
        for ident, frame in sys._current_frames().items()
    }
    report.write()
    os._exit(HUNG)


# The classes to which a platform gives fonts of its own.
CLASSES_WITH_FONTS = (
    "QAbstractItemView",
    "QHeaderView",
    "QListView",
    "QMenu",
    "QMenuBar",
    "QMessageBox",
    "QStatusBar",
    "QTableView",
    "QTreeView",
)


# A quarter of the usual pixels makes the test short.
SCENE = Scene(camera=paper_camera(binning=2), led_noise=0.0)


LETTERS = "Aaµ°±光笔校准"


class Desk:
    """An application whose data and settings are in a folder of its own."""

    def __init__(self, folder: Path) -> None:
        self._data = folder / "data"
        self._swing = folder / "swing 光笔"
        self._settings = folder / "lightpen.json"
        if not has_display():
            os.environ["QT_QPA_PLATFORM"] = "offscreen"
        self._application = make_application(sys.argv[:1])

    def tested_fonts(self) -> str:
        """Return the fonts that were found to have all letters."""
        load_fonts()
        missing = set(FAMILIES) - set(QFontDatabase.families())
        if missing:
            raise SelfTestError(f"Not among the fonts: {', '.join(sorted(missing))}.")
        metrics = [QFontMetrics(QFont(family)) for family in FAMILIES]
        for letter in LETTERS:
            if not any(each.inFontUcs4(ord(letter)) for each in metrics):
                raise SelfTestError(f"The fonts have no {letter}.")
        apply_theme(self._application, LIGHT)
        for name in CLASSES_WITH_FONTS:
            # The stubs of PySide 6.11 want bytes, which the method itself refuses.
            family = QApplication.font(name).family()  # type: ignore[call-overload]
            if family != FAMILIES[0]:
                raise SelfTestError(f"{name} is shown in {family}, not {FAMILIES[0]}.")
        return ", ".join(FAMILIES)

    def drawn_window(self, picture: Path) -> str:
        """Show the window until all pages are made, and draw it."""
        around = SourceEnvironment(SceneSimulator(SCENE), SkippingClock(rests=True))
        settings = Settings(self._settings)
        wizard = Wizard(self._application, faces(), settings, self._data, around)
        faults: list[str] = []

        def end() -> None:
            if not wizard.window.grab().save(str(picture)):
                faults.append(f"The picture {picture} cannot be written.")
            wizard.window.close()

        def give_up(
            kind: type[BaseException], error: BaseException, trace: TracebackType | None
        ) -> None:
            previous(kind, error, trace)
            faults.append(f"{kind.__name__}: {error}")
            wizard.window.close_unasked()

        previous, sys.excepthook = sys.excepthook, give_up
        wizard.workbench.notifications.raised.connect(
            lambda text, _: faults.append(text)
        )
        wizard.show()
        wizard.started.connect(end)
        try:
            self._application.exec()
        finally:
            sys.excepthook = previous
        if faults:
            raise SelfTestError(" ".join(faults))
        return "drawn"

    def found_tip(self) -> Tip:
        """Calibrate the tip of a rendered swing; return it and the true one."""
        true_tip = write_scene(SCENE, self._swing)
        camera = read_camera(self._swing / "camera.yaml")
        pen = read_pen(self._swing / "leds.csv")
        seen = detect(find_images(str(self._swing / "images")), camera, pen)
        found = reported(calibrate(camera, pen, seen))
        u = found.expanded_uncertainty[:3].tolist()
        return Tip(found.tip_pen.tolist(), true_tip.tolist(), u)
