"""Tests of `lightpen.verification.tasks.circle`."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.limits import VerificationLimits
from lightpen.verification.tasks.circle import Circle, CircleOptions, measure_circle
from lightpen.verification.tasks.circle_fit import fit_circle, on_ring_of, residuals_of
from lightpen.verification.tasks.probed_point import ProbedPoint
from lightpen.verification.tasks.task import Conditions, Surface

Touching = Callable[..., tuple[ProbedPoint, ...]]
Ring = Callable[..., FloatArray]
RADIUS = 31.751
LIMITS = VerificationLimits()


@pytest.fixture(scope="module")
def measured(instrument: Instrument, touching: Touching) -> Callable[..., Circle]:
    """Return a function that measures points as one run."""

    def measure(points: FloatArray, radius: float = RADIUS, seed: int = 1) -> Circle:
        run = ("run", touching(points, seed=seed, tilt=0.1))
        return measure_circle(
            [run], Conditions(instrument, LIMITS), CircleOptions(radius=radius)
        )

    return measure


def test_exact_points_give_the_exact_circle(ring: Ring) -> None:
    fit = fit_circle(ring())

    assert fit.radius == pytest.approx(RADIUS, abs=1e-9)
    np.testing.assert_allclose(fit.center_cam, [-8, 168, 1050], atol=1e-9)
    assert fit.roundness < 1e-9
    assert fit.covered == pytest.approx(342)


def test_the_radius_follows_points_as_its_weights_say(ring: Ring) -> None:
    points = ring(9)
    fit = fit_circle(points)
    rng = np.random.default_rng(0)
    moves = 1e-5 * rng.standard_normal(points.shape)

    changed = fit_circle(points + moves).radius - fit.radius

    assert changed == pytest.approx(float(np.sum(fit.weights * moves)), abs=1e-9)


def test_a_ring_is_measured_within_its_uncertainty(
    measured: Callable[..., Circle], ring: Ring
) -> None:
    errors = [measured(ring(), seed=seed) for seed in range(12)]

    within = [abs(each.errors[0]) <= each.uncertainty for each in errors]
    assert sum(within) >= 10
    assert all(each.assessment.is_accepted for each in errors)


def test_less_than_three_quarters_of_a_ring_are_refused(
    measured: Callable[..., Circle], ring: Ring
) -> None:
    with pytest.raises(CalibrationError, match=r"cover 200 degrees .* 270 are needed"):
        measured(ring(20, degrees=200))


@pytest.mark.parametrize("middle", [0, 90, 180, 270])
def test_a_gap_counts_wherever_in_the_ring_it_is(ring: Ring, middle: int) -> None:
    degrees = np.degrees(fit_circle(ring(72)).angles) - middle
    open_here = ring(72)[np.abs((degrees + 180) % 360 - 180) > 57.5]

    assert fit_circle(open_here).covered == pytest.approx(240, abs=6)


def test_runs_shrink_the_noise_and_not_what_is_certified(
    instrument: Instrument, touching: Touching, ring: Ring
) -> None:
    exact = replace(instrument, covariance=np.zeros_like(instrument.covariance))
    run = ("run", touching(ring(), tilt=0.1))

    one, two, certified = (
        measure_circle(
            runs,
            Conditions(exact, LIMITS),
            CircleOptions(radius=RADIUS, radius_uncertainty=stated),
        )
        for runs, stated in (([run], 0.0), ([run, run], 0.0), ([run], 0.01))
    )

    assert two.uncertainty == pytest.approx(one.uncertainty / np.sqrt(2))
    assert certified.uncertainty == pytest.approx(np.hypot(one.uncertainty, 0.01))


def test_points_of_a_square_are_no_circle(measured: Callable[..., Circle]) -> None:
    side = np.linspace(-30, 30, 5, endpoint=False)
    square = np.concatenate(
        [
            np.column_stack([side, np.full(5, -30.0)]),
            np.column_stack([np.full(5, 30.0), side]),
            np.column_stack([-side, np.full(5, 30.0)]),
            np.column_stack([np.full(5, -30.0), -side]),
        ]
    )
    points = np.column_stack([square, np.zeros(20)]) + np.array([0, 200, 1080])

    with pytest.raises(CalibrationError, match="lie on no circle"):
        measured(points)


def test_points_in_one_place_or_on_a_line_are_no_circle(
    measured: Callable[..., Circle],
) -> None:
    place = np.tile([0.0, 200.0, 1080.0], (12, 1))
    line = place + np.linspace(-30, 30, 12)[:, None] * [1.0, 0.0, 0.0]
    for points in (place, line):
        with pytest.raises(CalibrationError, match="which determines no circle"):
            measured(points)


def test_a_lifted_pen_is_left_out_and_named(
    measured: Callable[..., Circle], ring: Ring
) -> None:
    points = ring()
    points[7] += [0.0, -9.0, 0.0]

    found = measured(points)

    assert [touch.label for touch in found.runs[0].left_out] == ["touch 8 image 1"]
    assert found.assessment.grade is Grade.CHECK
    assert abs(found.errors[0]) < 0.01


@pytest.mark.parametrize("seed", range(5))
def test_points_off_the_ring_of_the_others_are_left_out(seed: int) -> None:
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0, 2 * np.pi, 9))
    off = np.zeros(9, dtype=bool)
    off[rng.choice(9, 3, replace=False)] = True
    radii = np.where(off, 25.0 + rng.uniform(1, 4, 9), 25.0)
    flat = np.column_stack([radii * np.cos(angles), radii * np.sin(angles), 3.0 * off])
    turn, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    points = flat @ turn.T + [10.0, -20.0, 1100.0] + rng.normal(0, 0.002, (9, 3))
    assert np.array_equal(on_ring_of(points), ~off)


def test_a_diameter_given_for_the_radius_is_reported(
    measured: Callable[..., Circle], ring: Ring
) -> None:
    found = measured(ring(), radius=2 * RADIUS)

    assert found.assessment.reason.code == "circle.another"


def test_a_wrong_radius_is_refused(measured: Callable[..., Circle], ring: Ring) -> None:
    found = measured(ring(), radius=RADIUS + 0.05)

    assert found.assessment.grade is Grade.REPEAT
    assert found.errors[0] == pytest.approx(-0.05, abs=0.01)


def test_the_ball_is_added_to_the_circle_of_its_centres(
    instrument: Instrument, touching: Touching, ring: Ring
) -> None:
    run = ("run", touching(ring(radius=RADIUS - 1.5), tilt=0.1))

    found = measure_circle(
        [run],
        Conditions(instrument, LIMITS, ball_diameter=3.0),
        CircleOptions(radius=RADIUS, surface=Surface.BORE),
    )

    assert abs(found.errors[0]) < 0.01


def test_points_are_as_far_off_the_circle_as_it_says(ring: Ring) -> None:
    rng = np.random.default_rng(4)
    points = ring(9) + 0.01 * rng.standard_normal((9, 3))
    fit = fit_circle(points)

    np.testing.assert_allclose(
        residuals_of(fit, tuple(points)),
        np.column_stack([fit.radial, fit.axial]),
        # The middle of the circle lies in the plane but for what was rounded.
        atol=1e-9,
    )


def test_a_camera_that_moved_counts_in_the_radius(
    instrument: Instrument, touching: Touching, ring: Ring
) -> None:
    run = ("run", touching(ring(), tilt=0.1))
    options = CircleOptions(radius=RADIUS)
    still = measure_circle([run], Conditions(instrument, LIMITS), options)
    drift = np.array([0.005, 0.002, 0.0])
    moved = measure_circle([run], Conditions(instrument, LIMITS, drift=drift), options)

    assert moved.uncertainty == pytest.approx(np.hypot(still.uncertainty, 0.01))
    assert moved.runs[0].uncertainty > still.runs[0].uncertainty
