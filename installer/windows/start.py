"""What the launchers run, within the runtime that lies beside it."""

import ctypes
import multiprocessing
import os
import platform
import sys
import traceback
from contextlib import suppress
from pathlib import Path

import compiled_modules

LOG = Path(os.environ.get("LOCALAPPDATA", ".")) / "lightpen" / "crashes"
QUIET = "LIGHTPEN_NO_DIALOG"  # set where nobody could close a dialog


def start() -> int:
    """Run the program; where it cannot even begin, say so in a window."""
    # Without a console there are no streams, and what prints must not fail by that;
    # those put in their place stay open as long as the program runs.
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            nowhere = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115
            setattr(sys, name, nowhere)
    if sys.platform == "win32":
        # Packages find the C++ library there that they are linked with.
        os.add_dll_directory(sys.prefix)
    sys.dont_write_bytecode = True  # no file comes to those that were installed
    compiled_modules.install()
    # Without _wmi it would ask a console for the version of Windows, at every start;
    # without an answer it takes that which Windows told Python.
    platform._syscmd_ver = lambda *unknown: ("", "", "")  # type: ignore[attr-defined]
    # Processes that it begins are the program itself, which is no python.exe.
    sys.frozen = True  # type: ignore[attr-defined]
    if sys.argv[1:2] == ["--multiprocessing-fork"]:
        multiprocessing.freeze_support()  # works, and does not return
    if sys.argv[1:3] == ["-m", "lightpen_program"]:
        del sys.argv[1:3]
    try:
        from lightpen_program.__main__ import main
    except (ImportError, OSError, SyntaxError, ValueError, EOFError):
        return _complain(traceback.format_exc())
    return main()


def _complain(trace: str) -> int:
    """Say that the program is damaged: an import that fails has no other cause."""
    sys.stderr.write(trace)
    text = "Lightpen cannot start: its files are damaged. Install it again.\n\n" + trace
    with suppress(OSError):  # the window says it all the same
        LOG.mkdir(parents=True, exist_ok=True)
        (LOG / "start.txt").write_text(text, encoding="utf-8")
    if sys.platform == "win32" and not os.environ.get(QUIET):
        ctypes.windll.user32.MessageBoxW(None, text[-1500:], "Lightpen", 0x10)
    return 3


if __name__ == "__main__":
    sys.exit(start())
