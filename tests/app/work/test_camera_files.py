"""Intrinsics, mask and rig file belong to the cameras: stored by serial number."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QCoreApplication, QThreadPool

from lightpen.cameras.protocol import CameraInUse, CameraSettings
from lightpen.formats.opened_files import CameraFile
from lightpen.formats.rig_files import read_rig, write_camera, write_rig
from lightpen.model.rigid import Rig
from lightpen.swing.preparation import SourceChoice
from lightpen_app.work.workbench import Workbench
from lightpen_extensions.simulator.swings import paper_camera

SPOT = np.array([[100.0, 200.0, 20.0]])
WEBCAM = SourceChoice("webcam", "0")


class Bench:
    """A workbench at which real cameras are plugged in."""

    def __init__(self, workbench: Workbench, folder: Path) -> None:
        self.selection, self.folder = workbench.selection, folder
        self.reported: list[str] = []
        workbench.notifications.raised.connect(lambda text: self.reported.append(text))
        now = self.selection.preparation
        self.selection.observe(replace(now, source=WEBCAM, camera_file=None))

    @property
    def file(self) -> str:
        file = self.selection.preparation.camera_file
        return "" if file is None else file.path.name

    def plug_in(self, *serials: str) -> None:
        """Let cameras of these serial numbers be open."""
        other = SourceChoice("webcam", "1") if len(serials) > 1 else None
        self.selection.observe(self.selection.preparation.with_second(other))
        now = self.selection.preparation.without_images()
        used = [CameraInUse(serial, CameraSettings()) for serial in serials]
        self.selection.observe(now)
        if now.second is not None:
            now = replace(now, second=replace(now.second, in_use=used[1]))
        self.selection.observe(replace(now, camera_in_use=used[0]))
        self.settle()

    def open(self, name: str, fx: float) -> None:
        path = self.folder / name
        write_camera(replace(paper_camera(), fx=fx), path)
        now = self.selection.preparation
        file = CameraFile.read(path)
        self.selection.set_preparation(replace(now, camera_file=file))
        self.settle()

    def settle(self) -> None:
        for _ in range(4):
            QThreadPool.globalInstance().waitForDone()
            QCoreApplication.processEvents()


@pytest.fixture
def bench(workbench: Workbench, tmp_path: Path) -> Bench:
    return Bench(workbench, tmp_path)


def test_each_camera_has_its_intrinsics_and_mask_again(bench: Bench) -> None:
    bench.plug_in("S1")
    bench.open("one.yaml", 4000.0)
    now = bench.selection.preparation
    bench.selection.set_preparation(replace(now, mask=SPOT))

    bench.plug_in("S2")
    assert bench.file == ""
    assert (
        "one.yaml is the intrinsics file of camera S1, not of camera S2"
        in (bench.reported[-1])
    )
    now = bench.selection.preparation
    bench.selection.set_preparation(replace(now, mask=np.zeros((0, 3))))
    bench.open("two.yaml", 4100.0)

    bench.plug_in("S1")
    assert bench.file == "one.yaml"
    np.testing.assert_array_equal(bench.selection.preparation.mask, SPOT)
    bench.plug_in("S2")
    assert bench.file == "two.yaml"
    assert len(bench.selection.preparation.mask) == 0


def test_a_file_that_is_written_anew_is_of_the_camera_that_uses_it(
    bench: Bench,
) -> None:
    bench.plug_in("S1")
    bench.open("camera.yaml", 4000.0)
    bench.plug_in("S2")
    bench.open("camera.yaml", 4100.0)

    assert bench.file == "camera.yaml"


def test_a_rig_file_belongs_to_both_cameras(bench: Bench, tmp_path: Path) -> None:
    names = ["left.yaml", "right.yaml"]
    for name in names:
        write_camera(paper_camera(), tmp_path / name)
    sides = np.array([[0.0, 0.0, 0.0], [-500.0, 0.0, 0.0]])
    both = (paper_camera(), paper_camera())
    rig_of_two = Rig(both, np.stack([np.eye(3)] * 2), sides, names=("left", "right"))
    rig_path = tmp_path / "rig.yaml"
    write_rig(rig_of_two, rig_path, names)
    bench.plug_in("S1", "S2")
    rig = read_rig(rig_path)
    now = bench.selection.preparation
    bench.selection.set_preparation(now.with_rig(rig))
    bench.settle()
    now = bench.selection.preparation
    bench.selection.set_preparation(now.with_rig(None))

    bench.plug_in("S1", "S3")
    assert bench.selection.preparation.rig_file is None
    bench.plug_in("S1", "S2")
    found = bench.selection.preparation.rig_file
    assert found is not None
    assert found.path == rig_path


def test_a_simulated_camera_keeps_nothing(workbench: Workbench) -> None:
    now = workbench.selection.preparation
    used = CameraInUse("S1", CameraSettings())
    workbench.selection.set_preparation(replace(now, camera_in_use=used, mask=SPOT))
    workbench.selection.set_preparation(replace(now, camera_in_use=used, mask=SPOT[:0]))

    assert workbench.settings.camera_files("S1").mask == ()
    assert workbench.settings.camera_files("S1").file == ""
