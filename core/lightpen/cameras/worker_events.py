"""What a camera's worker tells of."""

from dataclasses import dataclass
from enum import Enum, auto
from typing import TypeAlias

from lightpen.cameras.protocol import CameraFailure, CameraSettings
from lightpen.errors import LightpenError


class Connection(Enum):
    """How a camera and its worker get on."""

    OPENING = auto()
    STREAMING = auto()
    SILENT = auto()
    LOST = auto()
    CLOSED = auto()


@dataclass(frozen=True)
class FrameReady:
    """A frame lies in the box, which was empty before."""


@dataclass(frozen=True)
class ConnectionChanged:
    """The camera is in another state."""

    connection: Connection


@dataclass(frozen=True)
class SettingsApplied:
    """The camera has these settings in force."""

    settings: CameraSettings


@dataclass(frozen=True)
class Troubled:
    """Something went wrong; the worker carries on."""

    error: CameraFailure


@dataclass(frozen=True)
class KeepsUp:
    """No image is skipped any more, after it was told that they were."""


@dataclass(frozen=True)
class Failed:
    """Something went wrong that ended the worker."""

    error: LightpenError


@dataclass(frozen=True)
class Ended:
    """The camera has no more images, which ended the worker."""


WorkerEvent: TypeAlias = (
    FrameReady
    | ConnectionChanged
    | SettingsApplied
    | Troubled
    | KeepsUp
    | Failed
    | Ended
)
