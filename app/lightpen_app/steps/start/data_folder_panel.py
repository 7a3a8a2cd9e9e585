"""Where swings and results are kept, and who else uses that folder."""

from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QGroupBox, QHBoxLayout, QVBoxLayout, QWidget

from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import breakable
from lightpen_app.widgets.opened_folder import open_folder
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.sign_label import Remark, SignLabel
from lightpen_app.widgets.translated import Translated


class DataFolderPanel(Translated, QGroupBox):
    """Shows the data folder, opens it, and tells of other windows that use it.

    Parameters
    ----------
    folder : Path
        The data folder.

    Signals
    -------
    change_requested()
        Another one is to be chosen.
    told(str)
        Why the folder is not shown; empty once it is.
    """

    change_requested = Signal()
    told = Signal(str)

    def __init__(self, folder: Path, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._folder = folder
        self._n_others = 0
        self._trouble = ""

        # Widgets
        self._path = text_label(TextSize.SMALL, Tone.QUIET)
        self._path.setText(breakable(str(folder)))
        self._open = PushButton()
        self._change = PushButton()
        self._others = SignLabel()
        self._doubt = SignLabel()

        # Layout
        row = QHBoxLayout()
        row.setSpacing(2 * GRID)
        row.addWidget(self._path, 1)
        row.addWidget(self._open)
        row.addWidget(self._change)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GRID)
        layout.addLayout(row)
        layout.addWidget(self._doubt)
        layout.addWidget(self._others)

        # Connections
        self._open.clicked.connect(self._on_open_clicked)
        self._change.clicked.connect(self.change_requested)

        self._retranslate()

    def set_others(self, n_others: int) -> None:
        """Tell how many other windows of the program use the folder."""
        self._n_others = n_others
        self._retranslate()

    def set_trouble(self, trouble: str) -> None:
        """Tell why nothing can be kept in the folder; empty where it can."""
        self._trouble = trouble
        self._retranslate()

    def _on_open_clicked(self) -> None:
        self.told.emit(open_folder(self._folder))

    def _retranslate(self) -> None:
        self.setTitle(self.tr("Data folder"))
        self._open.setText(self.tr("Open folder"))
        self._open.setAccessibleName(self.tr("Open the data folder"))
        self._open.setToolTip(self.tr("Swings and results are kept here."))
        self._change.setText(self.tr("Change..."))
        self._change.setAccessibleName(self.tr("Choose another data folder"))
        self._change.setToolTip(
            self.tr("Keep swings and results elsewhere from the next start on.")
        )
        self._change.setProperty("inviting", bool(self._trouble))
        self._change.style().polish(self._change)
        doubt = Remark(breakable(self._trouble), Sign.CROSS, Tone.BAD)
        self._doubt.set_value(doubt if self._trouble else Remark())
        remark = Remark()
        if self._n_others:
            text = self.tr(
                "Other windows of the program that use this folder: {0}. All of them "
                "put their tips in force here."
            ).format(self._n_others)
            remark = Remark(text, Sign.WARNING, Tone.WARN)
        self._others.set_value(remark)
