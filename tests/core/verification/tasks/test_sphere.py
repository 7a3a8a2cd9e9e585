"""Tests of `lightpen.verification.tasks.sphere`."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import least_squares
from tests.core.verification.conftest import Touching

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.limits import VerificationLimits
from lightpen.simulator.swings import PAPER_CONE
from lightpen.verification.tasks.sphere import (
    SIMULATED_AXES,
    SPHERE,
    Sphere,
    SphereOptions,
    fit_sphere,
    measure_sphere,
    sphere_directions,
)
from lightpen.verification.tasks.task import Conditions, Surface

DIAMETER, BALL = 30.0, 10.0  # mm
Measure = Callable[..., Sphere]


def points_on(radius: float, n: int = 25) -> FloatArray:
    return np.asarray(PAPER_CONE + radius * sphere_directions(n) @ SIMULATED_AXES)


@pytest.fixture
def measure(instrument: Instrument, touching: Touching) -> Measure:
    """Return a function that probes a sphere whose ball centres lie at a radius."""

    def run(
        radius: float = (DIAMETER + BALL) / 2,
        surface: Surface = Surface.BOSS,
        moved: FloatArray | float = 0.0,
        limits: VerificationLimits | None = None,
        u_ball: float = 0.0,
    ) -> Sphere:
        points = touching(points_on(radius) + moved, n_frames=2)
        conditions = Conditions(
            instrument, limits or VerificationLimits(), ball_diameter=BALL
        )
        options = SphereOptions(DIAMETER, 0.001, surface, u_ball)
        return measure_sphere([("", points)], conditions, options)

    return run


def test_25_points_are_spread_from_the_pole_to_the_equator() -> None:
    tilts = np.degrees(np.arccos(sphere_directions()[:, 2]))

    found, counts = np.unique(np.round(tilts, 1), return_counts=True)
    np.testing.assert_allclose(found, [0, 22.5, 45, 67.5, 90])
    np.testing.assert_array_equal(counts, [1, 4, 8, 4, 8])


def test_exact_points_give_the_exact_sphere() -> None:
    fit = fit_sphere(points_on(17.0))

    np.testing.assert_allclose(fit.center_cam, PAPER_CONE, atol=1e-9)
    assert fit.radius == pytest.approx(17.0, abs=1e-9)
    assert fit.form < 1e-9


def test_the_sphere_is_that_of_least_squares() -> None:
    points = points_on(17.0) + 0.3 * np.random.default_rng(1).standard_normal((25, 3))
    fit = fit_sphere(points)

    def off(x: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.norm(points - x[:3], axis=1) - x[3])

    other = least_squares(off, [*PAPER_CONE, 17.0], xtol=1e-15, ftol=1e-15)
    np.testing.assert_allclose([*fit.center_cam, fit.radius], other.x, atol=1e-6)
    np.testing.assert_allclose(fit.residuals, off(other.x), atol=1e-6)


def test_its_derivative_by_the_sphere_is_that_of_differences() -> None:
    points = points_on(17.0)
    fit = fit_sphere(points)
    step = np.array([1e-6, -2e-6, 3e-6])
    moved = np.linalg.norm(points - fit.center_cam - step, axis=1) - fit.radius

    change = fit.by_sphere[:, :3] @ step
    np.testing.assert_allclose(moved - fit.residuals, change, atol=1e-10)


@pytest.mark.parametrize(
    ("surface", "radius"),
    [
        (Surface.BOSS, (DIAMETER + BALL) / 2),
        (Surface.BORE, (DIAMETER - BALL) / 2),
        (Surface.GROOVE, DIAMETER / 2),
    ],
)
def test_the_ball_is_compensated_outside_and_inside(
    measure: Measure, surface: Surface, radius: float
) -> None:
    found = measure(radius, surface)

    assert abs(found.size.error) <= found.size.uncertainty < 0.04
    assert found.assessment.grade is Grade.PASS
    assert "not the tip" not in str(found.assessment.reason) or (
        found.tip.detectable > VerificationLimits().tip
    )


def test_a_sphere_that_is_too_large_is_found(measure: Measure) -> None:
    found = measure((DIAMETER + BALL) / 2 + 0.1)

    assert found.size.error == pytest.approx(0.2, abs=0.02)
    assert found.assessment.grade is Grade.REPEAT


def test_another_sphere_is_named(measure: Measure) -> None:
    found = measure(DIAMETER + BALL / 2)

    assert found.assessment.reason.code == "sphere.another"


def test_the_form_of_a_sphere_is_its_range(measure: Measure) -> None:
    bump = np.zeros((25, 3))
    bump[7] = 0.3 * (sphere_directions() @ SIMULATED_AXES)[7]
    found = measure(moved=bump, limits=VerificationLimits(form=0.5))

    assert 0.2 < found.fit.form + 0.3 * len(found.left_out) < 0.6
    assert found.assessment.grade is not Grade.PASS


def test_u_of_the_ball_counts_on_a_surface(measure: Measure) -> None:
    without, with_ball = measure().size.uncertainty, measure(u_ball=0.01)

    assert with_ball.size.uncertainty == pytest.approx(np.hypot(without, 0.01))


def test_points_near_the_pole_determine_no_sphere() -> None:
    with pytest.raises(CalibrationError, match="cover too little"):
        fit_sphere(points_on(17.0, 5))


def test_too_few_points_are_refused(instrument: Instrument, touching: Touching) -> None:
    points = touching(points_on(20.0, 8))

    with pytest.raises(CalibrationError, match="at least 9"):
        measure_sphere([("", points)], Conditions(instrument), SphereOptions(30.0))


def test_diameter_certificate_and_ball_are_asked_for() -> None:
    def asked(options: SphereOptions, ball: float | None) -> str:
        found = SPHERE.missing(options, ball)
        return "" if found is None else found.code

    assert asked(SphereOptions(), 10.0) == "sphere.no-diameter"
    assert asked(SphereOptions(30.0), 10.0) == "verification.no-certificate-u"
    whole = SphereOptions(30.0, 0.001, Surface.BOSS)
    assert asked(whole, None) == "verification.no-ball"
    assert asked(whole, 10.0) == ""
