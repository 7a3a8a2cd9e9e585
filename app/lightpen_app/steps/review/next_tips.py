"""The next tip after acceptance: other tips of the pen, one click each."""

from collections.abc import Sequence
from dataclasses import replace

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QIcon
from PySide6.QtWidgets import QWidget

from lightpen.record.library.tip_library import StationStatus, TipStatus
from lightpen.record.results.acceptance import NextTip, next_tips
from lightpen.record.results.results import Result
from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.look.theme import TextSize, Tone, text_label
from lightpen_app.look.words import PARTED, set_tooltip, shortened
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.state_banner import (
    StatusMessage,
    message_icon,
    status_message,
)
from lightpen_app.work.job import LatestJob
from lightpen_app.work.library_watch import LibraryWatch
from lightpen_app.work.selection import Selection
from lightpen_app.work.swing_run import SwingRun

LONGEST = 12  # characters of a tip on its button


class NextTipsRow(Translated, QWidget):
    """Shows other tips with their status; hidden without any."""

    chosen = Signal(object)  # NextTip: the tip to calibrate next

    def __init__(self) -> None:
        super().__init__()
        self._value: tuple[NextTip, ...] = ()
        self._buttons: list[PushButton] = []
        self._statuses = StationStatus()

        # Widgets
        self._label = self.say(
            text_label(TextSize.SMALL, Tone.QUIET), self.tr("Next tip")
        )

        # Layout
        self._layout = horizontal_layout(self, self._label)

        self._retranslate()
        self.hide()

    def value(self) -> tuple[NextTip, ...]:
        """Return the tips that are shown."""
        return self._value

    def set_statuses(self, statuses: StationStatus) -> None:
        """Mark the tips by status."""
        self._statuses = statuses
        self._retranslate()

    def set_value(self, value: Sequence[NextTip]) -> None:
        """Show other tips, or none."""
        self._value = tuple(value)
        while self._buttons:
            button = self._buttons.pop()
            self._layout.removeWidget(button)
            button.deleteLater()
        for each in self._value:
            button = PushButton(0)
            button.clicked.connect(lambda _=False, each=each: self.chosen.emit(each))
            self._buttons.append(button)
            self._layout.addWidget(button)
        self.setVisible(bool(value))
        self._retranslate()

    def _retranslate(self) -> None:
        for button, each in zip(self._buttons, self._value, strict=True):
            tip, mark = each.tip, self._mark_of(each)
            button.setText(shortened(tip, LONGEST))
            button.setIcon(message_icon(mark, self) if mark.text else QIcon())
            name = self.tr("Next tip {0}").format(tip)
            button.setAccessibleName(name)
            button.setAccessibleDescription(mark.text)
            tooltip = self.tr(
                "Calibrate tip {0} next with its ball diameter and nominal centre"
            )
            set_tooltip(
                button, PARTED.join(filter(None, (tooltip.format(tip), mark.text)))
            )

    def _mark_of(self, each: NextTip) -> StatusMessage:
        """Return why a tip needs attention: overdue, or not calibrated."""
        if each.last is not None and each.last.is_simulated:
            return StatusMessage()
        status = self._statuses.of_tip(each.pen, each.tip)
        return StatusMessage() if status is TipStatus.VALID else status_message(status)


class NextTipsControl(QObject):
    """Finds the other tips of a pen and selects the requested one."""

    # The station is prepared for another tip; the swing before is left.
    chosen = Signal()

    def __init__(
        self,
        selection: Selection,
        run: SwingRun,
        library: LibraryWatch,
        row: NextTipsRow,
    ) -> None:
        super().__init__(row)
        self._selection, self._run, self._tips = selection, run, library
        self._row = row
        self._search = LatestJob(self)

        # Connections
        library.changed.connect(self._show_statuses)
        row.chosen.connect(self._on_chosen)

        self._show_statuses()

    def follow(self, result: Result | None) -> None:
        """Show the other tips of the pen of an accepted tip."""
        self.shut_down()
        self._row.set_value(())
        if result is None:
            return
        archive = self._run.archive
        self._search.start(lambda _: next_tips(archive, result), self._row.set_value)

    def shut_down(self) -> None:
        """Stop."""
        self._search.cancel()

    def _show_statuses(self) -> None:
        self._row.set_statuses(self._tips.statuses)

    def _on_chosen(self, tip: NextTip) -> None:
        self._run.runner.ask(lambda workflow: workflow.abandon())
        now = self._selection.preparation
        chosen = now.renamed(replace(now.names, pen=tip.pen, tip=tip.tip))
        if tip.listed is not None:
            chosen = chosen.with_listed(tip.listed)
        if tip.last is not None:
            chosen = chosen.completed(tip.last)
        self._selection.set_preparation(chosen)
        self.chosen.emit()
