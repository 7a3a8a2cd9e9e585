"""Responsive layout of widgets by the available size."""

from dataclasses import dataclass

from PySide6.QtCore import QSize
from PySide6.QtGui import QResizeEvent
from typing_extensions import override

from lightpen_app.look.theme import GRID
from lightpen_app.widgets.keys import WidgetMixin


@dataclass(frozen=True)
class SizeClass:
    """Whether a widget is short of room, in width and in height, or has plenty."""

    is_narrow: bool = False
    is_low: bool = False
    is_large: bool = False
    is_very_large: bool = False  # whether there is room for more than the essentials

    @property
    def margin(self) -> int:
        """Margin at the left and right of a page, px."""
        return 2 * GRID if self.is_narrow else 4 * GRID


NO_ROOM = SizeClass(is_narrow=True, is_low=True)


class ResponsiveLayout(WidgetMixin):
    """Mixin before the base of a widget: rearranges it when its size changes.

    The constructor of the widget arranges it once.
    """

    # px; with less width or height it is short of room.
    narrow_below = 0
    low_below = 0
    # Sizes from which the layout is large or very large; None: never.
    large_from: QSize | None = None
    very_large_from: QSize | None = None
    _room = SizeClass()

    def _use_room(self) -> None:
        """Arrange the content for the size class."""
        raise NotImplementedError

    @override
    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        size = event.size()
        room = SizeClass(
            is_narrow=size.width() < self.narrow_below,
            is_low=size.height() < self.low_below,
            is_large=_holds(size, self.large_from),
            is_very_large=_holds(size, self.very_large_from),
        )
        if room != self._room:
            self._room = room
            self._use_room()


def _holds(size: QSize, other: QSize | None) -> bool:
    """Return whether another size fits into a size, if there is one."""
    return other is not None and other.boundedTo(size) == other
