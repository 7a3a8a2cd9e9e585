"""About box: program and versions."""

from collections.abc import Mapping

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QDialog, QDialogButtonBox, QWidget

from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.widgets.fitted_window import FittedWindow


class About(FittedWindow, QDialog):
    """Names, versions and licences; the text can be copied into a report."""

    log_requested = Signal()  # open the folder of the log

    def __init__(
        self, versions: Mapping[str, str], parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle(self.tr("About Lightpen"))
        self.setMinimumWidth(60 * GRID)

        # Widgets
        heading = text_label(TextSize.TITLE)
        heading.setText("Lightpen")
        purpose = text_label(TextSize.BODY)
        purpose.setText(self.tr("Calibration of the probe tip of a light pen"))
        self._versions = text_label(TextSize.BODY)
        self._versions.setText(
            "\n".join(f"{name} {number}" for name, number in versions.items())
        )
        licences = text_label(TextSize.SMALL, Tone.QUIET)
        licences.setText(
            self.tr(
                "Lightpen: MIT licence. Qt, PySide6 and psycopg: LGPL 3. FFmpeg, "
                "which some installations of OpenCV contain: LGPL 2.1. Fonts: cut from "
                "Noto Sans and Noto Sans CJK, SIL Open Font License 1.1."
            )
        )
        for label in (self._versions, licences):
            label.setTextInteractionFlags(
                Qt.TextInteractionFlag.TextSelectableByMouse
                | Qt.TextInteractionFlag.TextSelectableByKeyboard
            )
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        role = QDialogButtonBox.ButtonRole.ActionRole
        log = buttons.addButton(self.tr("Open the log"), role)

        # Layout
        parts = (heading, purpose, self._versions, licences, buttons)
        vertical_layout(self, *parts, spacing=2 * GRID, margins=3 * GRID)

        # Connections
        buttons.rejected.connect(self.reject)
        log.clicked.connect(self.log_requested)
