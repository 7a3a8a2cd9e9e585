"""Scenes: content and disturbances of a simulated set of images."""

from dataclasses import dataclass, field, fields
from typing import Literal, TypeAlias

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen_extensions.simulator.postures import SwingKind
from lightpen_extensions.simulator.sensor import Sensor
from lightpen_extensions.simulator.swings import (
    PAPER_CONE,
    PAPER_TIP,
    paper_camera,
    paper_pen,
)
from lightpen_extensions.simulator.view import Optics


@dataclass(frozen=True)
class Disturbances:
    """Fractions of the images that are disturbed, each 0 to 1."""

    clutter: float = 0.0  # foreign lamps, reflections, bright windows
    fingers: float = 0.0  # a finger before an LED
    missing: float = 0.0  # one to four LEDs off
    motion_blur: float = 0.0
    defocus: float = 0.0
    saturated: float = 0.0
    dim: float = 0.0
    slipped: float = 0.0  # the tip is 0.2 to 2 mm out of the cone
    blurred_away: float = 0.0  # moved so fast that nothing can be measured
    empty: float = 0.0  # all LEDs off

    def __post_init__(self) -> None:
        for item in fields(self):
            fraction = getattr(self, item.name)
            if not 0 <= fraction <= 1:
                raise ValueError(
                    f"`{item.name}` must be a fraction from 0 to 1, got {fraction}."
                )
        if self.slipped + self.blurred_away + self.empty > 1:
            raise ValueError(
                "`slipped`, `blurred_away` and `empty` must not exceed 1 together."
            )


CLEAN = Disturbances()
HARD = Disturbances(
    clutter=0.6,
    fingers=0.2,
    missing=0.25,
    motion_blur=0.2,
    defocus=0.15,
    saturated=0.12,
    dim=0.15,
    slipped=0.02,
    blurred_away=0.02,
    empty=0.02,
)
SCENES = {"clean": CLEAN, "hard": HARD}


FaceKind: TypeAlias = Literal["even", "hot-spot", "dome", "ring"]


@dataclass(frozen=True)
class Leds:
    """Luminance pattern of LEDs, and scattering of the optics."""

    faces: FaceKind = "even"
    optics: Optics = field(default_factory=Optics)


LEDS = {
    "even": Leds(),
    "hot-spot": Leds("hot-spot"),
    "dome": Leds("dome"),
    "ring": Leds("ring"),
    "halo": Leds(optics=Optics(halo=0.15)),
    "ghost": Leds(optics=Optics(ghost=0.03)),
    "board": Leds("dome", Optics(halo=0.1, board=0.1)),
}


@dataclass(frozen=True, eq=False)
class Scene:
    """Content of a simulated set of images."""

    n_images: int = 60
    seed: int = 1
    swing: SwingKind = "field"  # see `postures.draw_postures`
    disturbances: Disturbances = CLEAN
    optics: Optics = field(default_factory=Optics)
    sensor: Sensor = field(default_factory=Sensor)
    # Even, an off-centre spot, a dome whose bright part moves, or a dark centre.
    faces: FaceKind = "even"
    led_noise: float = 0.002  # mm, of the measured LED coordinates about the truth
    pen: Pen = field(default_factory=paper_pen)  # the truth
    camera: Camera = field(default_factory=paper_camera)
    tip_pen: FloatArray = field(default_factory=PAPER_TIP.copy)  # (3,), mm
    cone_cam: FloatArray = field(default_factory=PAPER_CONE.copy)  # (3,), mm
    has_lamp: bool = False  # whether a lamp beside the cone is in view
    camera_turn: float = 0.0  # px, by which images shift in all, or live in a minute
    viewpoint: int = 0  # index of the camera in the rig, from 0; it selects the noise
