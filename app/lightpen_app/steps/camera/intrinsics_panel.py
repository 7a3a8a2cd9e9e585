"""The intrinsics of the camera: file, content and match."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np
from PySide6.QtCore import QDate, QLocale, Qt, Signal
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QGroupBox,
    QLabel,
    QWidget,
)

from lightpen.formats.opened_files import CameraFile
from lightpen.formats.rig_files import write_window
from lightpen.local_time import local_now
from lightpen.model.camera import Camera, unmodelled_effects_of
from lightpen.record.swings.solving import Solution
from lightpen_app.face import Services
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import fill, grid_layout, vertical_layout
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import MAX_DECIMALS, number_text
from lightpen_app.widgets.controls import FileDrops
from lightpen_app.widgets.fields import PathField, Translated
from lightpen_app.widgets.fitting import FittedWindow
from lightpen_app.widgets.number_field import NumberField, is_refusing
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.work.job import LatestJob, Report
from lightpen_app.work.selection import Selection

FILES = "*.yaml *.yml *.json *.xml *.toml *.cameramodel *.txt"
N_FACTS = 5

Region: TypeAlias = tuple[int, int, int, int]  # x, y, width and height, px


class IntrinsicsPanel(Translated, QGroupBox):
    """Shows the file in use and the size of the live image."""

    discovery_requested = Signal()  # no such file: find the camera by a swing

    def __init__(self, selection: Selection, services: Services = ()) -> None:
        super().__init__()
        self.say(self, self.tr("Intrinsics of camera and lens"))
        self._selection, self._services = selection, services
        self._reading = LatestJob(self)
        self._file: CameraFile | None = None
        self._image_size: tuple[int, int] | None = None
        self._serial = ""
        self._swing: Solution | None = None

        # Widgets
        self._path = self.say(PathField(), hint=self.tr("Intrinsics file"))
        self._open = self.make_button(self.tr("Open..."), self._on_open_clicked)
        self._path.add_button(self._open)
        self._part = self.make_button(
            self.tr("Binned or cropped images..."), self._on_part_clicked
        )
        self._calibrate = self.make_button(
            self.tr("Calibrate camera..."), self._on_calibrate_clicked
        )
        self._discover = self.make_button(
            self.tr("I have no such file..."),
            self.discovery_requested,
            tip=self.tr("Find pen, camera and tip by one swing and one length."),
        )
        self._calibrate.setVisible(any(each.calibrates_cameras for each in services))
        self._discover.setVisible(any(each.discovers for each in services))
        self._problem = SignLabel()
        self._check = SignLabel()
        self._doubt = SignLabel()
        self._by_pen = SignLabel()
        facts = (
            self.tr("In use"),
            self.tr("Focal lengths"),
            self.tr("Principal point"),
            self.tr("Distortion"),
            self.tr("Calibrated"),
        )
        self._names = [
            self.say(text_label(TextSize.SMALL, Tone.QUIET), name) for name in facts
        ]
        self._facts = [text_label(TextSize.SMALL) for _ in range(N_FACTS)]

        # Layout
        layout = vertical_layout(
            self,
            self._path,
            self._problem,
            self._check,
            self._doubt,
            self._by_pen,
            self._part,
            self._calibrate,
            self._discover,
        )
        grid = grid_layout(layout, spacing=(2 * GRID, GRID // 2))
        grid.setColumnStretch(1, 1)
        for row, (name, fact) in enumerate(zip(self._names, self._facts, strict=True)):
            name.setWordWrap(False)
            grid.addWidget(name, row, 0, Qt.AlignmentFlag.AlignTop)
            grid.addWidget(fact, row, 1)

        # Connections
        self._path.path_chosen.connect(self._read)
        selection.station_changed.connect(self._forget_file)
        FileDrops(self).dropped.connect(self._path.accept)

        self._refresh()

    def set_value(self, value: CameraFile | None) -> None:
        """Show another file and clear the message about the previous one."""
        if value is self._file:
            return
        self._file = value
        self._forget_refused()

    def set_image_size(self, image_size: tuple[int, int] | None) -> None:
        """Compare with other live images, width and height in px, or with none."""
        if image_size != self._image_size:
            self._image_size = image_size
            self._refresh()

    def set_serial(self, serial: str) -> None:
        """Compare with the serial number of another camera, empty if it has none."""
        if serial != self._serial:
            self._serial = serial
            self._refresh()

    def set_swing(self, swing: Solution | None) -> None:
        """Check the file by another swing of the pen, or by none."""
        if swing is not self._swing:
            self._swing = swing
            self._refresh()

    def shut_down(self) -> None:
        """Cancel reading."""
        self._reading.cancel()

    def _forget_file(self) -> None:
        """Clear the message on a file that was chosen at another station."""
        self._reading.cancel()
        self._forget_refused()

    def _forget_refused(self) -> None:
        """Show the file in use instead of a refused choice."""
        self._path.set_value("" if self._file is None else str(self._file.path))
        self._set_problem("")

    def _set_problem(self, sentence: str) -> None:
        """Show why the selected file is not used; empty if it is."""
        self._path.set_faulty(bool(sentence))
        self._problem.set_value(StatusMessage.fault(sentence))
        self._refresh()

    def _on_open_clicked(self) -> None:
        self._path.pick(
            QFileDialog.FileMode.ExistingFile,
            self.tr("Intrinsics of camera and lens"),
            self.tr("Intrinsics files ({0})").format(FILES),
        )

    def _read(self, path: str) -> None:
        self._start(lambda _: CameraFile.read(Path(path)))

    def _start(self, read: Callable[[Report], CameraFile]) -> None:
        self._reading.start(read, self._on_file_read, self._set_problem)

    def _on_file_read(self, camera_file: CameraFile) -> None:
        now = self._selection.preparation
        self._selection.set_preparation(replace(now, camera_file=camera_file))

    def _on_part_clicked(self) -> None:
        file = self._selection.preparation.camera_file
        if file is not None:
            dialog = PartDialog(file.camera, self)
            dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
            dialog.given.connect(partial(self._on_part_given, file.path))
            dialog.open()

    def _on_part_given(self, path: Path, binning: int, region: Region) -> None:
        self._start(lambda _: CameraFile.read(write_window(path, binning, region)))

    def _on_calibrate_clicked(self) -> None:
        for each in self._services:
            if each.calibrates_cameras:
                each.calibrate_camera(self, self._read)

    def _refresh(self) -> None:
        camera = None if self._file is None else self._file.camera
        self._check.set_value(self._checked(camera))
        self._part.setVisible(
            camera is not None and self._image_size not in (None, camera.image_size)
        )
        self._doubt.set_value(self._doubt_message(camera))
        self._by_pen.set_value(self._checked_by_pen(camera))
        facts = [""] * N_FACTS if camera is None else self._fact_texts(camera)
        for name, label, fact in zip(self._names, self._facts, facts, strict=True):
            label.setText(fact)
            _let_select(label, bool(fact))
            label.setVisible(bool(fact))
            name.setVisible(bool(fact))

    def _checked(self, camera: Camera | None) -> StatusMessage:
        """Return whether the file matches the live images."""
        if camera is None:
            return StatusMessage.warning(
                self.tr("Open the intrinsics file of this camera and lens.")
            )
        made_for = self._size_text(*camera.image_size)
        if self._image_size is None:
            words = self.tr("Image size of the file: {0}")
            return StatusMessage(words.format(made_for), Sign.WAIT, Tone.QUIET)
        if self._image_size == camera.image_size:
            words = self.tr("Size fits: {0}. Checked against the pen at step LEDs.")
            return StatusMessage(words.format(made_for), Sign.RING, Tone.ACTIVE)
        words = self.tr(
            "Image size is {0}; the intrinsics file is for {1}. Choose the file of "
            "this camera, or say how the images are binned or cropped."
        )
        sent = self._size_text(*self._image_size)
        return StatusMessage(words.format(sent, made_for), Sign.WARNING, Tone.BAD)

    def _doubt_message(self, camera: Camera | None) -> StatusMessage:
        """Return why the file may no longer be valid."""
        if camera is None:
            return StatusMessage()
        doubts = unmodelled_effects_of(camera, local_now().date(), serial=self._serial)
        return StatusMessage.warning(" ".join(map(worded, doubts)))

    def _checked_by_pen(self, camera: Camera | None) -> StatusMessage:
        """Return whether the swing still agrees with the file that it was taken by."""
        if (
            camera is None
            or self._swing is None
            or self._swing.source.rig.n_cameras > 1
        ):
            return StatusMessage()
        used = self._swing.source.camera
        if not np.array_equal(camera.intrinsics, used.intrinsics):
            return StatusMessage()
        for denied in self._swing.calibration.contradictions:
            if not denied.of_pen:
                return StatusMessage.warning(worded(denied.message))
        return StatusMessage.good(self.tr("Checked by a swing: file and camera agree."))

    def _fact_texts(self, camera: Camera) -> list[str]:
        assert self._file is not None
        stated = camera.covariance
        u = None if stated is None else (2 * np.sqrt(np.diag(stated))).tolist()
        values = [camera.fx, camera.fy, camera.cx, camera.cy]
        fx, fy, cx, cy = (
            f"{value:.2f}" if u is None else f"{value:.2f} \u00b1 {u[i]:.2f}"
            for i, value in enumerate(values)
        )
        distortion = ", ".join(
            f"{name}\u00a0{_coefficient_text(value)}"
            for name, value in zip(
                camera.distortion_names, camera.distortion, strict=True
            )
        )
        day = camera.calibrated_on
        if day is None:
            date = self.tr("No date")
        else:
            form = QLocale.FormatType.LongFormat
            date = QLocale().toString(QDate(day.year, day.month, day.day), form)
        if u is None:
            date += self.tr(", no uncertainty in the file")
        pair = self.tr("{0} and {1} px")
        if u is not None:
            pair = self.tr("{0} and {1} px (k = 2)").replace(" = ", "\u00a0=\u00a0")
        return [
            self._file.path.name if self._problem.value().text else "",
            pair.format(fx, fy),
            pair.format(cx, cy),
            distortion,
            date,
        ]

    def _size_text(self, width: int, height: int) -> str:
        return self.tr("{0} x {1}").format(width, height)


def _coefficient_text(value: float) -> str:
    """Return a coefficient by four digits, none smaller than moves a point."""
    text = number_text(float(f"{value:.4g}"), MAX_DECIMALS)
    return text.rstrip("0").rstrip(".")


def _let_select(label: QLabel, selectable: bool) -> None:
    """Make the text of a label selectable, or not focusable."""
    flags = Qt.TextInteractionFlag
    label.setTextInteractionFlags(
        flags.TextSelectableByMouse if selectable else flags.NoTextInteraction
    )


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
