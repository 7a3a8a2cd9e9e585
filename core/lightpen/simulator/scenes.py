"""Scenes: content and disturbances of a simulated set of images."""

from dataclasses import dataclass, field, fields
from typing import Literal, TypeAlias

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.simulator.postures import SwingKind
from lightpen.simulator.sensor import Sensor
from lightpen.simulator.swings import PAPER_CONE, PAPER_TIP, paper_camera, paper_pen
from lightpen.simulator.view import Optics


@dataclass(frozen=True)
class Disturbances:
    """Fractions of the images that are disturbed, each 0 to 1.

    Attributes
    ----------
    clutter : float
        Foreign lamps, reflections, bright windows.
    fingers : float
        A finger before an LED.
    missing : float
        One to four LEDs off.
    slipped : float
        The tip is 0.2 to 2 mm out of the cone.
    blurred_away : float
        Moved so fast that nothing can be measured.
    empty : float
        All LEDs off.
    """

    clutter: float = 0.0
    fingers: float = 0.0
    missing: float = 0.0
    motion_blur: float = 0.0
    defocus: float = 0.0
    saturated: float = 0.0
    dim: float = 0.0
    slipped: float = 0.0
    blurred_away: float = 0.0
    empty: float = 0.0

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
    """Content of a simulated set of images.

    Attributes
    ----------
    swing : str
        Kind of swing, see `lightpen.simulator.postures.draw_postures`.
    faces : str
        Look of the LEDs: evenly lit, an off-centre hot spot, a dome whose bright part
        moves with the view, or a dark centre.
    led_noise : float
        Standard deviation of the measured LED coordinates about the truth, mm.
    pen : Pen
        The truth.
    tip_pen, cone_cam : (3,) array
        The truth, mm.
    has_lamp : bool
        Whether a lamp beside the cone is in view.
    camera_turn : float
        By which the image shifts from the first to the last one, as the camera turns,
        px; live, in a minute.
    viewpoint : int
        Index of the camera in the rig, from 0; it selects the noise.
    """

    n_images: int = 60
    seed: int = 1
    swing: SwingKind = "field"
    disturbances: Disturbances = CLEAN
    optics: Optics = field(default_factory=Optics)
    sensor: Sensor = field(default_factory=Sensor)
    faces: FaceKind = "even"
    led_noise: float = 0.002
    pen: Pen = field(default_factory=paper_pen)
    camera: Camera = field(default_factory=paper_camera)
    tip_pen: FloatArray = field(default_factory=PAPER_TIP.copy)
    cone_cam: FloatArray = field(default_factory=PAPER_CONE.copy)
    has_lamp: bool = False
    camera_turn: float = 0.0
    viewpoint: int = 0
