"""Buttons that lean and cover the simulated pen, where nobody can take it in hand."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QHBoxLayout, QWidget

from lightpen_app.look.theme import GRID
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated
from lightpen_app.work.live_view import LiveView

COVERED = (1, 2, 3)  # LEDs
COVER_S = 3.0


class HandRow(Translated, QWidget):
    """Has the simulated operator show the pen; hidden with a real one.

    Parameters
    ----------
    live : LiveView
        Whose operator it is.
    """

    def __init__(self, live: LiveView, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._live = live

        # Widgets
        self._lean = PushButton()
        self._lean.setCheckable(True)
        self._cover = PushButton()

        # Layout
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GRID)
        for button in (self._lean, self._cover):
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            layout.addWidget(button, 1)

        # Connections
        self._lean.toggled.connect(self._on_lean_toggled)
        self._cover.clicked.connect(self._on_cover_clicked)
        live.connection_changed.connect(self._refresh)

        self._retranslate()
        self._refresh()

    def rest(self) -> None:
        """Let the pen be held still."""
        self._lean.setChecked(False)

    def _refresh(self) -> None:
        is_simulated = self._live.operator is not None
        self.setVisible(is_simulated)
        if not is_simulated:
            self._lean.setChecked(False)

    def _on_lean_toggled(self, leans: bool) -> None:
        operator = self._live.operator
        if operator is None:
            return
        if leans:
            operator.swing()
        else:
            operator.hold()

    def _on_cover_clicked(self) -> None:
        if operator := self._live.operator:
            operator.cover(COVER_S, COVERED)

    def _retranslate(self) -> None:
        for button, text, tip in (
            (
                self._lean,
                self.tr("Lean the pen"),
                self.tr("The simulated pen is leaned to all sides until you end it."),
            ),
            (
                self._cover,
                self.tr("Cover LEDs"),
                self.tr("Hold a hand before three LEDs of the simulated pen."),
            ),
        ):
            button.setText(text)
            button.setToolTip(tip)
            button.setAccessibleDescription(tip)
