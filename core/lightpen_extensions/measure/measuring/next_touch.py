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
class Place:
    """A place on a feature, and the normal there, out of round surfaces; (3,) each."""

    point: FloatArray
    normal: FloatArray


def places_on(kind: FeatureKind, nominal: Nominal, n: int) -> list[Place]:
    """Return n places by nominals, each as far as can be from those before it.

    Empty if the nominals do not suffice.
    """
    names = SURFACES[kind].sizes
    radius, half_angle = (nominal.diameter or 0) / 2, (nominal.angle or 90) / 2
    if nominal.origin is None or (names and not radius):
        return []
    sizes = np.array([radius, np.radians(half_angle)])[: len(names)]
    q = _places(kind, sizes, nominal)
    gradients = SURFACES[kind].distances(q, sizes).by_point[:, 0]
    axes = frame_about(np.array(nominal.axis or (0.0, 0.0, 1.0)))
    away, found = np.full(len(q), np.inf), []
    for _ in range(n):
        i = int(np.argmax(away))
        away = np.minimum(away, np.linalg.norm(q - q[i], axis=1))
        found.append(Place(nominal.origin + axes @ q[i], axes @ gradients[i]))
    return found


def _places(kind: FeatureKind, sizes: FloatArray, nominal: Nominal) -> FloatArray:
    """Return places (N, 3) spread over a feature, in its frame."""
    length = nominal.length or USUAL_LENGTH
    width = nominal.width or length
    along = INSIDE / 2 * length * np.linspace(-1, 1, N_ALONG)
    turn = 2 * np.pi * np.arange(N_ROUND) / N_ROUND
    round_ = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(N_ROUND)])
    z = np.array([0.0, 0.0, 1.0])
    match kind:
        case FeatureKind.POINT:
            return np.zeros((1, 3))
        case FeatureKind.LINE:
            return np.outer(along, z)
        case FeatureKind.PLANE:
            side = INSIDE / 2 * np.linspace(-1, 1, N_GRID)
            x, y = np.meshgrid(length * side, width * side)
            return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
        case FeatureKind.CIRCLE:
            return np.asarray(sizes[0] * round_)
        case FeatureKind.SPHERE:
            tilt = np.linspace(0.0, HALF_ANGLE, N_ALONG)
            caps = [np.sin(t) * round_ + np.cos(t) * z for t in tilt]
            return np.asarray(sizes[0] * np.concatenate(caps))
        case FeatureKind.CYLINDER | FeatureKind.CONE:
            slope = np.tan(sizes[1]) if kind is FeatureKind.CONE else 0.0
            rings = [(sizes[0] + slope * h) * round_ + h * z for h in along]
            return np.concatenate(rings)


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
