"""Probed points from recorded images instead of live ones."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QCheckBox, QFileDialog, QProgressBar, QWidget
from typing_extensions import override

from lightpen_app.look.layouts import grid_layout
from lightpen_app.look.tooltips import set_tooltip
from lightpen_app.widgets.path_field import PathField
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated

STEPS = 1000  # of the progress


class ImagesRow(Translated, QWidget):
    """A place of images, and whether the pen is held still in them."""

    # The place, and whether the pen is held still through the images of a touch.
    read_requested = Signal(str, bool)
    cancel_requested = Signal()

    def __init__(self) -> None:
        super().__init__()

        # Widgets
        self._place = PathField()
        self._choose = PushButton()
        self._place.add_button(self._choose)
        self._is_still = QCheckBox()
        self._read = PushButton()
        self._progress = QProgressBar(maximum=STEPS, textVisible=False)
        self._cancel = PushButton()

        # Layout
        layout = grid_layout(self)
        layout.addWidget(self._place, 0, 0)
        layout.addWidget(self._is_still, 0, 1)
        layout.addWidget(self._read, 0, 2)
        layout.addWidget(self._progress, 1, 0, 1, 2)
        layout.addWidget(self._cancel, 1, 2)
        layout.setColumnStretch(0, 1)

        # Connections
        self._choose.clicked.connect(self._on_choose_clicked)
        self._place.value_changed.connect(self._on_place_changed)
        self._read.clicked.connect(self._on_read_clicked)
        self._cancel.clicked.connect(self.cancel_requested)

        self.set_progress(None)
        self._retranslate()

    def set_progress(self, fraction: float | None) -> None:
        """Show the progress of reading, 0 to 1, or none."""
        is_reading = fraction is not None
        for widget in (self._progress, self._cancel):
            widget.setVisible(is_reading)
        for control in (self._place, self._is_still):
            control.setEnabled(not is_reading)
        self._read.setEnabled(bool(self._place.value()) and not is_reading)
        self._progress.setValue(round(STEPS * (fraction or 0.0)))

    @override
    def _retranslate(self) -> None:
        self._choose.setText(self.tr("Choose..."))
        name = self.tr("Folder, video or record of images")
        self._place.edit.setAccessibleName(name)
        self._place.edit.setPlaceholderText(name)
        self._is_still.setText(self.tr("Held still"))
        set_tooltip(
            self._is_still,
            self.tr(
                "On: a point is several images with the pen held still. Off: "
                "each image is a point."
            ),
        )
        self._read.setText(self.tr("Read"))
        set_tooltip(
            self._read,
            self.tr(
                "Do this task with recorded images: a folder, or a folder of folders."
            ),
        )
        self._cancel.setText(self.tr("Cancel"))
        self._progress.setAccessibleName(self.tr("Progress of reading"))

    def _on_choose_clicked(self) -> None:
        self._place.pick(
            QFileDialog.FileMode.Directory, self.tr("Folder of recorded images")
        )

    def _on_place_changed(self) -> None:
        self._read.setEnabled(bool(self._place.value()))

    def _on_read_clicked(self) -> None:
        self.read_requested.emit(self._place.value(), self._is_still.isChecked())
