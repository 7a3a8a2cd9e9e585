"""What is assumed of camera and pen where their files say nothing of it."""

from dataclasses import dataclass, fields, replace
from math import isfinite


@dataclass(frozen=True)
class Assumptions:
    """Standard uncertainties that stand in for what a file leaves out.

    Those of the camera are what a lens that was calibrated once, and mounted and
    focused again since, was seen to be off by; that of the scale is what some K
    between its measurement and its use make of a pen: 2 to 23 ppm each.

    Attributes
    ----------
    focal_length : float
        Relative.
    aspect : float
        Of fy / fx.
    principal_point : float
        Of cx and of cy, px.
    k1, k2, tangential : float
        Of the distortion coefficients; ``tangential`` of p1 and of p2.
    scale : float
        Of all LED coordinates of a pen together, relative.
    diameter : float
        Of the LED discs, relative.
    rotation, translation : float
        Of a camera in its rig about and along each axis, rad and mm.
    """

    focal_length: float = 0.005
    aspect: float = 0.0003
    principal_point: float = 5.0
    k1: float = 0.02
    k2: float = 0.1
    tangential: float = 0.0003
    scale: float = 2e-5
    diameter: float = 0.02
    rotation: float = 0.02
    translation: float = 20.0

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if not (isfinite(value) and value >= 0):
                raise ValueError(f"`{item.name}` must be 0 or more, got {value}.")


USUAL = Assumptions()


def with_focal_length(assumptions: Assumptions, sigma: float) -> Assumptions:
    """Return other assumptions of the focal length, relative, and all else of a camera.

    A camera that is known better in one respect is so in all, as a rule.
    """
    times = sigma / assumptions.focal_length
    names = ("focal_length", "aspect", "principal_point", "k1", "k2", "tangential")
    return replace(
        assumptions, **{name: times * getattr(assumptions, name) for name in names}
    )
