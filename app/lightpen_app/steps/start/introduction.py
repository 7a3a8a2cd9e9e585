"""What the program is for, told in a window of its own."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QDialog, QDialogButtonBox, QVBoxLayout, QWidget

from lightpen_app.look.theme import GRID
from lightpen_app.steps.start.pictures import Pictures
from lightpen_app.widgets.push_button import PushButton

WIDTH = 112 * GRID  # px


class Introduction(QDialog):
    """Shows what is calibrated, how, and in which steps.

    Signals
    -------
    trial_requested()
        A simulated pen is to be calibrated.
    """

    trial_requested = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setWindowTitle(self.tr("What is this?"))

        # Widgets
        pictures = Pictures()
        buttons = QDialogButtonBox()
        close = PushButton()
        close.setText(self.tr("Close"))
        trial = PushButton()
        trial.setText(self.tr("Try it with a simulated pen"))
        buttons.addButton(close, QDialogButtonBox.ButtonRole.RejectRole)
        buttons.addButton(trial, QDialogButtonBox.ButtonRole.AcceptRole)
        trial.setDefault(True)

        # Layout
        layout = QVBoxLayout(self)
        margin = 3 * GRID
        layout.setContentsMargins(margin, margin, margin, margin)
        layout.setSpacing(2 * GRID)
        layout.addWidget(pictures)
        layout.addWidget(buttons)
        self.setFixedSize(WIDTH, layout.totalHeightForWidth(WIDTH))

        # Connections
        buttons.rejected.connect(self.reject)
        buttons.accepted.connect(self.accept)
        self.accepted.connect(self.trial_requested)
