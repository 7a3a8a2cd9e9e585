"""A field below its name."""

from PySide6.QtWidgets import QLabel, QWidget

from lightpen_app.look.layouts import GridPlace, Place, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label


def field_label(field: QWidget) -> QLabel:
    """Return a label for the name of a field."""
    label = text_label(TextSize.SMALL, Tone.QUIET)
    label.setWordWrap(False)
    label.setBuddy(field)
    return label


def add_labelled(
    place: Place,
    label: QLabel,
    field: QWidget,
    *,
    stretch: int = 0,
    at: GridPlace = (0, 0),
) -> None:
    """Add a label with its field below; for the place see `vertical_layout`."""
    vertical_layout(place, label, field, spacing=GRID // 2, stretch=stretch, at=at)
