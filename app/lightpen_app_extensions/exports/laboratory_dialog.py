"""Dialog for the laboratory that a certificate names."""

from dataclasses import astuple, replace

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QComboBox, QDialog, QDialogButtonBox, QLineEdit, QWidget

from lightpen.model.names import PLACES, Laboratory, is_country
from lightpen_app.look.layouts import grid_layout, vertical_layout
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import FittedWindow

LONGEST = 200  # characters
N_NEEDED, N_FIELDS = 4, 7  # the others may be empty


class LaboratoryDialog(FittedWindow, Translated, QDialog):
    """Dialog for the laboratory; name, e-mail, city and country are required."""

    given = Signal(object)  # Laboratory

    def __init__(self, known: Laboratory | None, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.say(self, self.tr("Calibration laboratory"))

        # Widgets
        self._edits = [QLineEdit() for _ in range(N_FIELDS)]
        places = (
            self.tr("Laboratory"),
            self.tr("Customer"),
            self.tr("Branch of the laboratory"),
            self.tr("Branch of the customer"),
            self.tr("Elsewhere"),
        )
        self._place = self.say_items(QComboBox(), places)
        texts = (
            self.tr("Name"),
            self.tr("E-mail address"),
            self.tr("City"),
            self.tr("Country code, two capital letters such as DE"),
            self.tr("Street (optional)"),
            self.tr("Post code (optional)"),
            self.tr("Procedure (optional)"),
            self.tr("Place of calibration"),
        )
        standard = QDialogButtonBox.StandardButton
        self._buttons = QDialogButtonBox(standard.Ok | standard.Cancel)
        self.say(self._buttons.button(standard.Ok), self.tr("Save..."))
        self.say(self._buttons.button(standard.Cancel), self.tr("Cancel"))

        # Layout
        layout = vertical_layout(self, spacing=2 * GRID, margins=3 * GRID)
        grid = grid_layout(layout, spacing=(2 * GRID, 2 * GRID))
        fields = zip((*self._edits, self._place), texts, strict=True)
        for i, (field, text) in enumerate(fields):
            self.make_field(grid, field, text, at=divmod(i, 2))
        layout.addWidget(self._buttons)
        self.setMinimumWidth(72 * GRID)

        # Connections
        for edit in self._edits:
            edit.setMaxLength(LONGEST)
            edit.textChanged.connect(self._refresh)
        self._buttons.accepted.connect(self._on_accepted)
        self._buttons.rejected.connect(self.reject)

        if known is not None:
            *given, place = astuple(known)
            for edit, text in zip(self._edits, given, strict=True):
                edit.setText(text)
            self._place.setCurrentIndex(PLACES.index(place) if place in PLACES else 0)
        self._refresh()

    def _refresh(self) -> None:
        texts = [edit.text().strip() for edit in self._edits[:N_NEEDED]]
        ok = self._buttons.button(QDialogButtonBox.StandardButton.Ok)
        ok.setEnabled(all(texts) and is_country(texts[-1]))

    def _on_accepted(self) -> None:
        texts = (edit.text().strip() for edit in self._edits)
        place = PLACES[self._place.currentIndex()]
        self.given.emit(replace(Laboratory(*texts), place=place))
        self.accept()
