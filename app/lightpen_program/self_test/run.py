"""The checks of a self-test, in order.

Only modules of Python itself are imported before the files are found to be whole.
"""

import importlib
import logging
import os
import sys
import threading
from contextlib import ExitStack
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Timer
from traceback import extract_stack

from lightpen_program.self_test.report import Report, SelfTestError, Tip

FILE_LIST = "files.sha256"


def file_list() -> Path:
    """Return the path of the file list of the installer, if it was used."""
    return Path(sys.prefix).parent / FILE_LIST


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
           "PySide6.QtSvg", "pyqtgraph", "lightpen.cli", "lightpen_app.application",
           "lightpen_app.wizard_pages")  # fmt: skip
# Drive cameras, and reach an archive on a server.
OPTIONAL = ("harvesters.core", "pypylon.pylon", "psycopg")


def test_program(file: Path) -> int:
    """Test the installation, write a report, and return the exit status.

    The report is written in any case, with a picture of the wizard beside it.
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
    from lightpen.logs import recent_lines, running_log

    stack.enter_context(running_log(logging.INFO))
    report.last_lines = recent_lines
    with report.check("imports") as found:
        there = (name for name in OPTIONAL if find_spec(name.partition(".")[0]))
        names = (*MODULES, *there)
        for name in names:
            importlib.import_module(name)
        found.append(", ".join(names))
    # Everything below needs these imports.
    from lightpen_program.self_test.desk import Desk

    with report.check("window system") as found:
        desk = Desk(folder)
        report.versions.update(desk.versions())
        found.append(desk.platform())
    with report.check("fonts") as found:
        found.append(desk.tested_fonts())
    with report.check("record") as found:
        found.append(desk.tested_record())
    with report.check("wizard") as found:
        report.doing = desk.doing
        picture = report.file.with_suffix(".png")
        found.append(desk.walked_wizard(picture))
        report.screenshot = str(picture)
    with report.check("result") as found:
        found.append(desk.tested_result())
    with report.check("tip") as found:
        report.tip = tip = desk.tip()
        found.append(_judged(tip))
    report.is_complete = True


def _checked_files() -> str:
    files = file_list()
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
