"""The result of a swing: the tip, its uncertainty, and the change."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import date

from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import QFrame, QLabel, QSizePolicy, QVBoxLayout, QWidget
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.consistency_test import SelfCheck
from lightpen.estimation.reports.report_warnings import reported
from lightpen.estimation.reports.verdict import halves_agree
from lightpen.model.bending import ASSUMED_BENDING
from lightpen.model.names import Origin
from lightpen.record.library.tip_library import Library
from lightpen.record.results.acceptance import SwingAssessment
from lightpen.record.swings.header import Names
from lightpen.record.swings.solving import Solution
from lightpen.swing.status import SwingStatus
from lightpen_app.look.languages import listed, worded
from lightpen_app.look.layouts import (
    fill,
    grid_layout,
    horizontal_layout,
    vertical_layout,
)
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, set_tone, text_label
from lightpen_app.look.words import AXES, day_text, mm_text
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import PageScroll
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.widgets.tables import Figures, NumberTable


@dataclass(frozen=True)
class TipValue:
    """A point with uncertainty, and its reference value."""

    tip: tuple[float, float, float]  # mm
    uncertainty: tuple[float, float, float]  # U (k = 2) along x, y and z, mm
    previous: tuple[str, ...] = ()  # result, mm; empty without one
    change: tuple[str, ...] = ()  # of the tip since then, with its U (k = 2), mm
    nominal: tuple[str, ...] = ()  # centre by design, mm; empty without one
    deviation: tuple[str, ...] = ()  # of the tip from it, mm
    since: str = ""  # date of the previous result

    def comparisons(self) -> tuple[tuple[str, ...], ...]:
        """Return the columns beside tip and U."""
        return self.previous, self.change, self.nominal, self.deviation


class TipReadout(QWidget):
    """Shows a tip to the digit that its uncertainty warrants, a row for each axis."""

    def __init__(self) -> None:
        super().__init__()
        self._value: TipValue | None = None

        # Widgets
        self._names = [text_label(TextSize.BODY, Tone.QUIET) for _ in AXES]
        self._numbers = [_number_label(TextSize.BODY) for _ in AXES]
        self._uncertainties = [_number_label(TextSize.SMALL, Tone.QUIET) for _ in AXES]

        # Layout
        layout = grid_layout(self, spacing=(2 * GRID, 0))
        right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignBaseline
        columns = self._names, self._numbers, self._uncertainties
        for column, labels in enumerate(columns):
            for row, label in enumerate(labels):
                layout.addWidget(label, row, column, right)
        layout.setColumnStretch(len(columns), 1)
        for name, axis in zip(self._names, AXES, strict=True):
            name.setText(axis)

    def set_value(self, value: TipValue | None) -> None:
        """Show another tip, or none."""
        self._value = value
        for row, axis in enumerate(AXES):
            number, uncertainty = self._numbers[row], self._uncertainties[row]
            if value is None:
                number.clear()
                uncertainty.clear()
                continue
            number.setText(mm_text(value.tip[row]))
            within = mm_text(value.uncertainty[row])
            uncertainty.setText(f"\N{PLUS-MINUS SIGN} {within}")
            number.setAccessibleName(f"{axis} = {number.text()} mm")
            uncertainty.setAccessibleName(f"{uncertainty.text()} mm")


def _number_label(size: TextSize, tone: Tone = Tone.PLAIN) -> QLabel:
    label = text_label(size, tone)
    label.setWordWrap(False)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    label.setAlignment(Qt.AlignmentFlag.AlignRight)
    return label


SIDE = 3 * GRID // 2  # px, margin: figures fit a window of 800 px


@dataclass(frozen=True, eq=False)
class ReviewedResult:
    """A solved swing with the result that was current before."""

    solution: Solution
    names: Names  # of the swing
    assessment: SwingAssessment
    limit: float | None = None  # of U, mm

    @property
    def tip_pen(self) -> FloatArray:
        """The tip, pen frame, (3,), mm."""
        return reported(self.solution.calibration).tip_pen

    @property
    def uncertainty(self) -> FloatArray:
        """U (k = 2) along x, y and z, (3,), mm."""
        return reported(self.solution.calibration).expanded_uncertainty[:3]

    @property
    def weakest_uncertainty(self) -> float:
        """U (k = 2) along the weakest direction, mm."""
        return reported(self.solution.calibration).budget.weakest_uncertainty


def reviewed_result(status: SwingStatus) -> ReviewedResult | None:
    """Return what a swing is solved to; None until it is."""
    if status.solution is None or status.assessment is None:
        return None
    limit = None if status.setup is None else status.setup.limits.max_uncertainty
    return ReviewedResult(status.solution, status.names, status.assessment, limit)


class TipSummary(Translated, QFrame):
    """Shows U beside its limit, in large figures, and the tip."""

    def __init__(self) -> None:
        super().__init__()
        self._value: ReviewedResult | None = None
        self.setProperty("area", "panel")

        # Widgets
        self._of_u = self.say(
            text_label(TextSize.SMALL, Tone.QUIET),
            self.tr("U (k = 2) of the tip in its weakest direction"),
        )
        self._u = text_label(TextSize.DISPLAY)
        self._limit = text_label(TextSize.LEAD, Tone.QUIET)
        for label in (self._u, self._limit):
            label.setWordWrap(False)
        self._heading = text_label(TextSize.SMALL, Tone.QUIET)
        self._readout = TipReadout()

        # Layout
        margins = SIDE, GRID, SIDE, GRID
        layout = horizontal_layout(self, spacing=3 * GRID, margins=margins)
        left = vertical_layout(layout, self._of_u, spacing=0, stretch=1)
        bottom = Qt.AlignmentFlag.AlignBottom
        row = (self._u, 0, bottom), (self._limit, 0, bottom), 1
        horizontal_layout(left, *row, spacing=2 * GRID)
        vertical_layout(layout, self._heading, self._readout, spacing=0, stretch=1)

        self._refresh()

    def set_value(self, value: ReviewedResult | None) -> None:
        """Show another outcome, or none."""
        self._value = value
        self._refresh()

    def _refresh(self) -> None:
        outcome = self._value
        if outcome is None:
            self._heading.setText(self.tr("Tip in the pen frame / mm, U (k = 2)"))
            self._readout.set_value(None)
            self._u.setText("\N{EN DASH}")
            self._limit.clear()
            return
        text = self.tr("Tip {0} in the frame of pen {1} / mm, U\xa0(k\xa0=\xa02)")
        self._heading.setText(text.format(outcome.names.tip, outcome.names.pen))
        self._readout.set_value(_tip_value(outcome))
        u, limit = outcome.weakest_uncertainty, outcome.limit
        self._u.setText(f"{mm_text(u)} mm")
        set_tone(self._u, Tone.BAD if limit is not None and u > limit else Tone.PLAIN)
        limit_words = self.tr("limit {0} mm")
        self._limit.setText("" if limit is None else limit_words.format(mm_text(limit)))


class ResultPanel(Translated, QFrame):
    """Shows what an outcome is compared with."""

    def __init__(self) -> None:
        super().__init__()
        self._value: ReviewedResult | None = None
        self.setProperty("area", "panel")

        # Widgets
        self._comparison = NumberTable()
        self._as_found = SignLabel()
        self._halves = SignLabel()
        self._self_check = SignLabel()
        self._bending = SignLabel()
        self._bending_words: Callable[[], StatusMessage] = StatusMessage
        self._images = SignLabel()

        # Layout
        margins = SIDE, 2 * GRID, SIDE, 2 * GRID
        layout = vertical_layout(self, spacing=GRID // 2, margins=margins)
        fill(layout, self._as_found, self._halves, self._self_check, self._bending)
        fill(layout, self._images)
        layout.addSpacing(GRID)
        fill(layout, self._comparison, 1)

        self._refresh()

    def value(self) -> ReviewedResult | None:
        """Return the outcome that is shown."""
        return self._value

    def set_value(self, value: ReviewedResult | None) -> None:
        """Show another outcome, or none."""
        self._value = value
        self._refresh()

    def set_bending(self, words: Callable[[], StatusMessage]) -> None:
        """Show the bending that counts for the tip, or the press test just made."""
        self._bending_words = words
        self._refresh()

    def _refresh(self) -> None:
        outcome = self._value
        self._bending.set_value(self._bending_words() if outcome else StatusMessage())
        if outcome is None:
            self._comparison.set_value(Figures())
            self._as_found.set_value(StatusMessage())
            self._halves.set_value(StatusMessage())
            self._self_check.set_value(StatusMessage())
            self._images.set_value(StatusMessage())
            return
        self._comparison.setAccessibleName(self.tr("The tip beside others"))
        self._comparison.set_value(self._compared(_tip_value(outcome)))
        self._as_found.set_value(self._as_found_message(outcome.assessment))
        self._halves.set_value(self._halves_message(outcome.solution))
        check = outcome.solution.calibration.self_check
        self._self_check.set_value(self._self_check_message(check))
        self._self_check.setVisible(check is not None)
        used = outcome.solution.calibration.used
        text = self.tr("{0} of {1} images included").format(int(used.sum()), len(used))
        whole = bool(used.all())
        self._images.set_value(
            StatusMessage.good(text)
            if whole
            else StatusMessage(text, Sign.RING, Tone.PLAIN)
        )

    def _compared(self, value: TipValue) -> Figures:
        """Return the tip beside the previous and the nominal one, mm."""
        names = (
            self.tr("Previous, {0} / mm").format(value.since),
            self.tr("Change / mm"),
            self.tr("Nominal / mm"),
            self.tr("Deviation / mm"),
        )
        rows = zip(names, value.comparisons(), strict=True)
        known = [(name, cells) for name, cells in rows if cells]
        return Figures(AXES, tuple(n for n, _ in known), tuple(c for _, c in known))

    def _as_found_message(self, assessment: SwingAssessment) -> StatusMessage:
        """Return the deviation of the tip as found, with its limit."""
        change, last, limit = assessment.change, assessment.last, assessment.max_change
        if change is None or last is None:
            return StatusMessage(self.tr("No earlier result"), Sign.RING, Tone.PLAIN)
        off = mm_text(change.distance)
        if limit is None:
            text = self.tr("As found: {0} mm from the previous calibration")
            return StatusMessage(text.format(off), Sign.RING, Tone.PLAIN)
        text = self.tr(
            "As found: {0} mm from the previous calibration, limit {1} mm"
        ).format(off, f"{limit:g}")
        is_within = change.distance <= limit
        return StatusMessage.good(text) if is_within else StatusMessage.warning(text)

    def _halves_message(self, solution: Solution) -> StatusMessage:
        halves = solution.calibration.halves
        agree = halves_agree(halves)
        figures = _with_u(halves.difference, halves.expanded_uncertainty)
        text = (
            self.tr("Odd and even images agree: {0}")
            if agree
            else self.tr("Odd and even images differ significantly: {0}")
        )
        parts = map("\xa0".join, zip(AXES, figures, strict=True))
        text = text.format(listed(parts) + "\xa0mm")
        return StatusMessage.good(text) if agree else StatusMessage.warning(text)

    def _self_check_message(self, check: SelfCheck | None) -> StatusMessage:
        """Return the cross-validation of the LEDs: each predicted by the others."""
        if check is None:
            return StatusMessage()
        text = self.tr("Self-check of the LEDs: {0}, limit {1}")
        text = text.format(f"{check.value:.2f}", f"{check.limit:.2f}")
        if check.is_passed:
            return StatusMessage.good(text)
        return StatusMessage.warning(text)


def bending_message(
    status: SwingStatus, library: Library, today: date
) -> StatusMessage:
    """Return the bending that counts for the tip of a swing, in words."""
    bending = ASSUMED_BENDING
    if status.origin is not Origin.SIMULATED:
        bending = library.bending_of(status.names.tip, today)
    text, is_measured = worded(bending.words), bending.measured is not None
    if is_measured and not bending.is_overdue:
        return StatusMessage.good(text)
    return StatusMessage(text, Sign.RING, Tone.PLAIN)


def _tip_value(outcome: ReviewedResult) -> TipValue:
    """Return the tip beside the previous and the nominal one, if known."""
    x, y, z = outcome.tip_pen.tolist()
    u_x, u_y, u_z = outcome.uncertainty.tolist()
    assessment = outcome.assessment
    value = TipValue((x, y, z), (u_x, u_y, u_z))
    change, last = assessment.change, assessment.last
    if change is not None and last is not None:
        before = outcome.tip_pen - change.difference
        value = replace(
            value,
            previous=_in_mm(before),
            change=_with_u(change.difference, change.expanded_uncertainty),
            since=day_text(last.accepted),
        )
    nominal = outcome.solution.source.pen.nominal_tip
    if nominal is not None:
        value = replace(
            value, nominal=_in_mm(nominal), deviation=_in_mm(outcome.tip_pen - nominal)
        )
    return value


def _with_u(values: FloatArray, u: FloatArray) -> tuple[str, ...]:
    """Return lengths in mm, each with its U."""
    pairs = zip(_in_mm(values), _in_mm(u), strict=True)
    return tuple(map("\xa0\N{PLUS-MINUS SIGN}\xa0".join, pairs))


def _in_mm(values: FloatArray) -> tuple[str, ...]:
    """Return lengths in mm."""
    return tuple(map(mm_text, values.tolist()))


MOST = 10 * GRID  # px of height; more is scrolled


class StatusMessageList(PageScroll):
    """Shows messages; hidden while there are none."""

    def __init__(self) -> None:
        super().__init__()
        self._value: tuple[StatusMessage, ...] = ()
        self._labels: list[SignLabel] = []
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

        # Widgets
        self._list = QWidget()

        # Layout
        self._layout = vertical_layout(self._list, spacing=GRID // 2)
        self._layout.setSizeConstraint(QVBoxLayout.SizeConstraint.SetMinimumSize)
        self.setWidget(self._list)

        self.hide()

    def value(self) -> tuple[StatusMessage, ...]:
        """Return the remarks that are shown."""
        return self._value

    def set_value(self, value: Sequence[StatusMessage]) -> None:
        """Show other remarks."""
        value = tuple(value)
        if value == self._value:
            return
        self._value = value
        self.setAccessibleName(" ".join(remark.text for remark in value))
        while len(self._labels) < len(value):
            label = SignLabel()
            self._labels.append(label)
            self._layout.addWidget(label)
        for i, label in enumerate(self._labels):
            label.set_value(value[i] if i < len(value) else StatusMessage())
        self.setVisible(bool(value))
        self.updateGeometry()

    @override
    def sizeHint(self) -> QSize:
        width = max(self.width(), 20 * GRID)
        height = self._layout.totalHeightForWidth(width)
        if height < 0:
            height = self._layout.totalSizeHint().height()
        return QSize(width, min(height, MOST))

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(20 * GRID, self.sizeHint().height())
