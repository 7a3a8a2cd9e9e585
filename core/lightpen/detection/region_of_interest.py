"""Camera, pen and mask for the detection in live images."""

from dataclasses import dataclass

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen


@dataclass(frozen=True, eq=False)
class RegionOfInterest:
    """Camera, pen and mask for the detection in images.

    Attributes
    ----------
    camera : Camera or None
        Intrinsics, if they are known.
    mask : (M, 3) array or None
        Circles of stray light to leave out: centre x, y and radius, px.
    others : tuple of RegionOfInterest
        Regions in the images of the other cameras of a rig.
    """

    camera: Camera | None = None
    pen: Pen | None = None
    mask: FloatArray | None = None
    others: tuple["RegionOfInterest", ...] = ()

    @property
    def regions(self) -> tuple["RegionOfInterest", ...]:
        """The same for each camera."""
        return (self, *self.others)
