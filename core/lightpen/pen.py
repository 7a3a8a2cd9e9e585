"""The light pen: where its LEDs are, and the frame they are given in."""

from dataclasses import dataclass

from lightpen.arrays import FloatArray

DISC_DIAMETER = 10.0  # mm, of each LED of the paper's pen


@dataclass(frozen=True, eq=False)
class Pen:
    """LED geometry of a light pen, in the pen frame.

    LED number j of the files is row ``j - 1`` of every array.

    Attributes
    ----------
    leds : (L, 3) array
        LED centres, mm.
    normals : (L, 3) array
        Unit normals of the LED discs, towards the viewer.
    diameter : float
        Diameter of the LED discs, mm.
    nominal_tip : (3,) array or None
        Where the design puts the centre of the probe tip, mm.
    name : str
        Name or serial number, empty if unknown.
    """

    leds: FloatArray
    normals: FloatArray
    diameter: float = DISC_DIAMETER
    nominal_tip: FloatArray | None = None
    name: str = ""

    @property
    def n_leds(self) -> int:
        """Number of LEDs."""
        return len(self.leds)
