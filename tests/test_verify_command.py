"""Tests of `lightpen verify` and `repeatability`."""

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import numpy as np
import pytest
from tests.simulated_centers import simulate_centers

from lightpen.arrays import FloatArray
from lightpen.formats.camera_files import read_camera
from lightpen.formats.pen_files import read_pen
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.swings import PAPER_CONE, swing_poses

Run = Callable[..., CompletedProcess[str]]
N_RUNS = 8


@pytest.fixture(scope="session")
def tip(swing_full: Path) -> Path:
    """Return the calibration of `swing-full`, with the paper's nominal tip."""
    return swing_full / "calibration.json"


@pytest.fixture
def files(shared_data: Path, tip: Path) -> list[str | Path]:
    """Return the options that name the files of the sets."""
    folder = shared_data / "fixed-point"
    return [
        *("--camera", folder / "camera.yaml", "--pen", folder / "leds.csv"),
        *("--tip", tip),
    ]


def read(path: Path) -> dict[str, Any]:
    record: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return record


def test_the_fixed_point_of_the_paper_is_steady(
    shared_data: Path, lightpen: Run, files: list[str | Path], tmp_path: Path
) -> None:
    outcome = lightpen(
        *("verify", "fixed-point", shared_data / "fixed-point", *files),
        *("--json", tmp_path / "point.json"),
    )

    assert outcome.returncode == 0, outcome.stderr
    assert "Verdict      PASS" in outcome.stdout
    assert "Cone by the nominal tip" in outcome.stdout
    record = read(tmp_path / "point.json")
    std = np.array(record["calibrated"]["std_mm"])
    assert (std <= [0.002, 0.002, 0.010]).all()
    assert min(record["nominal"]["std_mm"]) > 0.2
    assert len(record["touches"]) == 10
    assert np.linalg.eigvalsh(record["touches"][0]["covariance"])[0] > 0


@pytest.mark.slow
def test_the_circle_of_the_paper_has_its_radius(
    shared_data: Path, lightpen: Run, files: list[str | Path], tmp_path: Path
) -> None:
    runs = [shared_data / "circle" / f"run_{i + 1:02d}" for i in range(N_RUNS)]

    outcome = lightpen(
        *("verify", "circle", *runs, "--radius", "31.751", *files),
        *("--json", tmp_path / "circle.json"),
    )

    assert outcome.returncode == 0, outcome.stderr
    for title in ("Measured", "Error", "Relative error"):
        lines = [x for x in outcome.stdout.splitlines() if x.startswith(title)]
        assert sum(len(x[28:].split()) for x in lines) == N_RUNS + 2  # average and std
    record = read(tmp_path / "circle.json")
    radii = [e for e in record["characteristics"] if e["quantity"] == "radius"]
    errors = np.array([each["deviation"] for each in radii])
    assert abs(errors.mean()) <= 0.0015
    assert errors.std(ddof=1) <= 0.001
    assert all(abs(e["deviation"]) <= e["expanded_uncertainty"] for e in radii)


@pytest.mark.slow
def test_table_1_is_reproduced_from_results(
    shared_data: Path,
    calibration_of: Callable[..., Path],
    lightpen: Run,
    tmp_path: Path,
) -> None:
    folder = shared_data / "repeat"
    results = [
        calibration_of(folder, "--centers", str(table)) / "calibration.json"
        for table in sorted(folder.glob("calib_*.csv"))[:4]
    ]

    outcome = lightpen("repeatability", *results, "--json", tmp_path / "repeat.json")

    assert outcome.returncode == 0, outcome.stderr
    lines = outcome.stdout.splitlines()
    assert lines[1].split() == ["No.", "of", "test", "x-axis", "y-axis", "z-axis"]
    assert [line.split()[0] for line in lines[2:8]] == [
        "1",
        "2",
        "3",
        "4",
        "Ave",
        "Std",
    ]
    assert max(read(tmp_path / "repeat.json")["std_mm"]) < 0.003


def write_touches(path: Path, files: list[str | Path], moved: float) -> None:
    """Write LED centres of 15 touches, 8 images each, of a tip moved along x, mm."""
    rng = np.random.default_rng(1)
    camera, pen = read_camera(Path(files[1])), read_pen(Path(files[3]))
    tip = np.array(read(Path(files[5]))["tip_pen_mm"]) + np.array([moved, 0, 0])
    swing = swing_poses(15, rng, pen=pen, camera=camera, tip_pen=tip)
    write_centers(path, files, swing.rotations, swing.translations)


def write_ends(path: Path, files: list[str | Path], length: float, i: int) -> None:
    """Write LED centres of the ends of a length, mm, at the i-th place."""
    rng = np.random.default_rng(i)
    camera, pen = read_camera(Path(files[1])), read_pen(Path(files[3]))
    tip = np.array(read(Path(files[5]))["tip_pen_mm"])
    held = swing_poses(1, rng, pen=pen, camera=camera).rotations[0]
    along = rotation_from_vector(np.array([0.0, 0.0, 0.4 * i]))[:, 0]
    ends = PAPER_CONE + np.outer([-length / 2, length / 2], along)
    write_centers(path, files, np.array([held, held]), ends - held @ tip)


def write_centers(
    path: Path, files: list[str | Path], rotations: FloatArray, translations: FloatArray
) -> None:
    """Write LED centres of a pen held still in each pose through 8 images."""
    rng = np.random.default_rng(1)
    camera, pen = read_camera(Path(files[1])), read_pen(Path(files[3]))
    R, t = np.repeat(rotations, 8, axis=0), np.repeat(translations, 8, axis=0)
    images = simulate_centers(camera, pen, R, t, 0.02, rng)
    lines = ["frame,led,x_px,y_px"]
    for i, centers in enumerate(images, start=1):
        lines += [f"{i},{j},{x},{y}" for j, (x, y) in enumerate(centers, start=1)]
    path.write_text("\n".join(lines), encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize(("moved", "status"), [(0.0, 0), (0.02, 4), (0.3, 3)])
def test_led_centres_are_verified_and_the_exit_status_tells_the_verdict(
    *, lightpen: Run, files: list[str | Path], tmp_path: Path, moved: float, status: int
) -> None:
    centers = tmp_path / "touches.csv"
    write_touches(centers, files, moved)
    verify = ("verify", "fixed-point", "--centers", centers, *files)

    outcome = lightpen(
        *(*verify, "--exit-by-verdict", "--json", tmp_path / "point.json")
    )

    assert outcome.returncode == status, outcome.stdout
    assert "Decision rule: simple acceptance" in outcome.stdout
    record = read(tmp_path / "point.json")
    assert len(record["touches"]) == 15  # five images each, three to settle
    assert {len(each["images"]) for each in record["touches"]} == {5}
    assert record["tip_change_mm"][0] == pytest.approx(moved, abs=0.015)
    assert record["inputs"]["images"][0]["file"] == "touches.csv"


def test_lengths_at_seven_places_are_one_command_with_their_permissible_errors(
    lightpen: Run, files: list[str | Path], tmp_path: Path
) -> None:
    lengths = [60.0, 60.0, 90.0, 90.0, 120.0, 120.0, 150.0]
    places = [tmp_path / f"place_{i}.csv" for i in range(len(lengths))]
    for i, (place, length) in enumerate(zip(places, lengths, strict=True)):
        write_ends(place, files, length * (1 + 4 * 11.5e-6), i)
    verify = ("verify", "length", "--centers", *places, *files)
    warm = ("--temperature", "24", "--expansion", "11.5", "--limit-length-per-m", "0.1")

    outcome = lightpen(
        *(*verify, *warm, "--length", *map(str, lengths)),
        *("--exit-by-verdict", "--json", tmp_path / "length.json"),
    )
    of_two = lightpen(*verify, "--length", "60", "90")

    assert "SCALE OK" in outcome.stdout, outcome.stdout + outcome.stderr
    assert outcome.returncode == 5
    record = read(tmp_path / "length.json")
    for found, length in zip(record["characteristics"], lengths, strict=True):
        warmer = length * (1 + 4 * 11.5e-6)
        assert found["nominal"] == pytest.approx(warmer)
        assert found["upper_limit"] == pytest.approx(warmer + 0.03 + 1e-4 * warmer)
        assert abs(found["deviation"]) < found["expanded_uncertainty"]
    assert of_two.returncode == 2
    assert "2 values for 7 runs" in of_two.stderr


def test_a_verification_needs_images_or_led_centres(
    lightpen: Run, files: list[str | Path]
) -> None:
    outcome = lightpen("verify", "drift", *files)

    assert outcome.returncode == 2
    assert "--centers" in outcome.stderr


def test_a_tip_of_another_pen_is_refused(
    shared_data: Path, lightpen: Run, files: list[str | Path], tmp_path: Path
) -> None:
    other = tmp_path / "lp05_leds.csv"
    text = (shared_data / "fixed-point" / "leds.csv").read_text()
    other.write_text(text.replace("-24.89463", "-24.90463"))

    outcome = lightpen(
        *("verify", "fixed-point", shared_data / "fixed-point", *files, "--pen", other)
    )

    assert outcome.returncode == 2
    assert "was calibrated with the LED file leds.csv," in outcome.stderr
    assert "lp05_leds.csv. Give that LED file" in outcome.stderr


def test_a_pen_lifted_in_the_middle_is_named(
    shared_data: Path, lightpen: Run, files: list[str | Path], tmp_path: Path
) -> None:
    folder = tmp_path / "touches"
    shutil.copytree(shared_data / "fixed-point" / "images", folder)
    shutil.copy(
        shared_data / "circle" / "run_01" / "frame_0001.png", folder / "frame_0005.png"
    )

    outcome = lightpen("verify", "fixed-point", folder, *files)

    assert outcome.returncode == 0
    assert "Verdict      CHECK" in outcome.stdout
    assert "the first frame_0005.png" in outcome.stdout


def test_one_end_touched_twice_is_refused(
    shared_data: Path, lightpen: Run, files: list[str | Path]
) -> None:
    outcome = lightpen(
        *("verify", "length", shared_data / "fixed-point", "--length", "150", *files)
    )

    assert outcome.returncode == 1
    assert "one end was probed again" in outcome.stderr


def test_points_are_measured_without_a_plan(
    shared_data: Path, lightpen: Run, files: list[str | Path], tmp_path: Path
) -> None:
    file = tmp_path / "points.json"

    outcome = lightpen(
        *("measure", "points", shared_data / "fixed-point", *files, "--json", file)
    )

    assert outcome.returncode == 0, outcome.stderr
    assert "Probed points in the camera frame / mm" in outcome.stdout
    record = read(file)
    assert (record["verification"], record["verdict"]) == ("points", None)
    assert len(record["touches"]) == 10
    assert np.linalg.eigvalsh(record["touches"][0]["covariance"])[0] > 0


def test_files_that_are_missing_or_would_be_lost_are_named(
    shared_data: Path, lightpen: Run, files: list[str | Path], tip: Path
) -> None:
    point = ("verify", "fixed-point", shared_data / "fixed-point")

    without_pen = lightpen(*point, *files[:2], "--tip", tip)
    over_tip = lightpen(*point, *files, "--json", tip)
    no_tip = lightpen(*point, *files[:4], "--tip", files[1])

    assert without_pen.returncode == over_tip.returncode == no_tip.returncode == 2
    assert "--pen FILE is missing" in without_pen.stderr
    assert "would replace the input file" in over_tip.stderr
    assert "is not a calibration record." in no_tip.stderr


@pytest.mark.slow
def test_a_pen_is_examined_by_its_results_alone(
    shared_data: Path,
    calibration_of: Callable[..., Path],
    lightpen: Run,
    tmp_path: Path,
) -> None:
    folder = shared_data / "repeat"
    tables = [str(folder / f"calib_{i:02d}.csv") for i in range(1, 5)]
    results = [
        shutil.copy(
            calibration_of(folder, "--centers", table) / "calibration.json",
            tmp_path / f"swing_{i}.json",
        )
        for i, table in enumerate(tables, 1)
    ]

    examined = lightpen("verify", "pen", *results)

    assert "No LED moved relative to the others in 4 swings." in examined.stdout


@pytest.mark.slow
def test_calibrations_are_solved_again_and_their_uncertainty_checked(
    shared_data: Path,
    calibration_of: Callable[..., Path],
    lightpen: Run,
    tmp_path: Path,
) -> None:
    folder = shared_data / "fixed-point"
    few = calibration_of(folder) / "calibration.json"

    outcome = lightpen(
        *("recalculate", few, "--monte-carlo", "20"),
        *("--workers", "2", "--json", tmp_path / "again.json"),
    )

    assert outcome.returncode == 0, outcome.stderr
    assert "U (k = 2), Monte Carlo" in outcome.stdout
    # U is not too small; whether it is too large, 20 trials can hardly tell.
    assert re.search("Monte Carlo (gives less: U is|confirms U)", outcome.stdout)
    (again,) = read(tmp_path / "again.json")["calibrations"]
    assert max(map(abs, again["change_mm"])) < 1e-6
    assert again["monte_carlo"]["trials"] + again["monte_carlo"]["failed"] == 20
