"""Pen and cameras of a scene, for the window."""

from collections.abc import Sequence
from pathlib import Path

from lightpen.cameras.pairing import Clock
from lightpen.formats.opened_files import CameraFile, OpenedFiles, PenFile
from lightpen.formats.rig_files import read_rig
from lightpen.model.pen import Pen
from lightpen_extensions.simulator.camera import SERIAL, SimulatedCamera
from lightpen_extensions.simulator.scene_files import write_sample_files
from lightpen_extensions.simulator.scenes import Scene, beside

SECOND_SERIAL = "SIM-2"


class SceneSimulator:
    """Simulates cameras that see a scene; see `lightpen.live.sources.Simulator`."""

    serial = SERIAL

    def __init__(self, scene: Scene | None = None) -> None:
        self.scene = scene or Scene()

    @property
    def pen(self) -> Pen:
        """The true pen."""
        return self.scene.pen

    def write_files(self, folder: Path) -> OpenedFiles:
        """Write the files of camera, pen and rig, and return them."""
        files = write_sample_files(self.scene, folder)
        return OpenedFiles(
            CameraFile.read(files.camera), PenFile.read(files.pen), read_rig(files.rig)
        )

    def cameras(self, n_cameras: int, clock: Clock) -> Sequence[SimulatedCamera]:
        """Return one or two cameras, not yet opened, that see the same pen."""
        scene = self.scene
        first = SimulatedCamera(scene, clock)
        rig = beside(scene.camera, scene.cone_cam)
        second = SimulatedCamera(
            scene, clock, first.operator, serial=SECOND_SERIAL, rig=rig
        )
        return (first, second)[:n_cameras]
