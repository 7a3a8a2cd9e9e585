"""The scene before the camera: optics, pose, stray lights."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from lightpen.arrays import FloatArray
from lightpen_extensions.simulator.faces import MIN_SIGMA, Face, LightArray

PEAK = 205 / 255
GHOST_OFFSET = (9, 4)  # px, right and down
BOARD_OFFSET = (1, 8)  # px, right and down


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


class Window(NamedTuple):
    """Rows ``top`` to ``bottom`` and columns ``left`` to ``right`` of an image."""

    top: int
    bottom: int
    left: int
    right: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """Index of the window into an image."""
        return slice(self.top, self.bottom), slice(self.left, self.right)


class OtherLight(Protocol):
    """What adds light to an image of the pen, or takes some away."""

    def draw(self, levels: LightArray, exposure: float) -> Sequence[Window]:
        """Draw it on the light (H, W), fraction of full scale, and return where.

        ``exposure`` multiplies every light.
        """


@dataclass(frozen=True, eq=False)
class View:
    """View of the camera during one exposure."""

    rotations: FloatArray  # (S, 3, 3), cam_from_pen at S times, even in the exposure
    translations: FloatArray  # (S, 3), mm
    gains: FloatArray  # (L,), brightness of each LED, 0 if it is off
    lamps: tuple[Lamp, ...] = ()
    faces: tuple[Face, ...] = ()  # of each LED; empty for evenly lit ones
    others: tuple[OtherLight, ...] = ()
