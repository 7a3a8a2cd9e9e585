"""Asks for the laboratory that a Digital Calibration Certificate names."""

from dataclasses import astuple

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QDialog, QDialogButtonBox, QLineEdit, QWidget
from typing_extensions import override

from lightpen.record.exports.dcc import Laboratory, is_country
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.fitted_window import FittedWindow
from lightpen_app.widgets.labelled import add_labelled, field_label
from lightpen_app.widgets.translated import Translated

LONGEST = 200  # characters
N_FIELDS = 4


class LaboratoryDialog(FittedWindow, Translated, QDialog):
    """Name, e-mail address, city and country; can be confirmed when all are there.

    Signals
    -------
    given(Laboratory)
    """

    given = Signal(object)

    def __init__(self, known: Laboratory | None, parent: QWidget | None = None) -> None:
        super().__init__(parent)

        # Widgets
        self._edits = [QLineEdit() for _ in range(N_FIELDS)]
        self._labels = [field_label(edit) for edit in self._edits]
        standard = QDialogButtonBox.StandardButton
        self._buttons = QDialogButtonBox(standard.Ok | standard.Cancel)

        # Layout
        layout = vertical_layout(self, spacing=2 * GRID, margins=3 * GRID)
        for label, edit in zip(self._labels, self._edits, strict=True):
            add_labelled(layout, label, edit)
        layout.addWidget(self._buttons)
        self.setMinimumWidth(48 * GRID)

        # Connections
        for edit in self._edits:
            edit.setMaxLength(LONGEST)
            edit.textChanged.connect(self._refresh)
        self._buttons.accepted.connect(self._on_accepted)
        self._buttons.rejected.connect(self.reject)

        for edit, text in zip(
            self._edits, astuple(known) if known else (), strict=False
        ):
            edit.setText(text)
        self._refresh()
        self._retranslate()

    def _refresh(self) -> None:
        texts = [edit.text().strip() for edit in self._edits]
        ok = self._buttons.button(QDialogButtonBox.StandardButton.Ok)
        ok.setEnabled(all(texts) and is_country(texts[-1]))

    def _on_accepted(self) -> None:
        self.given.emit(Laboratory(*(edit.text().strip() for edit in self._edits)))
        self.accept()

    @override
    def _retranslate(self) -> None:
        self.setWindowTitle(self.tr("Calibration laboratory"))
        words = (
            self.tr("Name"),
            self.tr("E-mail address"),
            self.tr("City"),
            self.tr("Country code, two capital letters such as DE"),
        )
        for label, edit, text in zip(self._labels, self._edits, words, strict=True):
            label.setText(text)
            edit.setAccessibleName(text)
        standard = QDialogButtonBox.StandardButton
        self._buttons.button(standard.Ok).setText(self.tr("Save..."))
        self._buttons.button(standard.Cancel).setText(self.tr("Cancel"))
