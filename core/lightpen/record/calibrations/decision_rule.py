"""The rule by which a calibration is graded, in the words of ILAC-G8 and JCGM 106.

It is what `lightpen.estimation.reports.verdict` does, with its numbers. No statement of
conformity is made about the tip: what is compared with a limit is its uncertainty.

References
----------
.. [1] ILAC-G8:09/2019, "Guidelines on decision rules and statements of conformity",
   section 4.2.
.. [2] JCGM 106:2012, "The role of measurement uncertainty in conformity assessment",
   section 8.2.
"""

from lightpen.estimation.bundle.consistency_test import LIMIT as CONTRADICTED
from lightpen.estimation.bundle.led_quality import DISPLACED
from lightpen.estimation.contact.single_images import USUAL_SIGMA
from lightpen.estimation.reports.calibration_record import VerdictLimits
from lightpen.estimation.reports.verdict import (
    CHANGE_GATE,
    FAR_MOVED,
    FAR_OFF,
    HALVES_GATE,
    MANY_DROPPED,
)
from lightpen.messages import Message, message


def decision_rule(limits: VerdictLimits) -> tuple[Message, ...]:
    """Return the rule, a paragraph each."""
    limit = limits.max_uncertainty_mm
    return (
        message(
            "decision-rule.uncertainty", limit=limit, far=FAR_OFF * limit, times=FAR_OFF
        ),
        message(
            "decision-rule.consistency",
            halves=HALVES_GATE,
            contradicted=CONTRADICTED,
            moved=FAR_MOVED * limit,
            sigma=USUAL_SIGMA,
            displaced=DISPLACED,
            dropped=100 * MANY_DROPPED,
            n_images=limits.min_images,
        ),
        message("decision-rule.change", gate=CHANGE_GATE),
        message("decision-rule.change-limit"),
    )
