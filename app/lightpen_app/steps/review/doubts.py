"""What to look into before a tip is accepted, in sentences."""

from PySide6.QtCore import QObject

from lightpen.estimation.report import warnings_of
from lightpen.estimation.verdict import USUAL_CHANGE, distance_from_nominal
from lightpen.local_time import local_time
from lightpen.record.names import Names
from lightpen_app.look.sentences import worded
from lightpen_app.look.words import shortened
from lightpen_app.steps.review.result_panel import Outcome


class ReviewDoubts(QObject):
    """Words what is unusual about a solved swing."""

    def sentences(self, outcome: Outcome, named: Names) -> tuple[str, ...]:
        """Return what to look into, what matters most first.

        Parameters
        ----------
        named : Names
            What the step Start names now.
        """
        own = (
            self._of_names(outcome.names, named),
            self._of_change(outcome),
            self._of_nominal(outcome),
        )
        warnings = map(worded, warnings_of(outcome.solution.calibration))
        return (*filter(None, own), *warnings)

    def _of_names(self, swung: Names, named: Names) -> str:
        if (swung.pen, swung.tip) == (named.pen, named.tip):
            return ""
        text = self.tr(
            "This swing is of tip {0}, pen {1}, whatever the step Start names now: tip "
            "{2}, pen {3}."
        )
        names = (swung.tip, swung.pen, named.tip, named.pen)
        return text.format(*map(shortened, names))

    def _of_change(self, outcome: Outcome) -> str:
        change, last = outcome.change, outcome.last
        if change is None or last is None or not change.is_unusual:
            return ""
        text = self.tr(
            "The tip lies {0} mm from the calibration of {1} (usual change: {2} "
            "mm). Was the tip exchanged?"
        )
        date = f"{local_time(last.accepted):%Y-%m-%d}"
        return text.format(f"{change.distance:.3f}", date, USUAL_CHANGE)

    def _of_nominal(self, outcome: Outcome) -> str:
        nominal = outcome.solution.source.pen.nominal_tip
        distance = distance_from_nominal(outcome.tip_pen, nominal)
        if distance is None:
            return ""
        text = self.tr(
            "The tip lies {0} mm from its nominal place. Is it the tip that is named?"
        )
        return text.format(f"{distance:.1f}")
