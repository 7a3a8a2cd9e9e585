"""Asks for the laboratory that a Digital Calibration Certificate names."""

from dataclasses import astuple, replace

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QComboBox, QDialog, QDialogButtonBox, QLineEdit, QWidget
from typing_extensions import override

from lightpen.model.laboratory import PLACES, Laboratory, is_country
from lightpen_app.look.layouts import grid_layout, vertical_layout
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.fitted_window import FittedWindow
from lightpen_app.widgets.labelled import add_labelled, field_label
from lightpen_app.widgets.translated import Translated

LONGEST = 200  # characters
N_NEEDED, N_FIELDS = 4, 7  # the others may be empty


class LaboratoryDialog(FittedWindow, Translated, QDialog):
    """Dialog for the laboratory; name, e-mail, city and country are required."""

    given = Signal(object)  # Laboratory

    def __init__(self, known: Laboratory | None, parent: QWidget | None = None) -> None:
        super().__init__(parent)

        # Widgets
        self._edits = [QLineEdit() for _ in range(N_FIELDS)]
        self._place = QComboBox()
        self._place.addItems([""] * len(PLACES))
        self._labels = [field_label(edit) for edit in (*self._edits, self._place)]
        standard = QDialogButtonBox.StandardButton
        self._buttons = QDialogButtonBox(standard.Ok | standard.Cancel)

        # Layout
        layout = vertical_layout(self, spacing=2 * GRID, margins=3 * GRID)
        grid = grid_layout(layout, spacing=(2 * GRID, 2 * GRID))
        fields = zip(self._labels, (*self._edits, self._place), strict=True)
        for i, (label, edit) in enumerate(fields):
            add_labelled(grid, label, edit, at=divmod(i, 2))
        layout.addWidget(self._buttons)
        self.setMinimumWidth(72 * GRID)

        # Connections
        for edit in self._edits:
            edit.setMaxLength(LONGEST)
            edit.textChanged.connect(self._refresh)
        self._buttons.accepted.connect(self._on_accepted)
        self._buttons.rejected.connect(self.reject)

        if known is not None:
            *texts, place = astuple(known)
            for edit, text in zip(self._edits, texts, strict=True):
                edit.setText(text)
            self._place.setCurrentIndex(PLACES.index(place) if place in PLACES else 0)
        self._refresh()
        self._retranslate()

    def _refresh(self) -> None:
        texts = [edit.text().strip() for edit in self._edits[:N_NEEDED]]
        ok = self._buttons.button(QDialogButtonBox.StandardButton.Ok)
        ok.setEnabled(all(texts) and is_country(texts[-1]))

    def _on_accepted(self) -> None:
        texts = (edit.text().strip() for edit in self._edits)
        place = PLACES[self._place.currentIndex()]
        self.given.emit(replace(Laboratory(*texts), place=place))
        self.accept()

    @override
    def _retranslate(self) -> None:
        self.setWindowTitle(self.tr("Calibration laboratory"))
        words = (
            self.tr("Name"),
            self.tr("E-mail address"),
            self.tr("City"),
            self.tr("Country code, two capital letters such as DE"),
            self.tr("Street (optional)"),
            self.tr("Post code (optional)"),
            self.tr("Procedure (optional)"),
            self.tr("Place of calibration"),
        )
        fields = (*self._edits, self._place)
        for label, edit, text in zip(self._labels, fields, words, strict=True):
            label.setText(text)
            edit.setAccessibleName(text)
        places = (
            self.tr("Laboratory"),
            self.tr("Customer"),
            self.tr("Branch of the laboratory"),
            self.tr("Branch of the customer"),
            self.tr("Elsewhere"),
        )
        for i, text in enumerate(places):
            self._place.setItemText(i, text)
        standard = QDialogButtonBox.StandardButton
        self._buttons.button(standard.Ok).setText(self.tr("Save..."))
        self._buttons.button(standard.Cancel).setText(self.tr("Cancel"))
