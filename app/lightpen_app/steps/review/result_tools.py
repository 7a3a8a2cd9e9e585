"""Buttons for the result: copy the tip, save it, press test."""

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QMenu, QWidget

from lightpen.record.exports.formats import TABLE_FORMATS, ExportFormat
from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.look.sentences import listed, worded
from lightpen_app.look.tooltips import set_tooltip
from lightpen_app.widgets.translated import Translated


@dataclass(frozen=True)
class Export:
    """Format to save."""

    formats: tuple[ExportFormat, ...]
    has_plots: bool = False


TABLES = TABLE_FORMATS[:3]  # without the text that is pasted
ALL, PLOTS = Export(TABLES, has_plots=True), Export((), has_plots=True)


class ResultTools(Translated, QWidget):
    """Three buttons; that to save has a menu, also with formats of extensions."""

    folder_requested = Signal()  # open the folder of the swing
    copy_requested = Signal()  # copy the tip to the clipboard
    save_requested = Signal(object)  # Export
    report_requested = Signal()  # show the printed report
    press_requested = Signal()  # start the press test

    def __init__(self, formats: Sequence[ExportFormat] = ()) -> None:
        super().__init__()
        single = [Export((each,)) for each in (*TABLE_FORMATS, *formats)]

        # Widgets
        self._copy = self.make_button(self.tr("Copy tip"), self.copy_requested)
        self._save = self.make_button(self.tr("Save..."))
        self._save.setProperty("menu", True)
        menu = QMenu(self._save)
        menu.setToolTipsVisible(True)
        self._report = self.say(menu.addAction(""), self.tr("Calibration report..."))
        usual = [each for each in single if each.formats[0].name == "csv"]
        others = [each for each in single if each not in usual]
        self._actions = [(export, menu.addAction("")) for export in (*usual, ALL)]
        self._others = self.say(menu.addMenu(""), self.tr("Other formats"))
        self._others.setToolTipsVisible(True)
        self._actions += [
            (export, self._others.addAction("")) for export in (*others, PLOTS)
        ]
        menu.addSeparator()
        self._folder = self.say(
            menu.addAction(""),
            self.tr("Open folder"),
            tip=self.tr("Open the folder of the swing"),
        )
        self._save.setMenu(menu)
        self._press = self.make_button(self.tr("Press test"), self.press_requested)

        # Layout
        horizontal_layout(self, (self._copy, 1), (self._save, 1), (self._press, 1))

        # Connections
        for export, action in self._actions:
            action.triggered.connect(
                lambda _=False, export=export: self.save_requested.emit(export)
            )
        self._report.triggered.connect(self.report_requested)
        self._folder.triggered.connect(self.folder_requested)

        self._retranslate()

    def set_why_not(self, why_not: str) -> None:
        """Disable all with a reason, or enable them."""
        words = self.tr("Copy x, y, z in mm, separated by tabs")
        self._copy.set_why_not(why_not, words)
        words = self.tr("Save results and plots, named by pen, tip and date")
        self._save.set_why_not(why_not, words)

    def set_report_why_not(self, why_not: str) -> None:
        """Disable the report with a reason, or enable it."""
        self._report.setEnabled(not why_not)
        tooltip = self.tr("Preview, save as PDF, or print")
        set_tooltip(self._report, why_not or tooltip)

    def set_press_why_not(self, why_not: str) -> None:
        """Disable the press test with a reason, or enable it."""
        tooltip = self.tr(
            "Swing again with firm pressure and compare: shows a stylus that gives way"
        )
        self._press.set_why_not(why_not, tooltip)

    def _retranslate(self) -> None:
        for export, action in self._actions:
            action.setText(self._name(export) + "...")
            described = (worded(each.description) for each in export.formats)
            set_tooltip(action, listed(described))

    def _name(self, export: Export) -> str:
        if export == ALL:
            return self.tr("Record, tables and plots")
        if export == PLOTS:
            return self.tr("All plots (PNG)")
        return worded(export.formats[0].label)
