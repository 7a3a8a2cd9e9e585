"""What can be done with a tip besides: look at its files, copy it, save it."""

from enum import Enum, auto

from PySide6.QtCore import Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QHBoxLayout, QMenu, QWidget

from lightpen_app.look.theme import GRID
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated


class Export(Enum):
    """What is saved."""

    ALL = auto()
    JSON = auto()
    CSV = auto()
    PLOTS = auto()


class ResultTools(Translated, QWidget):
    """Three buttons; that to save has a menu.

    Signals
    -------
    folder_requested()
        The folder of the swing is to be opened.
    copy_requested()
        The tip is to be put on the clipboard.
    save_requested(Export)
    paper_requested()
        The record on paper is to be shown.
    """

    folder_requested = Signal()
    copy_requested = Signal()
    save_requested = Signal(object)
    paper_requested = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)

        # Widgets
        self._folder = PushButton()
        self._copy = PushButton()
        self._save = PushButton()
        self._save.setProperty("menu", True)
        menu = QMenu(self._save)
        self._exports: dict[Export, QAction] = {
            export: menu.addAction("") for export in Export
        }
        menu.addSeparator()
        menu.setToolTipsVisible(True)
        self._paper = menu.addAction("")
        self._save.setMenu(menu)
        self._buttons = (self._folder, self._copy, self._save)

        # Layout
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GRID)
        for button in self._buttons:
            layout.addWidget(button, 1)

        # Connections
        self._folder.clicked.connect(self.folder_requested)
        self._copy.clicked.connect(self.copy_requested)
        for export, action in self._exports.items():
            action.triggered.connect(
                lambda _=False, export=export: self.save_requested.emit(export)
            )
        self._paper.triggered.connect(self.paper_requested)

        self._retranslate()

    def set_why_not(self, why_not: str) -> None:
        """Disable all and say why not, or enable them."""
        told = (
            self.tr("Open the folder of the swing"),
            self.tr("Copy x, y, z in mm, parted by tabs"),
            self.tr("Save results and plots under the name of pen, tip and date"),
        )
        for button, words in zip(self._buttons, told, strict=True):
            button.set_why_not(why_not, words)

    def set_paper_why_not(self, why_not: str) -> None:
        """Offer no record on paper and say why not, or offer it."""
        self._paper.setEnabled(not why_not)
        told = self.tr("Look at it, save it as PDF, or print it")
        self._paper.setToolTip(why_not or told)

    def _retranslate(self) -> None:
        self._paper.setText(self.tr("Record on paper..."))
        self._folder.setText(self.tr("Open folder"))
        self._copy.setText(self.tr("Copy the tip"))
        self._save.setText(self.tr("Save..."))
        for export, text in (
            (Export.ALL, self.tr("All at once...")),
            (Export.JSON, self.tr("Record (JSON)...")),
            (Export.CSV, self.tr("Tip and images (CSV)...")),
            (Export.PLOTS, self.tr("All plots (PNG)...")),
        ):
            self._exports[export].setText(text)
