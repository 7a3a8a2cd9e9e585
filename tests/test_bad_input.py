"""Bad input: a sentence and an exit status, never a traceback."""

import resource
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from lightpen.cli import main
from lightpen.images import read_image

LIGHTPEN = Path(sys.executable).with_name("lightpen")
Edit = Callable[[str], str]


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sets") / "set"
    assert main(["simulate", str(folder), "--images", "8", "--seed", "3"]) == 0
    return folder


@pytest.fixture
def folder(original: Path, tmp_path: Path) -> Path:
    """Return a set of one's own to spoil."""
    return shutil.copytree(original, tmp_path / "set")


def files_of(folder: Path) -> list[str]:
    return ["--camera", str(folder / "camera.yaml"), "--pen", str(folder / "leds.csv")]


def refusal(folder: Path, capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    """Return exit status and message of a calibration that must fail."""
    capsys.readouterr()
    status = main(["calibrate", str(folder / "images"), *files_of(folder)])
    message = capsys.readouterr().err
    assert status in (1, 2)
    assert message.startswith("lightpen: ")
    assert message.rstrip().endswith(".")
    assert "Traceback" not in message
    return status, message


def scaled(text: str, factor: float) -> str:
    lines = text.splitlines()
    rows = [line.split(",") for line in lines[1:]]
    changed = [
        [row[0], *(repr(float(v) * factor) for v in row[1:4]), *row[4:]] for row in rows
    ]
    return "\n".join([lines[0], *(",".join(row) for row in changed)]) + "\n"


def swapped(first: int, second: int) -> Edit:
    """Return an edit that gives two LEDs each other's coordinates."""

    def edit(text: str) -> str:
        lines = text.splitlines()
        a, b = (lines[k].split(",", 1) for k in (first, second))
        lines[first], lines[second] = f"{a[0]},{b[1]}", f"{b[0]},{a[1]}"
        return "\n".join(lines) + "\n"

    return edit


def mirrored(column: int) -> Edit:
    def edit(text: str) -> str:
        lines = text.splitlines()
        for k in range(1, len(lines)):
            row = lines[k].split(",")
            row[column] = repr(-float(row[column]))
            lines[k] = ",".join(row)
        return "\n".join(lines) + "\n"

    return edit


PEN_EDITS: dict[str, tuple[Edit, str]] = {
    "empty": (lambda text: "", "empty"),
    "header only": (lambda text: text.splitlines()[0] + "\n", "no "),
    "cut off": (lambda text: text[: len(text) // 2], "leds.csv"),
    "a letter": (lambda text: text.replace("60", "6O", 1), "is not a number"),
    "not a number": (lambda text: text.replace("-30", "nan", 1), "leds.csv"),
    "a row twice": (lambda text: text + text.splitlines()[-1] + "\n", "10"),
    "out of order": (
        lambda text: "\n".join(text.splitlines()[:3][:1] + text.splitlines()[:0:-1]),
        "order",
    ),
    "swapped on the back": (swapped(2, 3), "2"),
    "swapped between columns": (swapped(5, 8), "5"),
    "in metres": (lambda text: scaled(text, 0.001), "metres"),
    "mirrored in x": (mirrored(1), "mirror"),
    "mirrored in z": (mirrored(3), "leds.csv"),
    "a binary file": (lambda text: "\x00\x01\x02" * 100, "leds.csv"),
}


@pytest.mark.parametrize("case", PEN_EDITS)
def test_a_bad_pen_file_is_refused(
    folder: Path, case: str, capsys: pytest.CaptureFixture[str]
) -> None:
    edit, word = PEN_EDITS[case]
    pen = folder / "leds.csv"
    pen.write_text(edit(pen.read_text()))

    _, message = refusal(folder, capsys)

    assert word in message


CAMERA_EDITS: dict[str, tuple[Edit, str]] = {
    "empty": (lambda text: "", "empty"),
    "cut off": (lambda text: text[: len(text) // 2], "camera.yaml"),
    "a letter": (lambda text: text.replace("4638", "46E8x"), "camera.yaml"),
    "no size": (lambda text: text.replace("image_width", "width_of_it"), "width"),
    "a size twice": (lambda text: text + "image_width: 2448\n", "second time"),
    "unsafe": (
        lambda text: text + 'x: !!python/object/apply:os.system ["touch boo"]\n',
        "camera.yaml",
    ),
    "of another size": (
        lambda text: text.replace("2448", "1224").replace("2048", "1024"),
        "1224 x 1024",
    ),
    "not finite": (lambda text: text.replace("4638.2", ".inf"), "camera.yaml"),
    "a table": (lambda text: "a,b,c\n1,2,3\n", "camera.yaml"),
}


@pytest.mark.parametrize("case", CAMERA_EDITS)
def test_a_bad_camera_file_is_refused(
    folder: Path,
    case: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(folder)
    edit, word = CAMERA_EDITS[case]
    camera = folder / "camera.yaml"
    before = camera.read_text()
    camera.write_text(edit(before))
    assert camera.read_text() != before

    _, message = refusal(folder, capsys)

    assert word in message
    assert not (folder / "boo").exists()


@pytest.mark.parametrize("name", ["camera.yaml", "leds.csv", "images"])
def test_what_is_missing_is_named(
    folder: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / name).rename(folder / "elsewhere")

    status, message = refusal(folder, capsys)

    assert status == 2
    assert name in message


@pytest.mark.parametrize("name", ["camera.yaml", "leds.csv"])
def test_a_huge_file_is_refused_before_it_is_read(
    folder: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with (folder / name).open("wb") as stream:
        stream.truncate(20_000_000_000)

    status, message = refusal(folder, capsys)

    assert status == 2
    assert "MB" in message or "bytes" in message


def test_an_empty_folder_is_refused(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for image in (folder / "images").iterdir():
        image.unlink()

    status, message = refusal(folder, capsys)

    assert status == 2
    assert "no images" in message


def test_images_of_another_pen_are_refused(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "other"
    assert main(["simulate", str(other), "--images", "2", "--pen", "eight"]) == 0
    shutil.copy(other / "leds.csv", folder / "leds.csv")

    status, message = refusal(folder, capsys)

    assert status == 1
    assert "do not fit the pen file" in message


def test_an_image_of_another_size_and_a_colour_image_do_no_harm(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    images = sorted((folder / "images").iterdir())
    grey = read_image(images[1])
    for path, image in (
        (images[0], grey[:1000]),
        (images[1], cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)),
        (images[2], grey.astype(np.uint16) * 257),
    ):
        path.write_bytes(cv2.imencode(".png", image)[1].tobytes())
    options = [
        "--camera",
        str(folder / "camera.yaml"),
        "--pen",
        str(folder / "leds.csv"),
    ]

    assert main(["calibrate", str(folder / "images"), *options]) == 0

    printed = capsys.readouterr().out
    assert "7 of 8 used" in printed
    assert "1 wrong size: frame_0001.png" in printed


CENTERS_EDITS: dict[str, tuple[Edit, int]] = {
    "empty": (lambda text: "", 2),
    "a letter": (lambda text: text.replace("1,2,", "1,2,x", 1), 2),
    "an LED twice": (lambda text: text + text.splitlines()[-1] + "\n", 2),
    "LED 11": (lambda text: text.replace("1,10,", "1,11,", 1), 2),
    "cut off": (lambda text: text[: len(text) - 12], 2),
    "few images": (lambda text: "\n".join(text.splitlines()[:41]), 1),
}


@pytest.mark.parametrize("case", CENTERS_EDITS)
def test_bad_centres_are_refused(
    shared_data: Path,
    tmp_path: Path,
    case: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    edit, expected = CENTERS_EDITS[case]
    repeat = shared_data / "repeat"
    centers = tmp_path / "centers.csv"
    centers.write_text(edit((repeat / "calib_01.csv").read_text()))
    capsys.readouterr()

    status = main(["calibrate", "--centers", str(centers), *files_of(repeat)])

    message = capsys.readouterr().err
    assert status == expected
    assert message.startswith("lightpen: ")


def test_wrong_usage_ends_with_status_two(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in ([], ["calibrate"], ["calibrate", "x", "--camera", "c"], ["fly"]):
        with pytest.raises(SystemExit) as caught:
            main(arguments)
        assert caught.value.code == 2
    files = ["--camera", "c", "--pen", "p"]
    assert main(["calibrate", *files]) == 2
    assert main(["calibrate", "x", "--centers", "y", *files]) == 2
    assert "either IMAGES or --centers" in capsys.readouterr().err


def test_a_full_disk_leaves_the_old_record_whole(folder: Path, tmp_path: Path) -> None:
    record = tmp_path / "tip.json"
    record.write_text("the old record")

    def small_files() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))

    arguments = ["calibrate", str(folder / "images"), *files_of(folder)]
    done = subprocess.run(
        [LIGHTPEN, *arguments, "--json", record],
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=small_files,
    )

    assert done.returncode == 2
    assert "tip.json cannot be written" in done.stderr
    assert record.read_text() == "the old record"
    assert list(tmp_path.glob("*tip*")) == [record]
