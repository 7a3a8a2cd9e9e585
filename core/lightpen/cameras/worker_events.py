"""Events of a camera worker."""

from dataclasses import dataclass
from enum import Enum, auto
from typing import TypeAlias

from lightpen.cameras.protocol import CameraFailure, CameraSettings
from lightpen.errors import LightpenError


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
