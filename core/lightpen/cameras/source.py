"""Kinds of cameras, for choosing among them."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto

from lightpen.cameras.clock import Clock
from lightpen.cameras.protocol import ImageCamera
from lightpen.messages import Message


class SourceNeeds(Enum):
    """Parameters that a source needs."""

    CHOICE = auto()  # no source is chosen yet
    NOTHING = auto()
    FILES = auto()  # a folder, a pattern, a video or a record
    DEVICE = auto()  # a camera, by its serial number or address
    DEVICE_AND_PRODUCER = auto()  # and a GenTL producer, unless the system names one


@dataclass(frozen=True)
class SourcePlace:
    """Location of the images of a source."""

    name: str  # folder, pattern or video; or serial number or address of a camera
    producer: str = ""  # file of GenTL; empty for those that the system names


@dataclass(frozen=True)
class FoundDevice:
    """A camera that was found."""

    place: str  # serial number or another identifier
    label: str  # vendor, model and serial number


@dataclass(frozen=True)
class Source:
    """A kind of camera."""

    key: str  # identifies it in settings and records; must not change
    name: Message
    needs: SourceNeeds
    # Returns a camera that is not open; None for the simulator, which needs its scene.
    camera: Callable[[SourcePlace, Clock], ImageCamera] | None = None
    # Returns the cameras that are there, given the file of a producer or nothing. Takes
    # seconds; not to be called while one of them streams. Raises `CameraFailure`.
    find: Callable[[str], tuple[FoundDevice, ...]] = lambda producer: ()
    # Returns what must be installed first, or None.
    why_absent: Callable[[], Message | None] = lambda: None
