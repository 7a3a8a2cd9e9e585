"""Panel for a first start: introduction and trial."""

import sys

from PySide6.QtCore import QProcess, Qt, Signal
from PySide6.QtWidgets import QDialog, QDialogButtonBox, QGroupBox, QWidget

from lightpen_app.look.layouts import grid_layout, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.tooltips import set_tooltip
from lightpen_app.steps.start.pictures import Pictures
from lightpen_app.widgets.fitted_window import FittedWindow
from lightpen_app.widgets.page_scroll import PageScroll
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated

WIDTH = 112 * GRID  # px


class Introduction(FittedWindow, QDialog):
    """Shows item, method and steps."""

    trial_requested = Signal()  # calibrate a simulated pen

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
        scroll = PageScroll()
        scroll.setWidget(pictures)
        margins = 3 * GRID
        vertical_layout(self, (scroll, 1), buttons, spacing=2 * GRID, margins=margins)
        height = pictures.heightForWidth(WIDTH - 2 * margins)
        self.resize(WIDTH, height + buttons.sizeHint().height() + 3 * margins)

        # Connections
        buttons.rejected.connect(self.reject)
        buttons.accepted.connect(self.accept)
        self.accepted.connect(self.trial_requested)


DEMO = (sys.executable, ["-m", "lightpen_app", "--demo"])


class NewcomerPanel(Translated, QGroupBox):
    """Introduces the program, plays the demo, and starts a trial."""

    trial_requested = Signal()  # calibrate a simulated pen

    def __init__(self) -> None:
        super().__init__()

        # Widgets
        self._words = text_label(TextSize.BODY, Tone.QUIET)
        self._try = PushButton()
        self._explain = PushButton()
        self._play = PushButton()

        # Layout
        self._layout = grid_layout(self)
        self._layout.addWidget(self._words, 0, 0, 1, 2)
        self.set_wide(False)

        # Connections
        self._try.clicked.connect(self.trial_requested)
        self._explain.clicked.connect(self._on_explain_clicked)
        self._play.clicked.connect(self._on_play_clicked)

        self._retranslate()

    def set_wide(self, wide: bool) -> None:
        """Put its buttons in one row without words, or below them."""
        layout = self._layout
        self._words.setHidden(wide)
        if wide:
            for column, button in enumerate((self._try, self._explain, self._play)):
                layout.addWidget(button, 1, column)
        else:
            layout.addWidget(self._try, 1, 0, 1, 2)
            layout.addWidget(self._explain, 2, 0)
            layout.addWidget(self._play, 2, 1)

    def set_why_not(self, why_not: str) -> None:
        """Show why the trial cannot start; empty if it can."""
        self._try.set_why_not(why_not)

    def _on_explain_clicked(self) -> None:
        introduction = Introduction(self.window())
        introduction.trial_requested.connect(self._try.click)
        introduction.open()

    def _on_play_clicked(self) -> None:
        QProcess.startDetached(*DEMO)

    def _retranslate(self) -> None:
        self.setTitle(self.tr("New here?"))
        self._words.setText(
            self.tr(
                "Try the whole procedure without a pen or a camera. Simulated "
                "results are stored apart from real tips."
            )
        )
        self._try.setText(self.tr("Try it with a simulated pen"))
        self._explain.setText(self.tr("What is this?"))
        self._play.setText(self.tr("Play the demo"))
        set_tooltip(
            self._play,
            self.tr("Opens another window that runs through all steps automatically."),
        )
