"""Whom an installation is for, all users or the account SYSTEM, and on what Windows."""

from pathlib import Path

from installer.places import IS_WINDOWS
from installer.trial import UNINSTALL, UNINSTALL_ALL, Trial

from lightpen_program.self_test import FILE_LIST, damaged_files

TOO_OLD = 4  # exit status of the installer
VERSION_KEY = r"HKLM\Software\Microsoft\Windows NT\CurrentVersion"
BUILD = "CurrentBuildNumber"
BUILD_1803 = "17134"  # the last that is too old
SYSTEM_PROFILE = r"C:\windows\system32\config\systemprofile"


def try_all_users(trial: Trial, version: str) -> None:
    """Install for all users, and remove it again; takes an administrator."""
    outcome = trial.install("/ALLUSERS")
    trial.expect("installs for all users", outcome.status == 0, outcome)
    folder = trial.folder_of_all
    wrong = damaged_files(folder / FILE_LIST) if folder.exists() else (FILE_LIST,)
    trial.expect("into the folder of all programs", not wrong, wrong[:5])
    stated = trial.value(UNINSTALL_ALL, "DisplayVersion")
    trial.expect("stated for the machine", stated == version, stated)
    own = trial.value(UNINSTALL, "DisplayName")
    trial.expect("and not for the user", not own and not trial.folder.exists(), own)
    links = sorted(path.name for path in _menu(trial).glob("*.lnk"))
    trial.expect("two entries in the menu of all", len(links) == 2, links)
    said = trial.machine.run(
        [trial.machine.windows_path(folder / "bin" / "lightpen.exe"), "--version"]
    )
    trial.expect("runs for a user", said.output.strip() == version, said)
    _remove(trial)


def try_system(trial: Trial) -> None:
    """Install as the account SYSTEM does, which has no menu and no desktop of its own.

    Under Wine its profile stands for the account; on Windows that takes a service.
    """
    if IS_WINDOWS:
        print("skip the account SYSTEM: its programs are started by a service")
        return
    setup = trial.machine.windows_path(trial.setup)
    words = f"set USERPROFILE={SYSTEM_PROFILE}&& {setup} /S"
    outcome = trial.machine.run(["cmd", "/c", *words.split(" ")])
    trial.machine.await_end()
    there = trial.folder_of_all / "Lightpen.exe"
    trial.expect("SYSTEM installs for all users", there.exists(), outcome)
    _remove(trial)


def try_old_windows(trial: Trial) -> None:
    """Install on a Windows that is older than any that the program was made for."""
    if IS_WINDOWS:
        print("skip an older Windows: this one is new enough")
        return
    now = trial.value(VERSION_KEY, BUILD)
    try:
        _state_build(trial, BUILD_1803)
        status = trial.install().status
    finally:
        _state_build(trial, now)
    is_refused = status == TOO_OLD and not trial.folder.exists()
    trial.expect("no installation on Windows 10 1803", is_refused, status)


def _remove(trial: Trial) -> None:
    uninstaller = trial.folder_of_all / "uninstall.exe"
    trial.machine.run([trial.machine.windows_path(uninstaller), "/S"])
    trial.machine.await_end()
    left = trial.remains()
    trial.expect("and is removed for all", not left and not _menu(trial).exists(), left)


def _state_build(trial: Trial, number: str) -> None:
    words = ["reg", "add", VERSION_KEY, "/v", BUILD, "/d", number, "/f"]
    trial.machine.run(words).require_success()
    trial.machine.await_end()


def _menu(trial: Trial) -> Path:
    programs = "ProgramData/Microsoft/Windows/Start Menu/Programs"
    return trial.machine.shared / programs / "Lightpen"
