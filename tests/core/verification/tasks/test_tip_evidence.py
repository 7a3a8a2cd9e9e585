"""What points tell of the tip counts in the directions that they determine."""

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.reports.verdict import Grade
from lightpen.model.limits import VerificationLimits
from lightpen.verification.tasks.tip_evidence import TipEvidence, judged_tip

LIMITS = VerificationLimits()


def evidence(change: list[float], sigma: list[float]) -> TipEvidence:
    covariance: FloatArray = np.diag(np.square(sigma))
    return TipEvidence(np.array(change), covariance, True, 0.02)


def test_a_change_that_is_known_alike_in_all_directions_counts_whole() -> None:
    found = evidence([0.03, 0.02, -0.04], [0.002] * 3)

    np.testing.assert_allclose(found.known_change, found.change, rtol=1e-12)
    np.testing.assert_allclose(found.known_uncertainty, 0.004, rtol=1e-12)
    judged = judged_tip(found, LIMITS)
    assert judged is not None
    assert judged.grade is Grade.REPEAT


def test_what_the_points_do_not_determine_makes_no_other_tip() -> None:
    found = evidence([0.3, -0.02, 0.012], [1.2, 0.1, 0.002])

    np.testing.assert_allclose(found.known_change, [0, 0, 0.012], atol=1e-4)
    np.testing.assert_allclose(found.known_uncertainty, 0.004, rtol=1e-2)
    judged = judged_tip(found, LIMITS)
    assert judged is not None
    assert judged.grade is Grade.CHECK  # 0.012 of a limit of 0.040
