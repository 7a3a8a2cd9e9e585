"""The result of a swing in figures: the tip, how sure it is, and what has changed."""

from dataclasses import dataclass

import numpy as np
from PySide6.QtWidgets import QFrame, QSizePolicy, QVBoxLayout, QWidget

from lightpen.arrays import FloatArray
from lightpen.estimation.verdict import halves_agree
from lightpen.local_time import local_time
from lightpen.model.coverage import Coverage
from lightpen.record.assessment import Assessment
from lightpen.record.names import Names
from lightpen.record.solving import Solution
from lightpen_app.look.quantities import AXES, MICROMETRES, decimals_for, number_text
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, set_size, text_label
from lightpen_app.look.words import shortened
from lightpen_app.steps.review.tip_readout import TipReadout, TipValue
from lightpen_app.widgets.number_table import Figures, NumberTable
from lightpen_app.widgets.posture_dial import DialValue, PostureDial
from lightpen_app.widgets.sign_label import Remark, SignLabel
from lightpen_app.widgets.translated import Translated

BLANK = ("", "", "")
DIAL_HEIGHT = 22 * GRID  # px


@dataclass(frozen=True, eq=False)
class Outcome:
    """A solved swing beside what was in force before it.

    Attributes
    ----------
    names : Names
        Of what was swung.
    """

    solution: Solution
    names: Names
    assessment: Assessment

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
        self._value: Outcome | None = None
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
        layout = QVBoxLayout(self)
        margin = 2 * GRID
        layout.setContentsMargins(margin, margin, margin, margin)
        layout.setSpacing(GRID // 2)
        layout.addWidget(self._heading)
        layout.addWidget(self._readout)
        layout.addSpacing(GRID)
        layout.addWidget(self._comparison)
        layout.addWidget(self._table)
        layout.addSpacing(GRID // 2)
        layout.addWidget(self._as_found)
        layout.addWidget(self._halves)
        layout.addWidget(self._images)
        layout.addSpacing(GRID)
        layout.addWidget(self._postures)
        layout.addWidget(self._dial, 100)
        layout.addStretch(1)

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

    def value(self) -> Outcome | None:
        """Return the outcome that is shown."""
        return self._value

    def set_value(self, value: Outcome | None) -> None:
        """Show another outcome, or none."""
        self._value = value
        self._refresh()

    def _retranslate(self) -> None:
        self._comparison.setText(self.tr("Differences / \xb5m"))
        self._table.setAccessibleName(self.tr("Differences"))
        self._postures.setText(self.tr("Postures of the images that are used"))
        self._refresh()

    def _refresh(self) -> None:
        outcome = self._value
        self._heading.setText(self._heading_text(outcome))
        if outcome is None:
            self._readout.set_value(None)
            self._table.set_value(Figures())
            self._as_found.set_value(Remark())
            self._halves.set_value(Remark())
            self._images.set_value(Remark())
            self._dial.set_value(DialValue())
            return
        self._dial.set_value(_postures(outcome.solution.calibration.coverage))
        x, y, z = outcome.tip_pen.tolist()
        u_x, u_y, u_z = outcome.uncertainty.tolist()
        self._readout.set_value(TipValue((x, y, z), (u_x, u_y, u_z)))
        self._table.set_value(self._differences(outcome))
        self._as_found.set_value(self._as_found_remark(outcome.assessment))
        self._halves.set_value(self._halves_remark(outcome.solution))
        used = outcome.solution.calibration.used
        text = self.tr("{0} of {1} images used").format(int(used.sum()), len(used))
        whole = bool(used.all())
        self._images.set_value(
            Remark(text, Sign.CHECK, Tone.GOOD)
            if whole
            else Remark(text, Sign.RING, Tone.PLAIN)
        )

    def _heading_text(self, outcome: Outcome | None) -> str:
        if outcome is None:
            return self.tr("Tip in the frame of the pen / mm, with U (k = 2)")
        text = self.tr("Tip {0} in the frame of pen {1} / mm, U\xa0(k\xa0=\xa02)")
        return text.format(shortened(outcome.names.tip), shortened(outcome.names.pen))

    def _differences(self, outcome: Outcome) -> Figures:
        rows: list[tuple[str, tuple[str, ...]]] = []
        change, last = outcome.assessment.change, outcome.assessment.last
        within = self.tr("its U (k = 2)")
        if change is None or last is None:
            rows.append((self.tr("no earlier result"), BLANK))
        else:
            date = f"{local_time(last.accepted):%Y-%m-%d}"
            since = self.tr("since {0}").format(date)
            u = change.expanded_uncertainty
            rows += [(since, _texts(change.difference, u)), (within, _texts(u, u))]
        nominal = outcome.solution.source.pen.nominal_tip
        if nominal is None:
            rows.append((self.tr("no nominal tip"), BLANK))
        else:
            deviation = _texts(outcome.tip_pen - nominal, outcome.uncertainty)
            rows.append((self.tr("since nominal"), deviation))
        halves = outcome.solution.calibration.halves
        u = halves.expanded_uncertainty
        rows += [
            (self.tr("odd - even"), _texts(halves.difference, u)),
            (within, _texts(u, u)),
        ]
        names, cells = zip(*rows, strict=True)
        return Figures(AXES, tuple(names), tuple(cells))

    def _as_found_remark(self, assessment: Assessment) -> Remark:
        """Return how far the tip in force was found off, against its limit."""
        change, last, limit = assessment.change, assessment.last, assessment.max_change
        if change is None or last is None:
            return Remark()
        decimals = decimals_for(float(change.expanded_uncertainty.max()))
        off = number_text(change.distance, decimals)
        if limit is None:
            text = self.tr("As found: {0} mm off; the tip has no limit of change")
            return Remark(text.format(off), Sign.RING, Tone.PLAIN)
        text = self.tr("As found: {0} mm off, limit {1} mm").format(off, f"{limit:g}")
        is_within = change.distance <= limit
        return (
            Remark(text, Sign.CHECK, Tone.GOOD)
            if is_within
            else Remark(text, Sign.WARNING, Tone.WARN)
        )

    def _halves_remark(self, solution: Solution) -> Remark:
        if halves_agree(solution.calibration.halves):
            text = self.tr("Odd and even images agree")
            return Remark(text, Sign.CHECK, Tone.GOOD)
        text = self.tr("Odd and even images differ by more than chance")
        return Remark(text, Sign.WARNING, Tone.WARN)


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
    """Return for how many decimals a column has room."""
    return 3 if abs(value) < 100 else 1 if abs(value) < 1000 else 0
