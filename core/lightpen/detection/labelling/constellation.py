"""A pen as a pattern of LEDs: its triangles and its near-symmetries."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import combinations, permutations

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.detection.spots import SpotFlaw, Spots
from lightpen.model.camera import Camera
from lightpen.model.pen import MIN_LEDS, Pen
from lightpen.model.rigid import fit_rigid

MIN_CERTAIN_LEDS = 6  # leave 6 equations over to check the 6 unknowns of a pose
FEWEST_LEDS = 5  # of a labelling if nothing else explains the spots
MIN_HEIGHT = 0.05  # of a triangle over its longest side; flatter ones fix no pose
LOOKALIKE = 0.025  # of the pen's size, within which an LED stands in for another
MAX_TRIANGLES = 120  # whose copies are sought in the pen
ALIKE_NORMALS = 0.9  # cosine


@dataclass(frozen=True, eq=False)
class Constellation:
    """Properties of a pen for the search, computed once per pen."""

    # `leds` and `normals`: (L, 3), centres, mm, and unit normals of the discs.
    leds: FloatArray
    normals: FloatArray
    radius: float  # radius of the discs, mm
    min_leds: int  # fewest LEDs of an accepted labelling
    triples: IntArray  # (Q, 3), all ordered triples of LEDs that form a triangle
    sides: FloatArray  # (Q, 3), sides 01, 02, 12 of the triangles, mm
    # `self_rotations` and `self_translations`: (M, 3, 3) and (M, 3). Motions of the pen
    # frame that put at least ``min_leds`` LEDs nearly where other LEDs were, discs
    # facing alike. Empty for a pen without near-symmetry.
    self_rotations: FloatArray
    self_translations: FloatArray

    @property
    def size(self) -> float:
        """Longest distance between two LEDs, mm."""
        return float(self.sides.max())


def certain_leds(pen: Pen) -> int:
    """Return the number of LEDs needed to label a pen among other spots."""
    return min(MIN_CERTAIN_LEDS, pen.n_leds)


def constellation_of(pen: Pen, certain: int = MIN_CERTAIN_LEDS) -> Constellation:
    """Return the constellation of a pen.

    Parameters
    ----------
    pen : Pen
        Pen with at least four LEDs that are not collinear.
    certain : int
        LEDs to be explained before a labelling is believed, if it has that many.
    """
    if pen.n_leds < MIN_LEDS:
        raise ValueError(f"`pen` must have at least {MIN_LEDS} LEDs, got {pen.n_leds}.")
    # By their content: a file that is read again is the same pen.
    leds, normals = (each.astype(float).tobytes() for each in (pen.leds, pen.normals))
    return _constellation(leds, normals, pen.diameter, min(certain, pen.n_leds))


@lru_cache(maxsize=32)
def _constellation(
    led_bytes: bytes, normal_bytes: bytes, diameter: float, min_leds: int
) -> Constellation:
    leds, normals = (
        np.frombuffer(each).reshape(-1, 3) for each in (led_bytes, normal_bytes)
    )
    triples = np.array(list(permutations(range(len(leds)), 3)))
    sides = _sides(leds[triples])
    triangles = _heights(leds[triples]) > MIN_HEIGHT * sides.max(axis=1)
    if not triangles.any():
        raise ValueError("`pen` must not have all its LEDs on one line.")
    triples, sides = triples[triangles], sides[triangles]
    motions = _self_motions(leds, normals, triples, sides, min_leds)
    return Constellation(
        leds, normals, diameter / 2, min_leds, triples, sides, *motions
    )


def _sides(corners: FloatArray) -> FloatArray:
    a, b, c = corners[..., 0, :], corners[..., 1, :], corners[..., 2, :]
    return np.asarray(np.linalg.norm(np.stack([a - b, a - c, b - c], -2), axis=-1))


def _heights(corners: FloatArray) -> FloatArray:
    """Return the height of triangles over their longest side."""
    along = corners[:, 1] - corners[:, 0]
    doubled_area = np.linalg.norm(
        np.cross(along, corners[:, 2] - corners[:, 0]), axis=1
    )
    return np.asarray(doubled_area / np.maximum(_sides(corners).max(axis=1), 1e-300))


def _self_motions(
    leds: FloatArray,
    normals: FloatArray,
    triples: IntArray,
    sides: FloatArray,
    min_leds: int,
) -> tuple[FloatArray, FloatArray]:
    """Return the motions, except identity, that map enough LEDs to LEDs."""
    known = {tuple(triple) for triple in triples.tolist()}
    bases = np.array([t for t in combinations(range(len(leds)), 3) if t in known])
    heights = _heights(leds[bases])
    # A triangle that fixes the motion well; all of them where the pen has few.
    bases = bases[np.argsort(-heights, kind="stable")][:MAX_TRIANGLES]
    reach = LOOKALIKE * sides.max()
    own = _sides(leds[bases])
    close = [np.abs(own[:, k, None] - sides[:, k]) < 2 * reach for k in range(3)]
    base, copy = np.nonzero(close[0] & close[1] & close[2])
    moved = (bases[base] != triples[copy]).any(axis=1)
    base, copy = base[moved], copy[moved]
    R, t = fit_rigid(leds[bases[base]], leds[triples[copy]])
    there = leds @ np.swapaxes(R, 1, 2) + t[:, None]
    squares = np.einsum("mli,mli->ml", there, there)[..., None] - 2 * there @ leds.T
    squares += np.einsum("li,li->l", leds, leds)
    partner = np.where(squares.min(axis=2) < reach**2, squares.argmin(axis=2), -1)
    turned = normals @ np.swapaxes(R, 1, 2)
    alike = np.einsum("mli,mli->ml", turned, normals[partner]) > ALIKE_NORMALS
    partner = np.where(alike, partner, -1)
    moving = (partner >= 0) & (partner != np.arange(len(leds)))
    enough = ((partner >= 0).sum(axis=1) >= min_leds) & moving.any(axis=1)
    first: dict[tuple[int, ...], int] = {}
    for which in np.flatnonzero(enough).tolist():
        first.setdefault(tuple(partner[which].tolist()), which)
    kept = np.array(list(first.values()), dtype=np.int64)
    return R[kept], t[kept]


# The spots of many images as arrays, without distortion.
#
# Pinhole pixels are the undistorted normalised plane times the focal length.


FAR = 1e7  # px, where no spot is
UNWHOLE = int(SpotFlaw.MERGED | SpotFlaw.CUT)


@dataclass(frozen=True, eq=False)
class SpotArrays:
    """The spots of B images in pinhole pixels, padded to N spots each."""

    focal: float  # pinhole pixels in one unit of the normalised plane
    points: FloatArray  # (B, N, 2), centres, `FAR` where there is no usable spot
    # (B, N, 2), centres of the merged and cut spots, `FAR` elsewhere.
    unwhole_points: FloatArray
    shapes: FloatArray  # (B, N, 2, 2), covariances of the areas
    usable: BoolArray  # (B, N)
    radius: float  # radius of the discs of the pen, mm

    @cached_property
    def rays(self) -> FloatArray:
        """Unit vectors to the usable spots, (B, N, 3)."""
        rays = np.ones((*self.usable.shape, 3))
        rays[..., :2] = self.points / self.focal
        rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
        return rays

    @cached_property
    def ranges(self) -> FloatArray:
        """Distances of the usable spots, if they are discs of the pen, (B, N), mm."""
        ranges = np.full(self.usable.shape, np.inf)
        points = self.points[self.usable] / self.focal
        shapes = self.shapes[self.usable] / self.focal**2
        ranges[self.usable] = _ranges(points, shapes, self.radius)
        return ranges


def spot_arrays(
    spots: Sequence[Spots], camera: Camera, radius: float, use_unwhole: bool = False
) -> SpotArrays:
    """Return the spots of images, undistorted.

    Parameters
    ----------
    spots : sequence of Spots
        One per image.
    radius : float
        Radius of the discs, mm.
    use_unwhole : bool
        Take merged and cut spots for whole ones.
    """
    n_spots = np.array([len(s) for s in spots])
    there = np.arange(max(int(n_spots.max()), 1)) < n_spots[:, None]
    flaws = np.zeros(there.shape, dtype=np.int64)
    flaws[there] = np.concatenate([s.flaws for s in spots])
    focal = float(np.sqrt(camera.fx * camera.fy))
    centers = np.concatenate([s.centers for s in spots])
    seen = there.copy()
    seen[there] = camera.sees(centers)
    centers[~seen[there]] = np.nan  # has no direction
    plane = camera.unproject_with_jacobian(centers)
    J = focal * plane.jacobian
    points = np.full((*there.shape, 2), FAR)
    points[there] = np.where(seen[there][:, None], focal * plane.points, FAR)
    shapes = np.empty((*there.shape, 2, 2))
    shapes[:] = np.eye(2)
    shapes[there] = J @ np.concatenate([s.shapes for s in spots]) @ J.transpose(0, 2, 1)
    unwhole = seen & (flaws & UNWHOLE != 0)
    usable = seen & (use_unwhole | ~unwhole)
    return SpotArrays(
        focal=focal,
        points=np.where(usable[..., None], points, FAR),
        unwhole_points=np.where(unwhole[..., None], points, FAR),
        shapes=shapes,
        usable=usable,
        radius=radius,
    )


def _ranges(x: FloatArray, shapes: FloatArray, radius: float) -> FloatArray:
    """Return distances of discs from their shapes in the normalised plane.

    Seen along its ray, a disc's longer semi-axis is radius / distance whatever its
    tilt; the plane is first turned square to the ray.
    """
    stretch = np.sqrt(1 + np.einsum("ni,ni->n", x, x))
    turn = np.eye(2) - x[:, :, None] * (x / (stretch * (stretch + 1))[:, None])[:, None]
    square = turn @ shapes @ np.swapaxes(turn, 1, 2) / (stretch**2)[:, None, None]
    half_trace = 0.5 * (square[:, 0, 0] + square[:, 1, 1])
    difference = 0.5 * (square[:, 0, 0] - square[:, 1, 1])
    largest = half_trace + np.hypot(difference, square[:, 0, 1])
    return np.asarray(radius / (2 * np.sqrt(largest)))
