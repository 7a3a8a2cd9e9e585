"""``lightpen discover`` as it is called."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.simulated_stations import random_station

from lightpen.formats.camera_files import read_camera
from lightpen.formats.pen_files import read_pen
from lightpen.formats.rig_files import write_camera
from lightpen_program.extensions import main

STATION = random_station(6, n_images=160)
SIZE = f"{STATION.camera.width}x{STATION.camera.height}"
OUTPUTS = ("pen.json", "camera.yaml", "found.json")


@pytest.fixture
def centers(tmp_path: Path) -> Path:
    """Return a file of unlabelled centres, in any order within a frame."""
    rows = ["frame,x_px,y_px"]
    for frame, spots in enumerate(STATION.sightings.centers):
        rows += [f"{frame},{x:.5f},{y:.5f}" for x, y in spots.tolist()]
    path = tmp_path / "centers.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


def arguments(centers: Path, *more: str) -> list[str]:
    folder = centers.parent
    pen, camera, record = (str(folder / name) for name in OUTPUTS)
    given = ["discover", "--centers", str(centers), "--image-size", SIZE]
    given += ["--led-diameter", str(STATION.pen.diameter)]
    return [*given, *more, "--out-pen", pen, "--out-camera", camera, "--json", record]


@pytest.mark.slow
def test_a_swing_of_centres_and_a_length_give_pen_camera_and_record(
    centers: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    length = ("--length", "longest", f"{STATION.longest}", "--length-sigma", "0.001")

    assert main(arguments(centers, *length)) == 0

    folder = centers.parent
    pen = read_pen(folder / "pen.json")
    camera = read_camera(folder / "camera.yaml")
    record = json.loads((folder / "found.json").read_text())
    np.testing.assert_allclose(record["leds_mm"], pen.leds)
    assert len(record["tip_pen_mm"]) == len(record["expanded_uncertainty_mm"]) == 3
    focal = record["intrinsics"]["fx"]
    assert focal["value"] == camera.fx
    assert abs(camera.fx - STATION.camera.fx) < 4 * focal["standard_uncertainty"]
    assert camera.covariance is not None
    assert focal["standard_uncertainty"] == pytest.approx(
        camera.covariance[0, 0] ** 0.5
    )
    matrix = np.array(record["covariance"]["matrix"])
    assert matrix.shape == (len(record["covariance"]["parameters"]),) * 2
    np.testing.assert_allclose(
        np.diag(matrix)[:3] ** 0.5 * 2, record["expanded_uncertainty_mm"]
    )
    assert np.linalg.eigvalsh(matrix).min() > -1e-12
    assert {"mirrored", "focal_length_px", "misfit_px"} <= set(record["hypotheses"][0])
    assert record["scale"] == "measured"
    assert pen.normal_covariance is not None
    assert "tip x" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize(
    ("more", "reported"),
    [
        ([], "one known length"),
        (["--length", "1", "180"], "is not a length"),
        (["--length", "longest", f"{0.5 * STATION.longest}"], "disc diameter of"),
        (["--length", "1", "99", "180"], "no LED 99"),
        (["--length", "2", "2", "180"], "and itself"),
    ],
)
def test_what_cannot_be_done_is_reported_and_nothing_is_written(
    centers: Path, more: list[str], reported: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments(centers, *more)) != 0

    assert reported in capsys.readouterr().err
    assert not any((centers.parent / name).exists() for name in OUTPUTS)


@pytest.mark.slow
def test_a_camera_file_that_is_off_is_reported(
    centers: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    camera, length = STATION.camera, ("--length", "longest", f"{STATION.longest}")
    file = centers.parent / "stated.yaml"
    given = (*length, "--camera", str(file))

    write_camera(camera, file)
    assert main(arguments(centers, *given)) == 0
    assert "intrinsics file is off" not in capsys.readouterr().out

    off = replace(camera, fx=1.05 * camera.fx, fy=1.05 * camera.fy)
    write_camera(off, file)
    assert main(arguments(centers, *given)) == 0
    assert "intrinsics file is off" in capsys.readouterr().out

    for name in OUTPUTS:
        (centers.parent / name).unlink(missing_ok=True)
    certain = 0.25 * np.eye(len(off.intrinsics))
    for factor in (1.05, 1.01):
        off = replace(camera, fx=factor * camera.fx, fy=factor * camera.fy)
        write_camera(replace(off, covariance=certain), file)
        assert main(arguments(centers, *given)) == 1
        assert "does not fit the intrinsics file" in capsys.readouterr().err
    assert not any((centers.parent / name).exists() for name in OUTPUTS)


def test_an_output_in_a_folder_that_does_not_exist_is_reported_first(
    centers: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    length = ("--length", "longest", f"{STATION.longest}")

    *others, _ = arguments(centers, *length)

    assert main([*others, str(centers.parent / "none" / "found.json")]) != 0

    assert "folder does not exist" in capsys.readouterr().err
    assert not any((centers.parent / name).exists() for name in OUTPUTS)


def test_centres_in_millimetres_are_named(
    centers: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = np.loadtxt(centers, delimiter=",", skiprows=1)
    rows[:, 1:] *= 0.00345
    np.savetxt(centers, rows, "%d,%.6f,%.6f", header="frame,x_px,y_px", comments="")

    assert main(arguments(centers, "--length", "longest", "180")) != 0

    assert "Write them in pixels" in capsys.readouterr().err
    assert not any((centers.parent / name).exists() for name in OUTPUTS)
