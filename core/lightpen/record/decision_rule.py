"""The rule by which a calibration is graded, in the words of ILAC-G8 and JCGM 106.

It is what `lightpen.estimation.verdict` does, with its numbers. No statement of
conformity is made about the tip: what is compared with a limit is its uncertainty.

References
----------
.. [1] ILAC-G8:09/2019, "Guidelines on decision rules and statements of conformity",
   section 4.2.
.. [2] JCGM 106:2012, "The role of measurement uncertainty in conformity assessment",
   section 8.2.
"""

from lightpen.estimation.led_quality import DISPLACED
from lightpen.estimation.refutation import LIMIT as CONTRADICTED
from lightpen.estimation.single_images import USUAL_SIGMA
from lightpen.estimation.verdict import (
    CHANGE_GATE,
    FAR_MOVED,
    FAR_OFF,
    HALVES_GATE,
    MANY_DROPPED,
)
from lightpen.record.statement import StatedLimits
from lightpen.sentences import Sentence, sentence


def decision_rule(limits: StatedLimits) -> tuple[Sentence, ...]:
    """Return the rule, a paragraph each."""
    limit = limits.max_uncertainty_mm
    return (
        sentence(
            "decision-rule.uncertainty",
            "U (k = 2) of the tip along its weakest direction is compared with the "
            "limit of {limit:.4f} mm by simple acceptance (ILAC-G8:09/2019, 4.2.1; "
            "JCGM 106:2012, 8.2): what is judged is U itself, so the guard band is "
            "zero. U up to the limit is PASS, above it CHECK, above {far:.4f} mm, "
            "{times:g} times the limit, REPEAT.",
            limit=limit,
            far=FAR_OFF * limit,
            times=FAR_OFF,
        ),
        sentence(
            "decision-rule.consistency",
            "What would pass is CHECK nevertheless if odd and even images put the tip "
            "apart by more than the limit and by more than {halves:g} times U (k = 2) "
            "of their difference, if the images contradict a file by more than "
            "{contradicted:g} standard deviations, if cone and camera moved by more "
            "than {moved:.4f} mm, if the residuals exceed {sigma:g} px, if an LED "
            "stands out by more than {displaced:g} mm, if one of several cameras is "
            "out of step, if more than {dropped:.0f} % of the images that show the pen "
            "take no part, if fewer than {n_images} images show it, or none on one of "
            "the eight sides.",
            halves=HALVES_GATE,
            contradicted=CONTRADICTED,
            moved=FAR_MOVED * limit,
            sigma=USUAL_SIGMA,
            displaced=DISPLACED,
            dropped=100 * MANY_DROPPED,
            n_images=limits.min_images,
        ),
        sentence(
            "decision-rule.change",
            "The difference from the tip that was in force before is accepted up to "
            "{gate:g} times U (k = 2) of the difference along each axis, with which "
            "an unchanged tip is accepted in 95 % of all cases; beyond it, or where "
            "that tip cannot be read, is CHECK. A CHECK is put in force only with a "
            "reason, a REPEAT not at all.",
            gate=CHANGE_GATE,
        ),
        sentence(
            "decision-rule.change-limit",
            "Where the tip has a limit of its own for its change, the distance from "
            "the tip that was in force before (as found) to the tip that is accepted "
            "(as left) is compared with it by simple acceptance; beyond it is CHECK.",
        ),
    )
