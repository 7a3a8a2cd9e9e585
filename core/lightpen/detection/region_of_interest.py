"""Camera, pen and mask for the detection in live images."""

from dataclasses import dataclass

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen


@dataclass(frozen=True, eq=False)
class RegionOfInterest:
    """Camera, pen and mask for the detection in images."""

    camera: Camera | None = None  # intrinsics, if they are known
    pen: Pen | None = None
    # (M, 3), circles of stray light to leave out: centre x, y and radius, px
    mask: FloatArray | None = None
    # Regions in the images of the other cameras of a rig.
    others: tuple["RegionOfInterest", ...] = ()

    @property
    def regions(self) -> tuple["RegionOfInterest", ...]:
        """The same for each camera."""
        return (self, *self.others)
