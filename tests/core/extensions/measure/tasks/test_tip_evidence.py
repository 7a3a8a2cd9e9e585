"""What points tell of the tip counts in the directions that they determine."""

from collections.abc import Callable
from dataclasses import replace
from math import inf

import numpy as np
import pytest
from scipy.stats import chi2, ncx2

from lightpen.arrays import FloatArray
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.limits import VerificationLimits
from lightpen_extensions.measure.tasks.fixed_point import (
    TipEvidence,
    _detectable,
    judged_tip,
    points_evidence,
    tip_entries,
)
from lightpen_extensions.measure.tasks.probed_point import ProbedPoint, joint_covariance
from lightpen_extensions.simulator.swings import PAPER_CONE

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


def test_points_that_scatter_too_much_make_the_tip_as_uncertain(
    instrument: Instrument, touching: Callable[..., tuple[ProbedPoint, ...]]
) -> None:
    points = touching(np.tile(PAPER_CONE, (5, 1)))
    offs = 0.2 * np.random.default_rng(1).standard_normal((5, 3))

    def found(by: float) -> TipEvidence:
        placed = [
            replace(each, point_cam=PAPER_CONE + by * off)
            for each, off in zip(points, offs, strict=True)
        ]
        return points_evidence(placed, instrument, np.zeros(3))

    root = np.linalg.cholesky(joint_covariance(points, instrument))
    by_tip = -np.concatenate([point.rotation for point in points])
    design = np.linalg.solve(root, np.hstack([by_tip, np.tile(np.eye(3), (5, 1))]))
    residuals = np.linalg.solve(root, (offs - offs.mean(axis=0)).ravel())
    _, (chi_square,), *_ = np.linalg.lstsq(design, residuals)
    expected = chi_square / 9 * found(0.0).covariance
    np.testing.assert_allclose(found(1.0).covariance, expected, rtol=1e-2)  # by prior


def test_points_in_one_posture_leave_the_tip_as_unknown_as_before(
    instrument: Instrument, touching: Callable[..., tuple[ProbedPoint, ...]]
) -> None:
    (point,) = touching(PAPER_CONE[None])
    found = points_evidence([point] * 4, instrument, np.zeros(3))

    np.testing.assert_allclose(found.covariance, 3.0**2 * np.eye(3), atol=1e-6)
    assert found.detectable == inf
    assert tip_entries(found)["detectable_tip_error_mm"] is None
    assert not found.is_significant


def test_an_error_is_detectable_that_is_missed_once_in_twenty_times() -> None:
    sigma = 0.01
    gate = chi2.isf(0.01, 3)
    found = _detectable(np.diag([sigma, 0.5 * sigma, 0.1 * sigma]) ** 2)

    assert ncx2.sf(gate, 3, (found / sigma) ** 2) == pytest.approx(0.95, abs=1e-6)
    for by, is_found in ((0.999, True), (1.001, False)):
        larger = _detectable((by * sigma / found) ** 2 * np.eye(3))
        assert (larger == pytest.approx(by)) if is_found else larger == inf


@pytest.mark.parametrize(("by", "is_significant"), [(0.999, False), (1.001, True)])
def test_a_change_is_more_than_chance_beyond_its_quantile(
    instrument: Instrument,
    touching: Callable[..., tuple[ProbedPoint, ...]],
    by: float,
    is_significant: bool,
) -> None:
    points = touching(np.tile(PAPER_CONE, (8, 1)))

    def moved(size: float) -> TipEvidence:
        """Return the evidence of points of a tip that is off along x."""
        off = [
            replace(each, point_cam=PAPER_CONE - size * each.rotation[:, 0])
            for each in points
        ]
        return points_evidence(off, instrument, np.zeros(3))

    usual = moved(0.01)
    squared = usual.change @ np.linalg.solve(usual.covariance, usual.change)
    found = moved(0.01 * by * np.sqrt(chi2.isf(0.01, 3) / squared))

    assert found.is_significant == is_significant
    entries = tip_entries(found)
    assert entries["wants_other_tip"] == is_significant
    assert entries["detectable_tip_error_mm"] == found.detectable
    np.testing.assert_allclose(
        entries["tip_change_expanded_uncertainty_mm"],
        2 * np.sqrt(np.diag(found.covariance)),
    )
