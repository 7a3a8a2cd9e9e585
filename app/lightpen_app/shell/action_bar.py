"""The action bar at the bottom: status line, Back and main button."""

from collections.abc import Callable

from PySide6.QtCore import QDeadlineTimer, Qt, Signal
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QFrame
from typing_extensions import override

from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, Tone, set_styled, text_label
from lightpen_app.widgets.page import MainAction
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.responsive_layout import SizeClass
from lightpen_app.widgets.translated import Translated

MAIN_WIDTH = 22 * GRID + 34  # px; with the padding and the border
HEIGHT, LOW_HEIGHT = 9 * GRID, 8 * GRID  # px, at least
GUARD_MS = 800  # for which keys are ignored after the main button has changed


class ActionBar(Translated, QFrame):
    """One main button, with the reason when it cannot be pressed.

    Keys are ignored for a moment after the button or the page has changed, so that a
    second Enter does nothing.
    """

    main_pressed = Signal()
    back_pressed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("bottom_bar")
        self._status_holds: Callable[[], bool] | None = None
        self._guard = QDeadlineTimer()  # expired

        # Widgets
        self._why_not = text_label(TextSize.BODY, Tone.WARN)
        self._status = text_label(TextSize.SMALL, Tone.QUIET)
        self._back = self.make_button(self.tr("Back"), self.back_pressed)
        self._main = _MainButton(MAIN_WIDTH)
        self._main.setObjectName("main_button")

        # Layout
        self._layout = horizontal_layout(self, spacing=2 * GRID)
        vertical_layout(
            self._layout, 1, self._why_not, self._status, 1, spacing=0, stretch=1
        )
        fill(self._layout, self._back, self._main)

        # Connections
        self._main.clicked.connect(self._on_main_clicked)

        self.set_room(SizeClass())
        self.set_status("")

    def set_action(self, action: MainAction, *, can_go_back: bool) -> None:
        """Show another main action."""
        if action.text != self._main.text():
            self.guard()
        self._main.setText(action.text)
        if action.why_not and self._main.hasFocus():
            self.setFocus()  # kept for the button, until it can be pressed again
        set_styled(self._main, "early", "true" if action.is_early else "")
        self._main.setEnabled(not action.why_not)
        if not action.why_not and self.hasFocus():
            self._main.setFocus()
        self._main.setAccessibleDescription(action.why_not)
        self._why_not.setText(action.why_not)
        self._why_not.setVisible(bool(action.why_not))
        if self._status_holds is not None and not self._status_holds():
            self.set_status("")
        self._refresh_status()
        self._back.setVisible(can_go_back)

    def set_status(self, text: str, holds: Callable[[], bool] | None = None) -> None:
        """Show a sentence in the status line, or none.

        It stays until there is another, or as long as it ``holds``.
        """
        self._status_holds = holds
        self._status.setText(text)
        self._status.setAccessibleName(text)
        self._refresh_status()

    def _visible_status(self) -> str:
        """Return the status, but not the same sentence twice."""
        text = self._status.text()
        return "" if text == self._why_not.text() else text

    def _refresh_status(self) -> None:
        self._status.setVisible(bool(self._visible_status()))

    def set_room(self, room: SizeClass) -> None:
        """Use less space in a small window."""
        self.setMinimumHeight(LOW_HEIGHT if room.is_low else HEIGHT)
        side = room.margin
        self._layout.setContentsMargins(side, GRID, side, GRID)

    def words(self) -> tuple[str, str]:
        """Return why the main button cannot be pressed, and the status."""
        return self._why_not.text(), self._visible_status()

    def press_main(self) -> None:
        """Press the main button, if it can be pressed."""
        if self._main.isEnabled():
            self._main.click()

    def guard(self) -> None:
        """Ignore the main button for a moment: it is about to do something else."""
        self._guard = QDeadlineTimer(GUARD_MS)

    def focus_main(self) -> None:
        """Put the focus on the main button."""
        self._main.setFocus(Qt.FocusReason.TabFocusReason)

    def _on_main_clicked(self) -> None:
        if self._guard.hasExpired():
            self.main_pressed.emit()


class _MainButton(PushButton):
    """Treats a double click as one: the second could press another page's button."""

    @override
    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        event.accept()
