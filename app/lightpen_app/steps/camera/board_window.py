"""Calibrating the camera by a board, live or from a folder, in a window of its own."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import (
    QFileDialog,
    QHBoxLayout,
    QListWidget,
    QListWidgetItem,
    QVBoxLayout,
    QWidget,
)
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen.errors import UsageError
from lightpen.formats.hashes import InputFile
from lightpen.intrinsics.boards import Board, parse_board
from lightpen.intrinsics.calibration import (
    MIN_VIEWS,
    CameraCalibration,
)
from lightpen.intrinsics.capture import Capture, Sight
from lightpen.intrinsics.coverage import cells_of
from lightpen.intrinsics.uncertainty_map import UncertaintyMap, map_uncertainty
from lightpen.model.origin import Origin
from lightpen.record.camera_calibrations import CameraTrial
from lightpen.record.outcome import TrialOutcome
from lightpen.sentences import Sentence
from lightpen_app.look.sentences import worded
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.steps.camera.board_jobs import (
    BoardLook,
    ComputedCamera,
    WantedOutline,
    calibrate_by_folder,
    calibrate_by_views,
    find_outline,
    look_for_board,
    save_camera,
)
from lightpen_app.steps.camera.board_view import BoardOverlay, BoardView
from lightpen_app.widgets.path_field import EnterEdit
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.sign_label import Remark, SignLabel
from lightpen_app.widgets.translated import Translated
from lightpen_app.work.job import Job, Report
from lightpen_app.work.live_view import LiveView, Shown

USUAL_BOARD = "chessboard:11x8:20"
SIDE_WIDTH = 46 * GRID
LONGEST_UNSEEN = 3.0  # s, after which it is asked what is seen instead
NANOSECONDS = 1e9


class BoardWindow(Translated, QWidget):
    """Leads the board through the image, calibrates, and saves the camera file.

    Signals
    -------
    saved(str)
        A camera file was written.
    concluded(CameraTrial)
        What became of an attempt.
    """

    saved = Signal(str)
    concluded = Signal(object)

    def __init__(self, live: LiveView, parent: QWidget | None = None) -> None:
        super().__init__(parent, Qt.WindowType.Window)
        self.setObjectName("board")
        self.resize(150 * GRID, 90 * GRID)
        self._live = live
        self._sought: Board | None = None  # while views are kept
        self._capture: Capture | None = None
        self._outline: FloatArray | None = None
        self._found: CameraCalibration | None = None
        self._seen_s = 0.0  # when it was seen, or last asked why it is not
        self._why_unseen: Sentence | None = None
        self._hashes: dict[str, str] = {}  # of the views that are kept or computed
        self._is_saved = False
        self._outcome: Callable[[], Remark] = Remark  # of what was done last
        self._searching: Job | None = None
        self._leading: Job | None = None
        self._computing: Job | None = None

        # Widgets
        self._image = BoardView()
        self._remark = SignLabel()
        self._board = EnterEdit(USUAL_BOARD)
        self._board_name = text_label(TextSize.BODY)
        self._forms = text_label(TextSize.SMALL, Tone.QUIET)
        self._begin = PushButton()
        self._folder = PushButton()
        self._compute = PushButton()
        self._count = text_label(TextSize.BODY)
        self._facts = text_label(TextSize.BODY)
        self._shows_residuals = PushButton()
        self._shows_uncertainty = PushButton()
        for button in (self._shows_residuals, self._shows_uncertainty):
            button.setCheckable(True)
            button.setAutoExclusive(True)
        self._shows_residuals.setChecked(True)
        self._worst_title = text_label(TextSize.SMALL, Tone.QUIET)
        self._worst = QListWidget()
        self._remove = PushButton()
        self._save = PushButton()

        # Layout
        side = QVBoxLayout()
        side.setSpacing(GRID)
        side.addWidget(self._board_name)
        side.addWidget(self._board)
        side.addWidget(self._forms)
        sources = QHBoxLayout()
        sources.addWidget(self._begin)
        sources.addWidget(self._folder)
        side.addLayout(sources)
        side.addWidget(self._count)
        side.addWidget(self._compute)
        side.addWidget(self._facts)
        pictures = QHBoxLayout()
        pictures.addWidget(self._shows_residuals)
        pictures.addWidget(self._shows_uncertainty)
        side.addLayout(pictures)
        side.addWidget(self._worst_title)
        side.addWidget(self._worst, 1)
        side.addWidget(self._remove)
        side.addWidget(self._save)
        panel = QWidget()
        panel.setLayout(side)
        panel.setFixedWidth(SIDE_WIDTH)
        main = QVBoxLayout()
        main.addWidget(self._image, 1)
        main.addWidget(self._remark)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(2 * GRID, 2 * GRID, 2 * GRID, 2 * GRID)
        layout.setSpacing(2 * GRID)
        layout.addLayout(main, 1)
        layout.addWidget(panel)

        # Connections
        self._live.image_shown.connect(self._on_image_shown)
        self._begin.clicked.connect(self._on_begin_clicked)
        self._folder.clicked.connect(self._on_folder_clicked)
        self._compute.clicked.connect(self._on_compute_clicked)
        self._remove.clicked.connect(self._on_remove_clicked)
        self._save.clicked.connect(self._on_save_clicked)
        self._worst.currentRowChanged.connect(self._refresh)
        self._shows_residuals.toggled.connect(self._refresh)

        self._retranslate()

    @override
    def closeEvent(self, event: QCloseEvent) -> None:
        self._stop()
        self._conclude()
        self._capture, self._hashes = None, {}
        self._drop_jobs()
        self._forget()
        self._tell(Remark)
        super().closeEvent(event)

    # Views

    def _on_begin_clicked(self) -> None:
        if self._sought is not None:
            self._stop()
        else:
            self._conclude()
            self._sought = self._named_board()
            self._capture = self._outline = None
            self._hashes = {}
            self._drop_jobs()
            self._forget()
        self._refresh()

    def _drop_jobs(self) -> None:
        """Tell nothing more of what was begun before."""
        for job in (self._searching, self._leading, self._computing):
            if job is not None:
                job.cancel()
        self._searching = self._leading = self._computing = None

    def _tell(self, outcome: Callable[[], Remark]) -> None:
        """Say what came of something, in each language anew."""
        self._outcome = outcome
        self._refresh()

    def _stop(self) -> None:
        self._sought = self._outline = None

    def _named_board(self) -> Board | None:
        """Return the board that was named, or say why it is none."""
        try:
            board = parse_board(self._board.text())
        except UsageError as error:
            self._tell(partial(_trouble, error.sentence))
            return None
        self._tell(Remark)
        return board

    def _on_image_shown(self, shown: Shown) -> None:
        if self._sought is None:
            return
        self._live.hurry()
        self._image.set_half(shown.half, shown.size)
        if self._searching is not None:
            return
        frame = shown.seen.frame
        if self._capture is None:
            height, width = frame.image.shape
            self._capture = Capture(self._sought, (width, height))
            self._seen_s = frame.host_ts_ns / NANOSECONDS
            self._why_unseen = None
            self._lead()
        time_s = frame.host_ts_ns / NANOSECONDS
        asks_why = time_s - self._seen_s >= LONGEST_UNSEEN
        if asks_why or self._capture.points is not None:
            self._seen_s = time_s
        look = partial(look_for_board, frame.image, self._sought, asks_why)
        self._searching = job = Job(look, self)

        # Connections
        job.succeeded.connect(lambda seen: self._on_looked(seen, time_s))
        job.ended.connect(partial(self._on_search_ended, job))
        job.start()

    def _on_search_ended(self, job: Job) -> None:
        if job is self._searching:
            self._searching = None

    def _on_looked(self, seen: BoardLook, time_s: float) -> None:
        if self._capture is None or self._sought is None:
            return
        n_kept = len(self._capture.kept)
        self._capture = self._capture.after(seen.points, time_s)
        if seen.why_unseen is not None or seen.points is not None:
            self._why_unseen = seen.why_unseen
        if len(self._capture.kept) > n_kept:
            self._hashes[self._capture.views.names[-1]] = seen.sha256
            self._lead()
        self._refresh()

    def _lead(self) -> None:
        """Find where the board is wanted next."""
        if self._capture is None or self._leading is not None:
            return
        capture = self._capture
        self._leading = job = Job(partial(find_outline, capture), self)

        # Connections
        job.succeeded.connect(self._on_led)
        job.ended.connect(partial(self._on_leading_ended, job, len(capture.kept)))
        job.start()

    def _on_led(self, wanted: WantedOutline) -> None:
        if self._sought is not None:
            self._outline = wanted.outline
            self._refresh()

    def _on_leading_ended(self, job: Job, n_kept: int) -> None:
        """Find it again where more views were kept meanwhile."""
        if job is not self._leading:
            return
        self._leading = None
        now = self._capture
        if self._sought is not None and now is not None and len(now.kept) > n_kept:
            self._lead()

    def _on_folder_clicked(self) -> None:
        board = self._named_board()
        if board is None:
            return
        folder = QFileDialog.getExistingDirectory(self, self.tr("Images of the board"))
        if folder:
            self.read_folder(folder)

    def read_folder(self, folder: str) -> None:
        """Calibrate by the images in a folder."""
        board = self._named_board()
        if board is None:
            return
        self._stop()
        self._conclude()
        self._capture = None
        self._image.set_image(None)
        self._run(partial(calibrate_by_folder, folder, board))

    # Calibration

    def _on_compute_clicked(self) -> None:
        if self._capture is not None:
            self._stop()
            self._conclude_found()
            self._run(partial(calibrate_by_views, self._capture.views, self._hashes))

    def _on_remove_clicked(self) -> None:
        found, item = self._found, self._worst.currentItem()
        if found is None or item is None:
            return
        name = item.data(Qt.ItemDataRole.UserRole)
        kept = np.array([each != name for each in found.views.names])
        self._conclude_found()
        self._run(partial(calibrate_by_views, found.views.chosen(kept), self._hashes))

    def _run(self, calibrate: Callable[[Report], ComputedCamera]) -> None:
        if self._computing is not None:
            self._computing.cancel()
        self._forget()
        self._computing = job = Job(calibrate, self)

        # Connections
        job.progressed.connect(self._on_progressed)
        job.succeeded.connect(self._on_found)
        job.failed.connect(self._on_refused)
        job.start()
        self._refresh()

    def _on_progressed(self, fraction: float) -> None:
        self._tell(partial(self._progress_remark, fraction))

    def _progress_remark(self, fraction: float) -> Remark:
        words = self.tr("Calibrating: {0:.0%}").format(fraction)
        return Remark(words, Sign.WAIT, Tone.QUIET)

    def _on_refused(self, sentence: str) -> None:
        self._computing = None
        self._tell(partial(Remark, sentence, Sign.CROSS, Tone.BAD))

    def _on_found(self, computed: ComputedCamera) -> None:
        found = computed.found
        self._computing, self._found, self._is_saved = None, found, False
        self._hashes = computed.hashes
        if self._image.image_size().isEmpty():  # the views are from a folder
            width, height = found.views.image_sizes[0]
            blank = np.zeros((height // 2, width // 2), np.uint8)
            self._image.set_half(blank, QSize(width, height))
        self._list_views()
        self._tell(partial(self._found_remark, found))

    def _found_remark(self, found: CameraCalibration) -> Remark:
        words = " ".join(map(worded, found.remarks))
        sign, tone = (Sign.WARNING, Tone.WARN) if words else (Sign.CHECK, Tone.GOOD)
        return Remark(words or self.tr("Calibrated."), sign, tone)

    def _list_views(self) -> None:
        """List the views of what was found; the one that is chosen stays so."""
        found, chosen = self._found, self._worst.currentRow()
        self._worst.clear()
        if found is None:
            return
        rms = found.adjustment.view_rms[:, 0]
        for v in found.worst_first:
            words = self.tr("{0}: {1:.4f} px, by the others {2:.4f} px")
            name = found.views.names[v]
            item = QListWidgetItem(words.format(name, rms[v], found.held_out[v]))
            item.setData(Qt.ItemDataRole.UserRole, name)
            self._worst.addItem(item)
        self._worst.setCurrentRow(chosen)

    def _forget(self) -> None:
        """Take away what was computed before."""
        self._found = None
        self._worst.clear()

    def _on_save_clicked(self) -> None:
        path, _ = QFileDialog.getSaveFileName(
            self, self.tr("Save the camera file"), "camera.yaml", "*.yaml"
        )
        if path:
            self.save(path)

    def save(self, path: str) -> None:
        """Write the camera file and offer it for use."""
        if self._found is None:
            return
        camera = replace(self._found.camera, serial=self._serial())
        trial = self._trial(TrialOutcome.ACCEPTED, self._found)
        self._is_saved = True  # unless that is denied
        job = Job(partial(save_camera, camera, Path(path)), self)

        # Connections
        job.succeeded.connect(partial(self._on_saved, trial))
        job.failed.connect(partial(self._on_save_refused, trial))
        job.start()

    def _on_saved(self, trial: CameraTrial, file: InputFile) -> None:
        self._tell(partial(self._saved_remark, file))
        self.concluded.emit(replace(trial, camera_file=file))
        self.saved.emit(str(file.path))

    def _saved_remark(self, file: InputFile) -> Remark:
        words = self.tr("Saved and in use: {0}").format(file.path)
        return Remark(words, Sign.CHECK, Tone.GOOD)

    def _on_save_refused(self, trial: CameraTrial, sentence: str) -> None:
        self._tell(partial(Remark, sentence, Sign.CROSS, Tone.BAD))
        if trial.found is self._found:
            self._is_saved = False
        else:  # it was left meanwhile
            self.concluded.emit(replace(trial, outcome=TrialOutcome.REFUSED))

    # What became of it

    def _serial(self) -> str:
        return "" if self._capture is None else self._live.serial

    def _conclude(self) -> None:
        """Tell what becomes of an attempt that ends now, without a camera file."""
        if self._found is not None:
            self._conclude_found()
        elif self._capture is not None and self._capture.kept:
            self.concluded.emit(self._trial(TrialOutcome.ABANDONED))

    def _conclude_found(self) -> None:
        """Tell that what was found is not used, unless it is."""
        if self._found is not None and not self._is_saved:
            self.concluded.emit(self._trial(TrialOutcome.REFUSED, self._found))
        self._found = None

    def _trial(
        self, outcome: TrialOutcome, found: CameraCalibration | None = None
    ) -> CameraTrial:
        is_live, board = self._capture is not None, self._board.text()
        names = set(self._hashes) if found is None else set(found.views.names)
        return CameraTrial(
            outcome=outcome,
            board=board if found is None else found.views.board.name,
            serial=self._serial(),
            origin=self._origin() if is_live else Origin.RECORDED,
            images={name: h for name, h in self._hashes.items() if name in names},
            found=found,
        )

    def _origin(self) -> Origin:
        return Origin.LIVE if self._live.operator is None else Origin.SIMULATED

    # What is shown

    def _retranslate(self) -> None:
        self.setWindowTitle(self.tr("Calibrate this camera"))
        self._board_name.setText(self.tr("Board"))
        self._board.setAccessibleName(self.tr("Board"))
        self._forms.setText(
            self.tr(
                "Kind, columns x rows, lengths in mm: chessboard:11x8:20 (inner "
                "corners, square), charuco:12x9:20:15:DICT_5X5_100 (squares, square, "
                "marker), circles:9x7:20:10 (distance, diameter), "
                "asymmetric-circles:4x11:20:10"
            )
        )
        self._folder.setText(self.tr("From a folder..."))
        self._compute.setText(self.tr("Calibrate"))
        self._worst_title.setText(self.tr("Views, the worst first"))
        self._worst.setAccessibleName(self.tr("Views, the worst first"))
        self._shows_residuals.setText(self.tr("Residuals"))
        self._shows_uncertainty.setText(self.tr("Uncertainty"))
        told = self.tr(
            "How uncertain the intrinsics leave where a point is seen, over the image: "
            "standard uncertainty, px."
        )
        self._shows_uncertainty.setToolTip(told)
        self._remove.setText(self.tr("Leave out and calibrate again"))
        self._save.setText(self.tr("Save and use..."))
        self._image.set_message(
            self.tr("Start, and hold the board as the outline shows.")
        )
        self._list_views()
        self._refresh()

    def _refresh(self) -> None:
        is_live = self._sought is not None
        n_kept = 0 if self._capture is None else len(self._capture.kept)
        self._begin.setText(self.tr("Stop") if is_live else self.tr("Start"))
        self._count.setText(self.tr("Views kept: {0}").format(n_kept))
        too_few = self.tr("At least {0} views are needed.").format(MIN_VIEWS)
        self._compute.set_why_not(too_few if n_kept < MIN_VIEWS else "")
        nothing = self.tr("Calibrate first.")
        self._save.set_why_not("" if self._found is not None else nothing)
        is_chosen = self._found is not None and self._worst.currentItem() is not None
        self._remove.set_why_not("" if is_chosen else self.tr("Choose a view."))
        self._facts.setText("" if self._found is None else self._told(self._found))
        for button in (self._shows_residuals, self._shows_uncertainty):
            button.setVisible(self._found is not None)
        self._image.set_overlay(self._overlay())
        if is_live and self._why_unseen is not None:
            self._remark.set_value(_trouble(self._why_unseen))
        elif is_live and self._capture is not None:
            words = self._words_of(self._capture.sight)
            self._remark.set_value(Remark(words, Sign.WAIT, Tone.QUIET))
        else:
            self._remark.set_value(self._outcome())

    def _overlay(self) -> BoardOverlay:
        found = self._found
        if found is not None and self._shows_uncertainty.isChecked():
            return BoardOverlay(uncertainty=_uncertainty(found))
        if found is not None:
            return _residuals(found)
        if self._capture is None:
            return BoardOverlay()
        points = self._capture.points if self._sought is not None else None
        return BoardOverlay(points, self._outline, self._capture.cells)

    def _words_of(self, sight: Sight) -> str:
        words = {
            Sight.UNSEEN: self.tr("The board is not seen."),
            Sight.MOVING: self.tr("Hold it still."),
            Sight.STILL: self.tr("Keep it still."),
            Sight.KEPT: self.tr("Kept. Move the board into the outline."),
            Sight.ALIKE: self.tr(
                "There is such a view already. Move the board into the outline."
            ),
        }
        return words[sight]

    def _told(self, found: CameraCalibration) -> str:
        """Return what came out, a line each."""
        camera = found.camera
        assert camera.covariance is not None
        fx, fy, cx, cy = camera.intrinsics[:4].tolist()
        u = (2 * np.sqrt(np.diag(camera.covariance)[:4])).tolist()
        uncertain = _uncertainty(found)
        residuals = self.tr("Residuals {0:.4f} px rms, in views left out {1:.4f} px")
        projection = self.tr("Projection uncertain by {0:.3f} px, at worst {1:.3f} px")
        return "\n".join(
            [
                f"fx {fx:.2f} \u00b1 {u[0]:.2f}, fy {fy:.2f} \u00b1 {u[1]:.2f} px",
                f"cx {cx:.2f} \u00b1 {u[2]:.2f}, cy {cy:.2f} \u00b1 {u[3]:.2f} px",
                residuals.format(found.adjustment.rms, found.held_out_rms),
                projection.format(uncertain.typical, uncertain.worst),
                worded(found.choice.sentence),
            ]
        )


def _residuals(found: CameraCalibration) -> BoardOverlay:
    seen = found.views.seen[:, 0]
    pixels, residuals = found.views.pixels[:, 0][seen], found.adjustment.residuals[:, 0]
    arrows = np.concatenate([pixels, residuals[seen]], axis=1)
    return BoardOverlay(cells=cells_of(found.views), arrows=arrows)


def _uncertainty(found: CameraCalibration) -> UncertaintyMap:
    camera = found.camera
    assert camera.covariance is not None
    return map_uncertainty(camera, camera.covariance)


def _trouble(sentence: Sentence) -> Remark:
    return Remark(worded(sentence), Sign.CROSS, Tone.BAD)
