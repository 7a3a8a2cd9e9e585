"""What a kind of camera is to those who choose among several."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto

from lightpen.cameras.clock import Clock
from lightpen.cameras.protocol import ImageCamera
from lightpen.sentences import Sentence


class Needs(Enum):
    """What a source has to be told besides its kind."""

    NOTHING = auto()
    FILES = auto()  # a folder, a pattern, a video or a record
    DEVICE = auto()  # a camera, by its serial number or address
    DEVICE_AND_PRODUCER = auto()  # and a GenTL producer, unless the system names one


@dataclass(frozen=True)
class SourcePlace:
    """Where the images of a source come from.

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
        Serial number, or what else it is found by again.
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
        Names it in settings and records; never changes.
    why_absent : callable
        Returns what has to be installed first; None where nothing is missing.
    find : callable
        Returns the cameras that are there, given the file of a producer or nothing.
        Takes seconds; not to be called while one of them streams. Raises
        `CameraFailure`.
    camera : callable or None
        Returns a camera that is not open. None for what the simulator makes, which
        needs its scene.
    """

    key: str
    name: Sentence
    needs: Needs
    camera: Callable[[SourcePlace, Clock], ImageCamera] | None = None
    find: Callable[[str], tuple[FoundDevice, ...]] = lambda producer: ()
    why_absent: Callable[[], Sentence | None] = lambda: None
