"""The cameras of a chosen source."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

from lightpen.cameras.clock import Clock, MachineClock
from lightpen.cameras.protocol import ImageCamera
from lightpen.cameras.source import FoundDevice, Source, SourcePlace
from lightpen.cameras.sources import found_cameras
from lightpen.formats.opened_files import CameraFile, OpenedFiles, PenFile
from lightpen.formats.rig_files import read_rig
from lightpen.local_time import local_now
from lightpen.swing.image_sources import SourceChoice
from lightpen_extensions.simulator.camera import SimulatedCamera
from lightpen_extensions.simulator.samples import beside
from lightpen_extensions.simulator.scene_files import write_sample_files
from lightpen_extensions.simulator.scenes import Scene

SECOND_SERIAL = "SIM-2"


@dataclass(frozen=True, eq=False)
class SourceEnvironment:
    """Environment of sources: scene and clocks."""

    scene: Scene = field(default_factory=Scene)  # scene of the simulated camera
    clock: Clock = field(default_factory=MachineClock)
    now: Callable[[], datetime] = local_now  # returns date and time with the time zone
    found_cameras: Callable[[], tuple[tuple[Source, FoundDevice], ...]] = found_cameras


def sample_files(around: SourceEnvironment, folder: Path) -> OpenedFiles:
    """Write the files that go with the simulated camera, and return them."""
    files = write_sample_files(around.scene, folder)
    return OpenedFiles(
        CameraFile.read(files.camera), PenFile.read(files.pen), read_rig(files.rig)
    )


def camera_of(choice: SourceChoice, around: SourceEnvironment) -> ImageCamera:
    """Return the camera of a source, not yet opened."""
    camera = choice.source.camera
    if camera is None:
        return SimulatedCamera(around.scene, around.clock)
    return camera(SourcePlace(choice.place, choice.producer), around.clock)


def cameras_of(
    choices: Sequence[SourceChoice], around: SourceEnvironment
) -> tuple[ImageCamera, ...]:
    """Return the cameras of one or two sources, not yet opened.

    Two simulated ones see the same pen.
    """
    first, *others = (camera_of(choice, around) for choice in choices)
    if not isinstance(first, SimulatedCamera):
        return (first, *others)
    scene = around.scene
    rig = beside(scene.camera, scene.cone_cam)
    return first, *(
        SimulatedCamera(
            scene, around.clock, first.operator, serial=SECOND_SERIAL, rig=rig
        )
        if isinstance(other, SimulatedCamera)
        else other
        for other in others
    )
