"""Input that cannot be used is refused in words, with status 1 or 2, and never used."""

import csv
import io
import json
import os
import re
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import cv2
import numpy as np
import pytest

Run = Callable[..., CompletedProcess[str]]
Scene = Callable[..., Path]
Truth = Callable[[Path], dict[str, Any]]
Edit = Callable[[str], str]

needs_posix = pytest.mark.skipif(os.name == "nt", reason="needs POSIX")
needs_linux = pytest.mark.skipif(sys.platform != "linux", reason="needs Linux")


@dataclass(frozen=True)
class Swing:
    """A swing that calibrates; tests replace one of its files by a bad one."""

    images: Path
    camera: Path
    pen: Path
    centers: Path
    true_tip: tuple[float, float, float]

    def arguments(self, **replaced: Path) -> list[str | Path]:
        """Return those that calibrate from the centers, or from `images` if given."""
        if "images" in replaced:
            source: list[str | Path] = [replaced["images"]]
        else:
            source = ["--centers", replaced.get("centers", self.centers)]
        camera = replaced.get("camera", self.camera)
        pen = replaced.get("pen", self.pen)
        return ["calibrate", *source, "--camera", camera, "--pen", pen]

    def calibrate(
        self, run: Run, *options: str | Path, **replaced: Path
    ) -> CompletedProcess[str]:
        return run(*self.arguments(**replaced), *options)


@pytest.fixture(scope="module")
def swing(
    scene: Scene, truth: Truth, tmp_path_factory: pytest.TempPathFactory
) -> Swing:
    folder = scene("--binning", "2", "--images", "40", "--seed", "8")
    answer = truth(folder)
    rng = np.random.default_rng(8)
    rows = ["frame,led,x_px,y_px"]
    for i, frame in enumerate(answer["frames"], 1):
        for led in frame["leds"]:
            x, y = np.array(led["ellipse_center"]) + rng.normal(0, 0.015, 2)
            rows.append(f"{i},{led['led']},{x:.5f},{y:.5f}")
    centers = tmp_path_factory.mktemp("swing") / "centers.csv"
    centers.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return Swing(
        images=folder / "images",
        camera=folder / "camera.yaml",
        pen=folder / "leds.csv",
        centers=centers,
        true_tip=tuple(answer["pen"]["tip_in_leds_csv_frame_bestfit"]),
    )


def assert_refused(outcome: CompletedProcess[str], *words: str) -> None:
    """Assert that a sentence says what is wrong, with all the words in it."""
    assert outcome.returncode in (1, 2), outcome.stdout
    assert outcome.stdout == ""
    assert "Traceback" not in outcome.stderr
    assert outcome.stderr.count("\n") <= 3, "that is no sentence"
    assert outcome.stderr.rstrip().endswith(".")
    for word in words:
        assert re.search(word, outcome.stderr, re.IGNORECASE), outcome.stderr


def assert_tip(
    outcome: CompletedProcess[str], swing: Swing, tolerance: float = 0.02
) -> None:
    """Assert status 0 and the right tip in the text; 0.02 mm suits 0.015 px noise."""
    assert outcome.returncode == 0, outcome.stderr
    line = re.search(r"joint((?:\s+-?\d+\.\d+){3})", outcome.stdout)
    assert line is not None
    tip = [float(word) for word in line[1].split()]
    np.testing.assert_allclose(tip, swing.true_tip, atol=tolerance)


def replace(old: str, new: str, count: int = 1) -> Edit:
    """Return an edit that must find what it replaces."""

    def edit(text: str) -> str:
        changed = re.sub(old, new, text, count=count, flags=re.DOTALL | re.MULTILINE)
        assert changed != text, f"{old} is not in the file"
        return changed

    return edit


def rows(change: Callable[[list[list[str]]], object]) -> Edit:
    """Return an edit of the rows of a table without its header, in place."""

    def edit(text: str) -> str:
        head, *table = csv.reader(io.StringIO(text))
        change(table)
        return "\n".join(",".join(row) for row in [head, *table]) + "\n"

    return edit


def cells(row: int, column: int, value: str) -> Edit:
    def change(table: list[list[str]]) -> None:
        table[row][column] = value

    return rows(change)


ROLES = ("camera", "pen", "centers", "poses")


def run_with(run: Run, swing: Swing, role: str, file: Path) -> CompletedProcess[str]:
    if role == "poses":
        return run("pivot", file)
    return swing.calibrate(run, **{role: file})


@pytest.mark.parametrize("role", ROLES)
def test_a_missing_file_is_refused_by_name(
    role: str, swing: Swing, lightpen: Run, tmp_path: Path
) -> None:
    outcome = run_with(lightpen, swing, role, tmp_path / "nowhere.yaml")
    assert_refused(outcome, r"nowhere\.yaml")
    assert outcome.returncode == 2


def scale(*factors: float) -> Edit:
    """Scale x, y and z."""

    def change(table: list[list[str]]) -> None:
        for row in table:
            for column, factor in enumerate(factors, 1):
                row[column] = repr(float(row[column]) * factor)

    return rows(change)


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (scale(1e-3, 1e-3, 1e-3), ["metres", "--units m"]),
        (scale(-1, -1, 1), ["in the pen frame", r"lightpen pen RAW\.csv OUT\.csv"]),
    ],
    ids=["metres", "turned"],
)
def test_what_is_wrong_with_a_pen_file_is_reported(
    edit: Edit, words: list[str], swing: Swing, lightpen: Run, tmp_path: Path
) -> None:
    file = tmp_path / "bad-pen.csv"
    file.write_text(edit(swing.pen.read_text(encoding="utf-8")), encoding="utf-8")
    outcome = swing.calibrate(lightpen, pen=file)
    assert_refused(outcome, r"bad-pen\.csv", *words)


@pytest.mark.parametrize("x", ["1e300", "-1e9", "99999", "-50.0"])
def test_a_center_outside_the_image_is_refused_or_not_used(
    x: str, swing: Swing, lightpen: Run, tmp_path: Path
) -> None:
    file, out = tmp_path / "bad-centers.csv", tmp_path / "out.json"
    text = swing.centers.read_text(encoding="utf-8")
    file.write_text(cells(4, 2, x)(text), encoding="utf-8")
    outcome = swing.calibrate(lightpen, "--json", out, centers=file)
    if outcome.returncode:
        assert_refused(outcome, r"bad-centers\.csv")
        return
    assert_tip(outcome, swing)
    frame = json.loads(out.read_text(encoding="utf-8"))["frames"][0]
    assert not any(led["used"] for led in frame["leds"] if led["led"] == 5)


@pytest.fixture(scope="module")
def poses_text(truth: Truth, scene: Scene) -> str:
    answer = truth(scene("--binning", "2", "--images", "40", "--seed", "8"))
    lines = ["pose,r11,r12,r13,r21,r22,r23,r31,r32,r33,tx_mm,ty_mm,tz_mm"]
    for i, frame in enumerate(answer["frames"], 1):
        numbers = [*np.ravel(frame["R"]), *frame["T"]]
        lines.append(",".join([str(i), *(f"{number:.10f}" for number in numbers)]))
    return "\n".join(lines) + "\n"


@pytest.fixture
def images(swing: Swing, tmp_path: Path) -> Path:
    """Return a folder with the images of the swing, to spoil."""
    folder = tmp_path / "images"
    shutil.copytree(swing.images, folder)
    return folder


@pytest.fixture
def few(images: Path) -> Path:
    """A third of the images, to be written anew: that takes longer than to use them."""
    for index, path in enumerate(sorted(images.iterdir())):
        if index % 3:
            path.unlink()
    return images


def read(path: Path) -> Any:
    return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)


def write(path: Path, image: Any) -> None:
    path.write_bytes(cv2.imencode(path.suffix, image)[1].tobytes())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "spoil"),
    [
        ("empty", lambda _: b""),
        ("half", lambda content: content[: len(content) // 2]),
        ("without its end", lambda content: content[:-3000]),
        ("head only", lambda content: content[:40]),
        ("text", lambda _: b"this is no image"),
        ("flipped bytes", lambda content: content[:9000] + bytes(
            byte ^ 0x5A for byte in content[9000:20000]) + content[20000:]),
    ],
)  # fmt: skip
def test_a_corrupt_image_is_dropped_and_named_and_the_rest_used(
    name: str, spoil: Callable[[bytes], bytes], swing: Swing, images: Path,
    lightpen: Run, tmp_path: Path, capfd: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    corrupt, file = images / "frame_0020.png", tmp_path / "out.json"
    corrupt.write_bytes(spoil(corrupt.read_bytes()))
    outcome = swing.calibrate(lightpen, "--json", file, images=images)
    assert_tip(outcome, swing)
    assert outcome.stderr == ""
    assert capfd.readouterr().err == ""  # no complaints of the image library
    assert "frame_0020.png" in outcome.stdout
    frames = json.loads(file.read_text(encoding="utf-8"))["frames"]
    assert [frame["file"] for frame in frames if not frame["used"]] == [corrupt.name]
    assert frames[19]["reason"]
    assert re.fullmatch(r"(image|read)\.[a-z-]+", frames[19]["detail_code"])


def test_a_folder_of_nothing_but_corrupt_images_is_refused(
    swing: Swing, images: Path, lightpen: Run
) -> None:
    for path in images.iterdir():
        path.write_bytes(path.read_bytes()[:5000])
    outcome = swing.calibrate(lightpen, images=images)
    assert_refused(outcome, "image", "read|corrupt|damaged|truncated|decode")
    assert "spots" not in outcome.stderr  # nobody has seen any


@pytest.mark.parametrize("name", ["nowhere", "nowhere/*.png", "nowhere.avi"])
def test_images_that_do_not_exist_are_refused_by_name(
    name: str, swing: Swing, lightpen: Run, tmp_path: Path
) -> None:
    outcome = swing.calibrate(lightpen, images=tmp_path / name)
    assert_refused(outcome, "nowhere")
    assert outcome.returncode == 2


def test_other_files_beside_the_images_do_no_harm(
    swing: Swing, images: Path, lightpen: Run
) -> None:
    (images / "notes.txt").write_text("a windy day")
    (images / "Thumbs.db").write_bytes(bytes(100))
    (images / ".hidden").write_text("")
    (images / "old").mkdir()
    outcome = swing.calibrate(lightpen, images=images)
    assert_tip(outcome, swing)
    assert "40 of 40 used" in outcome.stdout


def with_disk_of(size: int, script: Run) -> Run:
    """Return a run of the program that can write no file above a size in bytes."""
    import resource

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return lambda *arguments: script(*arguments, before=limit)


@pytest.mark.slow
@needs_posix
def test_a_full_disk_stops_a_simulation_with_a_sentence(
    script: Run, tmp_path: Path
) -> None:
    run = with_disk_of(20_000, script)
    outcome = run("simulate", tmp_path / "set", "--images", "3")
    assert_refused(outcome, "set")
    assert outcome.returncode == 2


@pytest.mark.slow
@needs_linux
@pytest.mark.parametrize("command", ["calibrate", "pivot", "simulate"])
def test_output_that_cannot_be_written_ends_with_a_sentence(
    command: str, swing: Swing, poses_text: str, script: Run, tmp_path: Path
) -> None:
    poses = tmp_path / "poses.csv"
    poses.write_text(poses_text, encoding="utf-8")
    with Path("/dev/full").open("w") as full:

        def run(*arguments: str | Path) -> CompletedProcess[str]:
            return script(*arguments, stdout=full)

        if command == "calibrate":
            outcome = swing.calibrate(run)
        elif command == "pivot":
            outcome = run("pivot", poses)
        else:
            outcome = run("simulate", tmp_path / "set", "--images", "2")
    assert outcome.returncode == 2
    assert "Traceback" not in outcome.stderr
    assert "Exception ignored" not in outcome.stderr
    assert outcome.stderr.rstrip().endswith(".")


@pytest.mark.parametrize("name", ["no-such-folder/out.json", "folder"])
def test_a_record_that_cannot_be_written_is_refused_by_name(
    name: str, swing: Swing, lightpen: Run, tmp_path: Path
) -> None:
    (tmp_path / "folder").mkdir()
    outcome = swing.calibrate(lightpen, "--json", tmp_path / name)
    assert outcome.returncode == 2
    assert "Traceback" not in outcome.stderr
    assert Path(name).name in outcome.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("calibrate", "--from-record", "tip.json", "--json"),
        ("export", "tip.json", "--for", "text"),
        ("pen", "pen.csv"),
        ("archive", "check", "--data"),
        ("archive", "list", "--data"),
        ("tips", "list", "--data"),
    ],
)
def test_a_place_that_cannot_be_looked_at_is_refused_by_name(
    arguments: tuple[str, ...], swing: Swing, lightpen: Run, tmp_path: Path
) -> None:
    """And the disk of what is printed is not blamed."""
    shutil.copy(swing.pen, tmp_path / "pen.csv")
    swing.calibrate(lightpen, "--json", tmp_path / "tip.json")
    place = tmp_path / (300 * "x") / "out.csv"  # no system has names so long
    words = [tmp_path / word if "." in word else word for word in arguments]
    outcome = lightpen(*words, place)

    assert outcome.returncode == 2
    assert "xxx" in outcome.stderr
    assert "printed" not in outcome.stderr


def test_no_record_is_written_where_there_is_no_tip(
    swing: Swing, lightpen: Run, tmp_path: Path
) -> None:
    centers, file = tmp_path / "centers.csv", tmp_path / "calibration.json"
    text = swing.centers.read_text(encoding="utf-8")
    centers.write_text("\n".join(text.splitlines()[:21]), encoding="utf-8")
    file.write_text("the old record", encoding="utf-8")
    outcome = swing.calibrate(lightpen, "--json", file, centers=centers)
    assert_refused(outcome, "image")
    assert outcome.returncode == 1
    assert file.read_text(encoding="utf-8") == "the old record"


@pytest.mark.slow
@needs_linux
def test_a_name_that_is_no_utf_8_is_written_and_shown(
    swing: Swing, images: Path, script: Run, tmp_path: Path
) -> None:
    first = images / "frame_0001.png"
    first.rename(os.fsdecode(os.fsencode(images) + b"/frame_0001_\xff.png"))
    odd = images / os.fsdecode(b"corrupt_\xfe.png")
    odd.write_bytes(b"no image")
    file = tmp_path / "out.json"
    outcome = swing.calibrate(script, "--json", file, images=images)
    assert_tip(outcome, swing)
    assert len(json.loads(file.read_bytes())["frames"]) == 41


# Names and options


@needs_posix
def test_names_of_files_say_nothing_to_the_terminal(
    swing: Swing, lightpen: Run, tmp_path: Path
) -> None:
    red = "\x1b[31m"
    folder = tmp_path / f"{red}swing"
    for refused in (
        swing.calibrate(lightpen, images=folder),
        swing.calibrate(lightpen, camera=folder),
        lightpen("simulate", tmp_path / "out", "--images", red),
    ):
        assert refused.returncode == 2
        assert red not in refused.stderr
        assert "\\x1b[31m" in refused.stderr
    written = lightpen("simulate", "--images", "1", folder)
    assert red not in written.stdout
    assert "\\x1b[31mswing" in written.stdout


def test_a_pen_is_not_written_over_the_measured_leds(
    swing: Swing, lightpen: Run, tmp_path: Path
) -> None:
    raw = tmp_path / "raw.csv"
    shutil.copy(swing.pen, raw)
    before = raw.read_bytes()
    (tmp_path / "inner").mkdir()
    same = tmp_path / "inner" / ".." / "raw.csv"

    assert_refused(lightpen("pen", raw, same), "replace its input, the measured LEDs")
    assert raw.read_bytes() == before


def test_a_record_is_not_written_over_an_image(
    swing: Swing, lightpen: Run, few: Path
) -> None:
    image = min(few.iterdir())
    before = image.read_bytes()
    outcome = swing.calibrate(lightpen, "--json", image, images=few)

    assert_refused(outcome, "would replace the input file")
    assert image.read_bytes() == before


def test_more_images_than_can_be_held_are_not_simulated(
    lightpen: Run, tmp_path: Path
) -> None:
    outcome = lightpen("simulate", "--images", "1000000000", tmp_path / "out")

    assert outcome.returncode == 2
    assert "at most 30000 images" in outcome.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("option", "number"),
    [
        ("--form-error", "1e308"),
        ("--center-bias", "1e300"),
        ("--temperature-sigma", "1e9"),
        ("--scale-sigma", "1e-300"),
    ],
)
def test_an_uncertainty_that_nothing_has_is_refused(
    option: str, number: str, swing: Swing, lightpen: Run
) -> None:
    outcome = swing.calibrate(lightpen, option, number)

    assert outcome.returncode == 2
    assert f"argument {option}: {number} " in outcome.stderr
    assert outcome.stderr.rstrip().endswith(".")
