"""Buttons, keys, focus, what is made when shown, dropped and saved files."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeVar

from PySide6.QtCore import (
    QCoreApplication,
    QEvent,
    QMimeData,
    QObject,
    QSize,
    Qt,
    QUrl,
    Signal,
)
from PySide6.QtGui import QDesktopServices, QDropEvent, QKeyEvent, QShowEvent
from PySide6.QtWidgets import QFileDialog, QLineEdit, QPushButton, QWidget
from typing_extensions import override

from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.signs import Sign, sign_icon
from lightpen_app.look.theme import GRID, Tone
from lightpen_app.look.words import set_tooltip

LEAST_WIDTH = 8 * GRID + 34  # px; with the padding and the border


class PushButton(QPushButton):
    """A push button.

    A style sheet cannot say how narrow it may be: its min-width replaces the width that
    the words need, and a layout short of room would clip them. With short words it asks
    for ``least_width``, px.
    """

    def __init__(
        self, least_width: int = LEAST_WIDTH, *, checkable: bool = False
    ) -> None:
        super().__init__()
        self._mark = Sign.NONE, Tone.PLAIN
        self.setCheckable(checkable)
        self._least_width = least_width

    def set_why_not(self, why_not: str, tooltip: str = "") -> None:
        """Disable the button with a reason, or enable it with a tool tip."""
        self.setEnabled(not why_not)
        set_tooltip(self, why_not or tooltip)
        self.setAccessibleDescription(why_not or tooltip)

    def set_mark(self, sign: Sign, tone: Tone) -> None:
        """Show a sign before the words, in the colours of the theme."""
        if (sign, tone) != self._mark:
            self._mark = sign, tone
            self._draw_mark()

    def _draw_mark(self) -> None:
        self.setIcon(sign_icon(self, *self._mark))

    @override
    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        is_marked = self._mark[0] is not Sign.NONE
        if is_marked and event.type() in (
            QEvent.Type.PaletteChange,
            QEvent.Type.StyleChange,  # of a theme; the style sheet fixes the palette
        ):
            self._draw_mark()

    @override
    def sizeHint(self) -> QSize:
        return super().sizeHint().expandedTo(QSize(self._least_width, 0))


if TYPE_CHECKING:
    WidgetMixin = QWidget
else:  # a class of Qt's cannot be a base twice
    WidgetMixin = object

ENTER_KEYS = (Qt.Key.Key_Return, Qt.Key.Key_Enter)
PAGE_KEYS = (Qt.Key.Key_PageUp, Qt.Key.Key_PageDown)


class LeavesPageKeys(WidgetMixin):
    """Mixin before the base of a widget: leaves the step keys to the window."""

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in PAGE_KEYS:
            event.ignore()
        else:
            super().keyPressEvent(event)


def give_focus(widget: QWidget) -> None:
    """Focus a widget and make it visible.

    Qt itself would also focus widgets on hidden pages, and take the focus from a field
    in use.
    """
    if widget.isVisible():
        widget.setFocus(Qt.FocusReason.OtherFocusReason)


W = TypeVar("W", bound=QWidget)


class LazyWidget(QWidget, Generic[W]):
    """Holds the place of a widget that may never be seen."""

    made = Signal(object)  # QWidget

    def __init__(self, make: Callable[[], W]) -> None:
        super().__init__()
        self._make = make
        self._content: W | None = None

        # Layout
        self._layout = vertical_layout(self)

    def content(self) -> W:
        """Return the widget, made now if it has not been."""
        if self._content is None:
            self._content = self._make()
            self._layout.addWidget(self._content)
            self._content.show()  # as it is added while this is being shown
            self.made.emit(self._content)
        return self._content

    def content_so_far(self) -> W | None:
        """Return the widget if it is made."""
        return self._content

    @override
    def showEvent(self, event: QShowEvent) -> None:
        self.content()
        super().showEvent(event)


class FileDrops(QObject):
    """Accepts one local file or folder dropped on a widget.

    The widget becomes its parent; a drop on one of the widget's children counts as
    well.
    """

    dropped = Signal(str)  # the path

    def __init__(self, place: QWidget) -> None:
        super().__init__(place)
        place.setAcceptDrops(True)
        for edit in place.findChildren(QLineEdit):
            edit.setAcceptDrops(False)  # it would take the text of an address
        place.installEventFilter(self)

    @override
    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if not isinstance(event, QDropEvent):  # also entering and moving
            return False
        path = _path_of(event.mimeData())
        if not path:
            return False
        event.acceptProposedAction()
        if event.type() == QEvent.Type.Drop:
            self.dropped.emit(path)
        return True


def _path_of(data: QMimeData) -> str:
    """Return the path of the only file that is held, or nothing."""
    urls = data.urls()
    return urls[0].toLocalFile() if len(urls) == 1 and urls[0].isLocalFile() else ""


def open_folder(folder: Path) -> str:
    """Open a folder in the file manager, or return a message with its path."""
    if QDesktopServices.openUrl(QUrl.fromLocalFile(str(folder))):
        return ""
    words = QCoreApplication.translate(
        "opened_folder", "No file manager found. Folder: {0}"
    )
    return words.format(folder)


def ask_file(
    parent: QWidget, title: str, path: Path, then: Callable[[Path], object]
) -> None:
    """Ask for a file to save, with a suggested path, and pass it on."""
    suffix = path.suffix
    dialog = QFileDialog(parent, title)
    dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
    dialog.setNameFilter(f"{suffix[1:].upper()} (*{suffix})")
    dialog.setDefaultSuffix(suffix[1:])
    dialog.setDirectory(str(path.parent))
    dialog.selectFile(path.name)
    dialog.fileSelected.connect(lambda chosen: then(Path(chosen)))
    dialog.open()
