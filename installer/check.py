"""Try an installer for real: ``python installer/check.py SETUP.exe``.

On Linux in a fresh Wine prefix, on Windows in the user's own account, unless there is
an installation or data of the program: then nothing is tried, as they would be lost.
Prints what it tries; the exit status is 1 if anything is not as it must be. See
installer/README.md.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from installer import bad_conditions, life, users
from installer.build import pack
from installer.launchers import ToolMissingError
from installer.machine import fresh_machine
from installer.places import IS_WINDOWS
from installer.signatures import binaries, is_signed, wrongly_signed
from installer.trial import Trial, await_so

from lightpen import __version__

DISPLAY = 93
CHINESE_LOCALE = Path("/usr/share/i18n/locales/zh_CN")  # of the package locales
NEWER = "999.0.0rc1"  # a candidate can be packed, too
REFUSAL = """check.py: This account has Lightpen or its data:
  {}
They would be changed and deleted. Nothing was done: use an account or a computer
without them."""
DOWNLOAD_LIMIT = 65e6  # bytes of the installer
START_LIMIT_S = 8.0
N_LATER_STARTS = 2
TIP_LIMIT = 1e-6  # mm between the tips of Linux and Windows


def main(arguments: Sequence[str] | None = None) -> int:
    """Try it, and return the exit status."""
    options = _parser().parse_args(arguments)
    began = time.monotonic()
    try:
        with fresh_machine(life.USUAL_PLATFORM) as machine:
            trial = Trial(machine, options.setup.absolute())
            if remains := trial.remains():
                print(REFUSAL.format("\n  ".join(remains)), file=sys.stderr)
                return 1
            if options.quick:
                try_quickly(trial, options.authority)
            else:
                payload = options.setup.absolute().parent / "payload"
                try_all(trial, payload, options.authority)
    except ToolMissingError as error:
        print(f"check.py: {error}", file=sys.stderr)
        return 1
    print(f"{len(trial.faults)} troubles, {time.monotonic() - began:.0f} s")
    return 1 if trial.faults else 0


def try_signatures(trial: Trial, authority: Path | None) -> None:
    """Verify the signature of every program and library that is installed."""
    installed = [trial.setup, *binaries(trial.folder)]
    if authority is None and not is_signed(trial.setup):
        print("skip signatures: the installer is not signed")
        return
    wrong = [path.name for path in wrongly_signed(installed, authority)]
    trial.expect(f"{len(installed)} signatures are right", not wrong, wrong)


def try_quickly(trial: Trial, authority: Path | None) -> None:
    """Install, self-test and uninstall."""
    files, registry = trial.machine.files(), trial.machine.registry()
    life.try_installation(trial, __version__)
    try_signatures(trial, authority)
    compare_tips(trial, life.try_self_test(trial, "offscreen"))
    life.try_removal(trial, files, registry)


def try_all(trial: Trial, payload: Path, authority: Path | None) -> None:
    """Try all that an installation goes through, and what goes wrong with it.

    Parameters
    ----------
    payload : Path
        The folder that the installer was packed from, for one of a newer version.
    authority : Path or None
        File of the certificate that signatures go back to.
    """
    files, registry = trial.machine.files(), trial.machine.registry()
    size = trial.setup.stat().st_size
    trial.expect(f"{size / 1e6:.1f} MB to download", size <= DOWNLOAD_LIMIT)
    bad_conditions.try_no_right(trial)
    bad_conditions.try_full_disk(trial)
    bad_conditions.try_other_folders(trial)
    try_chinese(trial)
    life.try_installation(trial, __version__)
    try_signatures(trial, authority)
    compare_tips(trial, life.try_self_test(trial, "offscreen"))
    with _screen(trial) as seen:
        if seen is not None:
            life.try_self_test(seen, "windows")
    life.try_remains(trial)
    try_start(trial)
    life.try_entry_points(trial, __version__)
    life.try_demo(trial)
    life.try_double_click(trial)
    life.try_refusals(trial)
    bad_conditions.try_damage(trial)
    bad_conditions.try_interruption(trial)
    with TemporaryDirectory() as work:
        newer = Path(work) / "newer-setup.exe"
        pack(payload, Path(work), newer, NEWER, stored=True)
        life.try_upgrade(trial, newer, __version__, NEWER)
    life.try_removal(trial, files, registry)
    users.try_all_users(trial, __version__)
    users.try_system(trial)
    users.try_old_windows(trial)
    life.expect_nothing_left(trial, files, registry)


def compare_tips(trial: Trial, there: Mapping[str, Any]) -> None:
    """Compare the tip of a self-test with that of one on this computer."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "report.json"
        words = [sys.executable, "-m", "lightpen_program", "--self-test", str(file)]
        environment = os.environ | {"QT_QPA_PLATFORM": "offscreen"}
        subprocess.run(words, env=environment, check=True)
        here = json.loads(file.read_text("utf-8"))
    if not there["ok"]:
        return
    pairs = zip(there["tip"]["found_mm"], here["tip"]["found_mm"], strict=True)
    apart = max(abs(one - other) for one, other in pairs)
    trial.expect(f"its tip is that found here, to {apart:.1e} mm", apart <= TIP_LIMIT)


def try_chinese(trial: Trial) -> None:
    """Install where Windows is in Chinese, if that language is to be had here."""
    if IS_WINDOWS or not CHINESE_LOCALE.exists():
        print("skip a Chinese Windows: this computer has no locale for it")
        return
    with TemporaryDirectory() as folder:
        machine = trial.machine.in_chinese(Path(folder))
        life.try_chinese(replace(trial, machine=machine))


def try_start(trial: Trial) -> None:
    """Start the program, and take the time until its window serves.

    The limit is for the soonest of the later starts, as other work slows some down.
    """
    first, *later = (_start_seconds(trial) for _ in range(1 + N_LATER_STARTS))
    told = ", ".join(f"{seconds:.1f} s" for seconds in later)
    is_soon = min(later) <= START_LIMIT_S
    trial.expect(f"first start, {first:.1f} s; then {told}", is_soon)


def _start_seconds(trial: Trial) -> float:
    """Return how long it takes until the window serves; forever if it does not."""
    began = time.monotonic()
    process = trial.start_window()
    is_open = trial.await_window()
    seconds = time.monotonic() - began
    trial.end_programs()
    process.wait()
    return seconds if is_open else inf


@contextmanager
def _screen(trial: Trial) -> Iterator[Trial | None]:
    """Give the machine a screen, where there is none and one can be made."""
    if IS_WINDOWS:
        yield trial
        return
    program = shutil.which("Xvfb")
    if program is None:
        print("skip what needs a screen: Xvfb is not installed")
        yield None
        return
    words = [program, f":{DISPLAY}", "-screen", "0", "1600x1200x24"]
    server = subprocess.Popen(words, stderr=subprocess.DEVNULL)
    try:
        await_so(Path(f"/tmp/.X11-unix/X{DISPLAY}").exists)
        machine = trial.machine.with_display(f":{DISPLAY}")
        yield replace(trial, machine=machine)
    finally:
        server.terminate()
        server.wait()


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Try an installer for real.")
    parser.add_argument("setup", type=Path, metavar="SETUP.exe")
    parser.add_argument(
        "--quick", action="store_true", help="only install, self-test and uninstall"
    )
    parser.add_argument(
        "--authority",
        type=Path,
        metavar="FILE",
        help="certificate that the signatures of the installer go back to",
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
