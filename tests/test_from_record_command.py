"""`lightpen calibrate --from-record FILE` needs nothing but the JSON."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import numpy as np
import pytest
from tests.simulated_centers import simulate_centers

from lightpen.arrays import FloatArray
from lightpen.formats.own_json import with_checksum
from lightpen.record.swings.writing import note_excluded
from lightpen_extensions.simulator.scene_files import write_sample_files
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import swing_poses

Run = Callable[..., CompletedProcess[str]]
# The fits begin at other poses than those that the images gave, and end as close as
# their steps become.
SAME = 1e-9  # mm


@pytest.fixture
def calibrated(lightpen: Run, tmp_path: Path) -> tuple[Path, str]:
    """A record whose files are gone, and what was printed with it.

    One image has too few LEDs, in one the tip slipped, and one LED was never seen.
    """
    scene, rng = Scene(), np.random.default_rng(0)
    swing = swing_poses(40, rng, pen=scene.pen, camera=scene.camera)
    translations = swing.translations.copy()
    translations[5] += [0.5, 0, 0]
    pixels = simulate_centers(
        scene.camera, scene.pen, swing.rotations, translations, 0.02, rng
    )
    pixels[3, 2:] = np.nan
    pixels[:, -1] = np.nan
    files = write_sample_files(scene, tmp_path / "files")
    centers = tmp_path / "files" / "centers.csv"
    write_centers(centers, pixels)
    record = tmp_path / "tip.json"
    outcome = lightpen(
        *("calibrate", "--centers", centers, "--json", record),
        *("--camera", files.camera, "--pen", files.pen),
        *("--method", "two-stage", "--scale-sigma", "3e-5", "--temperature", "24"),
    )
    assert outcome.returncode == 0, outcome.stderr
    shutil.rmtree(tmp_path / "files")
    return record, outcome.stdout


def write_centers(file: Path, pixels: FloatArray) -> None:
    rows = [
        f"{frame + 1},{led + 1},{x!r},{y!r}"
        for frame, image in enumerate(pixels.tolist())
        for led, (x, y) in enumerate(image)
        if np.isfinite(x)
    ]
    file.write_text("\n".join(["frame,led,x_px,y_px", *rows]))


def read(file: Path) -> dict[str, Any]:
    fields: dict[str, Any] = json.loads(file.read_bytes())
    return fields


def rewrite(file: Path, **changes: object) -> None:
    """Change a record, and give it a checksum that fits."""
    fields = read(file) | changes
    del fields["checksum"]
    file.write_bytes(with_checksum(json.dumps(fields).encode()))


def test_the_record_alone_gives_the_same_figures(
    lightpen: Run, calibrated: tuple[Path, str], tmp_path: Path
) -> None:
    record, printed = calibrated
    again = tmp_path / "again.json"
    outcome = lightpen("calibrate", "--from-record", record, "--json", again)

    assert outcome.returncode == 0, outcome.stderr
    assert outcome.stdout == printed
    before, after = read(record), read(again)
    for name in ("method", "inputs", "images", "nominal_tip_mm", "origin"):
        assert after[name] == before[name]
    for name in ("tip_pen_mm", "expanded_uncertainty_mm"):
        np.testing.assert_allclose(after[name], before[name], rtol=0, atol=SAME)
    assert [frame["reason"] for frame in after["frames"]] == [
        frame["reason"] for frame in before["frames"]
    ]
    assert before["images"]["dropped"] == {"too few LEDs": 1, "tip slipped": 1}


def test_images_that_were_taken_out_stay_out(
    lightpen: Run, swung: Callable[..., Path], tmp_path: Path
) -> None:
    folder = Path(shutil.copytree(swung(), tmp_path / "swing"))
    note_excluded(folder, {3: "taken out", 7: "taken out"})
    record = tmp_path / "tip.json"
    printed = lightpen("calibrate", folder, "--json", record).stdout
    shutil.rmtree(folder)

    outcome = lightpen("calibrate", "--from-record", record)
    assert outcome.returncode == 0, outcome.stderr
    assert outcome.stdout == printed


def test_what_a_record_brings_itself_is_refused_beside_it(
    lightpen: Run, calibrated: tuple[Path, str]
) -> None:
    outcome = lightpen("calibrate", "--from-record", calibrated[0], "--units", "mm")
    both = lightpen("calibrate", "images", "--from-record", calibrated[0])

    assert "Omit --units" in outcome.stderr
    assert "Give either IMAGES" in both.stderr
    assert (outcome.returncode, both.returncode) == (2, 2)


def test_a_record_is_not_written_over_itself(
    lightpen: Run, calibrated: tuple[Path, str]
) -> None:
    record, _ = calibrated
    before = record.read_bytes()

    outcome = lightpen("calibrate", "--from-record", record, "--json", record)
    assert outcome.returncode == 2
    assert record.read_bytes() == before


@pytest.mark.parametrize("name", ["camera", "pen"])
def test_a_record_that_does_not_hold_its_files_is_refused(
    lightpen: Run, calibrated: tuple[Path, str], name: str
) -> None:
    record, _ = calibrated
    whole = read(record)["inputs"]
    for kept in ({}, {"base64": "bm90IGl0"}, {"base64": "?"}):
        named = {word: whole[name][word] for word in ("file", "sha256")}
        rewrite(record, inputs=whole | {name: named | kept})

        outcome = lightpen("calibrate", "--from-record", record)
        assert outcome.returncode == 2
        assert "does not contain all input data of the calibration" in outcome.stderr


def test_a_record_that_was_changed_is_refused(
    lightpen: Run, calibrated: tuple[Path, str]
) -> None:
    record, _ = calibrated
    record.write_bytes(record.read_bytes().replace(b'"used": true', b'"used": null', 1))

    outcome = lightpen("calibrate", "--from-record", record)
    assert outcome.returncode == 2
    assert "was modified or damaged after it was written." in outcome.stderr
