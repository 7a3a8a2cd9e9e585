"""Buttons that tilt and cover the simulated pen."""

from PySide6.QtCore import Qt
from typing_extensions import override

from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.steps.simulator_controls import SimulatorControls, set_words
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.work.live_view import LiveView

COVERED = (1, 2, 3)  # LEDs
COVER_S = 3.0


class LedSimulatorControls(SimulatorControls):
    """Has the simulated operator show the pen; hidden with a real one."""

    def __init__(self, live: LiveView) -> None:
        super().__init__(live)

        # Widgets
        self._lean = PushButton(checkable=True)
        self._cover = PushButton()

        # Layout
        horizontal_layout(self, (self._lean, 1), (self._cover, 1))
        for button in (self._lean, self._cover):
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)

        # Connections
        self._lean.toggled.connect(self._on_lean_toggled)
        self._cover.clicked.connect(self._on_cover_clicked)

        self._retranslate()
        self._follow_connection()

    def rest(self) -> None:
        """Let the pen be held still."""
        self._lean.setChecked(False)

    @override
    def _follow_connection(self) -> None:
        super()._follow_connection()
        if self._live.operator is None:
            self.rest()

    def _on_lean_toggled(self, leans: bool) -> None:
        self._command(lambda hand: hand.swing() if leans else hand.hold())

    def _on_cover_clicked(self) -> None:
        self._command(lambda operator: operator.cover(COVER_S, COVERED))

    @override
    def _retranslate(self) -> None:
        set_words(
            self._lean,
            self.tr("Tilt pen"),
            self.tr("Tilts the simulated pen to all sides until switched off"),
        )
        set_words(
            self._cover,
            self.tr("Cover LEDs"),
            self.tr("Covers three LEDs of the simulated pen"),
        )
