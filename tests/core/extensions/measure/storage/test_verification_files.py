"""The files of cameras as inputs of a record."""

from pathlib import Path

from lightpen.formats.opened_files import InputFile
from lightpen.formats.own_json import FileRecord
from lightpen.model.rigid import rig_of
from lightpen_extensions.measure.probing.sources import PenCameras
from lightpen_extensions.measure.storage.session_files import viewer_entries
from lightpen_extensions.simulator.swings import paper_camera

NAMES = "rig.json", "left.yaml", "right.yaml"


def test_files_of_one_camera_and_of_several_are_named() -> None:
    files = tuple(InputFile(Path("x", name), 64 * name[0]) for name in NAMES)
    of_rig, *of_cameras = (FileRecord(name, 64 * name[0], "") for name in NAMES)
    rig = rig_of(paper_camera())

    alone = viewer_entries(PenCameras(rig, files[1:2]))
    together = viewer_entries(PenCameras(rig, files))

    assert alone == {"camera": of_cameras[0]}
    assert together == {"camera": of_cameras[0], "rig": of_rig, "cameras": of_cameras}
