"""Opens a folder in the file manager."""

from pathlib import Path

from PySide6.QtCore import QCoreApplication, QUrl
from PySide6.QtGui import QDesktopServices


def open_folder(folder: Path) -> str:
    """Open a folder in the file manager, or return a message with its path."""
    if QDesktopServices.openUrl(QUrl.fromLocalFile(str(folder))):
        return ""
    words = QCoreApplication.translate(
        "opened_folder", "No file manager found. Folder: {0}"
    )
    return words.format(folder)
