"""A field for the path of a file or a folder, typed or picked in a dialog."""

from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent, QPaintEvent
from PySide6.QtWidgets import (
    QFileDialog,
    QLineEdit,
    QPushButton,
    QSizePolicy,
    QStyle,
    QStyleOptionFrame,
    QStylePainter,
    QWidget,
)
from typing_extensions import override

from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.look.theme import Tone, set_tone
from lightpen_app.look.tooltips import set_tooltip
from lightpen_app.widgets.keys import ENTER_KEYS

QUOTES = "\"'"


class EnterEdit(QLineEdit):
    """A line edit whose Enter key only ends editing.

    Where nothing was edited, Enter is left to the window. Without the focus it shows
    the end of a text that is too long.
    """

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        option = QStyleOptionFrame()
        self.initStyleOption(option)
        line = QStyle.SubElement.SE_LineEditContents
        area = self.style().subElementRect(line, option, self).adjusted(2, 0, -2, 0)
        left = Qt.TextElideMode.ElideLeft
        shown = self.fontMetrics().elidedText(self.text(), left, area.width())
        if self.hasFocus() or shown == self.text():
            super().paintEvent(event)
            return
        painter = QStylePainter(self)
        painter.drawPrimitive(QStyle.PrimitiveElement.PE_PanelLineEdit, option)
        painter.drawText(area, Qt.AlignmentFlag.AlignVCenter, shown)

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        was_edited = self.isModified()
        super().keyPressEvent(event)
        if event.key() in ENTER_KEYS:
            event.setAccepted(was_edited)
            self.setModified(False)


class PathField(QWidget):
    """A path that is taken over when Enter is pressed or the field is left."""

    # Another path was given, or a faulty one again by Enter.
    value_changed = Signal(str)
    path_chosen = Signal(str)  # so it was, and it is not empty

    def __init__(self) -> None:
        super().__init__()
        self._value = self._last = ""
        self._is_faulty = False

        # Widgets
        self.edit = EnterEdit()
        self.edit.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setFocusProxy(self.edit)

        # Layout
        self._layout = horizontal_layout(self, (self.edit, 1))

        # Connections
        self.edit.returnPressed.connect(self._on_return_pressed)
        self.edit.editingFinished.connect(self._on_editing_finished)

    def value(self) -> str:
        """Return the path that was given last."""
        return self._value

    def set_value(self, value: str) -> None:
        """Show another path."""
        self._value, self._last = value, value or self._last
        self.edit.setText(value)
        set_tooltip(self.edit, value)

    def set_faulty(self, faulty: bool) -> None:
        """Mark the path as not existing."""
        self._is_faulty = faulty
        set_tone(self.edit, Tone.BAD if faulty else Tone.PLAIN)

    def add_button(self, button: QPushButton) -> None:
        """Add a button beside the line."""
        self._layout.addWidget(button)

    def pick(
        self, mode: QFileDialog.FileMode, title: str, name_filter: str = ""
    ) -> None:
        """Let the user pick a file or a folder in a dialog, and take it over.

        The dialog opens where the last one was.
        """
        dialog = QFileDialog(self, title)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setFileMode(mode)
        if mode is QFileDialog.FileMode.Directory:
            dialog.setOption(QFileDialog.Option.ShowDirsOnly)
        elif name_filter:
            dialog.setNameFilter(name_filter)
        last = Path(self._last)
        if self._last and last.parent.is_dir():
            dialog.setDirectory(str(last if last.is_dir() else last.parent))
        dialog.fileSelected.connect(self.take)
        dialog.open()

    def take(self, path: str) -> None:
        """Take over a path as if it were typed."""
        self.set_value(path)
        self.value_changed.emit(path)
        if path:
            self.path_chosen.emit(path)

    def _typed(self) -> str:
        """Return the text without the quotes added by a desktop."""
        text = self.edit.text().strip()
        for quote in QUOTES:
            if len(text) > 1 and text.startswith(quote) and text.endswith(quote):
                text = text[1:-1]
        return str(Path(text).expanduser()) if text.startswith("~") else text

    def _on_return_pressed(self) -> None:
        """Accept the typed path; consume Enter, which the window uses otherwise."""
        if self.edit.isModified() or self._is_faulty:
            self.take(self._typed())

    def _on_editing_finished(self) -> None:
        if self._typed() != self._value:
            self.take(self._typed())
