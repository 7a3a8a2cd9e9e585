"""Kinds of cameras, for choosing among them."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto

from lightpen.cameras.clock import Clock
from lightpen.cameras.protocol import ImageCamera
from lightpen.messages import Message


class SourceNeeds(Enum):
    """Parameters that a source needs."""

    NOTHING = auto()
    FILES = auto()  # a folder, a pattern, a video or a record
    DEVICE = auto()  # a camera, by its serial number or address
    DEVICE_AND_PRODUCER = auto()  # and a GenTL producer, unless the system names one


@dataclass(frozen=True)
class SourcePlace:
    """Location of the images of a source.

    Attributes
    ----------
    name : str
        Folder, pattern or video; or serial number or address of a camera.
    producer : str
        File of a GenTL producer; empty for those that the system names.
    """

    name: str
    producer: str = ""


@dataclass(frozen=True)
class FoundDevice:
    """A camera that was found.

    Attributes
    ----------
    place : str
        Serial number or another identifier.
    label : str
        Vendor, model and serial number.
    """

    place: str
    label: str


@dataclass(frozen=True)
class Source:
    """A kind of camera.

    Attributes
    ----------
    key : str
        Identifies it in settings and records; must not change.
    why_absent : callable
        Returns what must be installed first, or None.
    find : callable
        Returns the cameras that are there, given the file of a producer or nothing.
        Takes seconds; not to be called while one of them streams. Raises
        `CameraFailure`.
    camera : callable or None
        Returns a camera that is not open. None for what the simulator makes, which
        needs its scene.
    """

    key: str
    name: Message
    needs: SourceNeeds
    camera: Callable[[SourcePlace, Clock], ImageCamera] | None = None
    find: Callable[[str], tuple[FoundDevice, ...]] = lambda producer: ()
    why_absent: Callable[[], Message | None] = lambda: None
