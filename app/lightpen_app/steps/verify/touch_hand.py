"""Buttons for the simulated operator who touches, where the pen is simulated."""

from PySide6.QtWidgets import QFrame, QHBoxLayout, QToolButton, QWidget
from typing_extensions import override

from lightpen.simulator.toucher import Artefacts
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated
from lightpen_app.work.live_view import LiveView


class TouchHand(Translated, QFrame):
    """Lets the simulated operator touch, or lift the pen; hidden with a real pen.

    Parameters
    ----------
    live : LiveView
        Whose operator it is.
    """

    def __init__(self, live: LiveView, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("area", "panel")
        self._live = live

        # Widgets
        self._touch = PushButton()
        self._touch.setCheckable(True)
        self._touch.setProperty("inviting", True)
        self._sizes = text_label(TextSize.SMALL, Tone.QUIET)
        self._lift = QToolButton()

        # Layout
        layout = QHBoxLayout(self)
        layout.setContentsMargins(GRID, GRID // 2, GRID, GRID // 2)
        layout.setSpacing(2 * GRID)
        layout.addWidget(self._touch)
        layout.addWidget(self._sizes, 1)
        layout.addWidget(self._lift)

        # Connections
        self._touch.toggled.connect(live.set_touching)
        self._lift.clicked.connect(self._on_lift_clicked)
        live.connection_changed.connect(self._on_connection_changed)

        self._retranslate()
        self._on_connection_changed()

    def stop(self) -> None:
        """Leave the operator to others."""
        self._touch.setChecked(False)

    @override
    def _retranslate(self) -> None:
        artefacts = Artefacts()
        self.setAccessibleName(self.tr("Simulated pen"))
        self._touch.setText(self.tr("Let the simulated operator touch"))
        self._touch.setToolTip(self.tr("It touches whatever is asked for by itself."))
        sizes = self.tr("Its ring has a radius of {0} mm, its bar a length of {1} mm.")
        self._sizes.setText(
            sizes.format(f"{artefacts.ring_radius:g}", f"{artefacts.length:g}")
        )
        self._lift.setText(self.tr("Lift"))
        self._lift.setToolTip(self.tr("Take the tip away for a moment."))

    def _on_connection_changed(self) -> None:
        operator = self._live.operator
        self.setVisible(operator is not None)
        if self._touch.isChecked():
            self._live.set_touching(operator is not None)  # of a camera opened anew

    def _on_lift_clicked(self) -> None:
        if operator := self._live.operator:
            operator.lift()
