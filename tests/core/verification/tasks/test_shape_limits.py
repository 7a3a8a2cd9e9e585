"""What points must be like to make a ring or length: just, and not."""

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from typing import Any

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.simulator.swings import PAPER_CONE
from lightpen.verification.tasks.circle import CIRCLE, CircleOptions
from lightpen.verification.tasks.circle_fit import fit_circle, ring_so_far
from lightpen.verification.tasks.length import LENGTH, LengthOptions
from lightpen.verification.tasks.probed_point import ProbedPoint
from lightpen.verification.tasks.surface_points import form_by_noise, lie_near
from lightpen.verification.tasks.task import Conditions, Surface, TaskProgress

Placed = Callable[[FloatArray], tuple[ProbedPoint, ...]]


@pytest.fixture(scope="module")
def placed(instrument: Instrument) -> Placed:
    """Return a function that makes points that share nothing."""
    shared = np.zeros((3, len(instrument.covariance)))

    def points(places: FloatArray) -> tuple[ProbedPoint, ...]:
        return tuple(
            ProbedPoint(place, 1e-6 * np.eye(3), shared, np.eye(3), (f"{i}",), 0.0)
            for i, place in enumerate(np.asarray(places))
        )

    return points


def refused(code: str | None) -> Any:
    """Return what expects an error with this code, or none."""
    if code is None:
        return nullcontext()
    return pytest.raises(CalibrationError, check=lambda e: e.message.code == code)


def rectangle(a: float, b: float, n: int = 3) -> FloatArray:
    """Corners of a rectangle, n at each, whose rms extents are a and b."""
    corners = np.array([[a, b, 0], [a, -b, 0], [-a, b, 0], [-a, -b, 0]])
    return np.asarray(PAPER_CONE + np.tile(corners, (n, 1)))


def ring(n: int, radius: float = 20.0, degrees: float = 360.0) -> FloatArray:
    angles = np.radians(degrees) * np.arange(n) / n
    return np.asarray(
        PAPER_CONE
        + radius * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    )


@pytest.mark.parametrize(
    ("a", "b", "is_one"),
    [(0.49, 0.4, False), (0.51, 0.4, True), (50, 0.99, False), (50, 1.01, True)],
)
def test_a_ring_is_wide_enough_both_ways(a: float, b: float, is_one: bool) -> None:
    with refused(None if is_one else "circle.line"):
        fit = fit_circle(rectangle(a, b))
        assert fit.radius == pytest.approx(np.hypot(a, b))
    assert (ring_so_far(rectangle(a, b)) is not None) == is_one
    assert ring_so_far(rectangle(30.0, 30.0, 1)[:2]) is None
    assert ring_so_far(rectangle(30.0, 30.0, 1)[:3]) is not None


@pytest.mark.parametrize(
    ("median", "by", "is_near"),
    [
        (0.001, 0.099, True),
        (0.001, 0.101, False),
        (0.1, 0.79, True),
        (0.1, 0.81, False),
    ],
)
def test_a_point_lies_near_a_surface(median: float, by: float, is_near: bool) -> None:
    assert lie_near(np.array([median, -median, by, -by, median])).tolist() == [
        *(True, True, is_near, is_near, True)
    ]


@pytest.mark.parametrize(("n_rows", "quantile"), [(1, 3.2905), (2, 3.4808)])
def test_noise_alone_makes_more_form_once_in_a_thousand_times(
    n_rows: int, quantile: float
) -> None:
    """Of two points, whose range is normal; the larger one of two such ranges."""
    largest = 0.01 * np.sqrt(2) * quantile
    found = form_by_noise(0.01**2 * np.eye(2 * n_rows), n_rows)
    assert found == pytest.approx(largest, rel=0.03)


@pytest.mark.parametrize(("n_off", "fits"), [(4, True), (5, False)])
def test_a_quarter_of_the_points_may_be_left_out(
    instrument: Instrument, placed: Placed, n_off: int, fits: bool
) -> None:
    places = ring(16)
    off = np.linspace(1, 14, n_off).astype(int)
    places[off] += [0.0, 0.0, -0.5]
    with refused(None if fits else "circle.none") as error:
        found = CIRCLE.measure(
            [("run", placed(places))], Conditions(instrument), CircleOptions(20.0)
        )
        (run,) = found.runs
        assert {point.label for point in run.left_out} == {str(i) for i in off}
    if error is not None:
        assert {16, n_off} <= {*error.value.message.values.values()}


@pytest.mark.parametrize(("by", "fits"), [(0.99, True), (1.01, False)])
def test_a_ring_is_round_to_a_twentieth_of_its_radius(
    instrument: Instrument, placed: Placed, by: float, fits: bool
) -> None:
    base = ring(24)
    ways = (-1.0) ** np.arange(24)[:, None] * (base - PAPER_CONE)
    shape = fit_circle(base + 0.02 * ways)
    places = base + 0.02 * by * 0.05 * shape.radius / shape.roundness * ways
    with refused(None if fits else "circle.none"):
        CIRCLE.measure(
            [("run", placed(places))], Conditions(instrument), CircleOptions(20.0)
        )


@pytest.mark.parametrize(
    ("places", "code"),
    [
        (ring(5), "circle.too-few"),
        (ring(6), None),
        (ring(12, degrees=269.0 * 12 / 11), "circle.open"),
        (ring(12, degrees=271.0 * 12 / 11), None),
    ],
)
def test_a_ring_has_six_points_over_three_quarters(
    instrument: Instrument, placed: Placed, places: FloatArray, code: str | None
) -> None:
    with refused(code) as error:
        CIRCLE.measure(
            [("run", placed(places))], Conditions(instrument), CircleOptions(20.0)
        )
    if code == "circle.open" and error is not None:
        said = error.value.message.values
        assert {said["first"], said["second"]} == {"0", "11"}
        assert said["covered"] == pytest.approx(269.0)


def along(*offs: float | tuple[float, float]) -> FloatArray:
    """Points along a line, each also off it."""
    both = [each if isinstance(each, tuple) else (each, 0.0) for each in offs]
    return np.array([PAPER_CONE + np.array([x, y, 0.0]) for x, y in both])


@pytest.mark.parametrize(
    ("places", "code"),
    [
        (along(0.0), "length.too-few"),
        (along(0.0, 9.9), "length.one-end"),
        (along(0.0, 10.1), None),
        (along((0.0, 9.9), (0.0, -9.9), 100.0), None),
        (along((0.0, 10.1), (0.0, -10.1), 100.0), "length.no-end"),
        (along(0.0, (100.0, 9.9), (100.0, -9.9)), None),
        (along(0.0, (100.0, 10.1), (100.0, -10.1)), "length.no-end"),
    ],
)
def test_a_length_has_two_ends(
    instrument: Instrument, placed: Placed, places: FloatArray, code: str | None
) -> None:
    with refused(code) as error:
        found = LENGTH.measure(
            [("run", placed(places))], Conditions(instrument), LengthOptions(100.0)
        )
        assert sum(map(len, found.runs[0].ends)) == len(places)
    if code == "length.no-end" and error is not None:
        assert error.value.message.values["distance"] == pytest.approx(10.1)


@pytest.mark.parametrize("surface", Surface)
@pytest.mark.parametrize(
    ("length", "kept"), [(89.9, [1]), (90.1, [0, 1]), (109.9, [0, 1]), (110.1, [1])]
)
def test_two_ends_are_a_tenth_from_the_certified_length_at_most(
    instrument: Instrument,
    placed: Placed,
    surface: Surface,
    length: float,
    kept: Sequence[int],
) -> None:
    beyond = {Surface.GROOVE: 0.0, Surface.BORE: 4.0, Surface.BOSS: -4.0}[surface]
    points = placed(along(0.0, length - beyond))
    conditions = Conditions(instrument, ball_diameter=4.0)
    options = LengthOptions(100.0, surface=surface)

    def screened(n: int) -> list[int]:
        three = (*points, *points)[:n]
        return [*LENGTH.screen(options, conditions, TaskProgress(three)).kept]

    assert [screened(1), screened(2), screened(3)] == [[0], kept, [0, 1, 2]]


@pytest.mark.parametrize(("length", "least"), [(15.0, 7.5), (100.0, 10.0)])
def test_the_other_end_is_half_a_length_away_at_least(
    length: float, least: float
) -> None:
    assert LENGTH.newness(LengthOptions(length))[1] == least


@pytest.mark.parametrize(("sine", "is_edge_on"), [(0.89, False), (0.91, True)])
def test_angles_of_a_ring_are_from_u_or_from_v_where_it_is_seen_edge_on(
    sine: float, is_edge_on: bool
) -> None:
    cosine = np.sqrt(1 - sine**2)
    u, v = np.array([cosine, 0.0, sine]), np.array([0.0, 1.0, 0.0])
    turns = 2 * np.pi * np.arange(8) / 8
    spokes = np.column_stack([np.cos(turns), np.sin(turns)]) @ [u, v]
    fit = fit_circle(PAPER_CONE + 20.0 * spokes)

    np.testing.assert_allclose(fit.normal_cam, [sine, 0.0, -cosine], atol=1e-9)
    across = np.cross(fit.normal_cam, v if is_edge_on else u)
    start = v if is_edge_on else u
    angles = np.arctan2(spokes @ across, spokes @ start)
    difference = np.angle(np.exp(1j * (fit.angles - angles)))
    np.testing.assert_allclose(difference, 0.0, atol=1e-9)
