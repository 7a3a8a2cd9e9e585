"""The current tip of a pen and probe tip, and its age."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtWidgets import QGroupBox

from lightpen.local_time import local_time
from lightpen.model.limits import DueRule
from lightpen.model.names import Origin
from lightpen.record.library.supervision import Signature
from lightpen.record.library.tip_library import TipStatus
from lightpen.record.results.results import Result
from lightpen.swing.preparation import Preparation
from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.phrases import GRADE_MARKS, age_text, first_missing, grade_text
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import AXES, PARTED, mm_text, moment_text, shortened
from lightpen_app.widgets.bars import WithdrawalBar
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.state_banner import (
    SignLabel,
    StatusMessage,
    origin_message,
    status_message,
)
from lightpen_app.widgets.tables import Figures, NumberTable
from lightpen_app.work.job import LatestJob
from lightpen_app.work.library_watch import LibraryWatch
from lightpen_app.work.selection import Selection
from lightpen_app.work.swing_run import SwingRun


@dataclass(frozen=True, eq=False)
class LastResult:
    """Data of the current tip."""

    result: Result | None = None  # None before the first
    is_named: bool = True  # whether pen and tip are named at all
    fault: str = ""  # why it is unknown; else empty
    is_simulated: bool = False


class LastResultPanel(Translated, QGroupBox):
    """Shows the last accepted calibration: age, verdict, tip and uncertainty."""

    # Result, str, Signature or None: result to revoke, and reason.
    take_back_requested = Signal(object, str, object)
    verification_requested = Signal()  # verify the displayed tip

    def __init__(self, now: Callable[[], datetime], can_verify: bool = True) -> None:
        super().__init__()
        self._now = now
        self._value = LastResult()
        self._rule = DueRule()
        self._marked: TipStatus | None = None

        # Widgets
        self._age = text_label(TextSize.TITLE)
        self._age.setWordWrap(False)
        self._grade = SignLabel(wraps=False)
        self._status = SignLabel(wraps=False)
        self._when = text_label(TextSize.SMALL, Tone.QUIET)
        self._table = NumberTable()
        self._origin = SignLabel()
        self._reason = SignLabel()
        self._warning = SignLabel()
        self._verify = self.make_button(
            self.tr("Verify tip"), self.verification_requested
        )
        if not can_verify:
            self._verify.hide()
        self._take_back = self.make_button(
            self.tr("Revoke acceptance..."),
            self._ask_to_take_back,
            tip=self.tr(
                "Reinstate the previous result. Both results stay in the archive."
            ),
        )
        self._withdrawal = WithdrawalBar()
        self._is_guarded = False

        # Layout
        layout = vertical_layout(self, spacing=GRID // 2)
        middle = Qt.AlignmentFlag.AlignVCenter
        marks = ((each, 0, middle) for each in (self._grade, self._status))
        horizontal_layout(layout, self._age, *marks, 1, spacing=2 * GRID)
        fill(layout, self._when, self._table, self._origin, self._reason)
        fill(layout, self._warning)
        horizontal_layout(layout, self._verify, self._take_back, 1)
        fill(layout, self._withdrawal)

        # Connections
        self._withdrawal.given.connect(self._on_given)
        self._withdrawal.declined.connect(self._take_back.setFocus)

        self._refresh()

    def set_value(self, value: LastResult) -> None:
        """Show another result, or why there is none."""
        self._value = value
        self._withdrawal.hide()
        self._refresh()

    def set_rule(self, rule: DueRule) -> None:
        """Set the calibration interval."""
        if rule != self._rule:
            self._rule = rule
            self._refresh()

    def set_status(self, status: TipStatus | None) -> None:
        """Mark a tip that must not be used for measuring; None if unknown."""
        self._marked = None if status is TipStatus.VALID else status
        self._status.set_value(status_message(self._marked))

    def set_why_unverified(self, why_not: str) -> None:
        """Disable verification with a reason, or enable it."""
        tooltip = self.tr(
            "Half a minute: leave the tip in the cone and lean the pen to six sides."
        )
        self._verify.set_why_not(why_not, tooltip)

    def words(self) -> tuple[str, ...]:
        """Return the texts, line by line."""
        marks = [each.value().text for each in (self._grade, self._status)]
        lines = [self._age.text(), *marks, self._when.text()]
        if self._value.result is not None:
            shown = self._table.value()
            rows = zip(shown.rows, shown.cells, strict=True)
            lines += [" ".join((axis, *cells)) for axis, cells in rows]
        remarks = (self._origin, self._reason, self._warning)
        lines += [remark.value().text for remark in remarks]
        return tuple(filter(None, lines))

    def _refresh(self) -> None:
        value = self._value
        self.setTitle(
            self.tr("Last practice with this pen and tip")
            if value.is_simulated
            else self.tr("Last calibration of this pen and tip")
        )
        self._status.set_value(status_message(self._marked))
        for button in (self._verify, self._take_back):
            button.setVisible(value.result is not None)
        if value.result is not None:
            self._show(value.result)
        elif value.fault:
            self._say(fault=value.fault)
        elif value.is_named:
            self._say(
                self.tr("No result yet"),
                self.tr("Accepted practice results are stored apart from real pens.")
                if value.is_simulated
                else self.tr("The first accepted result becomes the current tip."),
            )
        else:
            self._say(
                hint=self.tr("Select a pen and a tip to see the last calibration.")
            )

    def _say(self, short: str = "", hint: str = "", fault: str = "") -> None:
        """Say why there is no result."""
        self._age.setText(short)
        self._age.setVisible(bool(short))
        self._grade.set_value(StatusMessage())
        self._when.setText(hint)
        self._when.setVisible(bool(hint))
        self._table.hide()
        for remark in (self._origin, self._reason):
            remark.set_value(StatusMessage())
        self._warning.set_value(StatusMessage.fault(fault))

    def _show(self, result: Result) -> None:
        now = self._now()
        for widget in (self._age, self._when, self._table):
            widget.show()
        self._age.setText(self._age_text(result, now))
        self._grade.set_value(
            StatusMessage(grade_text(result.grade), *GRADE_MARKS[result.grade])
        )
        when = moment_text(result.accepted)
        by = shortened(result.names.operator)
        self._when.setText(PARTED.join(filter(None, (when, by))))
        heads = self.tr("Tip centre / mm"), self.tr("U (k = 2) / mm")
        numbers = zip(result.tip_pen.tolist(), result.uncertainty.tolist(), strict=True)
        cells = tuple(tuple(map(mm_text, row)) for row in numbers)
        self._table.set_value(Figures(heads, AXES, cells))
        self._origin.set_value(origin_message(result.origin))
        self._reason.set_value(self._reason_of(result))
        self._warning.set_value(self._warning_of(result, now))

    def _reason_of(self, result: Result) -> StatusMessage:
        """Return why it was accepted though it was to be checked."""
        if not result.reason:
            return StatusMessage()
        text = self.tr("Accepted. Reason: {0}").format(result.reason)
        if result.supervisor:
            text = self.tr("Accepted by supervisor {0}. Reason: {1}")
            text = text.format(shortened(result.supervisor), result.reason)
        return StatusMessage.warning(text)

    def set_guarded(self, is_guarded: bool) -> None:
        """Ask for a supervisor before an acceptance is revoked, or for none."""
        self._is_guarded = is_guarded

    def _ask_to_take_back(self) -> None:
        self._withdrawal.ask(of_supervisor=self._is_guarded)

    def _on_given(self, reason: str, signature: Signature | None) -> None:
        self.take_back_requested.emit(self._value.result, reason, signature)

    def _warning_of(self, result: Result, now: datetime) -> StatusMessage:
        if result.accepted > now:
            text = self.tr(
                "Calibration date is in the future. Check the clock of this computer."
            )
        elif now > self._rule.due(result.accepted):
            text = self.tr(
                "Calibration is older than {0} days. Calibrate before you measure."
            ).format(self._rule.max_days)
        else:
            return StatusMessage()
        return StatusMessage.warning(text)

    def _age_text(self, result: Result, now: datetime) -> str:
        days = (now.date() - local_time(result.accepted).date()).days
        if days < 0:
            return self.tr("In the future")
        return age_text(days)


class LastResultPresenter(QObject):
    """Shows the last result of the selected tip."""

    verification_requested = Signal()  # verify the displayed tip

    def __init__(
        self,
        selection: Selection,
        run: SwingRun,
        library: LibraryWatch,
        panel: LastResultPanel,
    ) -> None:
        super().__init__(panel)
        self._selection, self._run, self._library = selection, run, library
        self._panel = panel
        self._lookup = LatestJob(self)

        # Connections
        selection.changed.connect(self._on_selected)
        library.changed.connect(self.show_status)
        run.result_changed.connect(self.look_up)
        panel.take_back_requested.connect(self._on_take_back_requested)
        panel.verification_requested.connect(self.verification_requested)

        self.show_status()

    def look_up(self) -> None:
        """Read the current result."""
        self._look_up(lambda result: None)

    def shut_down(self) -> None:
        """Stop."""
        self._lookup.cancel()

    def _look_up(self, use: Callable[[Result | None], None]) -> None:
        self.shut_down()
        pen, tip, is_simulated = _key(self._selection.preparation)
        if not (pen and tip):
            self._panel.set_value(LastResult(is_named=False))
            return
        archive = self._run.archive

        def show(result: Result | None) -> None:
            self._panel.set_value(LastResult(result, is_simulated=is_simulated))
            use(result)

        self._lookup.start(
            lambda _: archive.in_force(pen, tip, is_simulated=is_simulated),
            show,
            self._on_failed,
            crashed=lambda: self._on_failed(self.tr("Last calibration not available")),
        )

    def _fill_in(self, result: Result | None) -> None:
        if result is not None:
            completed = self._selection.preparation.completed(result)
            self._selection.set_preparation(completed)

    def _on_failed(self, sentence: str) -> None:
        self._panel.set_value(LastResult(fault=sentence))

    def _on_selected(self, before: Preparation) -> None:
        self.show_status()
        if _key(self._selection.preparation) != _key(before):
            self._look_up(self._fill_in)

    def show_status(self) -> None:
        """Mark the selected tip by its status."""
        now, library = self._selection.preparation, self._library
        self._panel.set_guarded(self._selection.supervision.is_guarded)
        status = library.statuses.of_tip(now.names.pen, now.names.tip)
        self._panel.set_status(None if now.origin is Origin.SIMULATED else status)
        due = self._selection.limits.due
        self._panel.set_rule(library.library.rule_of(now.names.tip, due))
        self._panel.set_why_unverified(first_missing(now.missing_inputs()))

    def _on_take_back_requested(
        self, result: Result, reason: str, signature: Signature | None
    ) -> None:
        operator = self._selection.preparation.names.operator
        self._run.runner.ask(
            lambda workflow: workflow.solving.revoke(
                result, operator, reason, signature
            )
        )


def _key(preparation: Preparation) -> tuple[str, str, bool]:
    names = preparation.names
    return names.pen, names.tip, preparation.origin is Origin.SIMULATED
