"""What points tell of the tip counts in the directions that they determine."""

from collections.abc import Callable

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.limits import VerificationLimits
from lightpen.simulator.swings import PAPER_CONE
from lightpen.verification.tasks.probed_point import ProbedPoint, joint_covariance
from lightpen.verification.tasks.tip_evidence import (
    TipEvidence,
    block_diagonal,
    judged_tip,
    tip_evidence,
)

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


def test_residuals_too_large_for_their_noise_make_the_tip_as_uncertain(
    instrument: Instrument, touching: Callable[..., tuple[ProbedPoint, ...]]
) -> None:
    points = touching(np.tile(PAPER_CONE, (5, 1)))
    by_points = block_diagonal([np.array([[0.6, 0.0, 0.8]])] * 5)
    by_artefact = np.ones((5, 1))  # one coordinate more than there are unknowns
    residuals = np.array([0.1, -0.2, 0.2, 0.1, -0.1])

    sound, worn = (
        tip_evidence(points, instrument, each, by_points, by_artefact).covariance
        for each in (0 * residuals, residuals)
    )

    root = np.linalg.cholesky(
        by_points @ joint_covariance(points, instrument) @ by_points.T
    )
    by_tip = -by_points @ np.concatenate([point.rotation for point in points])
    design = np.linalg.solve(root, np.hstack([by_tip, by_artefact]))
    _, (chi_square,), *_ = np.linalg.lstsq(design, np.linalg.solve(root, residuals))
    np.testing.assert_allclose(worn, chi_square * sound, rtol=1e-2)  # by the prior
