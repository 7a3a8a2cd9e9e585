"""Tests of the flatness of a plate."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.verification.tasks.plane import (
    Flatness,
    PlaneOptions,
    fit_plane,
    measure_plane,
)
from lightpen.verification.tasks.probed_point import ProbedPoint
from lightpen.verification.tasks.task import Conditions

MIDDLE = np.array([8.0, 128.0, 1000.0])
N_TRIALS = 300
BY_CHANCE = 2.6  # standard deviations: 99 %

Touching = Callable[..., tuple[ProbedPoint, ...]]


def plate(n: int = 12, tilt: float = 0.4, radius: float = 30.0) -> FloatArray:
    """Points on a plate that leans to the camera, at two distances from its middle."""
    angles = np.linspace(0, 2 * np.pi, n, endpoint=False)
    axes = np.array([[1, 0, 0], [0, np.cos(tilt), np.sin(tilt)]])
    spokes = np.column_stack([np.cos(angles), np.sin(angles)]) @ axes
    lengths = radius * np.where(np.arange(n) % 2, 1.0, 0.5)
    return np.asarray(MIDDLE + lengths[:, None] * spokes)


def normal(tilt: float = 0.4) -> FloatArray:
    return np.array([0.0, np.sin(tilt), -np.cos(tilt)])


def point(place: FloatArray, noise: FloatArray, n_shared: int) -> ProbedPoint:
    """A point that shares nothing with others but its noise."""
    return ProbedPoint(
        place, noise, np.zeros((3, n_shared)), np.eye(3), ("image",), 0.0
    )


def measured(
    points: tuple[ProbedPoint, ...], instrument: Instrument, certified: float = 0.0
) -> Flatness:
    return measure_plane(
        [("", points)], Conditions(instrument), PlaneOptions(flatness=certified)
    )


def test_points_of_a_plane_give_exactly_this_plane_and_no_flatness() -> None:
    x, y = np.meshgrid([-16.0, 0.0, 16.0], [-8.0, 0.0, 8.0])
    places = np.column_stack([x.ravel(), y.ravel(), np.full(9, 1024.0)])

    fit = fit_plane(places)

    assert fit.flatness == 0.0
    assert fit.center_cam.tolist() == [0.0, 0.0, 1024.0]
    assert fit.normal_cam.tolist() == [0.0, 0.0, -1.0]


def test_a_leaning_plane_is_met_but_for_rounding() -> None:
    fit = fit_plane(plate())

    assert fit.flatness < 1e-11  # places of 1000 mm in double precision
    np.testing.assert_allclose(fit.normal_cam, normal(), atol=1e-13)
    np.testing.assert_allclose(fit.center_cam, MIDDLE, atol=1e-11)


def test_residuals_follow_moves_of_the_points_as_their_weights_say() -> None:
    places, step = plate(), 1e-4  # mm, in which the second order is 1e-10
    fit = fit_plane(places)
    moves = np.random.default_rng(1).normal(0, step, len(places))

    moved = fit_plane(places + moves[:, None] * normal())

    expected = fit.weights @ moves
    np.testing.assert_allclose(moved.residuals, expected, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("form", [0.0, 0.05])
def test_u_covers_the_true_flatness_of_ideal_and_of_bent_plates(
    instrument: Instrument, form: float
) -> None:
    rng = np.random.default_rng(5)
    spread = np.array([0.004, 0.004, 0.02])  # mm: more along the view
    n_shared = len(instrument.covariance)
    true = plate() + form * (np.arange(12) % 3 == 0)[:, None] * normal()
    flatness = fit_plane(true).flatness
    covered = 0
    for _ in range(N_TRIALS):
        places = true + rng.normal(size=true.shape) * spread
        points = tuple(point(p, np.diag(spread**2), n_shared) for p in places)
        found = measured(points, instrument)
        covered += abs(found.fit.flatness - flatness) <= found.uncertainty
    share, least = covered / N_TRIALS, 0.9545

    by_chance = BY_CHANCE * np.sqrt(least * (1 - least) / N_TRIALS)
    assert share >= least - by_chance
    if not form:  # the bound is met by plates without form
        assert share <= least + by_chance


@pytest.mark.slow
def test_u_covers_what_wrong_files_and_the_noise_make_of_an_ideal_plate(
    instrument: Instrument, touching: Touching
) -> None:
    rng = np.random.default_rng(6)
    unsure = replace(instrument, covariance=9.0 * instrument.covariance)
    probed, true = touching(plate()), plate()
    files = rng.multivariate_normal(
        np.zeros(len(unsure.covariance)), unsure.covariance, N_TRIALS, method="eigh"
    )
    noise_alone, covered = measured(probed, instrument).uncertainty, 0
    for error in files:
        points = tuple(
            replace(
                each,
                point_cam=place
                + each.sensitivity @ error
                + rng.multivariate_normal(np.zeros(3), each.noise),
            )
            for each, place in zip(probed, true, strict=True)
        )
        found = measured(points, unsure)
        assert found.uncertainty > noise_alone  # what the points share counts, too
        covered += found.fit.flatness <= found.uncertainty
    share, expected = covered / N_TRIALS, 0.9545

    by_chance = BY_CHANCE * np.sqrt(expected * (1 - expected) / N_TRIALS)
    assert share == pytest.approx(expected, abs=by_chance)


def test_what_all_points_share_and_moves_them_alike_does_not_count(
    instrument: Instrument,
) -> None:
    noise = 1e-6 * np.eye(3)
    n_shared = len(instrument.covariance)
    tip = np.zeros((3, n_shared))
    tip[:, instrument.parameters.tip] = np.eye(3)
    alone = tuple(point(p, noise, n_shared) for p in plate())
    shared = tuple(
        ProbedPoint(p.point_cam, noise, tip, p.rotation, p.names, 0.0) for p in alone
    )

    one, other = (measured(each, instrument) for each in (alone, shared))

    assert other.uncertainty == pytest.approx(one.uncertainty, rel=1e-6)


def test_touches_of_a_plate_pass(instrument: Instrument, touching: Touching) -> None:
    found = measured(touching(plate(), n_frames=5), instrument)

    assert found.assessment.grade is Grade.PASS
    assert found.fit.flatness <= found.uncertainty < 0.1
    assert abs(found.fit.normal_cam @ normal()) > 0.999


def test_a_plate_is_judged_by_what_its_certificate_does_not_explain(
    instrument: Instrument, touching: Touching
) -> None:
    bowl = plate() + 0.3 * (np.arange(12) % 2)[:, None] * normal()
    points = touching(bowl, n_frames=5)

    assert measured(points, instrument).assessment.reason.code == "plane.off"
    assert measured(points, instrument, 0.3).assessment.grade is Grade.PASS


def test_a_lifted_pen_is_named(instrument: Instrument, touching: Touching) -> None:
    places = plate()
    places[4] += 2.0 * normal()

    found = measured(touching(places, n_frames=5), instrument)

    assert len(found.left_out) == 1
    assert found.assessment.grade is Grade.CHECK
    assert found.assessment.reason.values["first"] == found.left_out[0].label


@pytest.mark.parametrize(
    ("places", "code"),
    [
        (plate(8), "plane.too-few"),
        (MIDDLE + np.linspace(-30, 30, 12)[:, None] * np.eye(3)[0], "plane.line"),
        (MIDDLE + 0.1 * (plate() - MIDDLE), "plane.line"),
        (plate() + 20.0 * np.random.default_rng(2).normal(size=(12, 3)), "plane.none"),
    ],
)
def test_what_determines_no_plane_is_refused(
    instrument: Instrument, places: FloatArray, code: str
) -> None:
    n_shared = len(instrument.covariance)
    points = tuple(point(p, 1e-6 * np.eye(3), n_shared) for p in places)

    with pytest.raises(CalibrationError) as refused:
        measured(points, instrument)

    assert refused.value.message.code == code
