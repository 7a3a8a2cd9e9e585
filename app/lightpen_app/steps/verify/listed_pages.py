"""Pages with a list beside or a field above them."""

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRectF, Qt
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import (
    QFrame,
    QListWidget,
    QSizePolicy,
    QStackedWidget,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QWidget,
)
from typing_extensions import override

from lightpen_app.look.layouts import horizontal_layout, set_stacked
from lightpen_app.look.signs import Sign, draw_sign
from lightpen_app.look.theme import GRID, Tone, colors_of
from lightpen_app.widgets.choice_field import ChoiceField
from lightpen_app.widgets.responsive_layout import NO_ROOM, ResponsiveLayout

ROOM = GRID  # px, beside the longest title
STATE_ROOM = 3 * GRID  # px, of the state that a title gets later
MARK = Qt.ItemDataRole.UserRole  # sign and tone of a title


class _Cards(QStyledItemDelegate):
    """Draws the sign of a title at the left of it."""

    def __init__(self, place: QWidget) -> None:
        super().__init__(place)
        self._place = place

    @override
    def paint(
        self,
        painter: QPainter,
        option: QStyleOptionViewItem,
        index: QModelIndex | QPersistentModelIndex,
    ) -> None:
        super().paint(painter, option, index)
        sign, tone = index.data(MARK) or (Sign.NONE, Tone.PLAIN)
        box = QRectF(option.rect)
        box.setRect(box.left() + GRID, box.top(), 2 * GRID, box.height())
        draw_sign(painter, box, sign, colors_of(self._place.palette()).tone(tone))


class ListedPages(ResponsiveLayout, QWidget):
    """Shows the page of the selected title."""

    narrow_below = 119 * GRID  # px; then the titles are in a field above the page

    def __init__(self) -> None:
        super().__init__()
        self._room = NO_ROOM

        # Widgets
        self._list = QListWidget()
        self._list.setObjectName("task_list")
        self._list.setItemDelegate(_Cards(self))
        self._list.setSpacing(1)
        self._list.setFrameShape(QFrame.Shape.NoFrame)
        never = Qt.ScrollBarPolicy.ScrollBarAlwaysOff
        self._list.setHorizontalScrollBarPolicy(never)
        self._list.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Ignored)
        self._field = ChoiceField()
        self._stack = QStackedWidget()

        # Layout
        self._columns = horizontal_layout(
            self, self._field, self._list, (self._stack, 1), spacing=2 * GRID
        )
        self._use_room()

        # Connections
        self._list.currentRowChanged.connect(self._stack.setCurrentIndex)
        self._list.currentRowChanged.connect(self._field.setCurrentIndex)
        self._field.activated.connect(self._list.setCurrentRow)

    def add(self, page: QWidget) -> None:
        """Add a page as the last one, or move it there; the first is shown."""
        is_shown = self._stack.currentWidget() is page
        self.remove(page)
        self._stack.addWidget(page)
        self._field.addItem("")
        self._list.addItem("")
        if self._list.currentRow() < 0:
            self._list.setCurrentRow(0)
        if is_shown:
            self.show_page(page)

    def remove(self, page: QWidget) -> None:
        """Leave a page to another parent."""
        index = self._stack.indexOf(page)
        if index >= 0:
            self._stack.removeWidget(page)
            self._field.removeItem(index)
            self._list.takeItem(index)

    def set_title(
        self, page: QWidget, title: str, sign: Sign = Sign.NONE, tone: Tone = Tone.PLAIN
    ) -> None:
        """Name a page, and mark its state."""
        index = self._stack.indexOf(page)
        self._list.item(index).setData(MARK, (sign, tone))
        if self._list.item(index).text() != title:
            self._list.item(index).setText(title)
            width = self._list.sizeHintForColumn(0) + ROOM
            if width > self._list.minimumWidth():  # else it stays under the pointer
                self._list.setFixedWidth(width + STATE_ROOM)
            self._field.setItemText(index, title)

    def show_page(self, page: QWidget) -> None:
        """Show a page."""
        self._list.setCurrentRow(self._stack.indexOf(page))

    def set_list_name(self, name: str) -> None:
        """Set the accessible name of the list."""
        for each in (self._list, self._field):
            each.setAccessibleName(name)

    @override
    def _use_room(self) -> None:
        is_narrow = self._room.is_narrow
        set_stacked(self._columns, is_narrow)
        self._columns.setSpacing(GRID if is_narrow else 2 * GRID)
        self._field.setVisible(is_narrow)
        self._list.setVisible(not is_narrow)
        self.setFocusProxy(self._field if is_narrow else self._list)
