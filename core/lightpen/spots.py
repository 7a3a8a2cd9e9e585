"""Bright spots in an image: centres, shapes and what is wrong with each."""

from dataclasses import dataclass
from enum import IntFlag

from lightpen.arrays import FloatArray, IntArray


class Flaw(IntFlag):
    """What makes a spot less than a clean, whole LED disc."""

    NONE = 0
    MERGED = 1  # touches another bright thing
    CUT = 2  # partly hidden, or leaves the image
    SATURATED = 4  # clipped at the top of the range
    BLURRED = 8  # smeared by defocus or motion
    DIM = 16  # hardly above the noise


@dataclass(frozen=True, eq=False)
class Spots:
    """The spots of one image that may be LEDs, brightest first.

    Attributes
    ----------
    centers : (N, 2) array
        Centres, px.
    shapes : (N, 2, 2) array
        Covariance of the area of each spot, px^2; a full ellipse with semi-axes
        a and b has the eigenvalues a^2 / 4 and b^2 / 4.
    areas : (N,) array
        Area at half level, px^2.
    contrasts : (N,) array
        Peak above the local background, fraction of the full range.
    edge_widths : (N,) array
        Width of the rim from dark to bright, px; blur widens it.
    flaws : (N,) array
        `Flaw` of each spot.
    """

    centers: FloatArray
    shapes: FloatArray
    areas: FloatArray
    contrasts: FloatArray
    edge_widths: FloatArray
    flaws: IntArray

    def __len__(self) -> int:
        return len(self.centers)
