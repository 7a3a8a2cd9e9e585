"""`lightpen simulate --cameras` and `calibrate --rig` as a user runs them."""

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator

Run = Callable[..., CompletedProcess[str]]


@pytest.fixture(scope="module")
def station(scene: Callable[..., Path]) -> Path:
    """Return a folder with what two cameras saw of 12 postures."""
    return scene("--binning", "2", "--images", "12", "--seed", "3", "--cameras", "2")


@pytest.fixture
def copied(station: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(station, tmp_path / "set"))


def calibrate(
    run: Run, folder: Path, *options: str | Path, images: tuple[str, ...] = ()
) -> CompletedProcess[str]:
    places = [folder / name for name in images or ("left", "right")]
    files = "--rig", folder / "rig.json", "--pen", folder / "leds.csv"
    return run("calibrate", *files, *places, *options)


def assert_refused(outcome: CompletedProcess[str], words: str, status: int) -> None:
    assert outcome.returncode == status, outcome.stdout
    assert outcome.stdout == ""
    assert outcome.stderr.rstrip().endswith(".")
    assert re.search(words, outcome.stderr), outcome.stderr


def true_tip(folder: Path) -> list[float]:
    truth = json.loads((folder / "truth.json").read_text())
    tip: list[float] = truth["pen"]["tip_in_leds_csv_frame_bestfit"]
    return tip


@pytest.fixture(scope="module")
def fields(
    station: Path, lightpen: Run, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Any]:
    file = tmp_path_factory.mktemp("rig") / "tip.json"
    outcome = calibrate(lightpen, station, "--json", file)
    assert outcome.returncode == 0, outcome.stderr
    found: dict[str, Any] = json.loads(file.read_text())
    return found | {"text": outcome.stdout, "path": file}


@pytest.mark.slow
def test_a_tip_is_verified_by_both_cameras(
    station: Path, fields: dict[str, Any], lightpen: Run, tmp_path: Path
) -> None:
    files = "--rig", station / "rig.json", "--pen", station / "leds.csv"
    tip, out = ("--tip", fields["path"]), tmp_path / "point.json"
    outcome = lightpen("verify", "fixed-point", station, *files, *tip, "--json", out)
    assert outcome.returncode == 0, outcome.stderr
    record = json.loads(out.read_text())

    assert len(record["touches"]) == 12
    assert max(record["calibrated"]["std_mm"]) < 0.003  # along the view, too
    assert [each["file"] for each in record["inputs"]["cameras"]] == [
        "left.yaml",
        "right.yaml",
    ]
    assert record["inputs"]["rig"]["sha256"] == fields["inputs"]["rig"]["sha256"]


def test_images_of_one_camera_are_not_verified_by_two(
    station: Path, fields: dict[str, Any], lightpen: Run
) -> None:
    files = "--rig", station / "rig.json", "--pen", station / "leds.csv"
    tip = "--tip", fields["path"]
    outcome = lightpen("verify", "fixed-point", station / "left", *files, *tip)
    assert_refused(outcome, "contains no images of two cameras.", 2)


def test_the_record_of_two_cameras_is_as_the_schema_says(
    validator: Draft202012Validator, fields: dict[str, Any]
) -> None:
    written = {
        name: entry for name, entry in fields.items() if name not in ("text", "path")
    }

    assert [error.message for error in validator.iter_errors(written)] == []


def test_two_cameras_find_the_tip_that_was_simulated(
    station: Path, fields: dict[str, Any]
) -> None:
    error = np.array(fields["tip_pen_mm"]) - true_tip(station)

    assert np.linalg.norm(error) < 0.01
    assert (np.abs(error) < 1.5 * np.array(fields["expanded_uncertainty_mm"])).all()


def test_the_record_holds_every_file_with_its_hash(fields: dict[str, Any]) -> None:
    inputs = fields["inputs"]

    assert inputs["rig"]["file"] == "rig.json"
    assert [file["file"] for file in inputs["cameras"]] == ["left.yaml", "right.yaml"]
    assert len(inputs["observations"]) == 24
    assert len({file["sha256"] for file in inputs["observations"]}) == 24


def test_the_truth_has_a_view_of_each_camera(station: Path) -> None:
    truth = json.loads((station / "truth.json").read_text())

    left, right = truth["cameras"]
    assert left["cam_from_rig"]["rotation"] == np.eye(3).tolist()
    assert right["frames"][0]["file"] == "right/frame_0001.png"
    rotation = np.array(right["cam_from_rig"]["rotation"])
    one, other = (np.array(view["frames"][5]["R"]) for view in (left, right))
    np.testing.assert_allclose(rotation @ one, other, atol=1e-12)


def test_both_cameras_have_noise_of_their_own(station: Path) -> None:
    truth = json.loads((station / "truth.json").read_text())
    gains = [view["pen"]["radiance_gain"] for view in truth["cameras"]]

    assert gains[0] == gains[1]
    one, other = (
        (station / name / "frame_0001.png").read_bytes() for name in ("left", "right")
    )
    assert one != other


def test_centres_of_two_cameras_give_the_tip_as_well(
    station: Path, lightpen: Run, tmp_path: Path
) -> None:
    truth = json.loads((station / "truth.json").read_text())
    files = []
    for view in truth["cameras"]:
        rows = ["frame,led,x_px,y_px"]
        for i, frame in enumerate(view["frames"], 1):
            for led in frame["leds"]:
                x, y = led["ellipse_center"]
                rows.append(f"{i},{led['led']},{x},{y}")
        files.append(tmp_path / f"{view['name']}.csv")
        files[-1].write_text("\n".join(rows))
    out = tmp_path / "tip.json"
    outcome = lightpen(
        *("calibrate", "--rig", station / "rig.json", "--pen", station / "leds.csv"),
        *("--centers", *files, "--json", out),
    )

    assert outcome.returncode == 0, outcome.stderr
    tip = json.loads(out.read_text())["tip_pen_mm"]
    np.testing.assert_allclose(tip, true_tip(station), atol=0.005)


def test_exchanged_folders_of_other_names_are_reported_by_their_images(
    copied: Path, lightpen: Run
) -> None:
    (copied / "left").rename(copied / "b")
    (copied / "right").rename(copied / "a")

    assert_refused(
        calibrate(lightpen, copied, images=("a", "b")),
        "images are in the order of its cameras",
        1,
    )


def test_images_of_another_size_name_the_camera(copied: Path, lightpen: Run) -> None:
    for name, width in (("left", 1224), ("right", 1200)):
        path = copied / f"{name}.yaml"
        text = path.read_text()
        path.write_text(text.replace("image_width: 1224", f"image_width: {width}"))
    outcome = calibrate(lightpen, copied)

    assert_refused(outcome, "Camera right: 12 of 12 images are 1224 x 1024 px", 2)
    assert "Their size is that of left" in outcome.stderr


def test_missing_images_are_reported_and_the_others_used(
    copied: Path, lightpen: Run
) -> None:
    (copied / "right" / "frame_0004.png").unlink()
    outcome = calibrate(lightpen, copied)

    assert outcome.returncode == 0
    assert "Moments      12 of 12 used" in outcome.stdout
    assert "Camera right has no image at 1 of 12 instants, such as " in (outcome.stdout)


@pytest.mark.parametrize(
    ("images", "options", "words"),
    [
        (("left",), (), "files given: 1. The rig has 2 cameras"),
        (("left", "right", "left"), (), "files given: 3"),
        (("left", "left"), (), "or file is given twice. The rig has 2 cameras"),
        ((), ("--camera", "left.yaml"), "Omit --camera"),
    ],
)
def test_another_number_of_places_or_a_camera_beside_a_rig_is_refused(
    station: Path,
    lightpen: Run,
    images: tuple[str, ...],
    options: tuple[str, ...],
    words: str,
) -> None:
    assert_refused(calibrate(lightpen, station, *options, images=images), words, 2)


def test_two_folders_without_a_rig_ask_for_it(station: Path, lightpen: Run) -> None:
    files = "--camera", station / "left.yaml", "--pen", station / "leds.csv"
    outcome = lightpen("calibrate", station / "left", station / "right", *files)

    assert_refused(outcome, "need --rig FILE instead of --camera", 2)


def test_the_record_alone_gives_the_same_tip_where_a_camera_lost_an_image(
    copied: Path, lightpen: Run, tmp_path: Path
) -> None:
    record, again = tmp_path / "tip.json", tmp_path / "again.json"
    sorted((copied / "right").iterdir())[4].unlink()
    assert calibrate(lightpen, copied, "--json", record).returncode == 0
    shutil.rmtree(copied)
    outcome = lightpen("calibrate", "--from-record", record, "--json", again)

    assert outcome.returncode == 0, outcome.stderr
    before, after = (json.loads(each.read_bytes()) for each in (record, again))
    assert after["inputs"] == before["inputs"]
    for name in ("tip_pen_mm", "expanded_uncertainty_mm"):
        np.testing.assert_allclose(after[name], before[name], rtol=0, atol=1e-7)
    assert [(f["file"], f["reason"]) for f in after["frames"]] == [
        (f["file"], f["reason"]) for f in before["frames"]
    ]
