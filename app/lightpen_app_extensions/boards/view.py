"""The result of a camera calibration, and its run."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from PySide6.QtCore import (
    QCoreApplication,
    QLineF,
    QObject,
    QPointF,
    QRectF,
    Qt,
    Signal,
)
from PySide6.QtGui import QColor, QImage, QPainter, QPen, QPolygonF
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen.formats.images import find_images
from lightpen.formats.opened_files import InputFile, all_hashed, hashed
from lightpen.formats.own_json import plain
from lightpen.formats.rig_files import write_camera
from lightpen.local_time import local_now
from lightpen.model.camera import Camera
from lightpen.model.names import Origin
from lightpen.record.folder import CalibratedCamera
from lightpen_app.look.languages import worded
from lightpen_app.look.theme import DARK, TextSize, Tone, font
from lightpen_app.widgets.image_view import ImageView
from lightpen_app.widgets.state_banner import StatusMessage
from lightpen_app.work.job import Job, LatestJob, Report
from lightpen_app.work.live_view import LiveView
from lightpen_app_extensions.boards.form import BoardCapture
from lightpen_extensions.boards.boards import Board
from lightpen_extensions.boards.calibration import CameraCalibration, calibrate_camera
from lightpen_extensions.boards.distortion import UncertaintyMap, map_uncertainty
from lightpen_extensions.boards.observing import Views, observe_board
from lightpen_extensions.boards.report import intrinsics_record

POINT = 2.5  # px of the screen, radius
FOOT = 1.5  # px of the screen, radius of an arrow's foot
LONGEST_ARROW = 40.0  # px of the screen
# From no uncertainty to the largest: red, green, blue, opacity.
_BEST, _WORST = np.array([16, 60, 96, 230]), np.array([214, 104, 24, 230])


@dataclass(frozen=True, eq=False)
class BoardOverlay:
    """Overlay of the image."""

    points: FloatArray | None = None  # (N, 2), of the board, px; NaN where not seen
    # (4, 2), where the board is wanted, px, from its first corner on
    outline: FloatArray | None = None
    # (M, 4), residuals: place and value, px; drawn enlarged
    arrows: FloatArray | None = None
    uncertainty: UncertaintyMap | None = None


class BoardView(ImageView):
    """Shows the newest image with the detected board."""

    def __init__(self) -> None:
        super().__init__()
        self._overlay = BoardOverlay()

    def overlay(self) -> BoardOverlay:
        """Return the overlay of the image."""
        return self._overlay

    def set_overlay(self, overlay: BoardOverlay) -> None:
        """Draw something else on the image."""
        self._overlay = overlay
        self.update()

    @override
    def _draw(self, painter: QPainter) -> None:
        super()._draw(painter)
        if self.image_size().isEmpty():
            return
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        shown = self._overlay
        if shown.uncertainty is not None:
            self._draw_uncertainty(painter, shown.uncertainty)
        if shown.outline is not None:
            self._draw_outline(painter, shown.outline)
        if shown.points is not None:
            self._draw_points(painter, shown.points)
        if shown.arrows is not None:
            self._draw_arrows(painter, shown.arrows)

    def _draw_uncertainty(self, painter: QPainter, uncertainty: UncertaintyMap) -> None:
        """Colour the image by how uncertain a projection is, with numbers, px."""
        sigmas, size = uncertainty.sigmas, self.image_size()
        rows, columns = sigmas.shape
        colors = np.stack([_BEST, _WORST]).astype(float)
        shares = (sigmas / max(uncertainty.worst, 1e-12))[..., None]
        pixels = np.ascontiguousarray(colors[0] + shares * (colors[1] - colors[0]))
        picture = QImage(
            pixels.astype(np.uint8).tobytes(),
            columns,
            rows,
            4 * columns,
            QImage.Format.Format_RGBA8888,
        )
        # The samples lie on the border of the image, the pixels of a picture within.
        x, y = size.width() / (columns - 1) / 2, size.height() / (rows - 1) / 2
        right, bottom = float(size.width()), float(size.height())
        whole = self.place_of(-x, -y), self.place_of(right + x, bottom + y)
        inside = self.place_of(-0.5, -0.5), self.place_of(right - 0.5, bottom - 0.5)
        painter.save()
        painter.setClipRect(QRectF(*inside))
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.drawImage(QRectF(*whole), picture)
        painter.restore()
        painter.setPen(QColor(DARK.text))
        painter.setFont(font(TextSize.SMALL))
        for row, column in np.ndindex(rows, columns):
            if row % 2 and column % 2:
                place = self.place_of(*uncertainty.pixels[row, column].tolist())
                words = f"{sigmas[row, column]:.3f}"
                box = QRectF(place.x() - 40, place.y() - 12, 80, 24)
                painter.drawText(box, Qt.AlignmentFlag.AlignCenter, words)

    def _draw_outline(self, painter: QPainter, outline: FloatArray) -> None:
        places = [self.place_of(x, y) for x, y in outline.tolist()]
        pen = QPen(QColor(DARK.pointer), 3)
        pen.setDashPattern([4, 3])
        painter.setPen(pen)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawPolygon(QPolygonF(places))

    def _draw_points(self, painter: QPainter, points: FloatArray) -> None:
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(DARK.tone(Tone.GOOD))
        for x, y in points[np.isfinite(points[:, 0])].tolist():
            painter.drawEllipse(self.place_of(x, y), POINT, POINT)

    def _draw_arrows(self, painter: QPainter, arrows: FloatArray) -> None:
        longest = float(np.linalg.norm(arrows[:, 2:], axis=1).max(initial=0.0))
        if longest == 0:
            return
        scale = LONGEST_ARROW / longest
        painter.setPen(QPen(DARK.tone(Tone.WARN), 1.5))
        for x, y, u, v in arrows.tolist():
            foot = self.place_of(x, y)
            painter.drawLine(QLineF(foot, foot + QPointF(scale * u, scale * v)))
            painter.drawEllipse(foot, FOOT, FOOT)


@dataclass(frozen=True, eq=False)
class ComputedCamera:
    """A calibration, and the hash of each image by its name."""

    found: CameraCalibration
    hashes: Mapping[str, str]


class BoardCalibration(QObject):
    """Computes intrinsics, saves them, and reports the outcome."""

    found_changed = Signal()
    remark_changed = Signal()
    begun = Signal()
    progressed = Signal(float)  # of the computation, 0 to 1
    ended = Signal()
    saved = Signal(str)  # a camera file was written
    concluded = Signal(object)  # CalibratedCamera: its file was written

    def __init__(self, capture: BoardCapture, live: LiveView, parent: QObject) -> None:
        super().__init__(parent)
        self._capture, self._live = capture, live
        self._computed: ComputedCamera | None = None
        self._job = LatestJob(self)
        self._remark: Callable[[], StatusMessage] = StatusMessage

    @property
    def found(self) -> CameraCalibration | None:
        """The last result; None if it was discarded."""
        return None if self._computed is None else self._computed.found

    def remark(self) -> StatusMessage:
        """Return the result of the last step, in the present language."""
        return self._remark()

    def set_remark(self, remark: Callable[[], StatusMessage]) -> None:
        """State a result, again in each language."""
        self._remark = remark
        self.remark_changed.emit()

    def calibrate_by_capture(self) -> None:
        """Calibrate from the captured views."""
        state = self._capture.state
        if state.capture is not None:
            self._capture.stop()
            views = state.capture.views
            self._run(partial(calibrate_by_views, views, state.hashes))

    def calibrate_by_folder(self, folder: str, board: Board) -> None:
        """Calibrate by the images in a folder."""
        self._capture.stop()
        self._run(partial(calibrate_by_folder, folder, board), is_of_folder=True)

    def leave_out(self, name: str) -> None:
        """Calibrate again without one of the views."""
        if self._computed is not None:
            views, hashes = self._computed.found.views, self._computed.hashes
            kept = np.array([each != name for each in views.names])
            self._run(partial(calibrate_by_views, views.chosen(kept), hashes))

    def save(self, path: Path) -> None:
        """Write the camera file and offer it for use."""
        if self._computed is None:
            return
        serial = self._live.serial if self._is_live else ""
        camera = replace(self._computed.found.camera, serial=serial)
        job = Job(partial(save_camera, camera, path), self)
        job.start(partial(self._on_saved, self._computed, serial), self._on_refused)

    def discard(self) -> None:
        """Cancel the computation and discard the result."""
        self.cancel()
        self._computed = None
        self.found_changed.emit()

    @property
    def _is_live(self) -> bool:
        """Whether the views are of live images."""
        return self._capture.state.capture is not None

    def cancel(self) -> None:
        """End the computation; what was found before stays."""
        self._job.cancel()
        self.ended.emit()

    @property
    def is_computing(self) -> bool:
        """Whether a result is awaited."""
        return self._job.is_running

    def _run(
        self,
        calibrate: Callable[[Report], ComputedCamera],
        *,
        is_of_folder: bool = False,
    ) -> None:
        self._job.start(
            calibrate,
            partial(self._on_found, is_of_folder),
            self._on_refused,
            progressed=self.progressed,
            ended=self.ended,
        )
        self.begun.emit()

    def _on_refused(self, sentence: str) -> None:
        self.set_remark(partial(StatusMessage.fault, sentence))

    def _on_found(self, is_of_folder: bool, computed: ComputedCamera) -> None:
        if is_of_folder:
            self._capture.start(None)
        self._computed = computed
        self.found_changed.emit()
        self.set_remark(partial(self._found_message, computed.found))

    def _found_message(self, found: CameraCalibration) -> StatusMessage:
        words = " ".join(map(worded, found.remarks))
        if words:
            return StatusMessage.warning(words)
        return StatusMessage.good(self.tr("Camera calibrated."))

    def _on_saved(self, computed: ComputedCamera, serial: str, file: InputFile) -> None:
        found, origin = computed.found, Origin.RECORDED
        if self._is_live:
            is_real = self._live.operator is None
            origin = Origin.LIVE if is_real else Origin.SIMULATED
        names = found.views.names
        self.set_remark(partial(self._saved_message, file))
        self.concluded.emit(
            CalibratedCamera(
                board=found.views.board.name,
                serial=serial,
                origin=origin,
                images={n: h for n, h in computed.hashes.items() if n in names},
                found=plain(intrinsics_record(found, ())),
                camera_file=file,
            )
        )
        self.saved.emit(str(file.path))

    def _saved_message(self, file: InputFile) -> StatusMessage:
        return StatusMessage.good(self.tr("Saved and in use: {0}").format(file.path))


def calibrate_by_views(
    views: Views, hashes: Mapping[str, str], report: Report
) -> ComputedCamera:
    """Calibrate the camera from captured views."""
    found = calibrate_camera(views, local_now().date(), report)
    return ComputedCamera(found, hashes)


def calibrate_by_folder(folder: str, board: Board, report: Report) -> ComputedCamera:
    """Calibrate the camera by images in a folder.

    Raises `CalibrationError` if they do not show the camera.
    """
    images = find_images(folder)
    observed = observe_board(images, board, lambda fraction: report(0.7 * fraction))
    found = calibrate_camera(
        observed.views,
        local_now().date(),
        lambda fraction: report(0.7 + 0.3 * fraction),
    )
    files = all_hashed(images.files)
    return ComputedCamera(found, {file.path.name: file.sha256 for file in files})


def save_camera(camera: Camera, path: Path, report: Report) -> InputFile:
    """Write a camera file, and return it with its hash."""
    write_camera(camera, path)
    return hashed(path)


def facts_text(found: CameraCalibration) -> str:
    """Return the result, one text a line."""
    camera, translate = found.camera, QCoreApplication.translate
    assert camera.covariance is not None
    fx, fy, cx, cy = camera.intrinsics[:4].tolist()
    u = (2 * np.sqrt(np.diag(camera.covariance)[:4])).tolist()
    uncertain = uncertainty_over_image(found)
    residuals = translate(
        "BoardWindow", "Residuals: RMS {0:.4f} px, cross-validated {1:.4f} px"
    )
    projection = translate(
        "BoardWindow", "Projection uncertainty: RMS {0:.3f} px, max. {1:.3f} px"
    )
    return "\n".join(
        [
            f"fx {fx:.2f} \u00b1 {u[0]:.2f}, fy {fy:.2f} \u00b1 {u[1]:.2f} px (k = 2)",
            f"cx {cx:.2f} \u00b1 {u[2]:.2f}, cy {cy:.2f} \u00b1 {u[3]:.2f} px (k = 2)",
            residuals.format(found.adjustment.rms, found.held_out_rms),
            projection.format(uncertain.typical, uncertain.worst),
            worded(found.choice.message),
        ]
    )


def uncertainty_over_image(found: CameraCalibration) -> UncertaintyMap:
    """Return the text on the projection uncertainty of the intrinsics."""
    assert found.camera.covariance is not None
    return map_uncertainty(found.camera, found.camera.covariance)
