"""The scene before the camera: optics, pose, stray lights, fingers."""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.contours import MIN_SIGMA
from lightpen_extensions.simulator.faces import Face

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
