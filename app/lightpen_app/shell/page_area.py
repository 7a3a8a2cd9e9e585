"""The part of the window that the page has: its title and lead, over them a notice."""

from collections.abc import Sequence

from PySide6.QtCore import QPoint, QRect
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QApplication,
    QBoxLayout,
    QFrame,
    QSizePolicy,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)
from typing_extensions import override

from lightpen_app.look.theme import GRID, TextSize, Tone, set_tone, text_label
from lightpen_app.shell.notice_bar import NoticeBar
from lightpen_app.widgets.rearranged import Room


class PageArea(QFrame):
    """Shows one page of several.

    A notice lies over it and moves nothing, so that a key pressed meanwhile reaches
    what it was meant for.

    Parameters
    ----------
    pages : sequence of QWidget
        At least one; the first is shown.
    """

    def __init__(self, pages: Sequence[QWidget], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("page_area")
        self._pages = tuple(pages)

        # Widgets: the order of making them is the order of the Tab key
        self._notice = NoticeBar(self)
        self._title = text_label(TextSize.TITLE)
        self._title.setWordWrap(False)
        self._lead = text_label(TextSize.BODY, Tone.QUIET)
        self._stack = QStackedWidget()
        self._stack.setMinimumSize(1, 1)  # the pages ask for none: they scroll
        for page in self._pages:
            self._stack.addWidget(page)

        # Layout
        self._heading = QBoxLayout(QBoxLayout.Direction.TopToBottom)
        self._heading.addWidget(self._title)
        self._heading.addWidget(self._lead, 1)
        self._layout = layout = QVBoxLayout(self)
        layout.setSpacing(GRID)
        layout.addSpacing(GRID)
        layout.addLayout(self._heading)
        layout.addSpacing(GRID)
        layout.addWidget(self._stack, 1)

        # Connections
        self._notice.value_changed.connect(self._place_notice)

        self.show_page(self._pages[0])

    def notice(self) -> NoticeBar:
        """Return the bar of the notice."""
        return self._notice

    @override
    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._place_notice()

    def words(self) -> tuple[str, ...]:
        """Return what is said about the page."""
        return self._notice.text(), self._title.text(), self._lead.text()

    def show_page(self, page: QWidget) -> None:
        """Show a page; only that one may ask for room."""
        for each in self._pages:
            policy = QSizePolicy.Policy
            wish = policy.Preferred if each is page else policy.Ignored
            each.setSizePolicy(wish, wish)
        self._stack.setCurrentWidget(page)

    def set_heading(self, title: str, lead: str, tone: Tone = Tone.QUIET) -> None:
        """Say which page it is, and what to do on it."""
        self._title.setText(title)
        self._lead.setText(lead)
        set_tone(self._lead, tone)
        self._lead.setVisible(bool(lead))

    def set_room(self, room: Room) -> None:
        """Arrange title, lead and margins as the size of the window allows."""
        side = room.margin
        if room.is_low:
            self._layout.setContentsMargins(side, 0, side, GRID)
            self._heading.setDirection(QBoxLayout.Direction.LeftToRight)
            self._heading.setSpacing(3 * GRID)
        else:
            self._layout.setContentsMargins(side, 2 * GRID, side, 3 * GRID)
            self._heading.setDirection(QBoxLayout.Direction.TopToBottom)
            self._heading.setSpacing(GRID)

    def _place_notice(self) -> None:
        """Lay the notice over title and lead, but not over what is typed in."""
        notice = self._notice
        width = self.width() - 2 * GRID
        place = QRect(GRID, GRID // 2, width, notice.heightForWidth(width))
        focused = QApplication.focusWidget()
        if focused is not None and self._stack.isAncestorOf(focused):
            corner = focused.mapTo(self, QPoint(0, 0))
            if place.intersects(QRect(corner, focused.size())):
                place.moveBottom(self.height() - GRID)
        notice.setGeometry(place)
        notice.raise_()
