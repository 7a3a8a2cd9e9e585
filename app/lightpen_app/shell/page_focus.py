"""Where the focus is while a page is shown."""

from collections.abc import Callable

from PySide6.QtCore import QObject, Qt
from PySide6.QtWidgets import QAbstractButton, QApplication, QWidget

from lightpen_app.steps.page import Page


class PageFocus(QObject):
    """Puts the focus on the page that is shown, and back where what had it vanishes.

    Parameters
    ----------
    window : QWidget
        That the page is in.
    page : callable
        Returns it.
    otherwise : callable
        Takes the focus where no control of the page does.
    """

    def __init__(
        self,
        window: QWidget,
        page: Callable[[], Page],
        otherwise: Callable[[], None],
    ) -> None:
        super().__init__(window)
        self._window = window
        self._page = page
        self._otherwise = otherwise

        # Connections
        application = QApplication.instance()
        assert isinstance(application, QApplication)
        application.focusChanged.connect(self._on_focus_changed)

    def set(self) -> None:
        """Put the focus on the control that the page chose, or on its first one."""
        page = self._page()
        first = page.first_control()
        if first is not None:
            first.setFocus(Qt.FocusReason.TabFocusReason)
            return
        widget = page.nextInFocusChain()
        while widget is not None and page.isAncestorOf(widget):
            takes_tab = bool(widget.focusPolicy() & Qt.FocusPolicy.TabFocus)
            if takes_tab and widget.isEnabled() and widget.isVisibleTo(page):
                widget.setFocus(Qt.FocusReason.TabFocusReason)
                return
            widget = widget.nextInFocusChain()
        self._otherwise()

    def _on_focus_changed(self, before: QWidget | None, now: QWidget | None) -> None:
        """Let the page choose where the focus goes when what had it has vanished.

        Qt gives it to whatever comes next, such as a button that Enter then presses.
        """
        if not isinstance(now, QAbstractButton) or now.window() is not self._window:
            return
        if before is None or before.isVisible():
            return
        if self._page().isAncestorOf(before):
            self.set()
