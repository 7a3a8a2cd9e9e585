"""Readiness for a swing: one button for each requirement."""

from collections.abc import Sequence
from functools import partial

from PySide6.QtCore import QEvent, Signal
from PySide6.QtGui import QIcon
from PySide6.QtWidgets import QFrame
from typing_extensions import override

from lightpen_app.face import ReadinessItem
from lightpen_app.look.layouts import horizontal_layout, set_stacked, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, set_tone, text_label
from lightpen_app.look.tooltips import set_tooltip
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.sign_label import SignLabel, StatusMessage
from lightpen_app.widgets.status_mark import message_icon


class ReadinessLine(QFrame):
    """Shows station and operator, what is ready, and below it what is not."""

    step_requested = Signal(str)  # where an item is put right

    def __init__(self, n_items: int) -> None:
        super().__init__()
        self.setProperty("area", "panel")
        self._items: tuple[ReadinessItem, ...] = ()

        # Widgets
        self._place = text_label(TextSize.LEAD)
        self._buttons = tuple(PushButton(0) for _ in range(n_items))
        self._reasons = tuple(SignLabel() for _ in range(n_items))

        # Layout
        margins = (2 * GRID, GRID, 2 * GRID, GRID)
        layout = vertical_layout(self, margins=margins)
        self._row = horizontal_layout(layout, (self._place, 1))
        pairs = (self._buttons[i : i + 2] for i in range(0, n_items, 2))
        self._pairs = horizontal_layout(self._row)
        for pair in pairs:
            horizontal_layout(self._pairs, *pair, 1)
        for reason in self._reasons:
            layout.addWidget(reason)

        # Connections
        for index, button in enumerate(self._buttons):
            button.setFlat(True)
            button.clicked.connect(partial(self._on_clicked, index))

    def items(self) -> tuple[ReadinessItem, ...]:
        """Return the displayed value."""
        return self._items

    def set_narrow(self, narrow: bool) -> None:
        """Put the place above the items where there is little width."""
        for row in (self._row, self._pairs):
            set_stacked(row, narrow)

    def set_place(self, place: str) -> None:
        """Show station and operator."""
        self._place.setText(place)

    def set_items(self, items: Sequence[ReadinessItem]) -> None:
        """Show other items; those not ready with name and reason."""
        if tuple(items) == self._items:
            return
        self._items = tuple(items)
        for button in self._buttons[len(items) :]:
            button.hide()
        for item, button, reason in zip(
            items, self._buttons, self._reasons, strict=False
        ):
            text = item.name if item.is_amber else item.message.text
            button.setText(text)
            button.setIcon(message_icon(item.message, self))
            button.setAccessibleDescription(item.message.text)
            set_tooltip(button, item.message.text if item.is_amber else "")
            set_tone(button, item.message.tone)
            reason.set_value(item.message if item.is_amber else StatusMessage())

    @override
    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            self._restyle()

    def _restyle(self) -> None:
        """Draw the signs in the present colours."""
        for item, button in zip(self._items, self._buttons, strict=False):
            icon = message_icon(item.message, self) if item.message.text else QIcon()
            button.setIcon(icon)

    def _on_clicked(self, index: int) -> None:
        if index < len(self._items):
            self.step_requested.emit(self._items[index].step)
