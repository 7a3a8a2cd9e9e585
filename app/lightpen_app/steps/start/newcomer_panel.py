"""What somebody needs who has never seen the program: what it is, and a trial of it."""

import sys

from PySide6.QtCore import QProcess, Signal
from PySide6.QtWidgets import QGridLayout, QGroupBox, QWidget

from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.steps.start.introduction import Introduction
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated

DEMO = (sys.executable, ["-m", "lightpen_app", "--demo"])


class NewcomerPanel(Translated, QGroupBox):
    """Explains the program, plays its demo, and lets it be tried out.

    Signals
    -------
    trial_requested()
        A simulated pen is to be calibrated.
    """

    trial_requested = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)

        # Widgets
        self._words = text_label(TextSize.BODY, Tone.QUIET)
        self._try = PushButton()
        self._explain = PushButton()
        self._play = PushButton()

        # Layout
        layout = self._layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GRID)
        layout.addWidget(self._words, 0, 0, 1, 2)
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
        """Say why nothing can be tried out now, or let it."""
        self._try.set_why_not(why_not)

    def _on_explain_clicked(self) -> None:
        introduction = Introduction(self.window())
        introduction.trial_requested.connect(self._try.click)
        introduction.open()

    def _on_play_clicked(self) -> None:
        """Play the demo in a window of its own, which leaves this one as it is."""
        QProcess.startDetached(*DEMO)

    def _retranslate(self) -> None:
        self.setTitle(self.tr("New here?"))
        self._words.setText(
            self.tr(
                "No pen and no camera are needed to see how it goes. What is simulated "
                "is kept apart from real tips."
            )
        )
        self._try.setText(self.tr("Try it with a simulated pen"))
        self._explain.setText(self.tr("What is this?"))
        self._play.setText(self.tr("Play the demo"))
        self._play.setToolTip(
            self.tr("In another window, which goes through all steps by itself.")
        )
