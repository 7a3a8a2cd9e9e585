"""A field below its name."""

from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from lightpen_app.look.theme import GRID, TextSize, Tone, text_label


def field_label(field: QWidget) -> QLabel:
    """Return a label for the name of a field."""
    label = text_label(TextSize.SMALL, Tone.QUIET)
    label.setWordWrap(False)
    label.setBuddy(field)
    return label


def stacked(label: QLabel, field: QWidget) -> QVBoxLayout:
    """Return a label with its field below."""
    layout = QVBoxLayout()
    layout.setSpacing(GRID // 2)
    layout.addWidget(label)
    layout.addWidget(field)
    return layout
