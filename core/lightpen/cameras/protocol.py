"""What every live source of images offers, and what can go wrong with it.

`lightpen.model.camera.Camera` holds the intrinsics of a camera; an `ImageCamera` is
the thing that delivers images. One thread makes all calls of an open one, see
`lightpen.cameras.worker`.
"""

from dataclasses import dataclass, fields
from math import isnan
from typing import Protocol

from lightpen.arrays import Image
from lightpen.errors import LightpenError


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
    exposure_us : float or None
        That this image was exposed with.
    pixel_format : str
        Name in the GenICam Pixel Format Naming Convention.
    bits : int
        Full scale is ``2**bits - 1``.
    """

    image: Image
    seq: int
    host_ts_ns: int
    device_ts_ns: int | None = None
    exposure_us: float | None = None
    pixel_format: str = "Mono8"
    bits: int = 8

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
    """

    delivered: int = 0
    incomplete: int = 0
    missed: int = 0
    skipped: int = 0
    timeouts: int = 0

    def since(self, earlier: "Stats") -> "Stats":
        """Return what has come to pass since an earlier count."""
        names = [item.name for item in fields(self)]
        return Stats(*(getattr(self, name) - getattr(earlier, name) for name in names))


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


@dataclass(frozen=True)
class Caps:
    """What an open camera can do.

    Attributes
    ----------
    width, height : int
        Of the images, px.
    pixel_formats : tuple of str
        That are offered, the usual one first.
    exposure_us, gain_db, frame_rate : Range or None
        None if it cannot be set.
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
    waits: bool = False
    n_images: int | None = None


@dataclass(frozen=True)
class CameraSettings:
    """How a camera is to take images, or takes them.

    Attributes
    ----------
    exposure_us, gain_db, frame_rate : float or None
        In a request None means: leave it. In an answer: the camera has no such thing.
    """

    exposure_us: float | None = None
    gain_db: float | None = None
    frame_rate: float | None = None
    pixel_format: str | None = None


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
