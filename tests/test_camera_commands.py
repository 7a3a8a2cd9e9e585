"""Tests of the commands about cameras: intrinsics, extrinsics, board, check-camera."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from tests.simulated_boards import expose_board, render_board, simulate_board_poses

from lightpen.formats.camera_files import read_camera
from lightpen.formats.rig_files import read_rig
from lightpen.local_time import local_now
from lightpen.model.camera import Camera
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.boards.boards import parse_board
from lightpen_extensions.simulator.scenes import Sensor
from lightpen_program.extensions import main

BOARD = "chessboard:7x5:20"
CAMERA = Camera(200, 160, 300.0, 299.6, 101.0, 78.0)
TURN, SHIFT = rotation_from_vector(np.array([0.0, -0.05, 0.02])), [-25.0, 0.5, 1.0]
N_VIEWS = 8


@pytest.fixture(scope="module")
def pairs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write what two cameras see of a board, into the folders left and right."""
    folder = tmp_path_factory.mktemp("pairs")
    rng = np.random.default_rng(2)
    board = parse_board(BOARD)
    poses = simulate_board_poses(CAMERA, board, N_VIEWS, rng)
    for name, R, t in (("left", np.eye(3), np.zeros(3)), ("right", TURN, SHIFT)):
        (folder / name).mkdir()
        for v in range(N_VIEWS):
            light = render_board(
                CAMERA, board, R @ poses.rotations[v], R @ poses.translations[v] + t
            )
            image = expose_board(light, Sensor(), rng)
            cv2.imwrite(str(folder / name / f"{v}.png"), image)
    return folder


def run(*words: str | Path) -> int:
    return main([str(word) for word in words])


@pytest.mark.slow
def test_a_camera_file_is_made_of_a_folder_of_images(
    pairs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    camera_file, record_file = tmp_path / "camera.yaml", tmp_path / "record.json"
    today = local_now().date()
    status = run(
        *("intrinsics", pairs / "left", "--board", BOARD, "--out", camera_file),
        *("--serial", "DEV-7", "--temperature", "21.5", "--json", record_file),
    )

    assert status == 0
    camera, record = read_camera(camera_file), json.loads(record_file.read_text())
    assert camera.covariance is not None
    sigmas = np.sqrt(np.diag(camera.covariance))[:4]
    assert np.all(np.abs(camera.intrinsics - CAMERA.intrinsics)[:4] < 4 * sigmas)
    assert (camera.serial, camera.temperature_c) == ("DEV-7", 21.5)
    assert camera.calibrated_on in (today, local_now().date())
    assert record["rms_px"] < 0.05
    assert len(record["views"]) == N_VIEWS
    assert "U (k = 2)" in capsys.readouterr().out


@pytest.mark.slow
def test_the_rig_file_of_two_cameras_is_read_back(
    pairs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig_file = tmp_path / "rig.json"
    status = run(
        *("extrinsics", pairs / "left", pairs / "right", "--board", BOARD),
        *("--out", rig_file, "--json", tmp_path / "record.json"),
    )
    rig = read_rig(rig_file).rig

    assert status == 0
    assert rig.names == ("left", "right")
    assert rig.covariance is not None
    sigmas = np.sqrt(np.diag(rig.covariance))[3:]
    assert np.all(np.abs(rig.translations[1] - SHIFT) < 4 * sigmas)
    assert "Baseline" in capsys.readouterr().out


@pytest.mark.slow
def test_images_that_are_binned_use_a_camera_file_that_is_written(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = shared_data / "swing-clean"
    (tmp_path / "images").mkdir()
    for path in sorted((data / "images").iterdir())[::2]:
        image = np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), np.float64)
        binned = image.reshape(1024, 2, 1224, 2).mean(axis=(1, 3)).round()
        cv2.imwrite(str(tmp_path / "images" / path.name), binned.astype(np.uint8))
    camera = tmp_path / "camera.yaml"
    camera.write_bytes((data / "camera.yaml").read_bytes())
    given = ["calibrate", str(tmp_path / "images"), "--camera", str(camera)]
    given += ["--pen", str(data / "leds.csv"), "--json", str(tmp_path / "tip.json")]

    assert main([*given, "--binning", "2"]) == 0

    said = capsys.readouterr()
    assert "camera-binned-2.yaml" in said.err
    assert "Images       30 of 30 used" in said.out
    pen = json.loads((data / "truth.json").read_text())["pen"]
    record = json.loads((tmp_path / "tip.json").read_text())
    off = np.subtract(record["tip_pen_mm"], pen["tip_in_leds_csv_frame_bestfit"])
    assert np.all(np.abs(off) < record["expanded_uncertainty_mm"])
    assert main(given) != 0
    said = capsys.readouterr()
    assert "1224 x 1024 px" in said.err
    assert "--binning 2" in said.err


def test_binning_needs_a_camera_file(capsys: pytest.CaptureFixture[str]) -> None:
    given = ["calibrate", "images", "--rig", "r.json", "--pen", "p.csv"]

    assert main([*given, "--binning", "2"]) == 2
    assert "Give it by --camera." in capsys.readouterr().err
