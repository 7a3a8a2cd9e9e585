"""The paper's second stage, as published."""

import numpy as np
import pytest
from tests.simulated_centers import simulate_centers
from tests.simulated_swings import SwingKind, swing_of_kind

from lightpen.arrays import FloatArray
from lightpen.detection.pose import fit_paper_poses
from lightpen.errors import CalibrationError
from lightpen.estimation.pivot.pivot import fit_pivot, fit_two_stage, projection_bias
from lightpen_extensions.simulator.swings import Swing, paper_camera, paper_pen


def swing(n_frames: int = 100, kind: SwingKind = "field", seed: int = 0) -> Swing:
    return swing_of_kind(n_frames, np.random.default_rng(seed), kind)


def test_exact_poses_give_the_exact_tip() -> None:
    truth = swing()
    fit = fit_two_stage(truth.rotations, truth.translations)

    np.testing.assert_allclose(fit.tip_pen, truth.tip_pen, atol=1e-8)
    np.testing.assert_allclose(fit.cone_cam, truth.cone_cam, atol=1e-8)


def test_the_optimum_is_that_of_algebraic_least_squares() -> None:
    truth = swing()
    rng = np.random.default_rng(1)
    t = truth.translations + 0.05 * rng.standard_normal(truth.translations.shape)

    fit = fit_two_stage(truth.rotations, t)

    algebraic = fit_pivot(truth.rotations, t, robust=False)
    np.testing.assert_allclose(fit.tip_pen, algebraic.tip_pen, atol=1e-6)
    np.testing.assert_allclose(fit.cone_cam, algebraic.pivot_cam, atol=1e-6)


def test_the_record_starts_from_six_images_and_falls_with_every_step() -> None:
    truth = swing()
    rng = np.random.default_rng(2)
    t = truth.translations + 0.05 * rng.standard_normal(truth.translations.shape)
    fit = fit_two_stage(truth.rotations, t)

    six = np.linspace(0, 99, 6).round().astype(int)
    start = fit_pivot(truth.rotations[six], t[six], robust=False)
    np.testing.assert_allclose(fit.iterates[0, :3], start.tip_pen, atol=1e-6)
    assert np.all(np.diff(fit.objectives) <= 1e-12 * fit.objectives[0])
    assert len(fit.iterates) == len(fit.objectives) == len(fit.increments) + 1
    assert fit.increments[-1] < 1e-9
    assert fit.rms == pytest.approx(np.sqrt(3) * 0.05, rel=0.1)
    np.testing.assert_allclose(fit.iterates[-1, :3], fit.tip_pen)


def test_each_step_length_minimises_the_objective() -> None:
    truth = swing()
    rng = np.random.default_rng(3)
    t = truth.translations + 0.05 * rng.standard_normal(truth.translations.shape)
    fit = fit_two_stage(truth.rotations, t)

    def objective(X: FloatArray) -> float:
        return float(np.sum((truth.rotations @ X[:3] + t - X[3:]) ** 2))

    for k in range(3):
        move = fit.iterates[k + 1] - fit.iterates[k]
        best = objective(fit.iterates[k + 1])
        assert objective(fit.iterates[k] + 0.99 * move) > best
        assert objective(fit.iterates[k] + 1.01 * move) > best


def test_the_projection_bias_is_the_error_on_exact_images_of_discs() -> None:
    truth, camera, pen = swing(), paper_camera(), paper_pen()
    poses = truth.rotations, truth.translations
    pixels = simulate_centers(camera, pen, *poses, 0.0, np.random.default_rng(0))
    paper = fit_paper_poses(camera, pen, pixels, *poses)
    found = fit_two_stage(paper.rotations, paper.translations)

    seen = np.ones(pixels.shape[:2], dtype=bool)
    bias = projection_bias(camera, pen, *poses, seen)

    error = found.tip_pen - truth.tip_pen
    small = 0.02 * float(np.linalg.norm(error))
    assert small > 0.0002
    np.testing.assert_allclose(bias[:3], error, atol=small)
    off = found.cone_cam - truth.cone_cam
    np.testing.assert_allclose(bias[3:], off, atol=0.02 * float(np.linalg.norm(off)))


def test_five_images_are_too_few() -> None:
    truth = swing(5)
    with pytest.raises(CalibrationError, match="starts from 6"):
        fit_two_stage(truth.rotations, truth.translations)


def test_one_axis_is_refused() -> None:
    truth = swing(60, "one-axis")
    with pytest.raises(CalibrationError, match="one axis"):
        fit_two_stage(truth.rotations, truth.translations)
