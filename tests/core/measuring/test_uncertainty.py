"""U of features, constructions and alignments agrees with the scatter of many fits."""

from collections.abc import Callable

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.measuring import constructions as construct
from lightpen.measuring.alignment import Alignment, align_321, align_points
from lightpen.measuring.features import fit_feature
from lightpen.measuring.quantities import Quantity, derive, quantity_of
from lightpen.measuring.surfaces import FeatureKind
from lightpen.model.rigid import rotation_from_vector

N_RUNS = 100
NOISE, COMMON = 0.004, 0.02  # mm
FAR = np.array([300.0, -200.0, 1500.0])
R_CAM = rotation_from_vector(np.array([0.3, 0.8, -0.4]))

PLATE = np.array([[x, y, 0.0] for x in (-50, 0, 50) for y in (-40, 0, 40)])
SIDE = np.array([[x, -60.0 + 0.3 * z, z] for x in (-50, -10, 30) for z in (-5, -20)])
END = np.array([[-70.0, y, z] for y in (-30, 10) for z in (-5, -20)])
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
    "end": (FeatureKind.PLANE, END),
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


def best_fit(part: dict[str, Quantity]) -> Quantity:
    corners = np.array([[30.0, 0, 0], [-30, 0, 0], [0, 50, 20]])
    axis = DERIVED["axis through plate"](part)
    found: Alignment = align_points([part["hole"], axis, part["ball"]], corners)
    return found.motion


DERIVED: dict[str, Function] = {
    "radius of the hole": of(lambda hole: hole[6], "hole"),
    "radius of the boss": of(lambda boss: boss[6], "boss"),
    "half angle": of(lambda cone: cone[7], "cone"),
    "apex": of(construct.apex, "cone"),
    "distance of hole and ball": of(construct.distance, "hole", "ball"),
    "ball above plate": of(construct.distance_to_plane, "ball", "plate"),
    "hole from axis": of(construct.distance_to_line, "hole", "boss"),
    "edge from axis": of(construct.distance_of_lines, "edge", "boss"),
    "angle of plate and side": of(construct.angle, "plate", "side"),
    "midpoint": of(construct.midpoint, "hole", "ball"),
    "on plate": of(construct.projection_on_plane, "ball", "plate"),
    "on axis": of(construct.projection_on_line, "ball", "edge"),
    "axis through plate": of(construct.intersection_of_line_and_plane, "boss", "plate"),
    "edge of planes": of(
        lambda a, b: construct.intersection_of_planes(a, b)[3:], "plate", "side"
    ),
    "corner": of(construct.intersection_of_three_planes, "plate", "side", "end"),
    "ball in the part": in_frame("ball"),
    "best fit": best_fit,
}


@pytest.fixture(scope="module")
def scatter() -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return of each derived quantity what many runs gave, and the covariance."""
    rng = np.random.default_rng(7)
    factor = np.linalg.cholesky(inputs())
    exact = measured(ALL)
    runs: dict[str, list[FloatArray]] = {name: [] for name in DERIVED}
    for _ in range(N_RUNS):
        part = measured(ALL + (factor @ rng.normal(size=N)).reshape(-1, 3))
        for name, function in DERIVED.items():
            runs[name].append(function(part).values)
    return {
        name: (np.array(runs[name]), function(exact).covariance(inputs()))
        for name, function in DERIVED.items()
    }


@pytest.mark.parametrize("name", DERIVED)
def test_predicted_covariance_is_that_of_many_runs(
    name: str, scatter: dict[str, tuple[FloatArray, FloatArray]]
) -> None:
    values, predicted = scatter[name]
    found = np.cov(values.T).reshape(predicted.shape)
    ratio = np.diag(found) / np.diag(predicted)
    # The variance of N runs scatters by sqrt(2 / N): 14 %; four of them.
    assert np.abs(ratio - 1).max() < 4 * np.sqrt(2 / N_RUNS), ratio


def test_a_common_scale_drops_out_of_an_angle_and_stays_in_a_distance() -> None:
    part = measured(ALL)
    alone = NOISE**2 * np.eye(N)
    distance = of(construct.distance, "hole", "ball")(part)
    angle = of(construct.angle, "plate", "side")(part)

    assert distance.uncertainty(inputs()) > 1.5 * distance.uncertainty(alone)
    np.testing.assert_allclose(
        angle.uncertainty(inputs()), angle.uncertainty(alone), rtol=1e-3
    )
