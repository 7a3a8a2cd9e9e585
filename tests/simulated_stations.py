"""Random stations without any file: what a camera sees of a swing of a pen."""

from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np
from scipy.optimize import linear_sum_assignment
from tests.simulated_centers import simulate_centers
from tests.simulated_swings import FRAME_RATE

from lightpen.arrays import FloatArray, IntArray
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.model.rigid import fit_rigid
from lightpen_extensions.discover.discover import discover
from lightpen_extensions.discover.found import Discovery
from lightpen_extensions.discover.scale import MeasuredLength, Request
from lightpen_extensions.discover.tracks import Sightings, sightings_of_centers
from lightpen_extensions.simulator.swings import (
    Postures,
    Swing,
    operator_postures,
    swing_from_postures,
)

WIDTH, HEIGHT = 2448, 2048
FOCAL_LENGTHS = (0.8, 4.0)  # image widths
STRONGEST_BARREL, STRONGEST_CUSHION = -0.3, 0.05  # k1
SIZES = (80.0, 400.0)  # mm
N_LEDS = (5, 12)
PLANAR = 0.2  # of the pens
NEAREST = 0.08  # of the pen's size, between two LEDs
FILLED = 0.75  # of the image, by pen and cone
EXACT = 1e-4  # mm


@dataclass(frozen=True, eq=False)
class Station:
    """A station and a swing before it.

    Attributes
    ----------
    pixels : (N, L, 2) array
        Measured centres, px; NaN where an LED is not seen.
    order : (N, L) array of int
        In which the LEDs of each image are given.
    diameter : float
        Of the discs as it is stated, mm.
    """

    camera: Camera
    pen: Pen
    swing: Swing
    pixels: FloatArray
    order: np.ndarray
    diameter: float

    @property
    def longest(self) -> float:
        """Largest distance between two LEDs, mm."""
        leds = self.pen.leds
        return float(np.linalg.norm(leds[:, None] - leds, axis=2).max())

    @property
    def sightings(self) -> Sightings:
        """What is known of the images: spots in any order."""
        centers = []
        for pixels, order in zip(self.pixels, self.order, strict=True):
            spots = pixels[order]
            centers.append(spots[np.isfinite(spots[:, 0])])
        names = tuple(f"frame {i}" for i in range(len(centers)))
        return sightings_of_centers(names, tuple(centers), self.camera.image_size)

    @property
    def request(self) -> Request:
        """What its user knows: the largest distance, and the discs."""
        length = MeasuredLength(None, self.longest, EXACT)
        return Request((length,), self.diameter)

    def discovered(self) -> Discovery:
        """Return what is found."""
        return discover(self.sightings, self.request)


def random_station(
    seed: int,
    n_images: int = 300,
    sigma: float = 0.03,
    missing: float = 0.02,
    rate: float = FRAME_RATE,
    diameter_error: float = 0.0,
) -> Station:
    """Return a station with a pen, a camera and a swing of its own.

    Parameters
    ----------
    sigma : float
        Noise of one image coordinate, px.
    missing : float
        Share of the LEDs that are not seen.
    rate : float
        Images a second.
    diameter_error : float
        Standard deviation of the stated diameter of the discs, relative.
    """
    rng = np.random.default_rng([29, seed])
    camera, pen = _camera(rng), _pen(rng)
    size = float(np.ptp(pen.leds[:, 1]))
    tip = size * np.array(
        [rng.uniform(-0.05, 0.05), -rng.uniform(0.3, 0.6), -rng.uniform(0, 0.15)]
    )
    distance = camera.fx * (size - tip[1]) / (FILLED * HEIGHT)
    across = (
        distance
        / camera.fx
        * np.array([rng.uniform(-0.05, 0.05) * WIDTH, 0.42 * HEIGHT])
    )
    postures = operator_postures(np.arange(n_images) / rate, int(rng.integers(2**31)))
    swing = swing_from_postures(postures, tip, np.append(across, distance))
    station = seen_station(camera, pen, swing, sigma, missing, rng)
    stated = pen.diameter * (1 + diameter_error * float(rng.standard_normal()))
    return replace(station, diameter=stated)


def seen_station(
    camera: Camera,
    pen: Pen,
    swing: Swing,
    sigma: float,
    missing: float,
    rng: np.random.Generator,
) -> Station:
    """Return the station of a given swing, with noise and in any order."""
    pixels = simulate_centers(
        camera, pen, swing.rotations, swing.translations, sigma, rng
    )
    pixels[rng.uniform(size=pixels.shape[:2]) < missing] = np.nan
    order = rng.permuted(np.tile(np.arange(pen.n_leds), (len(pixels), 1)), axis=1)
    return Station(camera, pen, swing, pixels, order, pen.diameter)


def seen_again(
    station: Station, n_images: int, sigma: float, rng: np.random.Generator
) -> Station:
    """Return another swing in the same cone."""
    swing = station.swing
    seed = int(rng.integers(2**31))
    postures = operator_postures(np.arange(n_images) / FRAME_RATE, seed)
    other = swing_from_postures(postures, swing.tip_pen, swing.cone_cam)
    return seen_station(station.camera, station.pen, other, sigma, 0.02, rng)


def leaning(postures: Postures, share: float) -> Postures:
    """Return postures whose tilts and rolls are a share of what they are."""
    return replace(postures, tilts=share * postures.tilts, rolls=share * postures.rolls)


@dataclass(frozen=True, eq=False)
class Errors:
    """What a discovery is off by, in the frame in which its LEDs fit the true ones.

    Attributes
    ----------
    tip : (3,) array
        mm.
    leds : (L, 3) array
        mm.
    intrinsics : (k,) array
    order : (L,) array of int
        LED found of each true one.
    """

    tip: FloatArray
    leds: FloatArray
    intrinsics: FloatArray
    order: np.ndarray

    @property
    def led_rms(self) -> float:
        """Rms distance of the LEDs from the true ones, mm."""
        return float(np.sqrt(np.mean(np.sum(self.leds**2, axis=1))))


def numbers_of(leds: FloatArray, known: FloatArray) -> IntArray:
    """Return the LEDs (L, 3), in any frame, in the order of known ones (L, 3)."""
    apart = np.linalg.norm(known[:, None] - known, axis=2)
    first, second = np.unravel_index(np.argmax(apart), apart.shape)
    off_line = np.cross(known - known[first], known[second] - known[first])
    third = np.argmax(np.linalg.norm(off_line, axis=1))
    corners = [int(first), int(second), int(third)]
    triples = np.array(list(permutations(range(len(leds)), 3)))
    sides = [
        np.linalg.norm(each - np.roll(each, 1, axis=-2), axis=-1)
        for each in (leds[triples], known[corners])
    ]
    near = np.abs(sides[0] - sides[1]).max(axis=1) < 0.2 * apart.max()
    best, order = np.inf, np.arange(len(known))
    for triple in triples[near]:
        R, t = fit_rigid(leds[triple], known[corners])
        gaps = np.linalg.norm(known[:, None] - leds @ R.T - t, axis=2)
        match = linear_sum_assignment(gaps**2)[1]
        R, t = fit_rigid(leds[match], known)
        misfit = float(np.sum((leds[match] @ R.T + t - known) ** 2))
        if misfit < best:
            best, order = misfit, match
    return order


def errors_of(found: Discovery, station: Station) -> Errors:
    """Compare a discovery with the truth."""
    order = numbers_of(found.pen.leds, station.pen.leds)
    leds = found.pen.leds[order]
    R, t = fit_rigid(station.pen.leds, leds)
    return Errors(
        tip=found.tip_pen - (R @ station.swing.tip_pen + t),
        leds=leds - (station.pen.leds @ R.T + t),
        intrinsics=found.camera.intrinsics - station.camera.intrinsics,
        order=order,
    )


def _camera(rng: np.random.Generator) -> Camera:
    focal = WIDTH * float(np.exp(rng.uniform(*np.log(FOCAL_LENGTHS))))
    middle = np.array([WIDTH / 2, HEIGHT / 2]) + 20 * rng.standard_normal(2)
    p1, p2 = 3e-4 * rng.standard_normal(2)
    k1 = rng.uniform(STRONGEST_BARREL, STRONGEST_CUSHION)
    return Camera(
        WIDTH,
        HEIGHT,
        focal,
        focal * (1 + 3e-4 * float(rng.standard_normal())),
        float(middle[0]),
        float(middle[1]),
        np.array([k1, rng.uniform(0, 0.15), p1, p2, 0.0]),
    )


def _pen(rng: np.random.Generator) -> Pen:
    n_leds = int(rng.integers(N_LEDS[0], N_LEDS[1] + 1))
    size = rng.uniform(*SIZES)
    depth = 0.0 if rng.uniform() < PLANAR else -0.2
    while True:
        leds = size * np.column_stack(
            [
                rng.uniform(-0.2, 0.2, n_leds),
                np.append([0.0, 1.0], rng.uniform(0, 1, n_leds - 2)),
                depth * rng.uniform(0, 1, n_leds),
            ]
        )
        apart = np.linalg.norm(leds[:, None] - leds, axis=2)
        np.fill_diagonal(apart, np.inf)
        if apart.min() > NEAREST * size:
            break
    normals = np.tile([0.0, 0.0, 1.0], (n_leds, 1))
    return Pen(leds, normals, min(10.0, 0.05 * size))
