"""The mark of a folder with simulated files.

A simulated camera file looks like a real one. Whoever writes simulated files leaves
this mark beside them, so that what is computed from them is known to be simulated.
"""

from pathlib import Path

from lightpen.formats.files import write_whole

MARK = "SIMULATED.txt"
TEXT = "The files in this folder were simulated by Lightpen; they are of no real pen.\n"


def mark_simulated(folder: Path) -> None:
    """Mark a folder."""
    write_whole(folder / MARK, TEXT.encode())


def is_simulated(path: Path) -> bool:
    """Return whether a file, or a folder of images, was simulated.

    Images may be in a subfolder beside the mark. Unreadable folders count as real.
    """
    folders = (path, path.parent, path.parent.parent)
    try:
        return any((folder / MARK).is_file() for folder in folders)
    except (OSError, ValueError):
        return False
