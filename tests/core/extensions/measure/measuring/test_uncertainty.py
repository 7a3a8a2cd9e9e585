"""U of features, characteristics and alignments, by their derivatives.

The coverage of U is measured by ``./run bench measure``.
"""

from collections.abc import Callable

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.measure.measuring import characteristics
from lightpen_extensions.measure.measuring.alignment import (
    Quantity,
    align_321,
    derive,
    quantity_of,
)
from lightpen_extensions.measure.measuring.features import fit_feature
from lightpen_extensions.measure.measuring.surfaces import FeatureKind

STEP = 1e-4  # mm, of differences
NOISE, COMMON = 0.004, 0.02  # mm
FAR = np.array([300.0, -200.0, 1500.0])
R_CAM = rotation_from_vector(np.array([0.3, 0.8, -0.4]))

PLATE = np.array([[x, y, 0.0] for x in (-50, 0, 50) for y in (-40, 0, 40)])
SIDE = np.array([[x, -60.0 + 0.3 * z, z] for x in (-50, -10, 30) for z in (-5, -20)])
TURN = np.deg2rad(np.arange(0, 360, 30))
HOLE = np.column_stack([30 + 8 * np.cos(TURN), 8 * np.sin(TURN), 0 * TURN])
BOSS = np.column_stack([8 * np.cos(TURN) - 30, 8 * np.sin(TURN), 5.0 * (TURN // 2)])
CONE = np.column_stack(
    [
        (5 + 3 * (TURN % 2)) * np.cos(TURN),
        (5 + 3 * (TURN % 2)) * np.sin(TURN),
        10 * (TURN % 2),
    ]
)
PARTS = {
    "plate": (FeatureKind.PLANE, PLATE),
    "side": (FeatureKind.PLANE, SIDE),
    "hole": (FeatureKind.CIRCLE, HOLE),
    "boss": (FeatureKind.CYLINDER, BOSS),
    "cone": (FeatureKind.CONE, CONE),
    "edge": (FeatureKind.LINE, np.array([[x, -60.0, 0] for x in (-50, -20, 15, 50)])),
    "ball": (
        FeatureKind.SPHERE,
        9 * np.vstack([np.eye(3), -np.eye(3), [[0.6, 0.8, 0]]]) + (0, 50, 20),
    ),
}
ALL = np.concatenate([points for _, points in PARTS.values()]) @ R_CAM.T + FAR
N = ALL.size


def inputs() -> FloatArray:
    """Return the covariance of all points: noise of each, and a common scale."""
    shape = (ALL - ALL.mean(axis=0)).ravel() / 100
    return NOISE**2 * np.eye(N) + COMMON**2 * np.outer(shape, shape)


def measured(points: FloatArray) -> dict[str, Quantity]:
    """Return the features of a part by its points (N, 3)."""
    found, start = {}, 0
    for name, (kind, own) in PARTS.items():
        rows = np.arange(start, start + len(own))
        start += len(own)
        found[name] = quantity_of(fit_feature(kind, points[rows]), 3 * rows, N)
    return found


Function = Callable[[dict[str, Quantity]], Quantity]


def of(function: Callable[..., FloatArray | float], *names: str) -> Function:
    return lambda part: derive(function, *(part[name] for name in names))


def in_frame(name: str) -> Function:
    def place(part: dict[str, Quantity]) -> Quantity:
        found = align_321(part["plate"], part["edge"], part["hole"])
        return derive(lambda values: values[:3], found.in_part(part[name]))

    return place


DERIVED: dict[str, Function] = {
    "radius of the hole": of(lambda hole: hole[6], "hole"),
    "radius of the boss": of(lambda boss: boss[6], "boss"),
    "half angle": of(lambda cone: cone[7], "cone"),
    "distance of hole and ball": of(characteristics.distance, "hole", "ball"),
    "ball above plate": of(characteristics.distance_to_plane, "ball", "plate"),
    "hole from axis": of(characteristics.distance_to_line, "hole", "boss"),
    "edge from axis": of(characteristics.distance_of_lines, "edge", "boss"),
    "angle of plate and side": of(characteristics.angle, "plate", "side"),
    "ball in the part": in_frame("ball"),
}


@pytest.fixture(scope="module")
def exact() -> dict[str, Quantity]:
    return measured(ALL)


@pytest.fixture(scope="module")
def nearby() -> tuple[FloatArray, list[tuple[dict[str, Quantity], ...]]]:
    """Return changes of all points, and the features of points moved there and back."""
    changes = np.random.default_rng(7).standard_normal((3, N))
    ends = [
        tuple(measured(ALL + sign * STEP * d.reshape(-1, 3)) for sign in (1, -1))
        for d in changes
    ]
    return changes, ends


@pytest.mark.parametrize("name", DERIVED)
def test_quantities_follow_the_points_as_their_derivatives_say(
    name: str,
    exact: dict[str, Quantity],
    nearby: tuple[FloatArray, list[tuple[dict[str, Quantity], ...]]],
) -> None:
    changes, ends = nearby
    predicted = DERIVED[name](exact).by_inputs @ changes.T
    moved = [[DERIVED[name](part).values for part in each] for each in ends]
    found = np.array([(there - back) / (2 * STEP) for there, back in moved]).T
    np.testing.assert_allclose(found, predicted, rtol=1e-4, atol=1e-5)


def test_a_common_scale_drops_out_of_an_angle_and_stays_in_a_distance(
    exact: dict[str, Quantity],
) -> None:
    part = exact
    alone = NOISE**2 * np.eye(N)
    distance = of(characteristics.distance, "hole", "ball")(part)
    angle = of(characteristics.angle, "plate", "side")(part)

    assert distance.uncertainty(inputs()) > 1.5 * distance.uncertainty(alone)
    np.testing.assert_allclose(
        angle.uncertainty(inputs()), angle.uncertainty(alone), rtol=1e-3
    )
