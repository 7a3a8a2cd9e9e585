"""Panels of small LEDs as they are on a board, drawn without the program's renderer.

Sub-pixels are lit, blurred and averaged; the board reflects each LED between it and the
next, the lens blooms, and the image is of 8 bits, packed as JPEG.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from lightpen.arrays import FloatArray, Image

FINE = 8  # sub-pixels per pixel and axis
FULL_SCALE = 255
FULL_WELL = 10_000.0  # electrons
READ_NOISE = 7.0  # electrons
COLUMNS, ROWS = 7, 5
MOST_TURN = 0.2  # rad, of the panel in the image
HALO_PLACE = 0.5  # standard deviation, in widths from the LED
HALO = (0.6, 1.4)  # standard deviations, least and most, in widths of an LED
DIE = 0.2  # standard deviation of the light of a chip, in widths of an LED
PLACE = (0.42, 0.55)  # of a reflection, in pitches below its LED
REFLECTION = (0.35, 0.2)  # standard deviations, in widths of an LED


@dataclass(frozen=True)
class Panel:
    """What a panel looks like.

    Attributes
    ----------
    width : float
        Of an LED, px.
    gains : tuple of float
        Least and most brightness, fractions of full scale; clipped above 1.
    reflections : tuple of float
        Least and most brightness of a reflection over that of its LED.
    bloom : float
        Share of the light that the lens scatters over four times the blur.
    darkening : float
        Share of the brightness that is lost towards the rim, as on a dome.
    psf : float
        Standard deviation of the blur, px.
    background : float
        Fraction of full scale.
    quality : int or None
        Of the JPEG; None for an image that is not packed.
    pitch : float
        In widths.
    halos : tuple of float
        Least and most brightness of the wide, smooth light about an LED, by its lens
        and the board, over that of its LED; each has a place and a shape of its own.
    gamma : float
        Of the camera; 1 is linear.
    variety : float
        Most by which one LED is narrower than another in a direction of its own, as
        lenses and soldering make them, share of the width.
    die : float
        Light of a chip beside the middle of its LED, over that of the LED.
    """

    width: float
    gains: tuple[float, float] = (0.35, 0.95)
    reflections: tuple[float, float] = (0.05, 0.15)
    bloom: float = 0.08
    darkening: float = 0.0
    psf: float = 1.5
    background: float = 0.03
    quality: int | None = 92
    pitch: float = 2.5
    halos: tuple[float, float] = (0.0, 0.0)
    gamma: float = 1.0
    variety: float = 0.0
    die: float = 0.0


@dataclass(frozen=True, eq=False)
class PanelImage:
    """An image, and the true centres of its LEDs, (N, 2), px."""

    image: Image
    centers: FloatArray


def panel_image(panel: Panel, rng: np.random.Generator) -> PanelImage:
    """Return an image of a panel at a random place."""
    centers, (width, height) = _places(panel, rng)
    light: npt.NDArray[np.float32] = np.zeros((height * FINE, width * FINE), np.float32)
    tilt, direction = rng.uniform(0.8, 1.0), rng.uniform(0, np.pi)
    for center in centers:
        gain = rng.uniform(*panel.gains)
        if panel.variety > 0:
            tilt, direction = rng.uniform(1 - panel.variety, 1), rng.uniform(0, np.pi)
        _add_led(light, center, panel, gain, tilt, direction)
        place = np.array([rng.normal(0, 0.1), rng.uniform(*PLACE)])
        there = center + panel.pitch * panel.width * place
        _add_reflection(
            light, there, panel.width, gain * rng.uniform(*panel.reflections)
        )
        if panel.die > 0:
            _add_die(light, center, panel, gain, rng)
        if panel.halos[1] > 0:
            _add_halo(light, center, panel, gain, rng)
    size = (width, height)
    blurred = cv2.GaussianBlur(light, (0, 0), panel.psf * FINE)
    pixels = cv2.resize(blurred, size, interpolation=cv2.INTER_AREA)
    bloom = cv2.GaussianBlur(pixels, (0, 0), 4 * panel.psf)
    pixels = (1 - panel.bloom) * pixels + panel.bloom * bloom
    y, x = np.mgrid[:height, :width]
    pixels = pixels + panel.background * (1 + 0.5 * x / width + 0.3 * y / height)
    charges = rng.poisson(FULL_WELL * pixels) + rng.normal(0, READ_NOISE, pixels.shape)
    shares = np.maximum(charges / FULL_WELL, 0) ** (1 / panel.gamma)
    digits = np.rint(FULL_SCALE * shares)
    image = np.clip(digits, 0, FULL_SCALE).astype(np.uint8)
    return PanelImage(_packed(image, panel.quality), centers)


def _places(
    panel: Panel, rng: np.random.Generator
) -> tuple[FloatArray, tuple[int, int]]:
    angle = rng.uniform(-MOST_TURN, MOST_TURN)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    grid = np.stack(np.meshgrid(np.arange(COLUMNS), np.arange(ROWS)), axis=-1)
    centers = panel.pitch * panel.width * grid.reshape(-1, 2) @ turn.T
    margin = max(3 * panel.width, 30.0)
    width, height = np.ceil(np.ptp(centers, axis=0) + 2 * margin).astype(int).tolist()
    centers = centers - centers.min(axis=0) + margin + rng.uniform(0, 1, (1, 2))
    return centers + rng.uniform(-0.5, 0.5, centers.shape), (width, height)


def _sub_pixels(
    light: npt.NDArray[np.float32], center: FloatArray, reach: float
) -> tuple[tuple[slice, slice], FloatArray, FloatArray]:
    """Return a window of sub-pixels and its places from a point, px."""
    slices, places = [], []
    for middle, size in zip(center[::-1], light.shape, strict=True):
        low, high = ((np.array([-reach, reach]) + middle + 0.5) * FINE).astype(int)
        low, high = max(low, 0), min(high, size)
        slices.append(slice(low, high))
        places.append((np.arange(low, high) + 0.5) / FINE - 0.5 - middle)
    rows, columns = slices
    y, x = places
    return (rows, columns), x, y[:, None]


def _add_led(
    light: npt.NDArray[np.float32],
    center: FloatArray,
    panel: Panel,
    gain: float,
    tilt: float,
    direction: float,
) -> None:
    radius = panel.width / 2
    window, x, y = _sub_pixels(light, center, radius + 1)
    u = x * np.cos(direction) + y * np.sin(direction)
    v = (y * np.cos(direction) - x * np.sin(direction)) / tilt
    rho = np.hypot(u, v) / radius
    inside = np.clip(0.5 + (1 - rho) * radius * FINE, 0, 1)
    light[window] += gain * inside * (1 - panel.darkening * np.minimum(rho, 1) ** 2)


def _add_reflection(
    light: npt.NDArray[np.float32], center: FloatArray, width: float, gain: float
) -> None:
    window, x, y = _sub_pixels(light, center, 2 * width)
    across, down = (width * share for share in REFLECTION)
    light[window] += gain * np.exp(-0.5 * ((x / across) ** 2 + (y / down) ** 2))


def _add_die(
    light: npt.NDArray[np.float32],
    center: FloatArray,
    panel: Panel,
    gain: float,
    rng: np.random.Generator,
) -> None:
    angle = rng.uniform(0, 2 * np.pi)
    there = center + panel.width / 2 * np.array([np.cos(angle), np.sin(angle)])
    window, x, y = _sub_pixels(light, there, panel.width)
    wide = DIE * panel.width
    light[window] += panel.die * gain * np.exp(-0.5 * (x**2 + y**2) / wide**2)


def _add_halo(
    light: npt.NDArray[np.float32],
    center: FloatArray,
    panel: Panel,
    gain: float,
    rng: np.random.Generator,
) -> None:
    there = center + panel.width * rng.normal(0, HALO_PLACE, 2)
    window, x, y = _sub_pixels(light, there, 4 * panel.width)
    angle = rng.uniform(0, np.pi)
    u = x * np.cos(angle) + y * np.sin(angle)
    v = y * np.cos(angle) - x * np.sin(angle)
    long, wide = panel.width * rng.uniform(*HALO, 2)
    height = gain * rng.uniform(*panel.halos)
    light[window] += height * np.exp(-0.5 * ((u / long) ** 2 + (v / wide) ** 2))


def _packed(image: Image, quality: int | None) -> Image:
    if quality is None:
        return image
    _, packed = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return np.asarray(cv2.imdecode(packed, cv2.IMREAD_GRAYSCALE), dtype=np.uint8)
