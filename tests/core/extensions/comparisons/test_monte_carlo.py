"""Tests of `lightpen_extensions.comparisons.monte_carlo`."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
import pytest
from tests.simulated_centers import calibrate_pixels, simulate_centers

from lightpen.errors import CalibrationError
from lightpen.estimation.bundle.priors import DiameterReading
from lightpen.estimation.calibrate import Calibration
from lightpen.estimation.uncertainty.budget import center_errors
from lightpen_extensions.comparisons.monte_carlo import (
    MonteCarlo,
    Trials,
    run_monte_carlo,
    run_trial,
    trials_of,
)
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses

S = TypeVar("S")
T = TypeVar("T")
N_TRIALS = 40


def in_this_process(
    function: Callable[[S], T], items: Sequence[S], report: Callable[[float], None]
) -> list[T]:
    return [function(item) for item in items]


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    rng = np.random.default_rng(3)
    camera, pen = paper_camera(), replace(paper_pen(), led_sigma=0.002)
    swing = swing_poses(25, rng, pen=pen, camera=camera)
    pixels = simulate_centers(
        camera, pen, swing.rotations, swing.translations, 0.03, rng
    )
    return calibrate_pixels(pixels, camera, pen)


@pytest.mark.slow
def test_the_linear_budget_agrees_with_trials(calibration: Calibration) -> None:
    found = run_monte_carlo(calibration, N_TRIALS, in_this_process)

    assert found.n_failed == 0
    # Four times the precision of so few trials; the benchmark has more.
    assert np.abs(found.difference).max() < 4
    low, high = found.interval
    assert (low < 0).all()
    assert (high > 0).all()


def test_a_trial_is_the_same_every_time(calibration: Calibration) -> None:
    trials = trials_of(calibration)
    first, again, other = (run_trial(trials, number) for number in (1, 1, 2))

    assert first is not None
    assert other is not None
    np.testing.assert_array_equal(first, again)
    assert not np.allclose(first, other)


def test_exact_files_and_images_give_no_error(calibration: Calibration) -> None:
    trials = trials_of(calibration)
    camera, pen = trials.camera, replace(trials.pen, led_sigma=1e-7)
    assert camera.covariance is not None
    exact = replace(
        trials,
        camera=replace(camera, covariance=1e-12 * camera.covariance),
        pen=pen,
        sigma=1e-6,
        led_covariance=0.0 * trials.led_covariance,
        move_covariance=0.0 * trials.move_covariance,
        jitter=np.zeros((3, 3)),
        priors=replace(
            trials.priors,
            center_bias=0.0,
            cameras=(replace(trials.priors.cameras[0], covariance=np.zeros((9, 9))),),
            scale=replace(trials.priors.scale, covariance=np.zeros((1, 1))),
            temperature=replace(trials.priors.temperature, covariance=np.zeros((1, 1))),
            diameter=replace(trials.priors.diameter, covariance=np.zeros((1, 1))),
        ),
    )

    error = run_trial(exact, 0)

    assert error is not None
    assert np.abs(error).max() < 1e-5


def test_too_few_trials_are_refused(calibration: Calibration) -> None:
    with pytest.raises(ValueError, match="20 or more"):
        run_monte_carlo(calibration, 5, in_this_process)


@pytest.mark.slow
def test_trials_of_a_seat_that_jitters_differ_by_it(calibration: Calibration) -> None:
    still = replace(trials_of(calibration), jitter=np.zeros((3, 3)))
    shaken = replace(still, jitter=0.02**2 * np.eye(3))
    found = [(run_trial(still, n), run_trial(shaken, n)) for n in range(4)]

    differences = [b - a for a, b in found if a is not None and b is not None]
    assert len(differences) >= 3
    # 25 images with 0.02 mm of jitter move the tip by some hundredths.
    assert 0.003 < np.std(differences) < 0.1


@pytest.mark.slow
def test_domes_that_all_stand_out_alike_move_the_tip_along_the_normals(
    calibration: Calibration,
) -> None:
    trials = trials_of(calibration)

    def trials_with(shift: float) -> Trials:
        reading = DiameterReading(trials.pen.diameter, 0.01, shift)
        return replace(trials, priors=replace(trials.priors, reading=reading))

    flat, domed = trials_with(0.0), trials_with(0.1)
    found = [(run_trial(flat, n), run_trial(domed, n)) for n in range(4)]

    moves = np.array([b - a for a, b in found if a is not None and b is not None])
    assert len(moves) >= 3
    np.testing.assert_array_equal(trials.pen.normals, [[0, 0, 1]] * 10)
    np.testing.assert_allclose(moves[:, :2], 0, atol=1e-9)
    assert 0.03 < np.sqrt(np.mean(moves[:, 2] ** 2)) < 0.3


def test_areas_that_are_all_read_too_large_hardly_move_the_tip(
    calibration: Calibration,
) -> None:
    trials = trials_of(calibration)

    def trials_with(sigma: float) -> Trials:
        reading = DiameterReading(trials.pen.diameter, sigma, 0.0)
        return replace(
            trials,
            edge_widths=np.full_like(trials.edge_widths, 1.2),
            priors=replace(trials.priors, reading=reading),
        )

    exact, read = trials_with(0.0), trials_with(0.04)
    found = [(run_trial(exact, n), run_trial(read, n)) for n in range(2)]

    moves = np.array([b - a for a, b in found if a is not None and b is not None])
    assert len(moves) == 2
    # By the depth at which a disc larger by 4 parts in 1000 is imaged off its centre.
    assert 2e-5 < np.sqrt(np.mean(moves[:, 2] ** 2)) < 3e-4


@pytest.mark.parametrize(
    ("n_trials", "ratio", "code"),
    [
        (400, 1.05, "monte-carlo.confirms"),  # is immaterial
        (20, 1.3, "monte-carlo.confirms"),  # is chance
        (400, 1.3, "monte-carlo.less"),
        (400, 0.7, "monte-carlo.more"),
    ],
)
def test_a_difference_from_the_budget_is_explained_if_it_is_real_and_matters(
    n_trials: int, ratio: float, code: str
) -> None:
    signs = np.where(np.arange(n_trials) % 2, 1.0, -1.0)
    errors = 0.001 * np.repeat(signs[:, None], 3, axis=1)
    linear = np.array([0.001, ratio * 0.001, 0.001])

    reported = MonteCarlo(errors, linear, 0).explanation

    assert reported.code == code
    assert reported.values["percent"] == pytest.approx(100 * abs(ratio - 1))
    assert reported.values["axis"] == "y"


def test_errors_of_trials_are_summed_up() -> None:
    errors = np.linspace(-1.0, 1.0, 41)[:, None] * [0.001, 0.002, 0.003]
    found = MonteCarlo(errors, np.array([0.001, 0.001, 0.002]), 2)

    deviation = (
        np.sqrt(np.mean(np.linspace(-1, 1, 41) ** 2)) * np.array([1, 2, 3]) / 1e3
    )
    np.testing.assert_allclose(found.deviation, deviation)
    np.testing.assert_allclose(found.precision, deviation / np.sqrt(82))
    np.testing.assert_allclose(
        found.interval, np.outer([-0.95, 0.95], [0.001, 0.002, 0.003])
    )
    difference = (found.linear - deviation) * np.sqrt(82) / deviation
    np.testing.assert_allclose(found.difference, difference)
    assert found.explanation.code == "monte-carlo.less"
    assert found.explanation.values == {
        "percent": pytest.approx(100 * (0.001 / deviation[0] - 1)),
        "axis": "x",
        "own": pytest.approx(100 / np.sqrt(82)),
    }


@pytest.mark.parametrize("n_failed", [0, 10, 11])
def test_trials_that_fail_are_counted_and_half_of_them_may(
    calibration: Calibration, n_failed: int
) -> None:
    def mapped(
        function: Callable[[S], T], items: Sequence[S], report: Callable[[float], None]
    ) -> list[T]:
        assert list(items) == list(range(20))
        report(0.5)
        errors: list[Any] = [
            None if n < n_failed else np.full(3, float(n)) for n in range(len(items))
        ]
        return errors

    if n_failed > 10:
        with pytest.raises(CalibrationError) as info:
            run_monte_carlo(calibration, 20, mapped)
        assert info.value.message.values == {"n_failed": 11, "n_trials": 20}
        return
    found = run_monte_carlo(calibration, 20, mapped)

    assert (found.n_failed, len(found.errors)) == (n_failed, 20 - n_failed)
    squares = sum(
        share.standard_uncertainty**2
        for share in calibration.budget.shares
        if share.name.value not in {"rig", "lens"}
    )
    n_images = int(calibration.used.sum())
    squares += np.diag(center_errors(calibration.bundle, n_images))[:3]
    np.testing.assert_allclose(found.linear**2, squares)
