"""What is looked for in live images."""

from dataclasses import dataclass

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen


@dataclass(frozen=True, eq=False)
class Aim:
    """What is looked for in the images.

    Attributes
    ----------
    camera : Camera or None
        Intrinsics, if they are known.
    mask : (M, 3) array or None
        Circles of stray light to leave out: centre x, y and radius, px.
    others : tuple of Aim
        In the images of the other cameras of a rig.
    """

    camera: Camera | None = None
    pen: Pen | None = None
    mask: FloatArray | None = None
    others: tuple["Aim", ...] = ()

    @property
    def aims(self) -> tuple["Aim", ...]:
        """What is looked for in the images of each camera."""
        return (self, *self.others)
