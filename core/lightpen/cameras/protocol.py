"""What every live source of images offers, and what can go wrong with it.

`lightpen.model.camera.Camera` holds the intrinsics of a camera; an `ImageCamera` is
the thing that delivers images. One thread makes all calls of an open one, see
`lightpen.cameras.worker`.
"""

from dataclasses import dataclass, fields
from enum import StrEnum
from math import isnan
from typing import Protocol

from lightpen.arrays import Image
from lightpen.errors import LightpenError
from lightpen.sentences import sentence

EXPOSURE = sentence("camera.exposure", "exposure")
GAIN = sentence("camera.gain", "gain")


class CameraFailure(LightpenError):  # noqa: N818 - its children tell what is wrong
    """Base of what goes wrong with a source of images."""


class DeviceNotFound(CameraFailure):
    """The device is not there, or not switched on."""


class DeviceBusy(CameraFailure):
    """Another program has the device; it may let go of it within seconds."""


class ConfigError(CameraFailure):
    """The device cannot do what the settings ask for."""


class FrameTimeout(CameraFailure):
    """No image came in time. Not fatal."""


class FrameIncomplete(CameraFailure):
    """An image arrived damaged and was thrown away. Not fatal."""


class FramesSkipped(CameraFailure):
    """Good images were thrown away because nobody took them in time. Not fatal."""


class FramesHeldUp(CameraFailure):
    """Frames of two cameras were paired that are of different moments. Not fatal."""


class DeviceLost(CameraFailure):
    """The device no longer answers; only closing and opening it can help."""


class EndOfImages(Exception):  # noqa: N818 - not an error
    """There are no more images."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One complete image of a camera.

    Attributes
    ----------
    image : (H, W) array
        Read-only and nobody else's memory, see `sealed`.
    seq : int
        Number given by the camera. It ascends over the life of the `ImageCamera`; a gap
        is an image that got lost.
    host_ts_ns : int
        When the image was there, by the monotonic clock of the machine.
    device_ts_ns : int or None
        By the clock of the camera.
    exposure_us, gain_db : float or None
        That this image was taken with; None where that is not known, as shortly after a
        change.
    pixel_format : str
        Name in the GenICam Pixel Format Naming Convention.
    bits : int
        Full scale is ``2**bits - 1``.
    others : tuple of Frame
        Those that the other cameras of a rig took at this moment.
    """

    image: Image
    seq: int
    host_ts_ns: int
    device_ts_ns: int | None = None
    exposure_us: float | None = None
    gain_db: float | None = None
    pixel_format: str = "Mono8"
    bits: int = 8
    others: tuple["Frame", ...] = ()

    @property
    def full_scale(self) -> int:
        """Brightest value a pixel can have."""
        return int(2**self.bits - 1)

    def __post_init__(self) -> None:
        if self.image.flags.writeable:
            raise ValueError("`image` must be read-only; use `sealed`.")


def sealed(image: Image) -> Image:
    """Return an image that was just made, and is nobody else's, as read-only."""
    image.flags.writeable = False
    return image


@dataclass(frozen=True)
class Stats:
    """What became of the images since the `ImageCamera` was made.

    Attributes
    ----------
    delivered : int
        Complete images.
    incomplete : int
        Arrived damaged and thrown away.
    missed : int
        Never arrived: gaps in the numbers.
    skipped : int
        Thrown away by this program because it was too slow.
    timeouts : int
        Waits for an image that ended without one.
    unpaired : int
        Thrown away because another camera of the rig took none at that moment.
    """

    delivered: int = 0
    incomplete: int = 0
    missed: int = 0
    skipped: int = 0
    timeouts: int = 0
    unpaired: int = 0

    def since(self, earlier: "Stats") -> "Stats":
        """Return what has come to pass since an earlier count."""
        names = [item.name for item in fields(self)]
        return Stats(*(getattr(self, name) - getattr(earlier, name) for name in names))

    def and_then(self, later: "Stats") -> "Stats":
        """Return the counts of both."""
        names = [item.name for item in fields(self)]
        return Stats(*(getattr(self, name) + getattr(later, name) for name in names))


@dataclass(frozen=True)
class Range:
    """Values that a feature of a camera takes: ``low + k step`` up to ``high``.

    Attributes
    ----------
    step : float
        0 if any value between is taken.
    """

    low: float
    high: float
    step: float = 0.0

    def nearest(self, value: float) -> float:
        """Return the value that the camera takes instead of this one.

        Some cameras wrap values out of range round instead of refusing them.
        """
        if isnan(value):
            raise ValueError("`value` must be a number, got nan.")
        inside = min(max(value, self.low), self.high)
        if self.step == 0 or inside == self.high:
            return inside
        n_steps = round((inside - self.low) / self.step)
        return min(self.low + n_steps * self.step, self.high)


class TriggerMode(StrEnum):
    """What makes a camera take an image."""

    FREE = "free running"  # its own clock
    SOFTWARE = "software"  # this program, whenever it waits for an image


@dataclass(frozen=True)
class Region:
    """The part of the sensor that is read out, px from its top left corner."""

    x: int
    y: int
    width: int
    height: int


@dataclass(frozen=True)
class RegionLimits:
    """Regions that a camera can read out.

    Attributes
    ----------
    width, height : Range
        ``high`` is that of the sensor.
    x_step, y_step : int
        Of the place of a region; 0 where it cannot be moved.
    """

    width: Range
    height: Range
    x_step: int = 0
    y_step: int = 0

    @property
    def whole(self) -> Region:
        """The whole sensor."""
        return Region(0, 0, int(self.width.high), int(self.height.high))

    def nearest(self, wanted: Region) -> Region:
        """Return the region that the camera reads out instead of this one."""
        width = int(self.width.nearest(wanted.width))
        height = int(self.height.nearest(wanted.height))
        return Region(
            _place(wanted.x, self.width.high - width, self.x_step),
            _place(wanted.y, self.height.high - height, self.y_step),
            width,
            height,
        )


def _place(wanted: int, most: float, step: int) -> int:
    """Return where a region begins instead of there."""
    return step and int(min(max(wanted, 0), most)) // step * step


@dataclass(frozen=True)
class Caps:
    """What an open camera can do.

    Attributes
    ----------
    width, height : int
        Of the images, px.
    pixel_formats : tuple of str
        That are offered, the usual one first.
    exposure_us, gain_db, frame_rate, packet_size : Range or None
        None if it cannot be set.
    gain_in_db : bool
        Whether the gain is in dB, not in steps of the camera's own.
    regions : RegionLimits or None
        None if there is but the whole image.
    triggers : tuple of TriggerMode
        That are offered, free running first.
    has_link : bool
        Whether images come over a cable that may lose some.
    waits : bool
        Whether no image is lost when nobody reads, as with a file.
    n_images : int or None
        After so many images a recording begins anew.
    """

    width: int
    height: int
    pixel_formats: tuple[str, ...]
    exposure_us: Range | None = None
    gain_db: Range | None = None
    frame_rate: Range | None = None
    packet_size: Range | None = None
    gain_in_db: bool = True
    regions: RegionLimits | None = None
    triggers: tuple[TriggerMode, ...] = (TriggerMode.FREE,)
    waits: bool = False
    has_link: bool = False
    n_images: int | None = None


@dataclass(frozen=True)
class CameraSettings:
    """How a camera is to take images, or takes them.

    In a request None means: leave it. In an answer: the camera has no such thing.

    Attributes
    ----------
    packet_size : int or None
        Of what a network camera sends at once, bytes.
    """

    exposure_us: float | None = None
    gain_db: float | None = None
    frame_rate: float | None = None
    pixel_format: str | None = None
    region: Region | None = None
    trigger: TriggerMode | None = None
    packet_size: int | None = None


class ImageCamera(Protocol):
    """A source of images, found by its serial number whenever it is opened.

    Calls out of order, such as reading before the start, raise `ValueError`. Any call
    on an open camera may raise `DeviceLost` except `stop` and `close`.
    """

    @property
    def serial(self) -> str:
        """Serial number of the device, or what else it is found by."""

    @property
    def caps(self) -> Caps:
        """What the camera can do, once it is open."""

    def open(self) -> None:
        """Find the device and take hold of it; nothing if it is open.

        Raises
        ------
        DeviceNotFound, DeviceBusy
        """

    def close(self) -> None:
        """Stop and let go of the device; seconds if it is dead, but never an error."""

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Set up the camera before the start; return what is in force.

        Values out of range are brought into it; what the camera has not is left out.
        `caps` may be others after it: the region gives the size of the images.

        Raises
        ------
        ConfigError
            The pixel format is not offered.
        """

    def set_exposure(self, exposure_us: float) -> float:
        """Set the exposure, also while images come; return what is in force, us.

        Raises
        ------
        ConfigError
            It cannot be set.
        """

    def set_gain(self, gain_db: float) -> float:
        """Set the gain, also while images come; return what is in force, dB.

        Raises
        ------
        ConfigError
            It cannot be set.
        """

    def start(self) -> None:
        """Let images come; nothing if they do."""

    def stop(self) -> None:
        """Let no more images come; nothing if none do."""

    def read(self, timeout_s: float) -> Frame:
        """Return the next complete image.

        Raises
        ------
        FrameTimeout
            None came in ``timeout_s``.
        FrameIncomplete
            One came damaged.
        EndOfImages
            There are no more.
        """

    def probe(self) -> None:
        """Do nothing if the device answers.

        Raises
        ------
        DeviceLost
        """

    def stats(self) -> Stats:
        """Return what became of the images so far; ``skipped`` is left at 0."""
