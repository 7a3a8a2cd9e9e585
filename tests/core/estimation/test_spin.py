"""The axis of a stylus by a spin: exact, as certain as it says, or refused."""

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.spin import fit_spin
from lightpen.model.posture import FACING
from lightpen.model.rigid import rotation_from_vector

AXIS = np.array([0.1, 0.97, -0.2]) / np.linalg.norm([0.1, 0.97, -0.2])


def spun(
    turn_deg: float, n: int = 60, wobble: float = 0.0, seed: int = 0
) -> FloatArray:
    """Return rotations (N, 3, 3) of a pen that is spun about `AXIS`."""
    angles = np.radians(np.linspace(-turn_deg / 2, turn_deg / 2, n))
    tilts = wobble * np.random.default_rng(seed).standard_normal((n, 3))
    turns = rotation_from_vector(angles[:, None] * AXIS)
    return np.asarray(rotation_from_vector(tilts) @ FACING @ turns)


@pytest.mark.parametrize("turn_deg", [45.0, 120.0, 360.0])
def test_an_exact_spin_gives_the_exact_axis(turn_deg: float) -> None:
    found = fit_spin(spun(turn_deg))

    np.testing.assert_allclose(found.axis_pen, AXIS, atol=1e-9)
    np.testing.assert_allclose(found.axis_cam, FACING @ AXIS, atol=1e-9)
    assert np.degrees(found.turn) == pytest.approx(turn_deg)
    assert found.wobble == pytest.approx(0, abs=1e-9)
    assert found.expanded_uncertainty == pytest.approx(0, abs=1e-9)


def test_the_axis_lies_within_its_uncertainty_as_often_as_it_says() -> None:
    within = []
    for seed in range(200):
        found = fit_spin(spun(100.0, wobble=np.radians(0.5), seed=seed))
        error = np.linalg.norm(found.axis_pen - AXIS)
        within.append(error <= found.expanded_uncertainty)

    # U is along the worst direction; an error has two, so of k = 2 some 95 % or less.
    assert 0.88 <= np.mean(within) <= 1.0


def test_the_axis_points_from_the_ball_into_the_pen() -> None:
    assert fit_spin(spun(90.0), upwards=-AXIS).axis_pen @ AXIS == pytest.approx(-1)


def test_a_pen_that_is_hardly_turned_is_refused() -> None:
    with pytest.raises(
        CalibrationError, match="turned by 20\N{DEGREE SIGN} about its stylus"
    ):
        fit_spin(spun(20.0))


@pytest.mark.parametrize("seed", range(5))
def test_a_turn_of_the_stated_angle_suffices(seed: int) -> None:
    found = fit_spin(spun(40.0, n=40, wobble=np.radians(0.2), seed=seed))

    assert np.degrees(found.turn) == pytest.approx(40, abs=1)


def test_too_few_images_are_refused() -> None:
    with pytest.raises(CalibrationError, match="detected in 5 images of the rotation"):
        fit_spin(spun(90.0, n=5))


def test_a_pen_that_is_tilted_as_it_is_spun_is_refused() -> None:
    with pytest.raises(CalibrationError, match="was tilted during the rotation"):
        fit_spin(spun(45.0, n=20, wobble=np.radians(15)))


def refused(rotations: FloatArray) -> dict[str, object]:
    with pytest.raises(CalibrationError) as info:
        fit_spin(rotations)
    return {"code": info.value.message.code, **info.value.message.values}


def test_what_is_needed_of_a_spin_is_stated() -> None:
    fit_spin(spun(90.0, n=10))
    assert refused(spun(90.0, n=9)) == {"code": "spin.few-poses", "n": 9, "needed": 10}
    # A turn is measured to a degree.
    fit_spin(spun(39.1))
    found = refused(spun(38.9))
    assert found["code"] == "spin.little-turn"
    assert found["turn"] == pytest.approx(38.9)
    assert found["needed"] == pytest.approx(40.0)


@pytest.mark.parametrize("times", [0.97, 1.03])
def test_an_axis_must_be_known_to_two_degrees(times: float) -> None:
    wobble = np.radians(1.0)
    known = fit_spin(spun(90.0, n=40, wobble=wobble)).expanded_uncertainty
    wobble *= times * np.radians(2.0) / known
    found = spun(90.0, n=40, wobble=wobble)

    if times < 1:
        assert np.degrees(fit_spin(found).expanded_uncertainty) < 2.0
    else:
        reported = refused(found)
        assert reported["code"] == "spin.wobbling"
        assert reported["needed"] == pytest.approx(2.0)
        assert reported["uncertainty"] == pytest.approx(2.0 * times, rel=0.02)


def tilted(ways: FloatArray) -> FloatArray:
    """Return a whole turn about y, with tilts (N, 2) about x and z, rad."""
    n = len(ways)
    turns = np.outer(np.linspace(0, 2 * np.pi, n, endpoint=False), [0.0, 1.0, 0.0])
    tilts = np.column_stack([ways[:, 0], np.zeros(n), ways[:, 1]])
    return rotation_from_vector(tilts) @ rotation_from_vector(turns)


@pytest.mark.parametrize(
    ("period", "factor"), [(2, 1.0), (4, 1.0), (40, None), (0, None)]
)
def test_tilts_that_last_count_less_than_independent_ones(
    period: int, factor: float | None
) -> None:
    """Over a whole turn both axes are known from n poses, of two tilts each."""
    n, size = 40, 1e-3
    k = np.arange(n)
    angle = 2 * np.pi * k / period if period else 3 * np.ones(n) * (k > 19)
    ways = size * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    found = fit_spin(tilted(ways))

    # What is left of the tilts, about the axis that is fitted.
    axis, pen = found.axis_cam, tilted(ways) @ found.axis_pen
    left = pen - (pen @ axis)[:, None] * axis
    squares = np.sum(left**2)
    lasting = max(np.sum(left[1:] * left[:-1]) / squares, 0.0)
    lasting = min(lasting, 0.98)
    variance = squares / (2 * n - 4) / n * (1 + lasting) / (1 - lasting)
    assert found.expanded_uncertainty == pytest.approx(2 * np.sqrt(variance), rel=1e-4)
    assert found.wobble == pytest.approx(np.sqrt(squares / n), rel=1e-4)
    if factor:
        assert lasting == pytest.approx(0.0, abs=0.03)
    else:
        assert lasting > 0.5
