"""Default uncertainties where the files of a station state none."""

from dataclasses import dataclass, fields, replace
from math import isfinite

COLDEST, WARMEST = -50.0, 100.0  # degrees C, of a pen
BALL_UNCERTAINTY = 0.001  # mm, U (k = 2) of the diameter of a ball with a certificate


@dataclass(frozen=True)
class Assumptions:
    """Default standard uncertainties for what files do not state.

    Those of the camera are typical errors of the file of a lens that was mounted and
    focused again after its calibration. The others concern the station: temperature of
    the pen, form of ball and cone.

    Attributes
    ----------
    focal_length : float
        Relative standard uncertainty of the focal length.
    aspect : float
        Relative standard uncertainty of fy / fx.
    principal_point : float
        Standard uncertainty of cx and of cy, px.
    k1, k2, tangential : float
        Standard uncertainty of the distortion coefficients; ``tangential`` applies to
        p1 and p2.
    scale : float
        Relative standard uncertainty of the scale of all LED coordinates.
    expansion : float
        Thermal expansion of the pen, 1/K: 2e-6 (carbon fibre) to 23e-6 (aluminium).
    expansion_share : float
        Relative standard uncertainty of a stated expansion coefficient.
    temperature_c : float or None
        Temperature of the pen during the swing, degrees Celsius; None if not measured.
    humidity_percent : float or None
        Relative humidity during the swing, for the record; None if not measured.
    temperature : float
        Standard uncertainty of the temperature, K.
    warmth : float
        Standard uncertainty of the temperature difference from the LED measurement, if
        the temperature during the swing was not measured, K.
    diameter : float
        Relative standard uncertainty of the LED disc diameter.
    form_error : float
        Standard uncertainty of the seat of the ball by the form error of ball and cone,
        along each axis in each form of dependence on the tilt, mm.
    center_bias : float
        Standard uncertainty of the centre of an LED's image, px, by errors that do not
        average out: different in each posture, equal whenever the posture returns.
    rotation, translation : float
        Standard uncertainty of the pose of a camera in its rig about and along each
        axis, rad and mm.
    """

    focal_length: float = 0.005
    aspect: float = 0.0003
    principal_point: float = 5.0
    k1: float = 0.02
    k2: float = 0.1
    tangential: float = 0.0003
    scale: float = 1e-5
    expansion: float = 2.3e-5
    expansion_share: float = 0.1
    temperature_c: float | None = None
    humidity_percent: float | None = None
    temperature: float = 0.5
    warmth: float = 1.5  # U (k = 2) of 3 K
    diameter: float = 0.05
    form_error: float = 0.0002
    center_bias: float = 0.003
    rotation: float = 0.02
    translation: float = 20.0

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if item.name == "temperature_c":
                if value is not None and not COLDEST <= value <= WARMEST:
                    raise ValueError(f"{value} degrees C is no temperature of a pen.")
            elif item.name == "humidity_percent":
                if value is not None and not 0 <= value <= 100:
                    raise ValueError(f"{value} % is no relative humidity.")
            elif not (isfinite(value) and value >= 0):
                raise ValueError(f"`{item.name}` must be 0 or more, got {value}.")


USUAL = Assumptions()


def with_focal_length(assumptions: Assumptions, sigma: float) -> Assumptions:
    """Return assumptions with another relative uncertainty of the focal length.

    A camera that is known better in one respect is so in all, as a rule.
    """
    times = sigma / assumptions.focal_length
    names = ("focal_length", "aspect", "principal_point", "k1", "k2", "tangential")
    return replace(
        assumptions, **{name: times * getattr(assumptions, name) for name in names}
    )
