"""Protocol of live image sources, and their errors.

`lightpen.model.camera.Camera` holds the intrinsics of a camera; an `ImageCamera` is
the thing that delivers images. One thread makes all calls of an open one, see
`lightpen.cameras.worker`.
"""

from dataclasses import dataclass, fields
from enum import Enum, StrEnum, auto
from math import isnan
from typing import Annotated, Protocol, TypeAlias

from msgspec import Meta

from lightpen.arrays import Image
from lightpen.errors import LightpenError
from lightpen.messages import message

EXPOSURE = message("camera.exposure")
GAIN = message("camera.gain")

Count: TypeAlias = Annotated[int, Meta(ge=0, le=10**9)]  # as records hold it


class CameraFailure(LightpenError):  # noqa: N818 - its subclasses name the error
    """Base of the errors of an image source."""


class DeviceNotFound(CameraFailure):
    """The device was not found or is switched off."""


class DeviceBusy(CameraFailure):
    """The device is in use by another program, perhaps only for seconds."""


class ConfigError(CameraFailure):
    """The device does not support the settings."""


class FrameTimeout(CameraFailure):
    """No image came in time. Not fatal."""


class FrameIncomplete(CameraFailure):
    """An image arrived damaged and was discarded. Not fatal."""


class FramesSkipped(CameraFailure):
    """Images were discarded because they were not processed in time. Not fatal."""


class FramesDelayed(CameraFailure):
    """Frames of two cameras were paired that are not simultaneous. Not fatal."""


class DeviceLost(CameraFailure):
    """The device no longer responds; close and reopen it."""


class EndOfImages(Exception):  # noqa: N818 - not an error
    """There are no more images."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One complete image of a camera."""

    image: Image  # (H, W), read-only, in memory of its own; see `sealed`
    seq: int  # ascends over the life of the `ImageCamera`; a gap is a lost image
    host_ts_ns: int  # when the image was there, by the monotonic clock of the machine
    device_ts_ns: int | None = None  # time stamp of the camera, ns
    # Exposure and gain of this image; None if unknown, as shortly after a change.
    exposure_us: float | None = None
    gain_db: float | None = None
    pixel_format: str = "Mono8"  # by the GenICam Pixel Format Naming Convention
    full_scale: int = 255  # brightest value a pixel can have
    others: tuple["Frame", ...] = ()  # simultaneous, of the other cameras of a rig

    @property
    def bits(self) -> int:
        """Bit depth of the values."""
        return self.full_scale.bit_length()

    def __post_init__(self) -> None:
        if self.image.flags.writeable:
            raise ValueError("`image` must be read-only; use `sealed`.")


def sealed(image: Image) -> Image:
    """Return a new image as read-only."""
    image.flags.writeable = False
    return image


@dataclass(frozen=True)
class Stats:
    """Frame counters since the `ImageCamera` was made."""

    delivered: Count = 0  # complete images
    incomplete: Count = 0  # arrived damaged and discarded
    missed: Count = 0  # never arrived: gaps in the sequence numbers
    skipped: Count = 0  # discarded because processing was too slow
    timeouts: Count = 0  # reads that timed out
    unpaired: Count = 0  # discarded without a simultaneous image of the other camera

    def since(self, earlier: "Stats") -> "Stats":
        """Return the difference from earlier counters."""
        names = [item.name for item in fields(self)]
        return Stats(*(getattr(self, name) - getattr(earlier, name) for name in names))

    def and_then(self, later: "Stats") -> "Stats":
        """Return the counts of both."""
        names = [item.name for item in fields(self)]
        return Stats(*(getattr(self, name) + getattr(later, name) for name in names))


@dataclass(frozen=True)
class Range:
    """Values that a feature of a camera takes: ``low + k step`` up to ``high``."""

    low: float
    high: float
    step: float = 0.0  # 0 if any value between is taken

    def nearest(self, value: float) -> float:
        """Return the nearest possible value.

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
    """Trigger mode of a camera."""

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
    """Regions that a camera can read out."""

    width: Range  # up to the sensor's
    height: Range
    x_step: int = 0  # of the position; 0 if it is fixed
    y_step: int = 0

    @property
    def whole(self) -> Region:
        """The whole sensor."""
        return Region(0, 0, int(self.width.high), int(self.height.high))

    def nearest(self, wanted: Region) -> Region:
        """Return the nearest possible region."""
        width = int(self.width.nearest(wanted.width))
        height = int(self.height.nearest(wanted.height))
        return Region(
            _place(wanted.x, self.width.high - width, self.x_step),
            _place(wanted.y, self.height.high - height, self.y_step),
            width,
            height,
        )


def _place(wanted: int, most: float, step: int) -> int:
    """Return the nearest possible offset of a region below the wanted one."""
    return step and int(min(max(wanted, 0), most)) // step * step


@dataclass(frozen=True)
class CameraCapabilities:
    """Capabilities of an open camera."""

    width: int  # of the images, px
    height: int
    pixel_formats: tuple[str, ...]  # the default first
    # Each of the next four is None if it cannot be set.
    exposure_us: Range | None = None
    gain_db: Range | None = None
    frame_rate: Range | None = None
    packet_size: Range | None = None
    gain_in_db: bool = True  # whether the gain is in dB and not in device units
    regions: RegionLimits | None = None  # None if the region cannot be set
    triggers: tuple[TriggerMode, ...] = (TriggerMode.FREE,)  # free running first
    waits: bool = False  # for its reader: no image is lost, as with a file
    has_link: bool = False  # whether images come over a cable that may lose some
    n_images: int | None = None  # after so many images a recording restarts


@dataclass(frozen=True)
class CameraSettings:
    """Requested or actual settings of a camera.

    In a request None means unchanged; in an answer, not supported.
    """

    exposure_us: float | None = None
    gain_db: float | None = None
    frame_rate: float | None = None
    pixel_format: str | None = None
    region: Region | None = None
    trigger: TriggerMode | None = None
    packet_size: int | None = None  # of a network camera, bytes


@dataclass(frozen=True)
class CameraInUse:
    """The camera that images come from."""

    serial: str
    settings: CameraSettings


class ImageCamera(Protocol):
    """An image source, found by its serial number when it is opened.

    Calls out of order, such as reading before the start, raise `ValueError`. Any call
    on an open camera may raise `DeviceLost` except `stop` and `close`.
    """

    @property
    def serial(self) -> str:
        """Serial number or address of the device."""

    @property
    def caps(self) -> CameraCapabilities:
        """Capabilities of the open camera."""

    def open(self) -> None:
        """Find and open the device, or raise `DeviceNotFound` or `DeviceBusy`.

        No-op if it is open.
        """

    def close(self) -> None:
        """Stop and close the device; takes seconds if it is dead, never raises."""

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Apply settings before the start; return the actual ones.

        Values are clipped to their ranges; unsupported settings are ignored.
        `caps` may be others after it: the region gives the size of the images.
        Raises `ConfigError` if the pixel format is not offered.
        """

    def set_exposure(self, exposure_us: float) -> float:
        """Set the exposure, also while streaming; return the actual one, us.

        Raises `ConfigError` if it cannot be set.
        """

    def set_gain(self, gain_db: float) -> float:
        """Set the gain, also while streaming; return the actual one, dB.

        Raises `ConfigError` if it cannot be set.
        """

    def start(self) -> None:
        """Start streaming; no-op while streaming."""

    def stop(self) -> None:
        """Stop streaming; no-op if stopped."""

    def read(self, timeout_s: float) -> Frame:
        """Return the next complete image.

        Raises `FrameTimeout` without one within ``timeout_s``, `FrameIncomplete` if one
        arrived damaged, and `EndOfImages` after the last.
        """

    def probe(self) -> None:
        """Raise `DeviceLost` unless the device responds."""

    def stats(self) -> Stats:
        """Return the frame counters; ``skipped`` stays 0."""


class Connection(Enum):
    """State of the connection to a camera."""

    OPENING = auto()
    STREAMING = auto()
    SILENT = auto()
    LOST = auto()
    CLOSED = auto()


@dataclass(frozen=True)
class FrameReady:
    """A new frame is in the box, which was empty."""


@dataclass(frozen=True)
class ConnectionChanged:
    """The state of the connection changed."""

    connection: Connection


@dataclass(frozen=True)
class SettingsApplied:
    """The camera uses these settings."""

    settings: CameraSettings


@dataclass(frozen=True)
class FaultRaised:
    """A fault occurred; the worker continues."""

    error: CameraFailure


@dataclass(frozen=True)
class ProcessingKeepsUp:
    """Images are no longer skipped."""


@dataclass(frozen=True)
class Failed:
    """An error ended the worker."""

    error: LightpenError


@dataclass(frozen=True)
class WorkerStopped:
    """The worker ended, as the camera has no more images."""


WorkerEvent: TypeAlias = (
    FrameReady
    | ConnectionChanged
    | SettingsApplied
    | FaultRaised
    | ProcessingKeepsUp
    | Failed
    | WorkerStopped
)


def busy(place: str) -> DeviceBusy:
    """Return the error of a camera in use by another program."""
    return DeviceBusy("camera.busy", place=place)


def lost(serial: str, why: str) -> DeviceLost:
    """Return the error of a camera that no longer responds."""
    return DeviceLost("camera.lost", serial=serial, why=why)


def not_found(place: str, why: str = "") -> DeviceNotFound:
    """Return the error of a camera that was not found."""
    return DeviceNotFound("camera.not-found", place=place, why=why and f" ({why})")
