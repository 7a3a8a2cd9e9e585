"""Form for an item of the tip library."""

from collections.abc import Callable
from datetime import date
from functools import partial
from pathlib import Path

from msgspec import structs
from PySide6.QtCore import QBuffer, QByteArray, QIODevice, QSize, Qt, Signal
from PySide6.QtGui import QImage, QImageReader, QPixmap
from PySide6.QtWidgets import QFileDialog, QGridLayout, QLabel, QLineEdit, QWidget

from lightpen.local_time import local_now
from lightpen.model.artefacts import KIND_WORDS, SIDES, ArtefactKind, Side
from lightpen.model.limits import MOST_DAYS, MOST_SWINGS
from lightpen.record.library.library_changes import read_kept_picture, read_picture
from lightpen.record.library.tip_library import (
    LARGEST_BALL,
    LARGEST_CHANGE,
    LARGEST_REFERENCE,
    LONGEST_ID,
    AnyItem,
    ListedReference,
    ListedTip,
)
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import GridPlace, grid_layout
from lightpen_app.look.theme import GRID
from lightpen_app.steps.start.fields import PointField
from lightpen_app.widgets.fields import (
    ChoiceField,
    DateField,
    PathField,
    Translated,
    add_labelled,
)
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.work.job import LatestJob

ReadPicture = Callable[[], bytes]  # raises a `LightpenError`


class TipPicture(Translated, QLabel):
    """Shows a picture, or why it cannot be shown; it is read off the GUI's thread.

    ``place`` is where it is shown as large as it can be, px.
    """

    def __init__(self, place: QSize) -> None:
        super().__init__()
        self.say(self, self.tr("Picture of the tip"))
        self._job = LatestJob(self)
        self.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.setWordWrap(True)
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setFixedSize(place)
        self.setProperty("area", "panel")
        self._retranslate()

    def set_value(self, read: ReadPicture | None) -> None:
        """Show another picture; None for none."""
        self._job.cancel()
        self.clear()
        if read is None:
            self._retranslate()
            return
        place, density = self.size(), self.devicePixelRatioF()
        self._job.start(
            lambda _: _scaled(read, place, density), self._on_read, self.setText
        )

    def _on_read(self, image: QImage) -> None:
        self.setPixmap(QPixmap.fromImage(image))

    def _retranslate(self) -> None:
        if not self._job.is_running and self.pixmap().isNull():
            self.setText(self.tr("No picture"))


def _scaled(read: ReadPicture, place: QSize, density: float) -> QImage:
    buffer = QBuffer()
    buffer.setData(QByteArray(read()))
    buffer.open(QIODevice.OpenModeFlag.ReadOnly)
    reader = QImageReader(buffer)
    reader.setAutoTransform(True)  # as the camera was held
    size = reader.size().scaled(place * density, Qt.AspectRatioMode.KeepAspectRatio)
    reader.setScaledSize(size)
    image = reader.read()
    image.setDevicePixelRatio(density)
    return image


LONGEST_NOTE = 500  # characters
PICTURE_SIZE = QSize(22 * GRID, 17 * GRID)  # px


class ItemForm(Translated, QWidget):
    """Shows an item; the id of one that is known cannot be changed.

    Pictures are kept in the data folder.
    """

    value_edited = Signal()  # something is typed

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self._folder = folder
        self._item: AnyItem = ListedTip(id="?")

        # Widgets
        self._id = QLineEdit(maxLength=LONGEST_ID)
        to_come = date(local_now().year + 1, 8, 14)
        self._due, self._certified = DateField(to_come), DateField()
        self._certificate = QLineEdit(maxLength=LONGEST_ID)
        self._value = NumberField("mm", (0.0, LARGEST_REFERENCE), 4)
        self._shape, self._side = ChoiceField(), ChoiceField()
        for shape in (None, *ArtefactKind):
            self._shape.addItem("", shape)
        for side in SIDES:
            self._side.addItem("", side)
        self._uncertainty = NumberField("mm", (0.0, 1.0), 4)
        self._ball = NumberField("mm", (0.0, LARGEST_BALL), 4)
        self._change = self.say(
            NumberField("mm", (0.0, LARGEST_CHANGE), 4),
            tip=self.tr(
                "Max. distance of the tip from its previous calibration. Beyond it, "
                "the result needs checking."
            ),
        )
        self._days = NumberField("", (0, MOST_DAYS), 0)
        self._swings = NumberField("", (0, MOST_SWINGS), 0)
        self._nominal = PointField()
        self._picture = PathField()
        self._browse = self.make_button(self.tr("Browse..."), self._on_browse_clicked)
        self._picture.add_button(self._browse)
        self._preview = TipPicture(PICTURE_SIZE)
        self._note = QLineEdit(maxLength=LONGEST_NOTE)
        own = (self._ball, self._change, self._days, self._swings)
        of_reference = self._value, self._shape, self._uncertainty, self._side
        nothing, no_limit = self.tr("Not specified"), self.tr("No limit")
        usual = self.tr("As for the station")
        texts = (
            (self._id, self.tr("ID (as on label)"), ""),
            (self._due, self.tr("Expiry date"), ""),
            (self._certificate, self.tr("Certificate number"), ""),
            (self._certified, self.tr("Date of the certificate"), ""),
            (self._value, self.tr("Certified value"), nothing),
            (self._shape, self.tr("Shape"), ""),
            (self._uncertainty, self.tr("U (k = 2) of the value"), nothing),
            (self._side, self.tr("Contact"), ""),
            (self._ball, self.tr("Ball diameter"), nothing),
            (self._change, self.tr("Max. change since last calibration"), no_limit),
            (self._days, self.tr("Calibration interval (days)"), usual),
            (self._swings, self.tr("Max. swings of the pen"), usual),
            (self._nominal, self.tr("Nominal tip centre"), ""),
            (self._picture, self.tr("Picture"), ""),
            (self._note, self.tr("Comment"), ""),
        )
        self._labels: dict[QWidget, QLabel] = {
            field: self.make_label(field, text, hint=hint)
            for field, text, hint in texts
        }
        for field in own:
            self._labels[field].setWordWrap(True)
        last_day = self.tr("Last day of use, for example {0}; empty for none")
        self.say(self._due, tip=last_day.format(to_come))

        # Layout
        grid = grid_layout(self, spacing=(2 * GRID, GRID // 2))
        self._add(grid, self._id, at=(0, 0))
        self._add(grid, self._due, at=(0, 1))
        self._add(grid, self._note, at=(0, 2, 1, 2))
        self._tip_only = QWidget()
        self._add(grid, self._certificate, at=(1, 0))
        self._add(grid, self._certified, at=(1, 1))
        self._reference_only = QWidget()
        row = grid_layout(self._reference_only, spacing=(2 * GRID, GRID // 2))
        for column, of_it in enumerate(of_reference):
            self._add(row, of_it, at=(0, column))
        grid.addWidget(self._reference_only, 3, 0, 1, 4)
        grid.addWidget(self._tip_only, 2, 0, 1, 4)
        inner = grid_layout(self._tip_only, spacing=(2 * GRID, GRID // 2))
        for column, field in enumerate(own):
            self._add(inner, field, at=(0, column))
        self._add(inner, self._nominal, at=(1, 0, 1, 3))
        self._add(inner, self._picture, at=(2, 0, 1, 3))
        inner.addWidget(self._preview, 1, 3, 2, 1, Qt.AlignmentFlag.AlignCenter)
        for layout in (grid, inner):
            for column in range(4):
                layout.setColumnStretch(column, 1)

        # Connections
        self._id.textChanged.connect(self.value_edited)
        for day in (self._due, self._certified):
            day.textChanged.connect(self.value_edited)
        self._picture.value_changed.connect(self._show_picture)

        self._retranslate()

    def value(self) -> AnyItem:
        """Return the item in the form, with the earlier picture."""
        for field in (self._ball, self._change, self._days, self._swings):
            field.settle()
        self._nominal.settle()
        item = structs.replace(
            self._item,
            id=self._id.text().strip(),
            due=self._due.value(),
            certificate=self._certificate.text().strip(),
            certified=self._certified.value(),
            note=self._note.text().strip(),
        )
        if isinstance(item, ListedReference):
            self._value.settle()
            self._uncertainty.settle()
            shape, side = self._shape.currentData(), self._side.currentData()
            return structs.replace(
                item,
                certified_mm=self._value.value() or None,
                shape=None if shape is None else ArtefactKind(shape),
                uncertainty_mm=self._uncertainty.value(),
                side=Side(side),
            )
        if not isinstance(item, ListedTip):
            return item
        nominal = self._nominal.value()
        return structs.replace(
            item,
            ball_diameter_mm=self._ball.value() or None,
            max_change_mm=self._change.value() or None,
            max_days=round(self._days.value()) or None,
            max_swings=round(self._swings.value()) or None,
            nominal_tip_mm=None if nominal is None else tuple(nominal.tolist()),
        )

    def picture(self) -> str:
        """Return the path of a new picture; empty if it is the previous one."""
        return self._picture.value()

    def set_value(self, item: AnyItem, *, is_new: bool) -> None:
        """Show an item."""
        self._item = item
        self._id.setText(item.id)
        self._id.setReadOnly(not is_new)
        self._due.set_value(item.due)
        self._certificate.setText(item.certificate)
        self._certified.set_value(item.certified)
        self._reference_only.setVisible(isinstance(item, ListedReference))
        if isinstance(item, ListedReference):
            self._value.set_value(item.certified_mm or 0.0)
            self._shape.setCurrentIndex(self._shape.findData(item.shape))
            self._uncertainty.set_value(item.uncertainty_mm)
            self._side.setCurrentIndex(self._side.findData(item.side))
        self._note.setText(item.note)
        self._picture.set_value("")
        self._show_picture()
        is_tip = isinstance(item, ListedTip)
        self._tip_only.setVisible(is_tip)
        if isinstance(item, ListedTip):
            self._ball.set_value(item.ball_diameter_mm or 0.0)
            self._change.set_value(item.max_change_mm or 0.0)
            self._days.set_value(item.max_days or 0)
            self._swings.set_value(item.max_swings or 0)
            self._nominal.set_value(item.nominal_tip)
        self._retranslate()

    def focus_first(self) -> None:
        """Put the keyboard into the first field that can be changed."""
        (self._due if self._id.isReadOnly() else self._id).setFocus()

    def has_id(self) -> bool:
        """Return whether an id is typed."""
        return bool(self._id.text().strip())

    def has_day(self) -> bool:
        """Return whether the fields of days are valid or empty."""
        days = (self._due, self._certified)
        return all(not d.text().strip() or d.value() is not None for d in days)

    def _on_browse_clicked(self) -> None:
        self._picture.pick(
            QFileDialog.FileMode.ExistingFile,
            self.tr("Picture of the tip"),
            self.tr("Pictures (*.png *.jpg *.jpeg *.bmp)"),
        )

    def _show_picture(self) -> None:
        """Show the new picture, or the stored one."""
        path, kept = self._picture.value(), None
        if isinstance(self._item, ListedTip):
            kept = kept_picture(self._folder, self._item)
        given = partial(read_picture, Path(path)) if path else None
        self._preview.set_value(given or kept)

    def _add(self, grid: QGridLayout, field: QWidget, at: GridPlace) -> None:
        add_labelled(grid, self._labels[field], field, at=at)

    def _retranslate(self) -> None:
        self._shape.setItemText(0, self.tr("Not specified"))
        for index, shape in enumerate(ArtefactKind, start=1):
            self._shape.setItemText(index, worded(KIND_WORDS[shape]))
        for index, side in enumerate(SIDES):
            self._side.setItemText(index, worded(SIDES[side]))
        kept = self._item.picture if isinstance(self._item, ListedTip) else None
        self._picture.edit.setPlaceholderText("" if kept is None else kept.place)


def kept_picture(folder: Path, tip: ListedTip) -> ReadPicture | None:
    """Return a reader of the stored picture of a tip; None without one."""
    if tip.picture is None:
        return None
    return partial(read_kept_picture, folder, tip.picture)
