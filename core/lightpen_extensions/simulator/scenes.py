"""Scenes, and the sensor that takes their images."""

from dataclasses import dataclass, field, replace
from functools import lru_cache
from statistics import NormalDist
from typing import Literal

import numpy as np

from lightpen.arrays import FloatArray, Image, IntArray
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig, rotation_from_vector
from lightpen_extensions.simulator.render import Light, LightArray, Optics
from lightpen_extensions.simulator.swings import (
    PAPER_CONE,
    PAPER_TIP,
    paper_camera,
    paper_pen,
)

# The image sensor: shot noise, read noise, quantisation.
#
# A pixel that collects the mean charge q reads
#
#     DN = round(clip((Poisson(q) + N(0, read noise) + offset) / e_per_dn)).
#
# Shot noise is drawn as a Gaussian of variance q: read noise of some electrons hides
# the difference at small q, the central limit at large q. Most of an image is dark: its
# pixels are independent draws from one discrete distribution, so only those that do not
# read the most likely number are drawn, at exponential gaps.


MOSTLY = 0.9  # share of the most likely reading above which the rest is drawn alone
TABLE_SIZE = 2**16  # equally likely values: one for each 16-bit random number


@dataclass(frozen=True)
class Sensor:
    """An image sensor."""

    bits: Literal[8, 12, 16] = 8  # 8, or 12 or 16 in a 16-bit image
    full_well: float = 10_000.0  # charge that reads full scale, electrons
    read_noise: float = 7.0  # standard deviation, electrons
    offset: float = 0.1 * 10_000 / 255  # added to the charge, electrons

    def __post_init__(self) -> None:
        if self.bits not in {8, 12, 16}:
            raise ValueError(f"`bits` must be 8, 12 or 16, got {self.bits}.")

    @property
    def full_scale(self) -> int:
        """Largest number a pixel reads."""
        return int(2**self.bits - 1)

    @property
    def electrons_per_dn(self) -> float:
        """Charge of one step of the reading."""
        return self.full_well / self.full_scale


def expose(light: Light, sensor: Sensor, rng: np.random.Generator) -> Image:
    """Return the image (H, W) that a sensor reads, uint8 for 8 bits, else uint16."""
    image = _dark_image(sensor, light.levels.size, rng)
    image = image.reshape(light.levels.shape)
    for window in light.windows:
        # Where windows overlap the last reading stands, which is as good as the first.
        image[window.slices] = _read(light.levels[window.slices], sensor, rng)
    return image


def _read(levels: LightArray, sensor: Sensor, rng: np.random.Generator) -> Image:
    charges = levels * np.float32(sensor.full_well)
    noise = np.maximum(charges, 0)
    noise += np.float32(sensor.read_noise**2)
    np.sqrt(noise, out=noise)
    noise *= _normal_table()[
        rng.integers(TABLE_SIZE, size=noise.shape, dtype=np.uint16)
    ]
    charges += noise
    return _digits(charges, sensor)


def _digits(charges: LightArray, sensor: Sensor) -> Image:
    readings = charges + np.float32(sensor.offset)
    readings *= np.float32(1 / sensor.electrons_per_dn)
    np.rint(readings, out=readings)
    np.clip(readings, 0, sensor.full_scale, out=readings)
    if sensor.bits == 8:
        return readings.astype(np.uint8)
    return readings.astype(np.uint16)


def _blank(shape: tuple[int, ...], sensor: Sensor) -> Image:
    if sensor.bits == 8:
        return np.zeros(shape, dtype=np.uint8)
    return np.zeros(shape, dtype=np.uint16)


@lru_cache(maxsize=1)
def _normal_table() -> LightArray:
    """Return equally likely values of a standard normal variable."""
    chances = (np.arange(TABLE_SIZE) + 0.5) / TABLE_SIZE
    values = np.array([NormalDist().inv_cdf(chance) for chance in chances.tolist()])
    return np.asarray(values / values.std(), dtype=np.float32)


def _dark_image(sensor: Sensor, n_pixels: int, rng: np.random.Generator) -> Image:
    """Return ``n_pixels`` independent readings of darkness."""
    values, probabilities = _dark_distribution(sensor)
    likely = int(np.argmax(probabilities))
    others = 1 - probabilities[likely]
    if probabilities[likely] < MOSTLY:
        edges = np.rint(np.cumsum(probabilities) * TABLE_SIZE).astype(np.int64)
        table = _blank((TABLE_SIZE,), sensor)
        table[:] = np.repeat(values, np.diff(edges, prepend=0))
        return table[rng.integers(TABLE_SIZE, size=n_pixels, dtype=np.uint16)]
    image = _blank((n_pixels,), sensor)
    if values[likely] > 0:
        image[:] = values[likely]
    if others <= 0:
        return image
    places = _bernoulli_places(n_pixels, others, rng)
    probabilities = probabilities.copy()
    probabilities[likely] = 0
    cumulated = np.cumsum(probabilities / others)
    rank = np.searchsorted(cumulated, rng.random(len(places)))
    image[places] = values[np.minimum(rank, len(values) - 1)]
    return image


def _bernoulli_places(n: int, probability: float, rng: np.random.Generator) -> IntArray:
    """Return the places of the successes in ``n`` independent trials."""
    spread = np.sqrt(n * probability)
    n_gaps = int(n * probability + 8 * spread + 8)
    places = np.cumsum(rng.geometric(probability, size=n_gaps)) - 1
    return places[: np.searchsorted(places, n)]


@lru_cache(maxsize=32)
def _dark_distribution(sensor: Sensor) -> tuple[IntArray, FloatArray]:
    """Return the readings that occur in the dark and their probabilities."""
    mean = sensor.offset / sensor.electrons_per_dn
    sigma = sensor.read_noise / sensor.electrons_per_dn
    low = max(int(np.floor(mean - 7 * sigma)), 0)
    high = min(int(np.ceil(mean + 7 * sigma)), sensor.full_scale)
    values = np.arange(low, max(high, low) + 1)
    reading = NormalDist(mean, max(sigma, 1e-12))
    upper = np.array([reading.cdf(value + 0.5) for value in values.tolist()])
    upper[-1] = 1
    return values, np.diff(upper, prepend=0.0)


@dataclass(frozen=True, eq=False)
class Scene:
    """Content of a simulated set of images."""

    n_images: int = 60
    seed: int = 1
    optics: Optics = field(default_factory=Optics)
    sensor: Sensor = field(default_factory=Sensor)
    led_noise: float = 0.002  # mm, of the measured LED coordinates about the truth
    pen: Pen = field(default_factory=paper_pen)  # the truth
    camera: Camera = field(default_factory=paper_camera)
    tip_pen: FloatArray = field(default_factory=PAPER_TIP.copy)  # (3,), mm
    cone_cam: FloatArray = field(default_factory=PAPER_CONE.copy)  # (3,), mm
    viewpoint: int = 0  # index of the camera in the rig, from 0; it selects the noise


LENS_SPREAD = 0.004  # of the focal length, from one lens of a kind to the next
ROTATION_SIGMA = 1e-4  # rad, of a rig that was calibrated with a board
TRANSLATION_SIGMA = 0.1  # mm
BASELINE = 500.0  # mm, of a camera and the one beside it


def beside(camera: Camera, cone_cam: FloatArray) -> Rig:
    """Return the rig of a camera and one to its right that sees the cone alike."""
    u, _, w = cone_cam
    turn = np.array([0.0, np.arctan2(u, w) - np.arctan2(u - BASELINE, w), 0.0])
    R = rotation_from_vector(turn)
    return Rig(
        cameras=(camera, replace(camera, fx=camera.fx * (1 + LENS_SPREAD))),
        rotations=np.stack([np.eye(3), R]),
        translations=np.stack([np.zeros(3), -BASELINE * R[:, 0]]),
        covariance=np.diag(np.repeat([ROTATION_SIGMA, TRANSLATION_SIGMA], 3) ** 2),
        names=("left", "right"),
    )
