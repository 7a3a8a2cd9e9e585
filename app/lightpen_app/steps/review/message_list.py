"""A compact list of status messages."""

from collections.abc import Sequence

from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import QFrame, QSizePolicy, QVBoxLayout, QWidget
from typing_extensions import override

from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.page_scroll import PageScroll
from lightpen_app.widgets.sign_label import SignLabel, StatusMessage

MOST = 10 * GRID  # px of height; more is scrolled


class StatusMessageList(PageScroll):
    """Shows messages; hidden while there are none."""

    def __init__(self) -> None:
        super().__init__()
        self._value: tuple[StatusMessage, ...] = ()
        self._labels: list[SignLabel] = []
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

        # Widgets
        self._list = QWidget()

        # Layout
        self._layout = vertical_layout(self._list, spacing=GRID // 2)
        self._layout.setSizeConstraint(QVBoxLayout.SizeConstraint.SetMinimumSize)
        self.setWidget(self._list)

        self.hide()

    def value(self) -> tuple[StatusMessage, ...]:
        """Return the remarks that are shown."""
        return self._value

    def set_value(self, value: Sequence[StatusMessage]) -> None:
        """Show other remarks."""
        value = tuple(value)
        if value == self._value:
            return
        self._value = value
        self.setAccessibleName(" ".join(remark.text for remark in value))
        while len(self._labels) < len(value):
            label = SignLabel()
            self._labels.append(label)
            self._layout.addWidget(label)
        for i, label in enumerate(self._labels):
            label.set_value(value[i] if i < len(value) else StatusMessage())
        self.setVisible(bool(value))
        self.updateGeometry()

    @override
    def sizeHint(self) -> QSize:
        width = max(self.width(), 20 * GRID)
        height = self._layout.totalHeightForWidth(width)
        if height < 0:
            height = self._layout.totalSizeHint().height()
        return QSize(width, min(height, MOST))

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(20 * GRID, self.sizeHint().height())
