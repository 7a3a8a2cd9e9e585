"""The intrinsics of the camera: file, content and match."""

import numpy as np
from PySide6.QtCore import QDate, QLocale, Qt, Signal
from PySide6.QtWidgets import QFileDialog, QGroupBox, QLabel

from lightpen.formats.opened_files import CameraFile
from lightpen.local_time import local_now
from lightpen.model.camera import Camera
from lightpen.model.camera_validity import unmodelled_effects_of
from lightpen.record.swings.solving import Solution
from lightpen_app.look.layouts import grid_layout, vertical_layout
from lightpen_app.look.quantities import MAX_DECIMALS, number_text
from lightpen_app.look.sentences import worded
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.widgets.file_drops import FileDrops
from lightpen_app.widgets.path_field import PathField
from lightpen_app.widgets.sign_label import SignLabel, StatusMessage
from lightpen_app.widgets.translated import Translated

FILES = "*.yaml *.yml *.json *.xml *.toml *.cameramodel *.txt"
N_FACTS = 5


class IntrinsicsPanel(Translated, QGroupBox):
    """Shows the file in use and the size of the live image."""

    path_chosen = Signal(str)  # path of the file to open
    calibration_requested = Signal()  # calibrate the camera with a board
    part_requested = Signal()  # the images are binned or cropped
    discovery_requested = Signal()  # no such file: find the camera by a swing

    def __init__(self, can_calibrate: bool = True, can_discover: bool = True) -> None:
        super().__init__()
        self.say(self, self.tr("Intrinsics of camera and lens"))
        self._file: CameraFile | None = None
        self._image_size: tuple[int, int] | None = None
        self._serial = ""
        self._swing: Solution | None = None

        # Widgets
        self._path = PathField()
        self._open = self.make_button(self.tr("Open..."), self._on_open_clicked)
        self._path.add_button(self._open)
        self._part = self.make_button(
            self.tr("Binned or cropped images..."), self.part_requested
        )
        self._calibrate = self.make_button(
            self.tr("Calibrate camera..."), self.calibration_requested
        )
        self._discover = self.make_button(
            self.tr("I have no such file..."),
            self.discovery_requested,
            tip=self.tr("Find pen, camera and tip by one swing and one length."),
        )
        if not can_calibrate:
            self._calibrate.hide()
        if not can_discover:
            self._discover.hide()
        self._problem = SignLabel()
        self._check = SignLabel()
        self._doubt = SignLabel()
        self._by_pen = SignLabel()
        self._names = [text_label(TextSize.SMALL, Tone.QUIET) for _ in range(N_FACTS)]
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
        self._path.path_chosen.connect(self.path_chosen)
        FileDrops(self).dropped.connect(self._path.take)

        self._retranslate()

    def set_value(self, value: CameraFile | None) -> None:
        """Show another file and clear the message about the previous one."""
        if value is self._file:
            return
        self._file = value
        self.forget_refused()

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

    def forget_refused(self) -> None:
        """Show the file in use instead of a refused choice."""
        self._path.set_value("" if self._file is None else str(self._file.path))
        self.set_problem("")

    def set_problem(self, sentence: str) -> None:
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

    def _retranslate(self) -> None:
        edit = self._path.edit
        edit.setAccessibleName(self.tr("Intrinsics file"))
        edit.setPlaceholderText(self.tr("Intrinsics file"))
        for label, name in zip(
            self._names,
            (
                self.tr("In use"),
                self.tr("Focal lengths"),
                self.tr("Principal point"),
                self.tr("Distortion"),
                self.tr("Calibrated"),
            ),
            strict=True,
        ):
            label.setText(name)
        self._refresh()

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
        if camera is None or self._swing is None or self._swing.source.rig is not None:
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
