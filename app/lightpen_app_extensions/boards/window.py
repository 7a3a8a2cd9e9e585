"""The window of a camera calibration, shown on demand."""

from functools import partial
from pathlib import Path

import numpy as np
from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import QFileDialog, QListWidget, QListWidgetItem, QWidget
from typing_extensions import override

from lightpen.errors import UsageError
from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.widgets.bars import JobProgress
from lightpen_app.widgets.controls import PushButton, ask_file
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import FittedWindow, PageScroll
from lightpen_app.widgets.number_field import is_refusing
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.work.chosen_files import SavePlace
from lightpen_app.work.live_view import DisplayedImage, LiveView
from lightpen_app_extensions.boards.form import (
    BoardCapture,
    BoardForm,
    CaptureState,
    fault_message,
    sight_message,
)
from lightpen_app_extensions.boards.view import (
    BoardCalibration,
    BoardOverlay,
    BoardView,
    facts_text,
    uncertainty_over_image,
)
from lightpen_extensions.boards.boards import Board
from lightpen_extensions.boards.calibration import MIN_VIEWS, CameraCalibration

SIDE_WIDTH = 48 * GRID
LEAST_LIST = 28 * GRID  # px, of the views


class BoardWindow(FittedWindow, Translated, QWidget):
    """Leads the board through the image, calibrates, and saves the camera file."""

    saved = Signal(str)  # a camera file was written
    concluded = Signal(object)  # CalibratedCamera: its file was written

    CLOSING_KEYS = (Qt.Key.Key_Escape,)

    def __init__(
        self, live: LiveView, place: SavePlace, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent, Qt.WindowType.Window)
        self.say(self, self.tr("Camera calibration"))
        self.setObjectName("board")
        self.resize(150 * GRID, 90 * GRID)
        self._live, self._place = live, place
        self._capture = BoardCapture(self)
        self._calibration = BoardCalibration(self._capture, live, self)

        # Widgets
        self._image = BoardView()
        self._remark, self._progress = SignLabel(), JobProgress()
        self.board = BoardForm()
        self._begin = PushButton()
        self._folder = self.make_button(
            self.tr("From a folder..."), self._on_folder_clicked
        )
        self._compute = self.make_button(self.tr("Calibrate"))
        self._count = text_label(TextSize.BODY)
        self._facts = text_label(TextSize.BODY)
        self._shows_residuals = self.say(
            PushButton(checkable=True), self.tr("Residuals")
        )
        self._shows_uncertainty = self.say(
            PushButton(checkable=True),
            self.tr("Uncertainty"),
            tip=self.tr(
                "Standard uncertainty of the projection of a point due to the "
                "intrinsics, over the image / px"
            ),
        )
        for button in (self._shows_residuals, self._shows_uncertainty):
            button.setAutoExclusive(True)
        self._shows_residuals.setChecked(True)
        self._worst_title = self.say(
            text_label(TextSize.SMALL, Tone.QUIET), self.tr("Views (worst first)")
        )
        self._worst = self.say(QListWidget(), self.tr("Views (worst first)"))
        self._remove = self.make_button(
            self.tr("Exclude view and recalibrate"), self._on_remove_clicked
        )
        self._outcome = QWidget()
        self._save = self.make_button(self.tr("Save and use..."), self._on_save_clicked)

        # Layout
        panel = QWidget()
        side = vertical_layout(panel, self.board, margins=None)
        horizontal_layout(side, self._begin, self._folder, spacing=-1)
        fill(side, self._count, (self._outcome, 1), 1)
        outcome = vertical_layout(self._outcome, self._facts)
        horizontal_layout(
            outcome, self._shows_residuals, self._shows_uncertainty, spacing=-1
        )
        fill(outcome, self._worst_title, (self._worst, 1), self._remove)
        self._worst.setMinimumHeight(LEAST_LIST)
        scroll = PageScroll()
        scroll.setWidget(panel)
        column = QWidget()
        column.setFixedWidth(SIDE_WIDTH)
        rows = vertical_layout(column, (scroll, 1))
        horizontal_layout(rows, (self._compute, 1), (self._save, 1))
        layout = horizontal_layout(self, spacing=2 * GRID, margins=2 * GRID)
        left = vertical_layout(layout, (self._image, 1), stretch=1, spacing=-1)
        fill(left, self._progress, self._remark)
        layout.addWidget(column)

        # Connections
        live.image_shown.connect(self._on_image_shown)
        self._capture.changed.connect(self._show_state)
        self._calibration.remark_changed.connect(self._show_state)
        self._calibration.found_changed.connect(self._on_found_changed)
        self._calibration.begun.connect(self._progress.begin)
        self._calibration.begun.connect(self._show_state)
        self._calibration.progressed.connect(self._progress.set_fraction)
        self._calibration.ended.connect(self._progress.end)
        self._calibration.ended.connect(self._show_state)
        self._progress.cancelled.connect(self._calibration.cancel)
        self._calibration.saved.connect(self.saved)
        self._calibration.concluded.connect(self.concluded)
        self._begin.clicked.connect(self._on_begin_clicked)
        self._compute.clicked.connect(self._calibration.calibrate_by_capture)
        self._worst.currentRowChanged.connect(self._show_state)
        self._shows_residuals.toggled.connect(self._show_state)

        self._refresh()

    @override
    def closeEvent(self, event: QCloseEvent) -> None:
        self._calibration.discard()
        self._capture.start(None)
        self._calibration.set_remark(StatusMessage)
        super().closeEvent(event)

    @property
    def is_searching(self) -> bool:
        """Whether an image is being processed."""
        return self._capture.is_searching

    def read_folder(self, folder: str) -> None:
        """Calibrate by the images in a folder."""
        self._place.remember(Path(folder))
        board = self._named_board()
        if board is not None:
            self._calibration.calibrate_by_folder(folder, board)

    def save(self, path: Path) -> None:
        """Write the camera file and offer it for use."""
        self._place.remember(path.parent)
        self._calibration.save(path)

    def _on_begin_clicked(self) -> None:
        if self._capture.state.sought is not None:
            self._capture.stop()
        elif not is_refusing(self):
            self._calibration.discard()
            self._calibration.set_remark(StatusMessage)
            self._capture.start(self._named_board())

    def _named_board(self) -> Board | None:
        """Return the board of the fields, or report why there is none."""
        try:
            board = self.board.board()
        except UsageError as error:
            self._calibration.set_remark(partial(fault_message, error.message))
            return None
        return board

    def _on_image_shown(self, shown: DisplayedImage) -> None:
        if self._capture.state.sought is not None:
            self._live.hurry()
            self._image.set_half(shown.half, shown.size)
            self._capture.process_frame(shown.seen.frame)

    def _on_folder_clicked(self) -> None:
        if self._named_board() is None:
            return
        folder = QFileDialog.getExistingDirectory(
            self, self.tr("Board images"), str(self._place.folder())
        )
        if folder:
            self.read_folder(folder)

    def _on_remove_clicked(self) -> None:
        item = self._worst.currentItem()
        if item is not None:
            self._calibration.leave_out(item.data(Qt.ItemDataRole.UserRole))

    def _on_save_clicked(self) -> None:
        path = self._place.folder() / "camera.yaml"
        ask_file(self, self.tr("Save intrinsics file"), path, self.save)

    def _on_found_changed(self) -> None:
        found = self._calibration.found
        if self._capture.state.capture is None:  # the views are from a folder
            self._image.clear()
            if found is not None:
                width, height = found.views.image_sizes[0]
                blank = np.zeros((height // 2, width // 2), np.uint8)
                self._image.set_half(blank, QSize(width, height))
        self._list_views()
        self._show_state()

    def _list_views(self) -> None:
        found, chosen = self._calibration.found, self._worst.currentRow()
        self._worst.clear()
        if found is None:
            return
        rms = found.adjustment.view_rms[:, 0]
        for v in found.worst_first:
            words = self.tr("{0}: RMS {1:.4f} px, cross-validated {2:.4f} px")
            name = found.views.names[v]
            item = QListWidgetItem(
                words.format(name, rms[v], found.effects.held_out[v])
            )
            item.setData(Qt.ItemDataRole.UserRole, name)
            self._worst.addItem(item)
        self._worst.setCurrentRow(chosen)

    def _refresh(self) -> None:
        self._list_views()
        self._show_state()

    def _show_state(self) -> None:
        state, found = self._capture.state, self._calibration.found
        is_live = state.sought is not None
        self._begin.setText(self.tr("Stop") if is_live else self.tr("Start"))
        self._image.set_message(
            self.tr("Waiting for the first image")
            if is_live
            else self.tr("Start, then align the board with the outline.")
        )
        views = None if state.capture is None else state.capture.views
        if found is not None:
            views = found.views
        n_views = 0 if views is None else views.n_views
        self._count.setText(self.tr("Views captured: {0}").format(n_views))
        too_few = self.tr("At least {0} views are needed.").format(MIN_VIEWS)
        busy = ""
        if self._calibration.is_computing:
            busy = self.tr("Another operation is in progress.")
        self._folder.set_why_not(busy)
        self._compute.set_why_not(busy or (too_few if state.n_kept < MIN_VIEWS else ""))
        nothing = self.tr("Calibrate first.")
        self._save.set_why_not(busy or ("" if found is not None else nothing))
        is_chosen = found is not None and self._worst.currentItem() is not None
        self._remove.set_why_not(
            busy or ("" if is_chosen else self.tr("Select a view."))
        )
        self._outcome.setVisible(found is not None)
        self._facts.setText("" if found is None else facts_text(found))
        for button in (self._shows_residuals, self._shows_uncertainty):
            button.setVisible(found is not None)
        is_wanted = self._shows_uncertainty.isChecked()
        overlay = _overlay(state, found, shows_uncertainty=is_wanted)
        self._image.set_overlay(overlay)
        self._remark.set_value(sight_message(state) or self._calibration.remark())


def _overlay(
    state: CaptureState, found: CameraCalibration | None, *, shows_uncertainty: bool
) -> BoardOverlay:
    """Return the overlay of a calibration, or of the views so far."""
    if found is not None and shows_uncertainty:
        return BoardOverlay(uncertainty=uncertainty_over_image(found))
    if found is not None:
        return _residuals(found)
    if state.capture is None:
        return BoardOverlay()
    points = state.capture.points if state.sought is not None else None
    return BoardOverlay(points, state.outline)


def _residuals(found: CameraCalibration) -> BoardOverlay:
    seen = found.views.seen[:, 0]
    pixels, residuals = found.views.pixels[:, 0][seen], found.adjustment.residuals[:, 0]
    arrows = np.concatenate([pixels, residuals[seen]], axis=1)
    return BoardOverlay(arrows=arrows)
