"""Asks how the images differ from those that an intrinsics file is for."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QDialog, QDialogButtonBox, QWidget

from lightpen.model.camera import Camera
from lightpen_app.look.layouts import fill, grid_layout, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, text_label
from lightpen_app.widgets.fitted_window import FittedWindow
from lightpen_app.widgets.number_field import NumberField, is_refusing
from lightpen_app.widgets.translated import Translated

MOST_BINNING = 8


class PartDialog(FittedWindow, Translated, QDialog):
    """Dialog for the region of the sensor that the images show, and its binning."""

    given = Signal(int, tuple)  # binning; x, y, width and height of the region, px

    def __init__(self, camera: Camera, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.say(self, self.tr("Binned or cropped images"))
        width, height = camera.image_size

        # Widgets
        self._lead = self.say(
            text_label(TextSize.BODY),
            self.tr(
                "An intrinsics file for these images is written beside the file of the "
                "whole sensor. The region is in pixels of that file, before binning."
            ),
        )
        self._binning = NumberField("", (1, MOST_BINNING), 0)
        self._region = [
            NumberField("px", limits, 0)
            for limits in ((0, width - 1), (0, height - 1), (1, width), (1, height))
        ]
        standard = QDialogButtonBox.StandardButton
        self._buttons = QDialogButtonBox(standard.Ok | standard.Cancel)
        self.say(self._buttons.button(standard.Ok), self.tr("Write and use"))
        self.say(self._buttons.button(standard.Cancel), self.tr("Cancel"))

        # Layout
        layout = vertical_layout(self, self._lead, spacing=2 * GRID, margins=3 * GRID)
        grid = grid_layout(layout, spacing=(2 * GRID, 2 * GRID))
        places = ((0, 0), (1, 0), (1, 1), (2, 0), (2, 1))
        texts = (
            self.tr("Binning"),
            self.tr("Left edge"),
            self.tr("Top edge"),
            self.tr("Width"),
            self.tr("Height"),
        )
        fields = (self._binning, *self._region)
        for field, text, at in zip(fields, texts, places, strict=True):
            self.make_field(grid, field, text, at=at)
        fill(layout, self._buttons)
        self.setMinimumWidth(56 * GRID)

        # Connections
        self._buttons.accepted.connect(self._on_accepted)
        self._buttons.rejected.connect(self.reject)

        self._binning.set_value(1)
        for each, value in zip(self._region, (0, 0, width, height), strict=True):
            each.set_value(value)

    def _on_accepted(self) -> None:
        if is_refusing(self):
            return
        region = tuple(round(each.value()) for each in self._region)
        self.given.emit(round(self._binning.value()), region)
        self.accept()
