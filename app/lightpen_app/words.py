"""Names and moments as they are shown."""

from datetime import datetime

from PySide6.QtCore import QDateTime, QLocale

LONGEST_SHOWN = 32  # characters
PARTED = "  \u00b7  "  # between things told in one line


def shortened(name: str, longest: int = LONGEST_SHOWN) -> str:
    """Return a name that fits into a line; its end is left out if it is long."""
    return name if len(name) <= longest else f"{name[: longest - 1]}\u2026"


def moment_text(moment: datetime, pattern: str) -> str:
    """Return a moment in local time, by a pattern of Qt, in the user's language."""
    local = QDateTime.fromSecsSinceEpoch(int(moment.timestamp()))
    return QLocale().toString(local, pattern)
