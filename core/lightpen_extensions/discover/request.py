"""Prior knowledge of pen and camera."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.priors import ConeSeparation
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen_extensions.discover.scale import MeasuredLength
from lightpen_extensions.discover.sightings import Sightings
from lightpen_extensions.measure.tasks.probed_point import ProbedPoint


@dataclass(frozen=True, eq=False)
class Request:
    """Prior knowledge, and the form of the results."""

    lengths: tuple[MeasuredLength, ...]  # none: the largest distance is `RELATIVE`
    diameter: float  # of the LED discs, mm
    camera: Camera | None = None  # of a camera file, with its covariance
    sketch: Pen | None = None  # rough LEDs, which give numbers and frame
    # A swing in a second cone, before the same camera, not moved. The distance of the
    # cones gives the scale where there is no length.
    second: "SecondSightings | None" = None
    touched: "TouchedLength | None" = None  # a certified length
    n_coefficients: int | None = None  # required by other swings; None: chosen

    @property
    def is_relative(self) -> bool:
        """Whether nothing gives the scale."""
        return not (self.lengths or self.second or self.touched)

    @property
    def rough_leds(self) -> FloatArray | None:
        """LEDs of the sketch, (L, 3), mm."""
        return None if self.sketch is None else self.sketch.leds


@dataclass(frozen=True, eq=False)
class SecondSightings:
    """A swing of the pen in a second cone, at a certified distance from the first."""

    sightings: Sightings
    separation: ConeSeparation


@dataclass(frozen=True, eq=False)
class TouchedLength:
    """Touches of both ends of a certified length, after the swing."""

    # Returns the touches as measured with pen, camera and tip as found.
    touches: Callable[[Instrument], Sequence[ProbedPoint]]
    separation: ConeSeparation
