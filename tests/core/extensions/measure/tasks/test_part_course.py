"""The course of a part: its runs, its datum points, and what is probed now."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.artefacts import Side
from lightpen_extensions.measure.measuring.plan import Nominal, Plan, PlannedFeature
from lightpen_extensions.measure.measuring.surfaces import FeatureKind
from lightpen_extensions.measure.probing_operator import plate_plan
from lightpen_extensions.measure.tasks.part import (
    feature_so_far,
    hand_goal,
    planned_places,
    touches_of_part,
)
from lightpen_extensions.measure.tasks.probed_point import ProbedPoint, joint_covariance
from lightpen_extensions.measure.tasks.task import (
    Conditions,
    TaskProgress,
    VerificationChoices,
)
from lightpen_extensions.simulator.swings import PAPER_CONE

Placed = Callable[[Sequence[Sequence[float]]], tuple[ProbedPoint, ...]]
PLATE = plate_plan()


@pytest.fixture(scope="module")
def placed(instrument: Instrument) -> Placed:
    """Return a function that makes points off the cone."""
    shared = np.zeros((3, len(instrument.covariance)))

    def points(offs: Sequence[Sequence[float]]) -> tuple[ProbedPoint, ...]:
        return tuple(
            ProbedPoint(
                PAPER_CONE + np.array(off),
                1e-6 * np.eye(3),
                shared,
                np.eye(3),
                ("",),
                0,
            )
            for off in offs
        )

    return points


def test_touches_of_a_part_are_those_of_the_ball_with_what_the_camera_moved(
    instrument: Instrument, placed: Placed
) -> None:
    one, other = placed([[0.0, 0, 0], [3, 0, 0]])
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    other = replace(other, approach_cam=np.array([0.0, 0, 1]), rotation=turn)
    drift = np.array([0.01, 0.02, 0.0])
    conditions = Conditions(
        instrument, ball_diameter=3.0, ball_uncertainty=0.004, drift=drift
    )

    found = touches_of_part([("a", one), ("b", other)], conditions)

    moved = np.diag(np.tile(drift**2, 2))
    shared = joint_covariance((one, other), instrument)
    np.testing.assert_allclose(found.covariance, shared + moved)
    np.testing.assert_array_equal(found.points_cam, [one.point_cam, other.point_cam])
    np.testing.assert_array_equal(found.approaches_cam, [[np.nan] * 3, [0, 0, 1]])
    np.testing.assert_array_equal(found.styli_cam, [[0, 1, 0], [-1, 0, 0]])
    assert (found.owners, found.ball_radius) == (("a", "b"), 1.5)
    assert found.ball_uncertainty == 0.002
    assert touches_of_part([("a", one)], Conditions(instrument)).ball_radius == 0


@pytest.mark.parametrize(
    ("kind", "places", "signs"),
    [
        # Of a plane deviations have a sign, off a line they have none.
        (
            FeatureKind.PLANE,
            [[-20, -20, 0.1], [20, -20, -0.1], [-20, 20, -0.1], [20, 20, 0.1]],
            [1, -1, -1, 1],
        ),
        (
            FeatureKind.LINE,
            [[-20, 0, 0.1], [-10, 0, -0.2], [10, 0, 0.2], [20, 0, -0.1]],
            [1, 1, 1, 1],
        ),
    ],
)
def test_deviations_of_the_feature_that_is_probed(
    instrument: Instrument,
    placed: Placed,
    kind: FeatureKind,
    places: list[list[float]],
    signs: list[int],
) -> None:
    plan = Plan("Part", (PlannedFeature("it", kind, touches=6),))
    choices = VerificationChoices(plan=plan)
    conditions, points = Conditions(instrument), placed(places)
    now = feature_so_far(choices, TaskProgress(points), conditions)
    begun = feature_so_far(choices, TaskProgress(), conditions)

    assert now is not None
    assert begun is not None
    assert now.fit is not None
    off = np.array([now.fit.distance_of(point.point_cam) for point in points])
    found = off * np.sign(off[0])
    assert np.sign(found).tolist() == signs
    if kind is FeatureKind.PLANE:
        np.testing.assert_allclose(found, 0.1 * np.array(signs), atol=1e-9)
    assert begun.fit is None
    assert feature_so_far(choices, TaskProgress((), (points,)), conditions) is None


def test_places_are_planned_by_kind_and_nominals_together() -> None:
    nominal = Nominal(origin=(10.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0))
    hole = next(each for each in PLATE.features if each.side is Side.INSIDE)

    assert planned_places(PlannedFeature("a", FeatureKind.PLANE)) == ()
    assert planned_places(PlannedFeature("a", None, nominal=nominal)) == ()
    inside = planned_places(hole)
    outside = planned_places(
        PlannedFeature(hole.name, hole.kind, nominal=hole.nominal, touches=hole.touches)
    )
    assert len(inside) == hole.n_touches
    for one, other in zip(inside, outside, strict=True):
        np.testing.assert_array_equal(one.normal, -other.normal)


def test_the_simulated_operator_goes_round_the_places_of_each_feature() -> None:
    choices = VerificationChoices(plan=PLATE)
    n = PLATE.features[0].n_touches
    first, again = (hand_goal(choices, 0, step) for step in (0, n))
    place = planned_places(PLATE.features[0])[0]

    assert first.point is not None
    assert first.outwards is not None
    np.testing.assert_array_equal([first.point], [again.point])
    u, v, w = place.point
    np.testing.assert_allclose(first.point, [u, -w - 30.0, v])
    u, v, w = place.normal
    np.testing.assert_allclose(first.outwards, [u, -w, v])
    assert hand_goal(choices, len(PLATE.features), 0).point is None
    assert hand_goal(VerificationChoices(), 0, 0).point is None
