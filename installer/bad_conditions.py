"""Adverse conditions of real computers, each tried in the installation."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from installer.life import damaged
from installer.trial import Trial, await_so

NO_RIGHT, NO_SPACE = 8, 9  # exit status of the installer
SMALL_DISK = "60m"
# A source, and the file with the compiled form of all, without which the program runs.
VICTIMS = (
    "runtime/Lib/site-packages/lightpen/swing/capture/rules.py",
    "runtime/compiled_modules.bin",
)


def try_damage(trial: Trial) -> None:
    """Damage two files: the self-test names them, the next installation mends them."""
    for victim in VICTIMS:
        file = trial.folder / victim
        whole = file.read_bytes()
        file.write_bytes(whole[: len(whole) // 2])
    report = trial.self_test()
    said = " ".join(check["found"] for check in report["checks"])
    is_named = not report["ok"] and all(victim in said for victim in VICTIMS)
    trial.expect("the self-test names damaged files", is_named, report)
    trial.install()
    trial.expect("which are mended by installing again", not damaged(trial))


def try_interruption(trial: Trial) -> None:
    """Kill an installation halfway: the next one repairs what is there."""
    module = trial.folder / "runtime" / "python313.dll"
    process = trial.machine.start([trial.machine.windows_path(trial.setup), "/S"])
    await_so(lambda: not module.exists())  # what was there is being replaced
    await_so(module.exists)
    trial.machine.run(["taskkill", "/f", "/im", trial.setup.name])
    process.wait()
    trial.machine.await_end()
    is_torn = bool(damaged(trial))
    trial.expect("a killed installation is not whole", is_torn)
    outcome = trial.install()
    trial.expect("the next one repairs it", outcome.status == 0 and not damaged(trial))


def try_other_folders(trial: Trial) -> None:
    """Install into two folders in turn whose names have blanks and Chinese letters."""
    folder = trial.machine.drive / "测量 程序" / "Light pen 1"
    before = folder.with_name("Light pen 0")
    trial.install(place=trial.machine.windows_path(before))
    place = trial.machine.windows_path(folder)
    trial.install(place=place)
    trial.expect("the folder before is removed", not before.exists())
    said = trial.machine.run([rf"{place}\bin\lightpen.exe", "--version"])
    trial.expect("runs from a folder with blanks and Chinese", said.status == 0, said)
    uninstaller = rf"{place}\uninstall.exe"
    trial.machine.run([uninstaller, "/S"])
    trial.machine.await_end()
    trial.expect("and is removed from there", not folder.exists())
    shutil.rmtree(folder.parent, ignore_errors=True)


def try_no_right(trial: Trial) -> None:
    """Install where nothing can be written."""
    outcome = trial.install(place=r"Z:\proc\lightpen")
    trial.expect("no right to write is told", outcome.status == NO_RIGHT, outcome)


def try_full_disk(trial: Trial) -> None:
    """Install onto a disk that is too small, which takes the rights to mount one."""
    if not hasattr(os, "geteuid") or os.geteuid() != 0:
        print("skip a full disk: only root can mount a small one")
        return
    folder = trial.machine.drive / "small"
    with _small_disk(folder):
        place = trial.machine.windows_path(folder / "Lightpen")
        outcome = trial.install(place=place)
        trial.expect("no space is told", outcome.status == NO_SPACE, outcome)
        trial.expect("and nothing is left there", not any(folder.iterdir()))


@contextmanager
def _small_disk(folder: Path) -> Iterator[None]:
    folder.mkdir()
    size = f"size={SMALL_DISK}"
    subprocess.run(["mount", "-t", "tmpfs", "-o", size, "none", folder], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", folder], check=True)
        folder.rmdir()
