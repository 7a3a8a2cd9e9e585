"""A field for a date, which may be empty."""

from datetime import date

from PySide6.QtCore import Signal

from lightpen_app.look.theme import Tone, set_tone
from lightpen_app.widgets.path_field import EnterEdit
from lightpen_app.widgets.translated import Translated

EXAMPLE = date(2025, 8, 14)  # of a day that is over


class DateField(Translated, EnterEdit):
    """A date such as 2026-08-14; an invalid one is marked and ignored.

    The example is shown while it is empty.
    """

    value_changed = Signal()

    def __init__(self, example: date = EXAMPLE) -> None:
        super().__init__()
        self._value: date | None = None
        self.setPlaceholderText(f"{example}")
        words = self.tr("Date, for example {0}; empty for any date")
        self.say(self, tip=words.format(example))

        # Connections
        self.textChanged.connect(self._on_text_changed)

    def value(self) -> date | None:
        """Return the day; None for any."""
        return self._value

    def set_value(self, day: date | None) -> None:
        """Show another day, or none."""
        self.setText("" if day is None else f"{day}")

    def _on_text_changed(self, text: str) -> None:
        before, typed = self._value, text.strip()
        try:
            self._value = date.fromisoformat(typed) if typed else None
        except ValueError:
            self._value = None
        is_wrong = bool(typed) and self._value is None
        set_tone(self, Tone.BAD if is_wrong else Tone.PLAIN)
        if self._value != before:
            self.value_changed.emit()
