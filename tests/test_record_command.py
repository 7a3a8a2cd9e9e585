"""`lightpen calibrate RECORD` gives the tip of the wizard, and says what is wrong."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import pytest

from lightpen.formats.files import sha256
from lightpen.record.swings.header import HEADER
from lightpen.record.swings.reading import JOURNAL, image_name, open_record
from lightpen.record.swings.solving import solve_record

Run = Callable[..., CompletedProcess[str]]
N_IMAGES = 20


@pytest.fixture
def folder(swung: Callable[..., Path], tmp_path: Path) -> Path:
    """A record that the test may change."""
    return Path(shutil.copytree(swung(), tmp_path / "swing 1"))


@pytest.fixture
def calibrated(
    lightpen: Run, tmp_path: Path
) -> Callable[..., tuple[dict[str, Any], str]]:
    """Return a function that calibrates a record: the JSON, and the text."""

    def run(folder: Path, *options: str) -> tuple[dict[str, Any], str]:
        file = tmp_path / "result.json"
        outcome = lightpen("calibrate", folder, "--json", file, *options)
        assert outcome.returncode == 0, outcome.stderr
        fields: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        return fields, outcome.stdout

    return run


Calibrated = Callable[..., tuple[dict[str, Any], str]]


@pytest.fixture
def untouched(
    swung: Callable[..., Path], record: Callable[..., dict[str, Any]]
) -> dict[str, Any]:
    """The JSON of the record that nobody changed, with the `text`."""
    return record(swung())


def test_the_tip_is_that_of_the_wizard_to_the_last_bit(
    untouched: dict[str, Any], swung: Callable[..., Path]
) -> None:
    joint = solve_record(open_record(swung())).calibration.joint

    assert untouched["tip_pen_mm"] == joint.tip_pen.tolist()
    assert untouched["cone_cam_mm"] == joint.cone_cam.tolist()
    assert f"{N_IMAGES} of {N_IMAGES} used" in untouched["text"]


def test_the_record_may_be_called_from_another_folder_or_with_a_slash(
    calibrated: Calibrated,
    untouched: dict[str, Any],
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tip = untouched["tip_pen_mm"]
    monkeypatch.chdir(folder)

    assert calibrated(Path())[0]["tip_pen_mm"] == tip
    assert calibrated(Path("images") / "..")[0]["tip_pen_mm"] == tip


def test_the_files_of_the_record_are_named_with_their_hashes(
    untouched: dict[str, Any], swung: Callable[..., Path]
) -> None:
    inputs, folder = untouched["inputs"], swung()

    assert (inputs["camera"]["file"], inputs["pen"]["file"]) == (
        "camera.yaml",
        "pen.json",
    )
    assert inputs["camera"]["sha256"] == sha256(folder / "camera.yaml")
    assert [file["sha256"] for file in inputs["observations"]] == [
        image.sha256 for image in open_record(folder).images
    ]


def test_the_verdict_goes_by_the_limits_of_the_record(
    untouched: dict[str, Any],
) -> None:
    verdict = untouched["verdict"]

    assert verdict["grade"] == "repeat"
    assert verdict["limits"]["max_uncertainty_mm"] == 1e-6
    assert verdict["limits"]["min_images"] == N_IMAGES
    assert verdict["text"].startswith("U (k = 2) of the tip is 0.0")
    assert f"Verdict      REPEAT: {verdict['text']}\n" in untouched["text"]


@pytest.mark.parametrize("is_gone", [False, True])
def test_a_damaged_or_lost_image_is_left_out_and_named(
    calibrated: Calibrated, folder: Path, is_gone: bool
) -> None:
    (folder / image_name(3)).write_bytes(b"\x89PNG\r\n\x1a\n")
    if is_gone:
        (folder / image_name(3)).unlink()
    fields, text = calibrated(folder)

    assert fields["images"]["dropped"] == {"unreadable": 1}
    assert len(fields["inputs"]["observations"]) == N_IMAGES - is_gone
    assert "1 unreadable: 000003.png" in text


@pytest.mark.parametrize(
    ("option", "values"),
    [
        ("--camera", ["camera.yaml"]),
        ("--pen", ["pen.json"]),
        ("--units", ["mm"]),
        ("--led-diameter", ["10"]),
        ("--nominal-tip", ["0", "-90", "-25"]),
    ],
)
def test_what_the_record_brings_is_not_to_be_given(
    lightpen: Run, folder: Path, option: str, values: list[str]
) -> None:
    outcome = lightpen("calibrate", folder, option, *values)

    assert outcome.returncode == 2
    assert f"is the record of a swing and contains these files. Omit {option}." in (
        outcome.stderr
    )


@pytest.mark.parametrize(
    "name", [HEADER, JOURNAL, "camera.yaml", "pen.json", image_name(1)]
)
def test_the_result_does_not_replace_a_file_of_the_record(
    lightpen: Run, folder: Path, name: str
) -> None:
    before = (folder / name).read_bytes()
    outcome = lightpen("calibrate", folder, "--json", folder / name)

    assert outcome.returncode == 2
    assert "would replace the input file of that name" in outcome.stderr
    assert (folder / name).read_bytes() == before


def test_an_empty_record_says_what_to_do(lightpen: Run, folder: Path) -> None:
    (folder / JOURNAL).write_bytes(b"")
    outcome = lightpen("calibrate", folder)

    assert outcome.returncode == 1
    assert outcome.stderr == (
        f"lightpen: {N_IMAGES} images, the first images/000001.png, are in the folder "
        "but not in the journal; their recording was not confirmed, and they are "
        "excluded.\n"
        "lightpen: The record swing 1 contains no images. Resume the swing, or start "
        "a new one.\n"
    )


def test_images_that_the_journal_does_not_name_are_reported(
    lightpen: Run, folder: Path
) -> None:
    for number in (24, 23, 22, 21):
        shutil.copy(folder / image_name(1), folder / image_name(number))
    outcome = lightpen("calibrate", folder)

    assert outcome.returncode == 0
    assert f"{N_IMAGES} of {N_IMAGES} used" in outcome.stdout
    said = "lightpen: 4 images, the first images/000021.png, are in the folder"
    assert outcome.stderr.startswith(said)
    assert outcome.stderr.count("lightpen:") == 1


def test_a_whole_record_has_nothing_to_report(lightpen: Run, folder: Path) -> None:
    (folder / "images" / ".0123456789abcdef.part").write_bytes(b"torn")

    assert lightpen("calibrate", folder).stderr == ""


def test_a_folder_that_is_no_record_still_needs_its_files(
    lightpen: Run, folder: Path
) -> None:
    outcome = lightpen("calibrate", folder / "images")

    assert outcome.returncode == 2
    assert "--camera FILE is missing. It may be omitted only" in outcome.stderr


@pytest.mark.parametrize(
    ("said", "origin", "line"),
    [
        ("live camera", "live camera", "Origin       LIVE CAMERA"),
        ("recorded", "recorded", "Origin       RECORDED"),
        ("simulated", "simulated", "SIMULATED: this is the tip of no real pen"),
    ],
)
def test_what_the_images_are_of_is_reported(
    calibrated: Calibrated,
    folder: Path,
    rewrite_header: Callable[..., None],
    said: str,
    origin: str | None,
    line: str | None,
) -> None:
    rewrite_header(folder, origin=said)
    fields, text = calibrated(folder)

    assert fields["origin"] == origin
    assert ("Origin " in text) is (line is not None)
    assert line is None or line in text
