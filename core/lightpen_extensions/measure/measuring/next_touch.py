"""The points of a part: those probed, and places to probe by the nominals."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen_extensions.measure.measuring.alignment import Quantity
from lightpen_extensions.measure.measuring.features import frame_about
from lightpen_extensions.measure.measuring.plan import Nominal
from lightpen_extensions.measure.measuring.surfaces import SURFACES, FeatureKind

N_ROUND, N_ALONG = 24, 5  # places round an axis and along it
N_GRID = 7  # places along the sides of a plane
INSIDE = 0.8  # of the extent: edges are not probed
HALF_ANGLE = np.radians(70.0)  # of a sphere, about its pole
USUAL_LENGTH = 20.0  # mm, of a feature whose nominal has none


@dataclass(frozen=True, eq=False)
class ProbedArea:
    """A feature and how far it reaches."""

    kind: FeatureKind
    origin: FloatArray  # (3,), as `features.Feature` has them
    axes: FloatArray  # (3, 3)
    sizes: FloatArray  # (S,)
    half: FloatArray  # (3,), half of its extent along its axes, mm


@dataclass(frozen=True, eq=False)
class Place:
    """A place on a feature, and the normal there, out of round surfaces; (3,) each."""

    point: FloatArray
    normal: FloatArray


def nominal_area(kind: FeatureKind, nominal: Nominal) -> ProbedArea | None:
    """Return the area of a feature by its nominals; None if they do not suffice."""
    if nominal.origin is None:
        return None
    z = np.array(nominal.axis or (0.0, 0.0, 1.0))
    length = nominal.length or USUAL_LENGTH
    width = nominal.width or length
    radius = (nominal.diameter or 0.0) / 2
    named = {"radius": radius, "half_angle": np.radians((nominal.angle or 90.0) / 2)}
    names = SURFACES[kind].sizes
    if names and not radius:
        return None
    is_flat = kind is FeatureKind.PLANE
    half = [length, width, 0.0] if is_flat else [radius, radius, length]
    return ProbedArea(
        kind,
        np.array(nominal.origin),
        frame_about(z),
        np.array([named[name] for name in names]),
        INSIDE / 2 * np.array(half),
    )


def spread_places(area: ProbedArea, n: int) -> list[Place]:
    """Return n places, each as far as can be from those before it."""
    places = _places(area)
    away = np.full(len(places), np.inf)
    found = []
    for _ in range(n):
        farthest = places[int(np.argmax(away))]
        away = np.minimum(away, np.linalg.norm(places - farthest, axis=1))
        found.append(_place(area, farthest))
    return found


def _place(area: ProbedArea, q: FloatArray) -> Place:
    gradient = SURFACES[area.kind].distances(q[None], area.sizes).by_point[0]
    return Place(area.origin + area.axes @ q, area.axes @ gradient[0])


def _places(area: ProbedArea) -> FloatArray:
    """Return places (N, 3) spread over a feature, in its frame."""
    along = np.linspace(-1, 1, N_ALONG) * area.half[2]
    turn = 2 * np.pi * np.arange(N_ROUND) / N_ROUND
    round_ = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(N_ROUND)])
    match area.kind:
        case FeatureKind.POINT:
            return np.zeros((1, 3))
        case FeatureKind.LINE:
            return np.outer(along, [0.0, 0.0, 1.0])
        case FeatureKind.PLANE:
            side = np.linspace(-1, 1, N_GRID)
            x, y = np.meshgrid(side * area.half[0], side * area.half[1])
            return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
        case FeatureKind.CIRCLE:
            return np.asarray(area.sizes[0] * round_)
        case FeatureKind.SPHERE:
            tilt = np.linspace(0.0, HALF_ANGLE, N_ALONG)
            caps = [
                np.sin(t) * round_ + np.cos(t) * np.array([0.0, 0.0, 1.0]) for t in tilt
            ]
            return np.asarray(area.sizes[0] * np.concatenate(caps))
        case FeatureKind.CYLINDER | FeatureKind.CONE:
            slope = 0.0 if area.kind is FeatureKind.CYLINDER else np.tan(area.sizes[1])
            return np.concatenate(
                [
                    (area.sizes[0] + slope * z) * round_ + np.array([0.0, 0.0, z])
                    for z in along
                ]
            )


@dataclass(frozen=True, eq=False)
class PartTouches:
    """Touches of a part in order."""

    points_cam: FloatArray  # (N, 3), centres of the ball, camera frame, mm
    covariance: FloatArray  # (3 N, 3 N), of all coordinates, with what they share, mm^2
    # (N, 3), unit vectors along which the ball came to the surface; NaN if unknown
    approaches_cam: FloatArray
    styli_cam: FloatArray  # (N, 3), unit vectors from the ball into the pen
    owners: tuple[str, ...]  # feature of each touch
    ball_radius: float = 0.0  # mm; 0 to measure at the centre of the tip
    ball_uncertainty: float = 0.0  # U (k = 2) of the radius, mm

    @property
    def n_inputs(self) -> int:
        """Number of inputs: all coordinates and the ball radius."""
        return 3 * len(self.points_cam) + 1

    @property
    def inputs(self) -> FloatArray:
        """Covariance of all inputs, (P, P), mm^2."""
        covariance = np.zeros((self.n_inputs, self.n_inputs))
        covariance[:-1, :-1] = self.covariance
        covariance[-1, -1] = (self.ball_uncertainty / 2) ** 2
        return covariance

    @property
    def ball(self) -> Quantity:
        """The ball radius as a quantity."""
        by_inputs = np.zeros((1, self.n_inputs))
        by_inputs[0, -1] = 1.0
        return Quantity(np.array([self.ball_radius]), by_inputs)

    def of(self, name: str) -> IntArray:
        """Return the indices of the touches of a feature."""
        return np.flatnonzero([owner == name for owner in self.owners])

    def noise(self, touches: IntArray) -> float:
        """Return the standard deviation of a coordinate about the mean of touches, mm.

        What moves all of them alike does not count.
        """
        n = len(touches)
        columns = self.columns(touches)
        own = self.covariance[np.ix_(columns, columns)].reshape(n, 3, n, 3)
        spread = np.einsum("iaia->", own) - np.einsum("iaja->", own) / n
        return float(np.sqrt(max(spread, 0.0) / (3 * max(n - 1, 1))))

    def columns(self, touches: IntArray) -> IntArray:
        """Return the indices of their coordinates among the inputs, (3 n,)."""
        return np.asarray((3 * touches[:, None] + np.arange(3)).ravel())

    def points(self, touches: IntArray | Sequence[int]) -> Quantity:
        """Return the coordinates of touches as one quantity, (3 n,)."""
        at = np.asarray(touches)
        columns = self.columns(at)
        by_inputs = np.zeros((len(columns), self.n_inputs))
        by_inputs[np.arange(len(columns)), columns] = 1.0
        return Quantity(self.points_cam[at].ravel(), by_inputs)
