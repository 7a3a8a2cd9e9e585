"""Tests of reading and writing rig files."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from tests.simulated_rigs import from_first, row_of_cameras

from lightpen.errors import FileError
from lightpen.formats.rig_files import RigFile, read_rig, write_camera, write_rig

RIG = from_first(row_of_cameras(3, 900.0))
FILES = tuple(f"{name}.yaml" for name in RIG.names)
Edit = Callable[[dict[str, Any]], object]


@pytest.fixture
def rig_file(tmp_path: Path) -> Path:
    for camera, name in zip(RIG.cameras, FILES, strict=True):
        write_camera(camera, tmp_path / name)
    write_rig(RIG, tmp_path / "rig.json", FILES)
    return tmp_path / "rig.json"


def edited(path: Path, edit: Edit) -> Path:
    """Change the second camera of a rig file."""
    tree = json.loads(path.read_text())
    edit(tree["cameras"][1])
    path.write_text(json.dumps(tree))
    return path


def setting(key: str, value: object) -> Edit:
    return lambda camera: camera.update({key: value})


def refusal(path: Path) -> str:
    with pytest.raises(FileError) as info:
        read_rig(path)
    return str(info.value)


def assert_same(found: RigFile, folder: Path) -> None:
    assert found.camera_files == tuple(folder / name for name in FILES)
    assert found.rig.names == RIG.names
    np.testing.assert_array_equal(found.rig.rotations[1:], RIG.rotations[1:])
    np.testing.assert_array_equal(found.rig.translations[1:], RIG.translations[1:])
    for camera, original in zip(found.rig.cameras, RIG.cameras, strict=True):
        np.testing.assert_array_equal(camera.intrinsics, original.intrinsics)


def test_a_rig_is_read_back_to_the_last_digit(rig_file: Path) -> None:
    found = read_rig(rig_file)

    assert_same(found, rig_file.parent)
    assert found.rig.covariance is not None
    np.testing.assert_array_equal(found.rig.covariance, RIG.covariance)


def test_the_reference_stands_in_the_frame_of_the_rig(rig_file: Path) -> None:
    found = read_rig(rig_file).rig

    np.testing.assert_array_equal(found.rotations[0], np.eye(3))
    np.testing.assert_array_equal(found.translations[0], np.zeros(3))


def test_a_rig_without_uncertainty_states_none(rig_file: Path) -> None:
    write_rig(replace(RIG, covariance=None), rig_file, FILES)

    assert read_rig(rig_file).rig.covariance is None


def test_a_rotation_may_be_a_quaternion(rig_file: Path) -> None:
    half = np.radians(30.0) / 2
    quaternion = [np.cos(half), 0.0, np.sin(half), 0.0]
    edited(rig_file, setting("cam_from_rig_rotation", quaternion))
    c, s = np.cos(2 * half), np.sin(2 * half)

    np.testing.assert_allclose(
        read_rig(rig_file).rig.rotations[1], [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    )


def test_a_rig_file_may_be_yaml(rig_file: Path) -> None:
    tree = json.loads(rig_file.read_text())
    rig_file.write_text(yaml.safe_dump(tree))

    assert_same(read_rig(rig_file), rig_file.parent)


def test_standard_deviations_stand_for_a_covariance(rig_file: Path) -> None:
    deviations = [1e-4, 2e-4, 3e-4, 0.1, 0.2, 0.3]

    def edit(camera: dict[str, Any]) -> None:
        del camera["extrinsics_covariance"]
        camera["std_deviations_extrinsics"] = deviations

    covariance = read_rig(edited(rig_file, edit)).rig.covariance

    assert covariance is not None
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)[:6]), deviations)


def test_a_rotation_in_few_digits_becomes_one_in_all(rig_file: Path) -> None:
    rounded = np.round(RIG.rotations[1], 5)
    edited(rig_file, setting("cam_from_rig_rotation", rounded.tolist()))
    found = read_rig(rig_file).rig.rotations[1]

    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(found, RIG.rotations[1], atol=2e-5)


@pytest.mark.parametrize(
    ("text", "program"),
    [
        ("cam0:\n  resolution: [9, 9]\ncam1:\n  T_cn_cnm1:\n  - [1, 0]\n", "Kalibr"),
        ('[cam_0]\nname = "a"\n\n[cam_1]\nname = "b"\n', "anipose"),
        ('[{"cameras": [{"ref_sensor": true}]}]', "COLMAP"),
        ('{"value0": {"T_imu_cam": [], "intrinsics": []}}', "Basalt"),
        ("%YAML:1.0\n---\nR: 1\nT: 2\nR1: !!opencv-matrix\n", "OpenCV"),
        ('{"CameraParameters1": {}, "CameraParameters2": {}}', "a stereo pair"),
        ('<Cameras><Camera DEVICEID="1"/><Camera DEVICEID="2"/></Cameras>', "Vicon"),
        ('{"cameras": [{"name": "left", "K": [[1]]}]}', "another program"),
        ('{"cameras": {"left": {"K": [[1]]}}, "camera_poses": {}}', "another program"),
        ("---\nimage_width: 9\n", "a single camera"),
        ('[{"ref_camera_id": 1, "cameras": []}]', "COLMAP"),
    ],
)
def test_a_rig_of_another_program_is_named(
    tmp_path: Path, text: str, program: str
) -> None:
    path = tmp_path / "rig.txt"
    path.write_text(text)

    assert re.search(f"of {program}.* see Help, Rig files", refusal(path))


def test_a_misspelt_rig_file_is_not_of_another_program(rig_file: Path) -> None:
    rig_file.write_text(rig_file.read_text().replace('"cameras"', '"camera"'))

    assert "has the unknown key" in refusal(rig_file)


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (setting("intrinsics", "gone.yaml"), "right: .*gone.yaml does not exist"),
        (setting("intrinsics", [3]), "has no intrinsics"),
        (setting("name", "left"), "two cameras named .left"),
        (setting("name", ""), "camera 2 of rig.json has no name"),
        (setting("rotation", [1]), "unknown key .rotation."),
        (setting("cam_from_rig_rotation", 9 * [1.0]), "is no rotation"),
        (
            setting("cam_from_rig_rotation", np.diag([1.0, 1.0, -1.0]).tolist()),
            "is no rotation, or a mirrored one",
        ),
        (setting("cam_from_rig_rotation", 4 * [1.0]), "is no rotation"),
        (setting("cam_from_rig_rotation", [1.0, 2.0]), "2 numbers where 9 are needed"),
        (setting("cam_from_rig_translation", [1.0, 2.0]), "2 numbers where 3"),
        (setting("cam_from_rig_translation", 3 * [1e9]), "millimetres are needed"),
        (setting("cam_from_rig_translation", 3 * [-1e9]), "millimetres are needed"),
        (setting("cam_from_rig_translation", ["a", 0, 0]), "cannot be read"),
        (lambda camera: camera.pop("cam_from_rig_translation"), "has no cam_from_rig"),
        (setting("extrinsics_covariance", (-np.eye(6)).tolist()), "non-negative"),
        (setting("extrinsics_covariance", np.ones((5, 5)).tolist()), "25 numbers"),
        (setting("std_deviations_extrinsics", 6 * [0.1]), "mean the same"),
        (lambda camera: camera.pop("extrinsics_covariance"), "but not of right"),
    ],
)
def test_what_a_rig_file_must_not_be_is_refused_in_words(
    rig_file: Path, edit: Edit, words: str
) -> None:
    assert re.search(words, refusal(edited(rig_file, edit)))


def test_a_reference_that_stands_elsewhere_is_refused(rig_file: Path) -> None:
    tree = json.loads(rig_file.read_text())
    tree["cameras"] = tree["cameras"][::-1]
    rig_file.write_text(json.dumps(tree))

    assert "is the reference of the rig: its cam_from_rig must be" in refusal(rig_file)


@pytest.mark.parametrize("cameras", ["left", [], [{"name": "left"}]])
def test_fewer_than_two_cameras_are_no_rig(rig_file: Path, cameras: object) -> None:
    rig_file.write_text(json.dumps({"cameras": cameras}))

    assert "2 to 16 cameras" in refusal(rig_file)


def test_correlations_that_contradict_each_other_are_refused(rig_file: Path) -> None:
    impossible = np.eye(6)
    impossible[:3, :3] = [[1, 0.9, 0.9], [0.9, 1, -0.9], [0.9, -0.9, 1]]
    edited(rig_file, setting("extrinsics_covariance", (1e-8 * impossible).tolist()))

    assert "symmetric positive" in refusal(rig_file)
