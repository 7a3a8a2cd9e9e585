"""The images of a solved swing: list, image and residuals."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen.arrays import Image
from lightpen.formats.decoding import full_scale_of
from lightpen.record.swings.interrupted import ImageRow, count_left_out, worst_first
from lightpen.record.swings.solving import RecordSource, Solution, load_image
from lightpen_app.look.figures import arrow_scale, pooled
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import grid_layout, horizontal_layout
from lightpen_app.look.phrases import reason_text
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.steps.review.image_table import ImageTable
from lightpen_app.steps.review.plots_panel import card_of
from lightpen_app.steps.review.residual_plots import (
    NO_ARROWS,
    Arrows,
    MisfitPlot,
    ResidualView,
)
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.figure import Axes
from lightpen_app.widgets.fitting import NO_ROOM, ResponsiveLayout
from lightpen_app.widgets.image_view import Marker
from lightpen_app.widgets.live_markers import CameraSwitch
from lightpen_app.work.job import LatestJob, Report

TABLE_WIDTH = 38 * GRID
VIEW_SHARE, PLOT_SHARE = 3, 2  # of the height
LEAST_HEIGHT = 9 * GRID  # px, of the image
RING = 10.0  # image px about an LED


@dataclass(frozen=True, eq=False)
class _Decoded:
    """A recorded image, ready to be shown."""

    source: RecordSource
    number: int
    camera: int
    half: Image
    size: QSize


class ImagesPanel(ResponsiveLayout, Translated, QWidget):
    """Shows the images of a solution; requests to exclude or include some.

    Delete excludes the selected images, Insert includes them.
    """

    narrow_below = 90 * GRID  # px; then the plot is below the image

    # list of int: numbers of images
    exclude_requested = Signal(list)
    include_requested = Signal(list)

    def __init__(self) -> None:
        super().__init__()
        self._solution: Solution | None = None
        self._room = NO_ROOM
        self._why_locked = ""
        self._job = LatestJob(self)
        self._loading: tuple[RecordSource, int, int] | None = None
        self._shown: tuple[int, int] | None = None  # number and camera

        # Widgets
        self._table = ImageTable()
        self._exclude = self.make_button(self.tr("Exclude"), self._on_exclude_clicked)
        self._include = self.make_button(self.tr("Include"), self._on_include_clicked)
        self._count = text_label(TextSize.SMALL, Tone.QUIET)
        self._view = ResidualView()
        self._view.setMinimumHeight(LEAST_HEIGHT)
        self._caption = text_label(TextSize.SMALL, Tone.QUIET)
        self._switch = CameraSwitch()
        self._switch.hide()
        self._misfits = MisfitPlot(Axes(""))
        self._card = card_of(self._misfits)

        # Layout
        self._grid = layout = grid_layout(self, margins=(0, GRID, 0, 0))
        layout.addWidget(self._table, 0, 0, 4, 1)
        layout.addWidget(self._switch, 4, 0)  # the image is too narrow for it
        layout.addWidget(self._count, 5, 0)
        horizontal_layout(layout, (self._exclude, 1), (self._include, 1), at=(6, 0))
        layout.setColumnMinimumWidth(0, TABLE_WIDTH)
        layout.setColumnStretch(1, 1)
        self._use_room()

        # Connections
        self._table.number_changed.connect(self._on_choice_changed)
        self._table.selection_changed.connect(self._refresh_buttons)
        self._switch.value_changed.connect(self._on_choice_changed)
        self._misfits.number_chosen.connect(self._table.choose)
        self._shortcut(QKeySequence.StandardKey.Delete, self._exclude.click)
        self._shortcut(Qt.Key.Key_Insert, self._include.click)

        self._refresh()

    @override
    def _use_room(self) -> None:
        """Place the plot beside the image, or below it."""
        is_narrow, grid = self._room.is_narrow, self._grid
        grid.addWidget(self._view, 0, 1, 1 if is_narrow else 7, 1)
        grid.addWidget(self._caption, 1 if is_narrow else 7, 1)
        if is_narrow:
            grid.addWidget(self._card, 3, 1, 5, 1)
        else:
            grid.addWidget(self._card, 0, 2, 8, 1)
        grid.setColumnStretch(2, 0 if is_narrow else 1)
        grid.setRowStretch(0, VIEW_SHARE)
        grid.setRowStretch(3, PLOT_SHARE if is_narrow else 0)

    def value(self) -> Solution | None:
        """Return the displayed solution."""
        return self._solution

    def set_value(self, solution: Solution | None, _limit: float | None = None) -> None:
        """Show the images of another solution; the chosen ones stay chosen."""
        before, self._solution = self._solution, solution
        if solution is None or before is None or before.source != solution.source:
            self.shut_down()
            self._clear_view()
        if not self._is_of_rig():
            self._switch.set_value(0)
        self._switch.setVisible(self._is_of_rig() and not self._view.isHidden())
        if _is_of_another(before, solution):
            self._table.set_value(())  # so that its worst is chosen
        rows = () if solution is None else worst_first(solution)
        self._table.set_value(rows)
        self._refresh_misfits()
        self._refresh_texts()
        self._mark()
        if self._shown is None and not self._job.is_running:
            self._load_wanted()

    def set_locked(self, why: str) -> None:
        """Lock the exclusion of images, with the reason, or unlock it."""
        self._why_locked = why
        self._refresh_buttons()

    def shut_down(self) -> None:
        """Stop reading an image."""
        self._job.cancel()

    def _shortcut(
        self, key: QKeySequence.StandardKey | Qt.Key, act: Callable[[], None]
    ) -> None:
        shortcut = QShortcut(QKeySequence(key), self)
        shortcut.setContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
        shortcut.activated.connect(act)

    def _refresh(self) -> None:
        self._misfits.set_axes(
            Axes(self.tr("RMS / px (x: excluded)"), self.tr("image"))
        )
        self._refresh_texts()
        self._refresh_buttons()
        self._mark()

    def _refresh_misfits(self) -> None:
        solution = self._solution
        if solution is None:
            empty = np.zeros(0)
            self._misfits.set_data(empty.astype(np.int64), empty, empty.astype(bool))
            return
        used = solution.calibration.used
        self._misfits.set_data(solution.numbers, solution.misfits, used)

    def _refresh_texts(self) -> None:
        solution = self._solution
        if solution is None:
            self._count.clear()
            return
        reasons = count_left_out(solution).items()
        each = self.tr("{0} {1}")
        parts = [each.format(count, reason_text(reason)) for reason, count in reasons]
        self._count.setText(self.tr("; ").join(parts))

    def _refresh_buttons(self) -> None:
        rows = self._table.selected()
        why_not_exclude, why_not_include = self._why_locked, self._why_locked
        if not rows:
            why_not_exclude = why_not_include = why_not_exclude or self.tr(
                "No image is selected."
            )
        elif not any(row.is_used for row in rows):
            why_not_exclude = why_not_exclude or self.tr("Already excluded")
        if not why_not_include and not any(row.can_be_included for row in rows):
            why_not_include = self._why_not_include(rows[0])
        self._exclude.set_why_not(
            why_not_exclude,
            self.tr("Exclude the selected images and recompute (Delete)"),
        )
        self._include.set_why_not(
            why_not_include,
            self.tr("Include the selected images and recompute (Insert)"),
        )

    def _why_not_include(self, row: ImageRow) -> str:
        if row.is_used:
            return self.tr("Already included")
        text = self.tr("Excluded automatically: {0}")
        return text.format(reason_text(row.reason))

    def _mark(self) -> None:
        """Draw the detections of the displayed image and describe it."""
        solution, number = self._solution, self._table.number()
        self._misfits.set_number(number)
        if solution is None or number is None:
            self._caption.clear()
            return
        index = int(np.searchsorted(solution.numbers, number))
        camera = self._switch.value()
        seen_by = solution.seen_by(camera)
        points = seen_by.seen_pixels[index]
        residuals = solution.residuals[index, camera]
        seen = np.isfinite(points[:, 0])
        fitted = np.isfinite(residuals[:, 0])
        extent = np.ptp(points[seen], axis=0).max() if seen.any() else 1.0
        scale = arrow_scale(residuals[fitted], 2 * float(extent))
        if (number, camera) == self._shown:
            used = solution.calibration.cameras[camera].leds_used[index]
            takes_part = bool(solution.calibration.used[index])
            self._view.set_markers(
                [
                    _ring(x, y, led + 1, bool(used[led]) or not takes_part, takes_part)
                    for led, (x, y) in enumerate(points.tolist())
                    if seen[led]
                ]
            )
            arrows = Arrows(points[fitted], residuals[fitted], scale)
            self._view.set_arrows(arrows)
        detail = seen_by.details[index]
        if fitted.any():
            text = self.tr("Image {0}, residuals \xd7 {1}")
            self._caption.setText(text.format(number, f"{scale:g}"))
        else:
            text = self.tr("Image {0}: pen not found. {1}")
            self._caption.setText(text.format(number, worded(detail)))

    def _on_choice_changed(self) -> None:
        self._mark()
        if not self._job.is_running:
            self._load_wanted()

    def _load_wanted(self) -> None:
        """Read the image that is chosen off the thread of the GUI, one at a time."""
        self._loading = self._wanted()
        if self._loading is None or self._solution is None:
            return
        _, number, camera = self._loading
        self._job.start(
            partial(_decoded, self._solution, number, camera),
            self._on_decoded,
            self._on_undecoded,
            crashed=lambda: self._on_undecoded(self.tr("Image not available")),
        )

    def _on_decoded(self, image: _Decoded) -> None:
        if (image.source, image.number, image.camera) != self._wanted():
            self._load_wanted()
            return
        self._shown = image.number, image.camera
        self._view.set_half(image.half, image.size)
        self._mark()
        rings = [(ring.x, ring.y) for ring in self._view.markers()]
        self._view.show_around(np.array(rings).reshape(-1, 2))

    def _on_undecoded(self, sentence: str) -> None:
        if self._loading != self._wanted():
            self._load_wanted()
            return
        self._clear_view()
        self._view.set_message(sentence)

    def _wanted(self) -> tuple[RecordSource, int, int] | None:
        """Return number and camera of the selected image."""
        number = self._table.number()
        if self._solution is None or number is None:
            return None
        return self._solution.source, number, self._switch.value()

    def _is_of_rig(self) -> bool:
        return self._solution is not None and self._solution.source.rig.n_cameras > 1

    def _clear_view(self) -> None:
        self._shown = None
        self._view.clear()
        self._view.set_message("")
        self._view.set_arrows(NO_ARROWS)

    def _on_exclude_clicked(self) -> None:
        rows = self._table.selected()
        self.exclude_requested.emit([row.number for row in rows if row.is_used])

    def _on_include_clicked(self) -> None:
        rows = self._table.selected()
        self.include_requested.emit([r.number for r in rows if r.can_be_included])


def _decoded(solution: Solution, number: int, camera: int, report: Report) -> _Decoded:
    report(0.0)
    image = load_image(solution, number, camera)
    height, width = image.shape
    source = solution.source.images[camera]
    full_scale = source.full_scale or full_scale_of(image)
    half = pooled(image, full_scale.bit_length())
    return _Decoded(solution.source, number, camera, half, QSize(width, height))


def _ring(x: float, y: float, led: int, fits: bool, takes_part: bool) -> Marker:
    """Return the marker of an LED; one excluded from the fit is crossed."""
    tone = (Tone.GOOD if fits else Tone.WARN) if takes_part else Tone.ACTIVE
    return Marker(x, y, RING, str(led), tone, crossed=not fits)


def _is_of_another(before: Solution | None, now: Solution | None) -> bool:
    """Whether the images are of another swing."""
    return before is None or now is None or before.source.folder != now.source.folder
