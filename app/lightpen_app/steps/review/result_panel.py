"""The result of a swing in figures: the tip, how sure it is, and what has changed."""

from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QLabel, QSizePolicy, QWidget

from lightpen.arrays import FloatArray
from lightpen.estimation.reports.verdict import halves_agree
from lightpen.local_time import local_time
from lightpen.model.coverage import Coverage
from lightpen.record.results.assessment import SwingAssessment
from lightpen.record.swings.names import Names
from lightpen.record.swings.solving import Solution
from lightpen_app.look.layouts import fill, grid_layout, vertical_layout
from lightpen_app.look.quantities import AXES, MICROMETRES, decimals_for, number_text
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, set_size, text_label
from lightpen_app.look.words import shortened
from lightpen_app.widgets.number_table import Figures, NumberTable
from lightpen_app.widgets.posture_dial import DialValue, PostureDial
from lightpen_app.widgets.sign_label import SignLabel, StatusMessage
from lightpen_app.widgets.translated import Translated


@dataclass(frozen=True)
class TipValue:
    """A point and its uncertainty.

    Attributes
    ----------
    tip : tuple of three floats
        mm.
    uncertainty : tuple of three floats
        U (k = 2) along x, y and z, mm.
    """

    tip: tuple[float, float, float]
    uncertainty: tuple[float, float, float]


class TipReadout(QWidget):
    """Shows a tip to the digit that its uncertainty warrants; can be copied."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._value: TipValue | None = None

        # Widgets
        self._numbers = [_number_label(TextSize.TITLE) for _ in AXES]
        self._uncertainties = [_number_label(TextSize.LEAD, Tone.QUIET) for _ in AXES]

        # Layout
        layout = grid_layout(self, spacing=(GRID, 0))
        right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignBaseline
        self._names = [text_label(TextSize.LEAD, Tone.QUIET) for _ in AXES]
        for row, axis in enumerate(AXES):
            name = self._names[row]
            name.setText(axis)
            layout.addWidget(name, row, 0, Qt.AlignmentFlag.AlignBaseline)
            layout.addWidget(self._numbers[row], row, 1, right)
            layout.addWidget(self._uncertainties[row], row, 2, right)
        layout.setColumnStretch(1, 1)

    def set_large(self, large: bool) -> None:
        """Show the figures larger, where there is the room, or no longer."""
        for label in self._numbers:
            set_size(label, TextSize.DISPLAY if large else TextSize.TITLE)
        for label in (*self._names, *self._uncertainties):
            set_size(label, TextSize.TITLE if large else TextSize.LEAD)

    def value(self) -> TipValue | None:
        """Return the tip that is shown."""
        return self._value

    def set_value(self, value: TipValue | None) -> None:
        """Show another tip, or none."""
        self._value = value
        for row, axis in enumerate(AXES):
            number, uncertainty = self._numbers[row], self._uncertainties[row]
            if value is None:
                number.clear()
                uncertainty.clear()
                continue
            decimals = decimals_for(value.uncertainty[row])
            number.setText(number_text(value.tip[row], decimals))
            within = number_text(value.uncertainty[row], decimals)
            uncertainty.setText(f"\N{PLUS-MINUS SIGN} {within}")
            number.setAccessibleName(f"{axis} = {number.text()} mm")
            uncertainty.setAccessibleName(f"{uncertainty.text()} mm")

    def texts(self) -> tuple[str, ...]:
        """Return the numbers of x, y and z and their uncertainties, as shown."""
        labels = zip(self._numbers, self._uncertainties, strict=True)
        return tuple(f"{number.text()} {u.text()}" for number, u in labels)


def _number_label(size: TextSize, tone: Tone = Tone.PLAIN) -> QLabel:
    label = text_label(size, tone)
    label.setWordWrap(False)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    label.setAlignment(Qt.AlignmentFlag.AlignRight)
    return label


BLANK = ("", "", "")
DIAL_HEIGHT = 22 * GRID  # px


@dataclass(frozen=True, eq=False)
class ReviewedResult:
    """A solved swing with the result that was current before.

    Attributes
    ----------
    names : Names
        Names of the swing.
    """

    solution: Solution
    names: Names
    assessment: SwingAssessment

    @property
    def tip_pen(self) -> FloatArray:
        """The tip, pen frame, (3,), mm."""
        return self.solution.calibration.joint.tip_pen

    @property
    def uncertainty(self) -> FloatArray:
        """U (k = 2) along x, y and z, (3,), mm."""
        return self.solution.calibration.budget.expanded_uncertainty[:3]


class ResultPanel(Translated, QFrame):
    """Shows an outcome."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._value: ReviewedResult | None = None
        self.setProperty("area", "panel")

        # Widgets
        self._heading = text_label(TextSize.SMALL, Tone.QUIET)
        self._readout = TipReadout()
        self._comparison = text_label(TextSize.SMALL, Tone.QUIET)
        self._table = NumberTable()
        self._as_found = SignLabel()
        self._halves = SignLabel()
        self._images = SignLabel()
        self._postures = text_label(TextSize.LEAD, Tone.QUIET)
        self._dial = PostureDial()
        self._dial.setMinimumHeight(DIAL_HEIGHT)
        # As high as its place is; it draws itself as large as it can.
        self._dial.setSizePolicy(
            QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Ignored
        )

        # Layout
        layout = vertical_layout(
            self, self._heading, self._readout, spacing=GRID // 2, margins=2 * GRID
        )
        layout.addSpacing(GRID)
        fill(layout, self._comparison, self._table)
        layout.addSpacing(GRID // 2)
        fill(layout, self._as_found, self._halves, self._images)
        layout.addSpacing(GRID)
        fill(layout, self._postures, (self._dial, 100), 1)

        self.set_large(False)
        self._retranslate()

    def set_large(self, large: bool) -> None:
        """Show its figures larger, and the postures, where there is the room."""
        self._readout.set_large(large)
        self._table.set_large(large)
        for label in (self._heading, self._comparison):
            set_size(label, TextSize.LEAD if large else TextSize.SMALL)
        for widget in (self._postures, self._dial):
            widget.setVisible(large)

    def value(self) -> ReviewedResult | None:
        """Return the outcome that is shown."""
        return self._value

    def set_value(self, value: ReviewedResult | None) -> None:
        """Show another outcome, or none."""
        self._value = value
        self._refresh()

    def _retranslate(self) -> None:
        self._comparison.setText(self.tr("Differences / \xb5m"))
        self._table.setAccessibleName(self.tr("Differences"))
        self._postures.setText(self.tr("Postures of the included images"))
        self._refresh()

    def _refresh(self) -> None:
        outcome = self._value
        self._heading.setText(self._heading_text(outcome))
        if outcome is None:
            self._readout.set_value(None)
            self._table.set_value(Figures())
            self._as_found.set_value(StatusMessage())
            self._halves.set_value(StatusMessage())
            self._images.set_value(StatusMessage())
            self._dial.set_value(DialValue())
            return
        self._dial.set_value(_postures(outcome.solution.calibration.coverage))
        x, y, z = outcome.tip_pen.tolist()
        u_x, u_y, u_z = outcome.uncertainty.tolist()
        self._readout.set_value(TipValue((x, y, z), (u_x, u_y, u_z)))
        self._table.set_value(self._differences(outcome))
        self._as_found.set_value(self._as_found_message(outcome.assessment))
        self._halves.set_value(self._halves_message(outcome.solution))
        used = outcome.solution.calibration.used
        text = self.tr("{0} of {1} images included").format(int(used.sum()), len(used))
        whole = bool(used.all())
        self._images.set_value(
            StatusMessage(text, Sign.CHECK, Tone.GOOD)
            if whole
            else StatusMessage(text, Sign.RING, Tone.PLAIN)
        )

    def _heading_text(self, outcome: ReviewedResult | None) -> str:
        if outcome is None:
            return self.tr("Tip in the pen frame / mm, U (k = 2)")
        text = self.tr("Tip {0} in the frame of pen {1} / mm, U\xa0(k\xa0=\xa02)")
        return text.format(shortened(outcome.names.tip), shortened(outcome.names.pen))

    def _differences(self, outcome: ReviewedResult) -> Figures:
        rows: list[tuple[str, tuple[str, ...]]] = []
        change, last = outcome.assessment.change, outcome.assessment.last
        within = self.tr("U (k = 2)")
        if change is None or last is None:
            rows.append((self.tr("No earlier result"), BLANK))
        else:
            date = f"{local_time(last.accepted):%Y-%m-%d}"
            since = self.tr("Since {0}").format(date)
            u = change.expanded_uncertainty
            rows += [(since, _texts(change.difference, u)), (within, _texts(u, u))]
        nominal = outcome.solution.source.pen.nominal_tip
        if nominal is None:
            rows.append((self.tr("No nominal tip"), BLANK))
        else:
            deviation = _texts(outcome.tip_pen - nominal, outcome.uncertainty)
            rows.append((self.tr("From nominal"), deviation))
        halves = outcome.solution.calibration.halves
        u = halves.expanded_uncertainty
        rows += [
            (self.tr("Odd - even"), _texts(halves.difference, u)),
            (within, _texts(u, u)),
        ]
        names, cells = zip(*rows, strict=True)
        return Figures(AXES, tuple(names), tuple(cells))

    def _as_found_message(self, assessment: SwingAssessment) -> StatusMessage:
        """Return the deviation of the tip as found, with its limit."""
        change, last, limit = assessment.change, assessment.last, assessment.max_change
        if change is None or last is None:
            return StatusMessage()
        decimals = decimals_for(float(change.expanded_uncertainty.max()))
        off = number_text(change.distance, decimals)
        if limit is None:
            text = self.tr(
                "As found: {0} mm from the previous calibration (no limit set)"
            )
            return StatusMessage(text.format(off), Sign.RING, Tone.PLAIN)
        text = self.tr(
            "As found: {0} mm from the previous calibration, limit {1} mm"
        ).format(off, f"{limit:g}")
        is_within = change.distance <= limit
        return (
            StatusMessage(text, Sign.CHECK, Tone.GOOD)
            if is_within
            else StatusMessage(text, Sign.WARNING, Tone.WARN)
        )

    def _halves_message(self, solution: Solution) -> StatusMessage:
        if halves_agree(solution.calibration.halves):
            text = self.tr("Odd and even images agree")
            return StatusMessage(text, Sign.CHECK, Tone.GOOD)
        text = self.tr("Odd and even images differ significantly")
        return StatusMessage(text, Sign.WARNING, Tone.WARN)


def _postures(coverage: Coverage) -> DialValue:
    """Return a dial of which each field is full that the images have."""
    turns = coverage.turns
    return DialValue(
        counts=coverage.counts.astype(np.int64),
        needed=np.minimum(coverage.counts, 1).astype(np.int64),
        n_upright=coverage.n_upright,
        n_upright_needed=min(coverage.n_upright, 1),
        turns=(float(turns.min()), float(turns.max())),
    )


def _texts(values: FloatArray, uncertainties: FloatArray) -> tuple[str, ...]:
    """Return lengths in micrometres, to the digit that their uncertainty warrants."""
    pairs = zip(
        (values * MICROMETRES).tolist(),
        (uncertainties * MICROMETRES).tolist(),
        strict=True,
    )
    return tuple(number_text(v, min(decimals_for(u), _room(v))) for v, u in pairs)


def _room(value: float) -> int:
    """Return the number of decimals that fit a column."""
    return 3 if abs(value) < 100 else 1 if abs(value) < 1000 else 0
