"""The scene before the camera: optics, pose, stray lights, fingers."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen.model.ellipse import Ellipses
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.faces import MIN_SIGMA, Face

PEAK = 205 / 255
GHOST_OFFSET = (9, 4)  # px, right and down
BOARD_OFFSET = (1, 8)  # px, right and down
CAP_STEPS = 16  # corners of a round finger end


@dataclass(frozen=True)
class Optics:
    """Brightness and sharpness of the image."""

    peak: float = PEAK  # of an LED of gain 1 seen head-on, fraction of full scale
    exposure: float = 1.0  # multiplies every light
    cos_power: float = 0.3  # of the level, by the cosine of the viewing angle
    psf_sigma: float = 0.8  # standard deviation of the Gaussian blur, px, at least 0.3
    defocus_radius: float = 0.0  # of the disc that a point is spread over, px
    background: float = 0.0  # level where nothing shines, fraction of full scale
    gradient: tuple[float, float] = (0.0, 0.0)  # of it, over width and height
    halo: float = 0.0  # share of the light of each LED that is scattered round it
    ghost: float = 0.0  # share that the filter reflects to `GHOST_OFFSET` beside
    board: float = 0.0  # share that the board reflects, blurred, `BOARD_OFFSET` beside

    def __post_init__(self) -> None:
        if self.psf_sigma < MIN_SIGMA:
            raise ValueError(
                f"`psf_sigma` must be at least {MIN_SIGMA} px, got {self.psf_sigma}."
            )


@dataclass(frozen=True, eq=False)
class Lamp:
    """A stray round light: an ellipse in the image."""

    center: FloatArray  # (2,), px
    semi_axes: tuple[float, float]  # px
    angle: float = 0.0  # of the first semi-axis from the image's x axis, rad
    level: float = PEAK  # fraction of full scale


@dataclass(frozen=True, eq=False)
class Glare:
    """A reflection or a bright window: a polygon with soft edges."""

    outline: FloatArray  # (N, 2), corners, px
    level: float  # fraction of full scale
    softness: float = 1.0  # standard deviation of its edges, px


@dataclass(frozen=True, eq=False)
class Finger:
    """A dark capsule in front of the pen."""

    start: FloatArray  # (2,), of its axis, px
    end: FloatArray  # (2,), px
    radius: float  # px
    softness: float = 1.5  # standard deviation of its edges, px

    @property
    def outline(self) -> FloatArray:
        """Corners of its outline, px."""
        axis = self.end - self.start
        heading = np.arctan2(axis[1], axis[0])
        half_turn = np.linspace(-np.pi / 2, np.pi / 2, CAP_STEPS) + heading
        cap = self.radius * np.stack([np.cos(half_turn), np.sin(half_turn)], axis=-1)
        return np.concatenate([self.end + cap, self.start - cap])


@dataclass(frozen=True, eq=False)
class View:
    """View of the camera during one exposure."""

    rotations: FloatArray  # (S, 3, 3), cam_from_pen at S times, even in the exposure
    translations: FloatArray  # (S, 3), mm
    gains: FloatArray  # (L,), brightness of each LED, 0 if it is off
    lamps: tuple[Lamp, ...] = ()
    glares: tuple[Glare, ...] = ()
    fingers: tuple[Finger, ...] = ()
    faces: tuple[Face, ...] = ()  # of each LED; empty for evenly lit ones


def moving_poses(
    rotation: FloatArray,
    translation: FloatArray,
    pivot_pen: FloatArray,
    turn: FloatArray,
    n_times: int,
) -> tuple[FloatArray, FloatArray]:
    """Return S poses, (S, 3, 3) and (S, 3), of a pen that turns during the exposure.

    It turns about the point ``pivot_pen`` (3,), mm, from the pose cam_from_pen at
    mid-exposure; ``turn`` (3,) is the rotation vector of the whole exposure in the
    camera frame, rad. ``n_times`` poses suffice if the LEDs move no more than the blur
    between two.
    """
    parts = (np.arange(n_times) + 0.5) / n_times - 0.5
    rotations = rotation_from_vector(parts[:, None] * turn) @ rotation
    pivot_cam = rotation @ pivot_pen + translation
    return rotations, pivot_cam - rotations @ pivot_pen


MAX_TRIES = 30
CLEARANCE = 6.0  # px between a foreign light and a disc
MAX_LAMPS = 4
WINDOW_CHANCE = 0.3
BETWEEN_CHANCE = 0.5
BLOB_CORNERS = 9


def random_lamps(
    camera: Camera, discs: Ellipses, rng: np.random.Generator
) -> tuple[Lamp, ...]:
    """Return one to four stray lamps clear of L discs, px, often one between them."""
    lamps = []
    radius = _reaches(discs).mean()
    if rng.random() < BETWEEN_CHANCE:
        size = radius * rng.uniform(0.4, 1.2)
        place = _clear_place(discs, size, lambda: _place_between(discs, rng))
        if place is not None:
            lamps.append(_lamp(place, size, rng))
    for _ in range(rng.integers(1, MAX_LAMPS)):
        size = radius * np.exp(rng.uniform(np.log(0.2), np.log(2.5)))
        place = _clear_place(discs, size, lambda: _place_anywhere(camera, rng))
        if place is not None:
            lamps.append(_lamp(place, size, rng))
    return tuple(lamps)


def random_glares(
    camera: Camera, discs: Ellipses, rng: np.random.Generator
) -> tuple[Glare, ...]:
    """Return up to two ragged reflections and sometimes a bright window."""
    glares = []
    for _ in range(rng.integers(3)):
        length = _reaches(discs).mean() * rng.uniform(1, 6)
        place = _clear_place(discs, length, lambda: _place_anywhere(camera, rng))
        if place is not None:
            outline = place + _ragged_outline(length, rng)
            glares.append(
                Glare(outline, rng.uniform(0.1, 1.2), softness=rng.uniform(1, 5))
            )
    if rng.random() < WINDOW_CHANCE:
        glares.append(_window(camera, discs, rng))
    return tuple(glares)


def random_finger(discs: Ellipses, rng: np.random.Generator) -> Finger:
    """Return a finger that hides one disc, or part of it, from the side of the pen."""
    reach = _reaches(discs).mean()
    radius = reach * rng.uniform(1.0, 1.7)
    target = discs.centers[rng.integers(len(discs.centers))]
    middle = discs.centers.mean(axis=0)
    pen_axis = np.linalg.svd(discs.centers - middle)[2][0]
    across = np.array([-pen_axis[1], pen_axis[0]])
    if (target - middle) @ across < 0:
        across = -across
    tilt = rng.uniform(-0.4, 0.4)
    heading = np.cos(tilt) * across + np.sin(tilt) * pen_axis
    tip = target + heading * rng.uniform(-0.5, 0.9) * (radius + reach)
    return Finger(tip, tip + heading * 30 * reach, radius)


def _lamp(place: FloatArray, size: float, rng: np.random.Generator) -> Lamp:
    semi_axes = (size, size * rng.uniform(0.7, 1.0))
    return Lamp(place, semi_axes, rng.uniform(0, np.pi), rng.uniform(0.15, 1.3))


def _reaches(discs: Ellipses) -> FloatArray:
    """Return the semi-major axes of the discs, px."""
    return np.asarray(2 * np.sqrt(np.linalg.eigvalsh(discs.shapes)[..., 1]))


def _clear_place(
    discs: Ellipses, size: float, draw: Callable[[], FloatArray]
) -> FloatArray | None:
    """Draw places until a light of ``size`` there is clear of all discs."""
    needed = _reaches(discs) + size + CLEARANCE
    for _ in range(MAX_TRIES):
        place = draw()
        if np.all(np.linalg.norm(discs.centers - place, axis=-1) > needed):
            return place
    return None


def _place_anywhere(camera: Camera, rng: np.random.Generator) -> FloatArray:
    return np.asarray(rng.random(2) * np.array(camera.image_size))


def _place_between(discs: Ellipses, rng: np.random.Generator) -> FloatArray:
    pair = rng.permutation(len(discs.centers))[:2]
    jitter = _reaches(discs).mean() * rng.standard_normal(2)
    return np.asarray(discs.centers[pair].mean(axis=0) + jitter)


def _ragged_outline(length: float, rng: np.random.Generator) -> FloatArray:
    angles = np.arange(BLOB_CORNERS) * 2 * np.pi / BLOB_CORNERS
    radii = length * rng.uniform(0.4, 1.0, BLOB_CORNERS)
    slim = rng.uniform(0.15, 0.8)
    turn = rng.uniform(0, np.pi)
    along = radii * np.cos(angles)
    across = slim * radii * np.sin(angles)
    return np.stack(
        [
            along * np.cos(turn) - across * np.sin(turn),
            along * np.sin(turn) + across * np.cos(turn),
        ],
        axis=-1,
    )


def _window(camera: Camera, discs: Ellipses, rng: np.random.Generator) -> Glare:
    """Return a bright quadrilateral on the side where the pen leaves more room."""
    margin = _reaches(discs).max() + 10 * CLEARANCE
    left = discs.centers[:, 0].min() - margin
    right = discs.centers[:, 0].max() + margin
    if left > camera.width - right:
        inner, outer = left, left - rng.uniform(0.3, 1.2) * left
    else:
        room = camera.width - right
        inner, outer = right, right + rng.uniform(0.3, 1.2) * room
    top, bottom = np.sort(rng.uniform(-0.2, 1.2, 2)) * camera.height
    corners = np.array([[inner, top], [outer, top], [outer, bottom], [inner, bottom]])
    slant = rng.uniform(-0.1, 0.1, (4, 2)) * abs(outer - inner)
    slant[[0, 3], 0] = np.sign(outer - inner) * np.abs(slant[[0, 3], 0])
    return Glare(corners + slant, rng.uniform(0.2, 1.3), softness=rng.uniform(1, 8))
