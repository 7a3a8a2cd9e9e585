"""Controller of the day page."""

from collections import deque
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from PySide6.QtCore import QObject, QTimer, Signal

from lightpen.swing.preparation import Preparation
from lightpen_app.face import ReadinessItem, Service
from lightpen_app.look.words import PARTED, shortened
from lightpen_app.steps.start.day_state import (
    CameraState,
    readiness,
    tip_details,
    tip_rows,
)
from lightpen_app.steps.start.day_view import DayView
from lightpen_app.steps.start.library_control import LibraryControl
from lightpen_app.widgets.page import MainAction
from lightpen_app.work.live_view import DisplayedImage
from lightpen_app.work.workbench import Workbench

REFRESH_MS = 500
LONGEST_NAME = 16  # letters of a tip on the main button
N_MISFITS = 10  # images by which the LEDs are judged


class DayControl(QObject):
    """Shows tips and readiness in the view; chooses tips."""

    changed = Signal()  # `main_action` may be different
    step_requested = Signal(str)  # key of the step to show

    def __init__(
        self,
        workbench: Workbench,
        services: Sequence[Service],
        library: LibraryControl,
        view: DayView,
    ) -> None:
        super().__init__(view)
        self._workbench, self._library, self._view = workbench, library, view
        self._services = tuple(services)
        self._selection, self._live = workbench.selection, workbench.live
        self._misfits: deque[float] = deque(maxlen=N_MISFITS)
        self._refreshing = QTimer(self, interval=REFRESH_MS)

        # Connections
        self._refreshing.timeout.connect(self.refresh_readiness)
        self._selection.changed.connect(self._on_selected)
        workbench.library.changed.connect(self.refresh)
        workbench.pens.changed.connect(self.refresh_readiness)
        self._live.image_shown.connect(self._on_image_shown)
        self._live.connection_changed.connect(self.refresh_readiness)
        view.tip_chosen.connect(self._on_tip_chosen)
        view.rows_changed.connect(self._on_rows_changed)
        view.tip_entered.connect(self._on_tip_entered)
        view.temperature_entered.connect(self._on_temperature_entered)
        view.step_requested.connect(self.step_requested)
        view.swing_requested.connect(lambda: self.step_requested.emit("swing"))

    def start(self) -> None:
        """Follow the camera while the page is shown."""
        self._misfits.clear()
        self.refresh()
        self._refreshing.start()

    def stop(self) -> None:
        """Stop updating the page."""
        self._refreshing.stop()

    def refresh(self) -> None:
        """Update tips and readiness."""
        now, statuses = self._selection.preparation, self._workbench.library.statuses
        self._view.set_tips(
            tip_rows(now, statuses), self._names(), tip_details(now, statuses)
        )
        self.refresh_readiness()

    def refresh_readiness(self) -> None:
        """Show whether a swing can start."""
        names = self._selection.preparation.names
        place = PARTED.join(map(shortened, (names.station, names.operator)))
        before, items = self._view.readiness(), self._items()
        now = self._selection.preparation
        can_swing = not (now.missing_inputs() or self._why_not_swing())
        is_asked = now.asks_temperature or now.lacks_temperature
        self._view.set_question(now.assumptions.temperature_c, is_asked=is_asked)
        self._view.set_ready(place, items, can_swing=can_swing)
        if items != before:
            self.changed.emit()

    def main_action(self) -> MainAction:
        """Return the action of the main button: swing, or show the missing input."""
        amber = self._first_amber()
        if amber is None:
            tip = shortened(self._selection.preparation.names.tip, LONGEST_NAME)
            return MainAction(
                self.tr("Swing tip {0}").format(tip), self._why_not_swing()
            )
        return MainAction(amber.action)

    def run_main_action(self) -> None:
        """Run the action of the main button."""
        amber = self._first_amber()
        if amber is not None and amber.step == "temperature":
            self._view.take_temperature()
        else:
            self.step_requested.emit("swing" if amber is None else amber.step)

    def _why_not_swing(self) -> str:
        """Return that the chosen tip is not among those that are searched."""
        names, text, rows = self._names(), self._view.search(), self._view.rows()
        if not text or any((row.pen, row.tip) == names for row in rows):
            return ""
        if rows:
            return self.tr("Choose a tip in the table, or clear the search.")
        words = self.tr("No tip matches {0}. Press Enter, or clear the search.")
        return words.format(shortened(text))

    def _names(self) -> tuple[str, str]:
        names = self._selection.preparation.names
        return names.pen, names.tip

    def _first_amber(self) -> ReadinessItem | None:
        return next((item for item in self._items() if item.is_amber), None)

    def _items(self) -> tuple[ReadinessItem, ...]:
        misfit = float(np.median(self._misfits)) if self._misfits else None
        rate = self._live.settings.frame_rate if self._live.is_open else None
        camera = CameraState(self._live.worst_connection, rate, misfit)
        own = readiness(
            self._selection.preparation,
            self._workbench.library.statuses,
            camera,
            self._workbench.pens.doubt(),
        )
        return (*own, *(item for each in self._services for item in each.readiness()))

    def _on_selected(self, before: Preparation) -> None:
        now = self._selection.preparation
        if now.pen is not before.pen or now.camera is not before.camera:
            self._misfits.clear()
        self.refresh()

    def _on_image_shown(self, shown: DisplayedImage) -> None:
        detection = shown.seen.detection
        if detection is not None and detection.has_pose:
            self._misfits.append(detection.sigma)

    def _on_temperature_entered(self, temperature_c: float | None) -> None:
        now = self._selection.preparation
        self._selection.set_preparation(now.with_temperature(temperature_c))

    def _on_rows_changed(self) -> None:
        self.refresh_readiness()
        self.changed.emit()

    def _on_tip_chosen(self, pen: str, tip: str) -> None:
        now = self._selection.preparation
        listed = self._library.tip(tip)
        names = replace(now.names, pen=pen, tip=tip)
        chosen = now.renamed(names)
        if listed is not None:
            chosen = chosen.with_listed(listed)
        self._selection.set_preparation(chosen)

    def _on_tip_entered(self, text: str) -> None:
        """Choose the only tip that matches; else find it in the library."""
        rows = self._view.rows()
        exact = [row for row in rows if row.tip.casefold() == text.casefold()]
        matching = exact or [row for row in rows if row.matches(text)]
        if len(matching) == 1:
            self._on_tip_chosen(matching[0].pen, matching[0].tip)
        else:
            self._library.take_code(text)
