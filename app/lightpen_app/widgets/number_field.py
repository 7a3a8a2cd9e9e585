"""A field for a number with its unit."""

import math

from PySide6.QtCore import QEvent, QPoint, Qt, Signal
from PySide6.QtGui import QFocusEvent, QHideEvent, QKeyEvent, QWheelEvent
from PySide6.QtWidgets import QLabel, QLineEdit, QScrollArea, QWidget
from typing_extensions import override

from lightpen_app.look.theme import GRID, TextSize, Tone, set_tone, text_label
from lightpen_app.look.words import TYPED, number_text, unit_size
from lightpen_app.widgets.controls import ENTER_KEYS, LeavesPageKeys

ARROWS = {Qt.Key.Key_Up: 1, Qt.Key.Key_Down: -1}
WHEEL_STEP = 120  # eighths of a degree


class NumberField(LeavesPageKeys, QLineEdit):
    """A number with its unit; what is out of range is refused with the reason.

    It accepts a decimal point or comma, and another unit of the same kind: "20 um" in
    a field in mm. A refused text stays, in red, with what is allowed below it, until
    it is corrected; `value` remains the last number that was accepted. Arrow keys
    and, with the focus, the wheel change the second digit of the number.
    """

    # A number was typed and Enter pressed or the field left, or it was stepped.
    value_changed = Signal(float)

    def __init__(self, unit: str, limits: tuple[float, float], n_decimals: int) -> None:
        super().__init__()
        self._unit, self._limits, self._n_decimals = unit, limits, n_decimals
        self._value = max(limits[0], min(0.0, limits[1]))  # shown, or before the typing
        self._typed = self._value
        self._empty: str | None = None  # what the least number is called, if anything
        self._reason = ""
        self._reason_label: QLabel | None = None
        self.setMaximumHeight(5 * GRID)

        # Connections
        self.textEdited.connect(self._on_edited)
        self.editingFinished.connect(self._take)

        self._show()

    def value(self) -> float:
        """Return the number, in the unit of the field."""
        return self._typed if self.isModified() and not self._reason else self._value

    def set_value(self, value: float) -> None:
        """Show another number; an unchanged one keeps the text being typed."""
        is_same = self._written(value) == self._written(self._value)
        self._value = value
        if not (is_same and self.hasFocus() and self.isModified()):
            self._show()

    def set_limits(self, least: float, largest: float) -> None:
        """Accept other numbers; the present one stays."""
        self._limits = (least, largest)

    def set_unit(self, unit: str) -> None:
        """Show another unit; an unchanged one keeps the text being typed."""
        if unit != self._unit:
            self._unit = unit
            self._show()

    def set_empty_text(self, text: str) -> None:
        """Show the least number as an empty field with a text, such as "No limit"."""
        self._empty = text
        self.setPlaceholderText(text)
        if not self.isModified():
            self._show()

    def reason(self) -> str:
        """Return why the text is refused; empty if it is accepted."""
        return self._reason

    def settle(self) -> None:
        """Take over the number that is being typed, unless it is refused."""
        if self.isModified():
            self._take()

    def show_reason(self) -> None:
        """Show below the field why its text is refused."""
        if self._reason_label is None:
            self._reason_label = text_label(TextSize.SMALL)
            self._reason_label.setObjectName("refusal")
            self._reason_label.setTextFormat(Qt.TextFormat.PlainText)
        label, around = self._reason_label, self._surroundings()
        label.setParent(around)
        label.setText(self._reason)
        label.setMaximumWidth(max(around.width() - GRID, 20 * GRID))
        label.adjustSize()
        below = self.mapTo(around, QPoint(0, self.height() + GRID // 4))
        x = max(0, min(below.x(), around.width() - label.width()))
        is_low = below.y() + label.height() > around.height()
        above = below.y() - self.height() - label.height() - GRID // 2
        label.move(x, max(above, 0) if is_low else below.y())
        label.raise_()
        label.show()

    def _surroundings(self) -> QWidget:
        """Return what the reason is drawn over: it scrolls with the field."""
        around = self.parentWidget() or self
        while not around.isWindow() and (above := around.parentWidget()) is not None:
            area = above.parentWidget()
            if isinstance(area, QScrollArea) and area.viewport() is above:
                break
            around = above
        return around

    def _written(self, value: float) -> str:
        """Return a number with its unit, as the field shows it."""
        if self._empty is not None and value <= self._limits[0]:
            return ""
        return f"{number_text(value, self._n_decimals)} {self._unit}".rstrip()

    def _show(self) -> None:
        self.setText(self._written(self._value))
        self.setCursorPosition(0)
        self._refuse("")

    def _refuse(self, reason: str) -> None:
        self._reason = reason
        set_tone(self, Tone.BAD if reason else Tone.PLAIN)
        self.setAccessibleDescription(reason)
        if reason and self.isVisible():
            self.show_reason()
        elif self._reason_label is not None:
            self._reason_label.hide()

    def _on_edited(self) -> None:
        self._typed, reason = self._read()
        self._refuse(reason)

    def _take(self) -> None:
        """Show the typed number as it was read, and emit it; a refused text stays."""
        if self._reason or not self.isModified():
            return
        self._change(self._typed)

    def _change(self, value: float) -> None:
        self._value = value
        self._show()
        self.value_changed.emit(value)

    def _read(self) -> tuple[float, str]:
        """Return the typed number, and why it is refused, empty if it is not."""
        text = self.text().strip()
        least, largest = self._limits
        if not text and self._empty is not None:
            return least, ""
        match = TYPED.fullmatch(text)
        if match is None:
            return math.nan, self.tr("Enter a number, {0}.").format(self._range())
        typed = match["number"].replace(",", ".")
        size = 1.0 if match["unit"] is None else unit_size(match["unit"], self._unit)
        if size is None:
            words = self.tr("{0} is not a unit here; enter {1}.")
            return math.nan, words.format(match["unit"], self._range())
        n_decimals = len((match["point"] or ".").rstrip("0")) - 1
        if size == 1.0 and n_decimals > self._n_decimals:
            if not self._n_decimals:
                return math.nan, self.tr("Enter a whole number.")
            words = self.tr("At most {0} decimals are possible.")
            return math.nan, words.format(self._n_decimals)
        value = round(float(typed) * size, self._n_decimals)
        if not least <= value <= largest:
            return math.nan, self._range_reason(float(typed), match["unit"])
        return value, ""

    def _range(self) -> str:
        """Return what is accepted, in words."""
        low, high = (f"{round(each, self._n_decimals):.12g}" for each in self._limits)
        return f"{self.tr('{0} to {1}').format(low, high)} {self._unit}".rstrip()

    def _range_reason(self, typed: float, unit: str | None) -> str:
        """Return what is accepted, and what to enter if smaller units were meant."""
        reason = self.tr("Allowed: {0}.").format(self._range())
        least, largest = self._limits
        if unit is None and self._unit == "mm" and least <= typed / 1000 <= largest:
            meant = self.tr("For {0} enter {1}.")
            entered = f"{typed / 1000:.6g}"
            reason += " " + meant.format(
                f"{typed:g} \N{GREEK SMALL LETTER MU}m", entered
            )
        return reason

    def _step(self, n_steps: int) -> None:
        """Change the second digit of the number by some steps."""
        self.settle()
        finest = 10.0**-self._n_decimals
        digits = math.floor(math.log10(max(abs(self._value), finest)) + 1e-9)
        step = max(10.0 ** (digits - 1), finest)
        least, largest = self._limits
        stepped = round(self._value + n_steps * step, self._n_decimals)
        within = max(least, min(stepped, largest))
        if within != self._value:
            self._change(within)

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in ARROWS and not self.isReadOnly():
            self._step(ARROWS[Qt.Key(event.key())])
            return
        was_edited = self.isModified()
        super().keyPressEvent(event)
        if event.key() in ENTER_KEYS:
            # A number that was typed does not press the main button of the window, too.
            event.setAccepted(was_edited or bool(self._reason))

    @override
    def wheelEvent(self, event: QWheelEvent) -> None:
        """Change the number only with the focus, not while the page scrolls."""
        if self.hasFocus():
            self._step(round(event.angleDelta().y() / WHEEL_STEP))
            event.accept()
        else:
            event.ignore()

    @override
    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        if event.reason() in (
            Qt.FocusReason.TabFocusReason,
            Qt.FocusReason.BacktabFocusReason,
        ):
            self.selectAll()

    @override
    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        if self._reason_label is not None:
            self._reason_label.hide()

    @override
    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.LanguageChange and self._reason:
            self._on_edited()


def is_refusing(area: QWidget) -> bool:
    """Return whether a number in an area is refused; its field says why."""
    for field in area.findChildren(NumberField):
        if field.reason() and field.isVisibleTo(area):
            field.setFocus(Qt.FocusReason.OtherFocusReason)
            field.show_reason()
            return True
    return False
