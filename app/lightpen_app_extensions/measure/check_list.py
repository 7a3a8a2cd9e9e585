"""The list of checks or features, ticked off as they are done, each with its value."""

from dataclasses import dataclass

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRectF, Qt, Signal
from PySide6.QtGui import QFontMetricsF, QPainter
from PySide6.QtWidgets import (
    QFrame,
    QListWidget,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QWidget,
)
from typing_extensions import override

from lightpen_app.look.signs import Sign, draw_sign
from lightpen_app.look.theme import GRID, Tone, colors_of

ROW = Qt.ItemDataRole.UserRole  # a `CheckRow`
WIDTH = 38 * GRID  # px
QWIDGETSIZE_MAX = 16_777_215  # px, as PySide does not name it


@dataclass(frozen=True)
class CheckRow:
    """A check, or a value of a part, and how far it is."""

    name: str
    value: str = ""  # with U, once known
    sign: Sign = Sign.NONE
    tone: Tone = Tone.PLAIN
    verdict: str = ""  # a word, where only the sign shows it

    @property
    def words(self) -> str:
        """All of it, for a screen reader."""
        value = " ".join(filter(None, (self.value, self.verdict)))
        return f"{self.name}: {value}" if value else self.name


class _Rows(QStyledItemDelegate):
    """Draws the sign at the left, the name, and the value at the right."""

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
        row: CheckRow = index.data(ROW)
        plain = QStyleOptionViewItem(option)
        super().paint(painter, plain, index)
        colors = colors_of(self._place.window().palette())  # its own is transparent
        box = QRectF(option.rect)
        sign = QRectF(box.left() + GRID, box.top(), 2 * GRID, box.height())
        draw_sign(painter, sign, row.sign, colors.tone(row.tone))
        words = box.adjusted(4 * GRID, 0, -GRID, 0)
        metrics, middle = QFontMetricsF(option.font), Qt.AlignmentFlag.AlignVCenter
        painter.save()
        painter.setFont(option.font)
        painter.setPen(colors.tone(row.tone if row.value else Tone.PLAIN))
        painter.drawText(words, middle | Qt.AlignmentFlag.AlignRight, row.value)
        words.setRight(words.right() - metrics.horizontalAdvance(row.value) - GRID)
        quiet = Tone.QUIET if row.sign is Sign.RING else Tone.PLAIN
        painter.setPen(colors.tone(quiet))
        name = metrics.elidedText(row.name, Qt.TextElideMode.ElideRight, words.width())
        painter.drawText(words, middle | Qt.AlignmentFlag.AlignLeft, name)
        painter.restore()

    @override
    def initStyleOption(
        self, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> None:
        super().initStyleOption(option, index)
        option.text = ""  # drawn above


class CheckList(QListWidget):
    """Shows the checks; the row that is current is marked."""

    chosen = Signal(int)  # row: the user selected another one

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("task_list")
        self.setItemDelegate(_Rows(self))
        self.setSpacing(1)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setUniformItemSizes(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)

        # Connections
        self.currentRowChanged.connect(self.chosen)

    def set_wide(self, is_wide: bool) -> None:
        """Take all the room, or as much as the rows need."""
        self.setMinimumWidth(0 if is_wide else WIDTH)
        self.setMaximumWidth(QWIDGETSIZE_MAX if is_wide else WIDTH)

    def set_rows(self, rows: tuple[CheckRow, ...]) -> None:
        """Show other rows; the selection stays."""
        self.blockSignals(True)
        while self.count() > len(rows):
            self.takeItem(self.count() - 1)
        while self.count() < len(rows):
            self.addItem("")
        for i, row in enumerate(rows):
            item = self.item(i)
            if item.data(ROW) != row:
                item.setData(ROW, row)
                item.setText(row.words)
                item.setToolTip(row.words)
        self.blockSignals(False)

    def show_row(self, index: int) -> None:
        """Select a row as if nobody had."""
        if index != self.currentRow():
            self.blockSignals(True)
            self.setCurrentRow(index)
            self.blockSignals(False)
            self.scrollToItem(self.item(min(index + 1, self.count() - 1)))
