"""The current tip of a pen and probe tip, and its age."""

from collections.abc import Callable
from datetime import datetime
from functools import partial

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QGroupBox
from typing_extensions import override

from lightpen.local_time import local_time
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
from lightpen_app.work.workbench import Workbench


class LastResultPanel(Translated, QGroupBox):
    """Shows the last accepted calibration: age, verdict, tip and uncertainty."""

    verification_requested = Signal()  # verify the displayed tip

    def __init__(self, workbench: Workbench, *, can_verify: bool = True) -> None:
        super().__init__()
        self._selection, self._run = workbench.selection, workbench.run
        self._library, self._now = workbench.library, workbench.around.now
        self._result: Result | None = None
        self._fault = ""  # why it is unknown
        self._lookup = LatestJob(self)

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
        self._can_verify = can_verify
        self._revoke = self.make_button(
            self.tr("Revoke acceptance..."),
            self._ask_to_revoke,
            tip=self.tr(
                "Reinstate the previous result. Both results stay in the archive."
            ),
        )
        self._withdrawal = WithdrawalBar()

        # Layout
        layout = vertical_layout(self, spacing=GRID // 2)
        middle = Qt.AlignmentFlag.AlignVCenter
        marks = ((each, 0, middle) for each in (self._grade, self._status))
        horizontal_layout(layout, self._age, *marks, 1, spacing=2 * GRID)
        fill(layout, self._when, self._table, self._origin, self._reason)
        fill(layout, self._warning)
        horizontal_layout(layout, self._verify, self._revoke, 1)
        fill(layout, self._withdrawal)

        # Connections
        self._withdrawal.given.connect(self._on_given)
        self._withdrawal.declined.connect(self._revoke.setFocus)
        self._selection.changed.connect(self._on_selected)
        self._library.changed.connect(self._refresh)
        self._run.result_changed.connect(self.look_up)

        self._refresh()

    def set_value(self, result: Result | None, fault: str = "") -> None:
        """Show another result, or why it is unknown."""
        self._result, self._fault = result, fault
        self._withdrawal.hide()
        self._refresh()

    def look_up(self) -> None:
        """Read the current result."""
        self._look_up(self.set_value)

    def shut_down(self) -> None:
        """Stop."""
        self._lookup.cancel()

    def _look_up(self, show: Callable[[Result | None], None]) -> None:
        self.shut_down()
        pen, tip, is_simulated = _key(self._selection.preparation)
        if not (pen and tip):
            self.set_value(None)
            return
        archive, unknown = self._run.archive, self.tr("Last calibration not available")
        self._lookup.start(
            lambda _: archive.in_force(pen, tip, is_simulated=is_simulated),
            show,
            partial(self.set_value, None),
            crashed=lambda: self.set_value(None, unknown),
        )

    def _on_selected(self, before: Preparation) -> None:
        self._refresh()
        if _key(self._selection.preparation) != _key(before):
            self._look_up(self._on_other_found)

    def _on_other_found(self, result: Result | None) -> None:
        self.set_value(result)
        if result is not None:
            completed = self._selection.preparation.completed(result)
            self._selection.set_preparation(completed)

    def words(self) -> tuple[str, ...]:
        """Return the texts, line by line."""
        marks = [each.value().text for each in (self._grade, self._status)]
        lines = [self._age.text(), *marks, self._when.text()]
        if self._result is not None:
            shown = self._table.value()
            rows = zip(shown.rows, shown.cells, strict=True)
            lines += [" ".join((axis, *cells)) for axis, cells in rows]
        remarks = (self._origin, self._reason, self._warning)
        lines += [remark.value().text for remark in remarks]
        return tuple(filter(None, lines))

    @override
    def _refresh(self) -> None:
        now, result = self._selection.preparation, self._result
        pen, tip, is_simulated = _key(now)
        self.setTitle(
            self.tr("Last practice with this pen and tip")
            if is_simulated
            else self.tr("Last calibration of this pen and tip")
        )
        status = None if is_simulated else self._library.statuses.of_tip(pen, tip)
        self._status.set_value(
            status_message(None if status is TipStatus.VALID else status)
        )
        tooltip = self.tr(
            "Half a minute: leave the tip in the cone and lean the pen to six sides."
        )
        self._verify.set_why_not(first_missing(now.missing_inputs()), tooltip)
        self._verify.setVisible(result is not None and self._can_verify)
        self._revoke.setVisible(result is not None)
        if result is not None:
            self._show(result)
        elif self._fault:
            self._say(fault=self._fault)
        elif pen and tip:
            self._say(
                self.tr("No result yet"),
                self.tr("Accepted practice results are stored apart from real pens.")
                if is_simulated
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

    def _ask_to_revoke(self) -> None:
        is_guarded = self._selection.supervision.is_guarded
        self._withdrawal.ask(of_supervisor=is_guarded)

    def _on_given(self, reason: str, signature: Signature | None) -> None:
        result, operator = self._result, self._selection.preparation.names.operator
        if result is not None:
            self._run.runner.ask(
                lambda workflow: workflow.solving.revoke(
                    result, operator, reason, signature
                )
            )

    def _warning_of(self, result: Result, now: datetime) -> StatusMessage:
        due = self._selection.limits.due
        rule = self._library.library.rule_of(result.names.tip, due)
        if result.accepted > now:
            text = self.tr(
                "Calibration date is in the future. Check the clock of this computer."
            )
        elif now > rule.due(result.accepted):
            text = self.tr(
                "Calibration is older than {0} days. Calibrate before you measure."
            ).format(rule.max_days)
        else:
            return StatusMessage()
        return StatusMessage.warning(text)

    def _age_text(self, result: Result, now: datetime) -> str:
        days = (now.date() - local_time(result.accepted).date()).days
        if days < 0:
            return self.tr("In the future")
        return age_text(days)


def _key(preparation: Preparation) -> tuple[str, str, bool]:
    names = preparation.names
    return names.pen, names.tip, preparation.origin is Origin.SIMULATED
