"""The part of a page that scrolls when the window is small."""

from PySide6.QtCore import QSize, Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QScrollArea, QWidget
from typing_extensions import override

from lightpen_app.look.layouts import vertical_layout
from lightpen_app.widgets.fitted_window import fit_screen


class PageScroll(QScrollArea):
    """Scrolls to the control that has the focus, and takes no key for itself.

    The page keys, which a presenter's remote sends, are left to the window.
    """

    height_changed = Signal(int)  # of the visible part, px

    def __init__(self) -> None:
        super().__init__()
        self.setWidgetResizable(True)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._revealed: QWidget | None = None  # until its user scrolls

        # Connections
        bar = self.verticalScrollBar()
        bar.rangeChanged.connect(self._on_range_changed)
        bar.actionTriggered.connect(self._forget_revealed)

    @override
    def setWidget(self, widget: QWidget) -> None:
        """Set the content, with the background of the parent."""
        super().setWidget(widget)
        widget.setAutoFillBackground(False)
        self.viewport().setAutoFillBackground(False)

    def reveal(self, widget: QWidget) -> None:
        """Scroll to a widget whose text may have grown."""
        content, around = self.widget(), widget.parentWidget()
        assert content is not None
        while around is not None and around is not self:
            layout = around.layout()
            if layout is not None:
                layout.activate()  # as pending events would do later
            around = around.parentWidget()
        content.resize(content.width(), content.heightForWidth(content.width()))
        self._revealed = widget
        self.ensureWidgetVisible(widget, 0, 0)

    @override
    def focusNextPrevChild(self, next: bool) -> bool:
        self._forget_revealed()
        return super().focusNextPrevChild(next)

    def _on_range_changed(self) -> None:
        """Keep the revealed widget visible while others change."""
        if self._revealed is not None:
            self.ensureWidgetVisible(self._revealed, 0, 0)

    def _forget_revealed(self) -> None:
        self._revealed = None

    @override
    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.height_changed.emit(event.size().height())

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        event.ignore()


class DialogScroll(PageScroll):
    """The fields of a dialog, scrolled only if the screen is too small.

    Qt opens a dialog with two thirds of the screen at most.
    """

    @override
    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if not event.spontaneous():
            size = self.window().size()
            QTimer.singleShot(0, self, lambda: self._grow(size))

    def _grow(self, size: QSize) -> None:
        window, bar = self.window(), self.verticalScrollBar()
        while bar.maximum() and window.size() == size:
            window.resize(size.width(), size.height() + bar.maximum())
            fit_screen(window)
            if window.height() <= size.height():
                return
            size = window.size()

    @override
    def sizeHint(self) -> QSize:
        content = self.widget()
        return super().sizeHint() if content is None else content.sizeHint()


class ShrinkingScrollContent(QWidget):
    """Content that scrolls only once it cannot be made smaller.

    Other content with words that wrap, and this where it is not to be squeezed, scrolls
    as soon as it has less than the height for which it asks. Without ``content``, the
    caller lays it out.
    """

    def __init__(self, content: QWidget | None = None) -> None:
        super().__init__()
        self._is_squeezed = True
        if content is not None:
            vertical_layout(self, content)

    def set_squeezed(self, squeezed: bool) -> None:
        """Allow the minimum size, or give the size hint."""
        self._is_squeezed = squeezed
        self.updateGeometry()

    @override
    def heightForWidth(self, width: int) -> int:
        if self._is_squeezed:
            return self.minimumSizeHint().height()
        return super().heightForWidth(width)
