"""The compiled form of all modules, made by the Python that will run it.

Its files never depend on times, and name their sources by paths that are the same
wherever they were compiled.
"""

import shutil
import subprocess
from pathlib import Path

from installer.places import INSTALLER, IS_WINDOWS
from installer.wine.prefix import Prefix

SCRIPT = "compile_modules.py"


def compile_modules(folder: Path) -> None:
    """Compile the modules of an installed folder, into one file."""
    shutil.copyfile(INSTALLER / "windows" / SCRIPT, folder / SCRIPT)
    python = folder / "runtime" / "python.exe"
    words = [str(python), "-I", "-B", SCRIPT]
    try:
        if IS_WINDOWS:
            subprocess.run(words, cwd=folder, check=True)
        else:
            Prefix.for_builds().run(words, folder=folder).require_success()
    finally:
        (folder / SCRIPT).unlink()
