"""The scene before the camera: optics, pose, stray lights, fingers."""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.pen import Pen
from lightpen.model.rigid import rotation_from_vector
from lightpen.simulator.contours import MIN_SIGMA
from lightpen.simulator.faces import Face

PEAK = 205 / 255
GHOST_OFFSET = (9, 4)  # px, right and down
BOARD_OFFSET = (1, 8)  # px, right and down
CAP_STEPS = 16  # corners of a round finger end


@dataclass(frozen=True)
class Optics:
    """Brightness and sharpness of the image.

    Attributes
    ----------
    peak : float
        Level of an LED of gain 1 seen head-on, fraction of full scale; above 1 it
        saturates.
    exposure : float
        Multiplies every light.
    cos_power : float
        The level goes with this power of the cosine of the viewing angle.
    psf_sigma : float
        Standard deviation of the Gaussian blur, px, at least 0.3.
    defocus_radius : float
        Radius of the even disc that defocus spreads each point over, px.
    background : float
        Level where nothing shines, fraction of full scale.
    gradient : tuple of float
        Change of the background over the width and over the height of the image.
    halo : float
        Share of the light of each LED that is scattered round it.
    ghost : float
        Share of it that is seen again `GHOST_OFFSET` beside, by reflection in the
        filter.
    board : float
        Share of it that the board reflects, blurred, `BOARD_OFFSET` beside.
    """

    peak: float = PEAK
    exposure: float = 1.0
    cos_power: float = 0.3
    psf_sigma: float = 0.8
    defocus_radius: float = 0.0
    background: float = 0.0
    gradient: tuple[float, float] = (0.0, 0.0)
    halo: float = 0.0
    ghost: float = 0.0
    board: float = 0.0

    def __post_init__(self) -> None:
        if self.psf_sigma < MIN_SIGMA:
            raise ValueError(
                f"`psf_sigma` must be at least {MIN_SIGMA} px, got {self.psf_sigma}."
            )


@dataclass(frozen=True, eq=False)
class Lamp:
    """A stray round light: an ellipse in the image.

    Attributes
    ----------
    center : (2,) array
        px.
    semi_axes : tuple of float
        px.
    angle : float
        Of the first semi-axis from the image's x axis, rad.
    level : float
        Fraction of full scale.
    """

    center: FloatArray
    semi_axes: tuple[float, float]
    angle: float = 0.0
    level: float = PEAK


@dataclass(frozen=True, eq=False)
class Glare:
    """A reflection or a bright window: a polygon with soft edges.

    Attributes
    ----------
    outline : (N, 2) array
        Corners, px.
    level : float
        Fraction of full scale.
    softness : float
        Standard deviation of its edges, px.
    """

    outline: FloatArray
    level: float
    softness: float = 1.0


@dataclass(frozen=True, eq=False)
class Finger:
    """A dark capsule in front of the pen.

    Attributes
    ----------
    start, end : (2,) array
        Ends of its axis, px.
    radius : float
        px.
    softness : float
        Standard deviation of its edges, px.
    """

    start: FloatArray
    end: FloatArray
    radius: float
    softness: float = 1.5

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
    """View of the camera during one exposure.

    Attributes
    ----------
    rotations, translations : (S, 3, 3) and (S, 3) array
        cam_from_pen at S times spread evenly over the exposure; mm.
    gains : (L,) array
        Brightness of each LED, 0 if it is off.
    lamps, glares, fingers : tuple
        Whatever else is in the picture; fingers hide what is behind them.
    faces : tuple of Face
        How each LED looks inside its contour; empty for evenly lit ones.
    """

    rotations: FloatArray
    translations: FloatArray
    gains: FloatArray
    lamps: tuple[Lamp, ...] = ()
    glares: tuple[Glare, ...] = ()
    fingers: tuple[Finger, ...] = ()
    faces: tuple[Face, ...] = ()


def still_view(pen: Pen, rotation: FloatArray, translation: FloatArray) -> View:
    """Return the view of a pen at rest with every LED lit and nothing else."""
    return View(rotation[None], translation[None], np.ones(pen.n_leds))


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
