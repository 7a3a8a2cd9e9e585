"""Where things are: the sources, and what is kept from one build to the next."""

import os
import sys
from pathlib import Path

INSTALLER = Path(__file__).resolve().parent
ROOT = INSTALLER.parent
IS_WINDOWS = sys.platform == "win32"


def cache() -> Path:
    """Return the user's folder for what was downloaded and can be downloaded again."""
    if IS_WINDOWS:
        base = Path(os.environ["LOCALAPPDATA"])
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = base / "lightpen-installer"
    folder.mkdir(parents=True, exist_ok=True)
    return folder
