"""The data folder and its other users."""

from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QGroupBox

from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.theme import TextSize, Tone, text_label
from lightpen_app.look.words import breakable
from lightpen_app.widgets.opened_folder import open_folder
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.sign_label import SignLabel, StatusMessage
from lightpen_app.widgets.translated import Translated
from lightpen_app.work.notifications import Notifications


class DataFolderPanel(Translated, QGroupBox):
    """Shows and opens the data folder, and other windows that use it."""

    change_requested = Signal()  # choose another folder

    def __init__(self, folder: Path, notifications: Notifications) -> None:
        super().__init__()
        self.say(self, self.tr("Data folder"))
        self._folder = folder
        self._notices = notifications
        self._n_others = 0
        self._fault = ""

        # Widgets
        self._path = text_label(TextSize.SMALL, Tone.QUIET)
        self._path.setText(breakable(str(folder)))
        self._open = self.say(
            PushButton(),
            self.tr("Open folder"),
            name=self.tr("Open the data folder"),
            tip=self.tr("Location of swings and results"),
        )
        self._change = self.say(
            PushButton(),
            self.tr("Change..."),
            name=self.tr("Choose another data folder"),
            tip=self.tr(
                "Save swings and results in another folder from the next start."
            ),
        )
        self._others = SignLabel()
        self._doubt = SignLabel()

        # Layout
        layout = vertical_layout(self)
        fill(layout, self._path)
        horizontal_layout(layout, self._open, self._change, 1)
        fill(layout, self._doubt, self._others)

        # Connections
        self._open.clicked.connect(self._on_open_clicked)
        self._change.clicked.connect(self.change_requested)

        self._retranslate()

    def set_others(self, n_others: int) -> None:
        """Show the number of other windows that use the folder."""
        self._n_others = n_others
        self._retranslate()

    def set_fault(self, fault: str) -> None:
        """Show why the folder cannot be written; an empty text ends it."""
        self._fault = fault
        self._retranslate()

    def _on_open_clicked(self) -> None:
        self._notices.show_status(open_folder(self._folder))

    def _retranslate(self) -> None:
        self._change.setProperty("inviting", bool(self._fault))
        self._change.style().polish(self._change)
        doubt = StatusMessage.fault(breakable(self._fault))
        self._doubt.set_value(doubt if self._fault else StatusMessage())
        remark = StatusMessage()
        if self._n_others:
            text = self.tr(
                "The program is open in other windows using the same data folder "
                "({0}). Results are shared."
            ).format(self._n_others)
            remark = StatusMessage.warning(text)
        self._others.set_value(remark)
