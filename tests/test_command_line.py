"""`lightpen calibrate`, `pivot` and `simulate` as a user runs them on good input."""

import hashlib
import json
import os
import re
import shutil
import sys
from collections.abc import Callable
from contextlib import suppress
from io import FileIO
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from lightpen import __version__
from lightpen.arrays import FloatArray
from lightpen.formats.observation_files import read_poses
from lightpen.logs import log_file
from lightpen_program.extensions import main

Run = Callable[..., CompletedProcess[str]]
Record = Callable[..., dict[str, Any]]
Scene = Callable[..., Path]
Truth = Callable[[Path], dict[str, Any]]

# Published by scikit-surgery for the same poses.
TRACKER_TIP = np.array([-14.476, 395.143, -7.558])
TRACKER_PIVOT = np.array([-805.285, -85.448, -2112.066])


def tip_error_um(fields: dict[str, Any], truth: dict[str, Any]) -> float:
    true_tip = np.array(truth["pen"]["tip_in_leds_csv_frame_bestfit"])
    return 1000 * float(np.linalg.norm(np.array(fields["tip_pen_mm"]) - true_tip))


def numbers_in(text: str) -> NDArray[np.float64]:
    return np.array([float(word) for word in re.findall(r"-?\d+(?:\.\d+)?", text)])


def assert_printed(values: list[float], text: str) -> None:
    """Assert that the text shows each value, to the micrometre at least."""
    shown = numbers_in(text)
    for value in values:
        assert np.abs(shown - value).min() < 6e-4, f"{value} is not in\n{text}"


def input_options(folder: Path) -> tuple[str | Path, ...]:
    return "--camera", folder / "camera.yaml", "--pen", folder / "leds.csv"


@pytest.fixture(scope="module")
def clean(shared_data: Path) -> Path:
    return shared_data / "swing-clean"


@pytest.fixture(scope="module")
def simulated(scene: Scene) -> Path:
    """A set of 40 images with a quarter of the pixels."""
    return scene("--binning", "2", "--images", "40", "--seed", "8")


@pytest.fixture(scope="module")
def clean_centers(
    clean: Path, record: Record, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """The LED centres of `clean`, as its record has them."""
    rows = [
        f"{i},{led['led']},{led['x_px']!r},{led['y_px']!r}"
        for i, frame in enumerate(record(clean)["frames"], 1)
        for led in frame["leds"]
    ]
    file = tmp_path_factory.mktemp("clean") / "centers.csv"
    file.write_text("\n".join(["frame,led,x_px,y_px", *rows]), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def full(swing_full: Path) -> dict[str, Any]:
    fields: dict[str, Any] = json.loads((swing_full / "calibration.json").read_bytes())
    return fields


@pytest.mark.slow
def test_swing_clean_gives_the_tip_to_4_um(
    clean: Path, record: Record, truth: Truth
) -> None:
    assert tip_error_um(record(clean), truth(clean)) <= 4.0


@pytest.mark.slow
def test_swing_full_gives_the_tip_to_3_5_um(
    shared_data: Path, full: dict[str, Any], truth: Truth
) -> None:
    assert full["images"]["used"] == 300
    assert tip_error_um(full, truth(shared_data / "swing-full")) <= 3.5


def test_ten_images_of_the_fixed_point_give_the_tip_to_10_um(
    shared_data: Path, record: Record, truth: Truth
) -> None:
    folder = shared_data / "fixed-point"
    assert tip_error_um(record(folder), truth(folder)) <= 10.0


@pytest.fixture(scope="module")
def repeated(shared_data: Path, record: Record) -> list[dict[str, Any]]:
    folder = shared_data / "repeat"
    files = [str(folder / f"calib_{i:02d}.csv") for i in range(1, 11)]
    return [record(folder, "--centers", file) for file in files]


@pytest.mark.slow
def test_ten_calibrations_scatter_no_more_than_by_their_noise(
    repeated: list[dict[str, Any]],
) -> None:
    """Their camera file states no uncertainty: each swing has to find the camera."""
    tips = [fields["tip_pen_mm"] for fields in repeated]
    noise = [fields["uncertainty"]["independent_noise_mm"] for fields in repeated]
    # The 99.9 % quantile of a standard deviation of 10.
    assert (np.std(tips, axis=0, ddof=1) <= 1.76 * np.median(noise, axis=0)).all()


@pytest.mark.slow
def test_ten_two_stage_calibrations_scatter_as_the_method_must(
    repeated: list[dict[str, Any]],
) -> None:
    tips = [fields["methods"]["two-stage"]["tip_pen_mm"] for fields in repeated]
    # The solver behind the figures is another one, so the last digit may differ.
    np.testing.assert_allclose(
        1000 * np.std(tips, axis=0, ddof=1), [5.5, 4.6, 1.7], atol=0.15
    )


@pytest.mark.slow
def test_the_uncertainty_covers_the_error(
    shared_data: Path, record: Record, full: dict[str, Any], truth: Truth
) -> None:
    for name in ("swing-clean", "swing-full", "fixed-point"):
        answer = truth(shared_data / name)
        fields = full if name == "swing-full" else record(shared_data / name)
        true_tip = answer["pen"]["tip_in_leds_csv_frame_bestfit"]
        error = np.array(fields["tip_pen_mm"]) - true_tip
        # 3 standard deviations, and 0.001 px between the renderer and the exact disc,
        # which is 0.5 um at the tip and the same in all images of a set.
        limit = 1.5 * np.array(fields["expanded_uncertainty_mm"]) + 0.0005
        assert np.all(np.abs(error) <= limit), name


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_300_images_fit_into_400_mb(swing_full: Path) -> None:
    status = (swing_full / "status").read_text(encoding="utf-8")
    peak = re.search(r"VmHWM:\s+(\d+) kB", status)
    assert peak is not None
    assert int(peak[1]) <= 400_000


def test_the_record_lists_every_image_in_order(clean: Path, record: Record) -> None:
    frames = record(clean)["frames"]
    files = sorted(path.name for path in (clean / "images").iterdir())
    assert [Path(frame["file"]).name for frame in frames] == files
    for frame in frames:
        assert set(frame) >= {"file", "used", "reason", "rms_px", "tip_cam_mm", "leds"}
        assert frame["used"] is True
        assert not frame["reason"]
        assert [led["led"] for led in frame["leds"]] == list(range(1, 11))
        for led in frame["leds"]:
            assert set(led) >= {"led", "x_px", "y_px", "used"}


def test_the_record_names_the_program_and_hashes_its_input(
    clean: Path, record: Record
) -> None:
    fields = record(clean)
    version = fields["program"]["version"]
    assert re.fullmatch(r"\d+\.\d+.*", version)
    text = json.dumps(fields["inputs"])
    inputs = [clean / "camera.yaml", clean / "leds.csv", *(clean / "images").iterdir()]
    assert len(inputs) == 62
    for path in inputs:
        assert hashlib.sha256(path.read_bytes()).hexdigest() in text, path.name


def test_the_program_says_its_version(script: Run, clean: Path, record: Record) -> None:
    outcome = script("--version")
    assert outcome.returncode == 0
    assert record(clean)["program"]["version"] in outcome.stdout


def test_a_part_of_the_images_can_be_used(
    clean: Path, clean_centers: Path, record: Record
) -> None:
    given = ("--centers", str(clean_centers), "--from", "3", "--until", "40")
    fields = record(clean, *given)

    outside = [frame["reason"] == "outside the part" for frame in fields["frames"]]
    assert not any(outside[2:40])
    assert all(outside[:2] + outside[40:])
    assert fields["images"]["used"] <= 38


def test_the_part_before_a_moved_cone_gives_the_tip(
    clean: Path, clean_centers: Path, record: Record, truth: Truth, tmp_path: Path
) -> None:
    header, *rows = clean_centers.read_text(encoding="utf-8").splitlines()
    moved = []
    for row in rows:
        frame, led, x, y = row.split(",")
        shift = 0.4 if int(frame) > 36 else 0.0  # px
        moved.append(f"{frame},{led},{float(x) + shift!r},{y}")
    file = tmp_path / "centers.csv"
    file.write_text("\n".join([header, *moved]), encoding="utf-8")

    verdict = record(clean, "--centers", str(file))["verdict"]
    told = verdict["values"]
    assert (verdict["grade"], verdict["next_step"]) == ("repeat", "use longer part")
    assert (told["image"], told["begin"], told["end"]) == (37, 1, 36)
    part = record(clean, "--centers", str(file), "--until", str(told["end"]))
    assert part["verdict"]["next_step"] != "use longer part"
    assert part["images"]["used"] == 36
    assert tip_error_um(part, truth(clean)) <= 10.0


@pytest.mark.slow
@pytest.mark.parametrize(
    "tip", ["-1.3182 -90.4095 -23.8548", "-1 -90. -23", "-1.3182e0 -9.04095e1 -2e1"]
)
def test_a_nominal_tip_with_negative_numbers_is_taken(
    tip: str, shared_data: Path, record: Record
) -> None:
    folder = shared_data / "fixed-point"
    fields = record(folder, "--nominal-tip", *tip.split())
    nominal = [float(word) for word in tip.split()]
    np.testing.assert_allclose(fields["tip_pen_mm"], record(folder)["tip_pen_mm"])
    assert_printed(nominal, fields["text"])
    text = re.sub(r"\s", "", json.dumps(fields))
    assert re.sub(r"\s", "", json.dumps(nominal)) in text


def test_a_pattern_that_the_shell_has_expanded_selects_images(
    simulated: Path, lightpen: Run
) -> None:
    images = sorted((simulated / "images").glob("frame_00[12]?.png"))
    outcome = lightpen("calibrate", *images, *input_options(simulated))
    assert outcome.returncode == 0, outcome.stderr
    assert re.search(r"\b20 used", outcome.stdout.replace("20 of ", ""))


@pytest.mark.slow
def test_a_video_gives_the_tip_of_its_images(
    simulated: Path, record: Record, lightpen: Run, tmp_path: Path
) -> None:
    video, file = tmp_path / "schwenk-Ü.avi", tmp_path / "out.json"
    plain = tmp_path / "plain.avi"  # the writer may not take every name
    codec = cv2.VideoWriter.fourcc(*"FFV1")
    writer = cv2.VideoWriter(str(plain), codec, 20.0, (1224, 1024), isColor=False)
    if not writer.isOpened():
        pytest.skip("OpenCV has no lossless video here")
    for path in sorted((simulated / "images").iterdir()):
        image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        assert image is not None
        writer.write(image)
    writer.release()
    plain.rename(video)
    outcome = lightpen("calibrate", video, *input_options(simulated), "--json", file)
    assert outcome.returncode == 0, outcome.stderr
    fields = json.loads(file.read_text(encoding="utf-8"))
    assert len(fields["frames"]) == 40
    assert len({frame["file"] for frame in fields["frames"]}) == 40
    np.testing.assert_allclose(
        fields["tip_pen_mm"], record(simulated)["tip_pen_mm"], atol=1e-6
    )
    assert hashlib.sha256(video.read_bytes()).hexdigest() in json.dumps(fields)


def test_the_centers_of_a_record_give_its_tip_again(
    clean: Path, clean_centers: Path, record: Record
) -> None:
    fields = record(clean)
    again = record(clean, "--centers", str(clean_centers))
    # Centres have no areas, which leaves the disc diameter uncertain by 5 %.
    np.testing.assert_allclose(again["tip_pen_mm"], fields["tip_pen_mm"], atol=1e-3)
    assert len(again["frames"]) == 60
    digest = hashlib.sha256(clean_centers.read_bytes()).hexdigest()
    assert digest in json.dumps(again)


@pytest.mark.slow
def test_swapped_leds_in_some_frames_leave_the_tip(
    shared_data: Path, record: Record, tmp_path: Path
) -> None:
    folder = shared_data / "repeat"
    head, *rows = (folder / "calib_02.csv").read_text(encoding="utf-8").split()
    swap = {"2": "8", "8": "2"}
    table = [row.split(",") for row in rows]
    for row in table:
        if int(row[0]) % 10 == 0:
            row[1] = swap.get(row[1], row[1])
    file = tmp_path / "swapped.csv"
    text = "\n".join([head, *(",".join(row) for row in table)])
    file.write_text(text + "\n", encoding="utf-8")
    fields = record(folder, "--centers", str(file))
    tip = record(folder, "--centers", str(folder / "calib_02.csv"))["tip_pen_mm"]
    # METHODS: 10 % swapped LEDs leave a scatter of 1.6 to 2.4 um.
    np.testing.assert_allclose(fields["tip_pen_mm"], tip, atol=0.005)
    for frame in fields["frames"][9::10]:
        assert not any(led["used"] for led in frame["leds"] if led["led"] in (2, 8))


@pytest.mark.slow
def test_names_in_any_script_are_read_and_written(
    script: Run, shared_data: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "Prüfstand 测试 Ω"
    shutil.copytree(shared_data / "fixed-point", folder, copy_function=shutil.copy)
    images = folder / "images"
    images.chmod(0o755)
    for path in images.iterdir():
        path.rename(images / path.name.replace("frame", "Aufnahme_写真"))
    (folder / "camera.yaml").rename(folder / "Kamera_é.yaml")
    (folder / "leds.csv").rename(folder / "Stift_ß.csv")
    file = folder / "Ergebnis_結果.json"
    outcome = script(
        "calibrate", images, "--camera", folder / "Kamera_é.yaml",
        "--pen", folder / "Stift_ß.csv", "--json", file,
    )  # fmt: skip
    assert outcome.returncode == 0, outcome.stderr
    frames = json.loads(file.read_text(encoding="utf-8"))["frames"]
    assert Path(frames[0]["file"]).name == "Aufnahme_写真_0001.png"


@pytest.mark.slow
def test_a_console_that_cannot_show_a_name_still_gets_the_tip(
    script: Run, shared_data: Path, tmp_path: Path
) -> None:
    source = shared_data / "fixed-point"
    images = tmp_path / "images"
    shutil.copytree(source / "images", images)
    images.chmod(0o755)
    (images / "写真.png").write_bytes(b"this is no image")
    outcome = script(
        "calibrate", images, *input_options(source),
        environment={"PYTHONIOENCODING": "cp1252"}, encoding="cp1252",
    )  # fmt: skip
    assert outcome.returncode == 0, outcome.stderr
    assert "Images       10 of 11 used" in outcome.stdout


@pytest.mark.slow
def test_nothing_but_the_result_is_written_when_piped(
    script: Run, shared_data: Path
) -> None:
    folder = shared_data / "fixed-point"
    outcome = script("calibrate", folder / "images", *input_options(folder))
    assert outcome.returncode == 0
    assert outcome.stderr == ""
    assert "\r" not in outcome.stdout
    assert "Finding LEDs" not in outcome.stdout


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo terminal")
def test_a_terminal_shows_progress(script: Run, shared_data: Path) -> None:
    import pty
    import termios

    folder = shared_data / "fixed-point"
    controller, terminal = pty.openpty()
    termios.tcsetwinsize(terminal, (24, 80))
    outcome = script(
        "calibrate", folder / "images", *input_options(folder),
        stderr=terminal,
    )  # fmt: skip
    os.close(terminal)
    with FileIO(controller) as shown:
        text = "".join(iter(lambda: read_terminal(shown), ""))
    assert outcome.returncode == 0
    assert " 100%" in text
    assert "\r" in text
    assert "Finding LEDs" not in outcome.stdout


def read_terminal(controller: FileIO) -> str:
    """Return what the terminal shows next, "" at its end."""
    try:
        return controller.read(65536).decode()
    except OSError:  # EIO: Linux says so at the end
        return ""


@pytest.mark.parametrize(
    "arguments",
    [
        "",
        "calibrate",
        "calibrate images",
        "calibrate images --camera c.yaml",
        "calibrate --camera c.yaml --pen p.csv",
        "calibrate images --centers c.csv --camera c.yaml --pen p.csv",
        "calibrate images --camera c.yaml --pen p.csv --method best",
        "calibrate images --camera c.yaml --pen p.csv --nominal-tip 1 2",
        "calibrate images --camera c.yaml --pen p.csv --nominal-tip 1 2 x",
        "pivot",
        "simulate",
        "simulate out --images many",
        "measure images",
    ],
)
def test_wrong_usage_ends_with_status_2_and_words(
    arguments: str, lightpen: Run
) -> None:
    outcome = lightpen(*arguments.split())
    assert outcome.returncode == 2
    assert outcome.stderr.strip()
    assert not outcome.stdout


@pytest.mark.parametrize(
    ("tip", "said"),
    [("nan 0 0", "tip"), ("0 inf 0", "tip"), ("1e9 0 0", "1e9 is too large a number")],
)
def test_a_nominal_tip_that_is_no_number_is_refused(
    tip: str, said: str, clean: Path, lightpen: Run
) -> None:
    outcome = lightpen(
        "calibrate", clean / "images", *input_options(clean),
        "--nominal-tip", *tip.split(),
    )  # fmt: skip
    assert outcome.returncode == 2
    assert said in outcome.stderr


@pytest.fixture(scope="module")
def tracker_file(shared_data: Path) -> Path:
    return shared_data / "pivot-poses" / "optical-tracker.csv"


def pivoted(lightpen: Run, poses: Path, *options: str) -> dict[str, Any]:
    file = poses.parent / "pivot.json"
    outcome = lightpen("pivot", poses, *options, "--json", file)
    assert outcome.returncode == 0, outcome.stderr
    fields: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return fields | {"text": outcome.stdout}


@pytest.fixture
def poses(tracker_file: Path, tmp_path: Path) -> Path:
    return Path(shutil.copy(tracker_file, tmp_path / "poses.csv"))


def test_plain_least_squares_gives_the_published_tip_and_pivot(
    lightpen: Run, poses: Path
) -> None:
    fields = pivoted(lightpen, poses, "--least-squares")
    np.testing.assert_allclose(fields["tip_pen_mm"], TRACKER_TIP, atol=1e-3)
    np.testing.assert_allclose(fields["pivot_cam_mm"], TRACKER_PIVOT, atol=1e-3)
    assert_printed([*fields["tip_pen_mm"], *fields["pivot_cam_mm"]], fields["text"])


def test_a_pivot_record_is_complete(lightpen: Run, poses: Path) -> None:
    fields = pivoted(lightpen, poses)
    covariance = np.array(fields["covariance"])
    assert covariance.shape == (6, 6)
    np.testing.assert_allclose(
        fields["expanded_uncertainty_mm"], 2 * np.sqrt(np.diag(covariance))[:3]
    )
    assert hashlib.sha256(poses.read_bytes()).hexdigest() in json.dumps(fields)
    assert len(fields["frames"]) == 1151


def written_poses(rotations: FloatArray, translations: FloatArray, file: Path) -> Path:
    """Write poses as a table without header."""
    np.savetxt(file, np.column_stack([rotations.reshape(-1, 9), translations]))
    return file


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda R, t: (np.swapaxes(R, 1, 2), t), "seem transposed"),
        (lambda R, t: (R, t / 1000), "The translations seem to be in metres:"),
        (
            lambda R, t: (R, np.random.default_rng(0).permutation(t)),
            "have no common tip",
        ),
        (
            lambda R, t: (R, t + (np.arange(len(t)) > 575)[:, None] * (R @ [0, 9, 0])),
            "From pose 577 on the tip lies elsewhere in the pen",
        ),
    ],
)
def test_poses_that_have_no_one_tip_are_refused_with_the_reason(
    spoil: Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]],
    said: str,
    lightpen: Run,
    poses: Path,
    tmp_path: Path,
) -> None:
    table = read_poses(poses)
    spoiled = spoil(table.rotations, table.translations)
    outcome = lightpen("pivot", written_poses(*spoiled, tmp_path / "spoiled.csv"))

    assert outcome.returncode == 1
    assert said in outcome.stderr
    assert not outcome.stdout


@pytest.fixture(scope="module")
def small(scene: Scene) -> Path:
    return scene("--images", "12", "--seed", "4")


def test_a_simulated_set_has_the_files_of_the_shared_sets(
    small: Path, clean: Path
) -> None:
    mark = {"SIMULATED.txt"}
    assert {p.name for p in small.iterdir()} - mark == {p.name for p in clean.iterdir()}
    names = [path.name for path in sorted((small / "images").iterdir())]
    assert names == [f"frame_{i:04d}.png" for i in range(1, 13)]
    image = cv2.imread(str(small / "images" / names[0]), cv2.IMREAD_UNCHANGED)
    assert image is not None
    assert image.shape == (2048, 2448)
    assert image.dtype == np.uint8


@pytest.mark.parametrize(
    "options",
    [
        "--images 0",
        "--images -5",
        "--seed -1",
        "--images 2.5",
        "--binning 3",
        "--cameras 0",
    ],
)
def test_a_senseless_simulation_is_refused(
    options: str, lightpen: Run, tmp_path: Path
) -> None:
    outcome = lightpen("simulate", tmp_path / "set", *options.split())
    assert outcome.returncode == 2
    assert outcome.stderr.strip()
    assert not (tmp_path / "set" / "truth.json").exists()


# The window and the output


class WitnessingDesktop:
    """Notes what is opened, or raises what goes wrong with it."""

    def __init__(self, fault: OSError | None = None) -> None:
        self.opened: list[Path | None] = []
        self._fault = fault

    def show_window(self, swing: Path | None) -> int:
        if self._fault is not None:
            raise self._fault
        self.opened.append(swing)
        return 0

    def play_demo(self) -> int:
        raise NotImplementedError

    def test_itself(self, report: Path) -> int:
        raise NotImplementedError

    def data_folder(self) -> Path:
        raise NotImplementedError


def test_what_the_window_cannot_read_is_not_taken_for_output_that_fails() -> None:
    desktop = WitnessingDesktop(FileNotFoundError("a font"))

    with pytest.raises(FileNotFoundError, match="a font"):
        main([], desktop)


@pytest.mark.parametrize("words", [["open", "{0}"], ["{0}"]])
def test_a_file_alone_is_opened_in_the_window(tmp_path: Path, words: list[str]) -> None:
    file = tmp_path / "swing.lightpen"
    file.touch()
    desktop = WitnessingDesktop()

    assert main([word.format(file) for word in words], desktop) == 0
    assert desktop.opened == [file]


def test_the_menu_opens_the_window_without_a_file() -> None:
    desktop = WitnessingDesktop()

    assert main(["open"], desktop) == 0
    assert desktop.opened == [None]


@pytest.mark.parametrize("name", ["no/such.lightpen", "such.lightpen", "/tip.json"])
@pytest.mark.parametrize("command", [(), ("open",)])
def test_a_file_that_is_missing_is_named(
    name: str, command: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*command, name], desktop := WitnessingDesktop()) == 2
    assert f"The file {name} does not exist." in capsys.readouterr().err
    assert desktop.opened == []


def test_a_name_that_cannot_be_looked_up_is_no_mistake_of_the_program() -> None:
    name = 300 * "x"  # no system has names so long
    with suppress(SystemExit):
        assert main([name], desktop := WitnessingDesktop()) == 0
        assert desktop.opened == [Path(name)]


def test_a_word_that_is_neither_command_nor_file_is_refused(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["calibrte"], WitnessingDesktop())

    assert "invalid choice: 'calibrte'" in capsys.readouterr().err


def test_output_that_fails_is_reported_even_without_a_standard_output(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("lightpen.commands.pen.write_pen", fail)
    monkeypatch.setattr("lightpen.commands.pen.read_raw_pen", lambda *_: None)
    monkeypatch.setattr("sys.stdout", None)

    assert main(["pen", "in.csv", "out.csv"]) == 2


def test_verbose_prints_the_log_of_a_command_or_its_action(lightpen: Run) -> None:
    for words in (["-v", "archive", "list"], ["archive", "list", "--verbose"]):
        outcome = lightpen(*words)

        assert f"lightpen.cli: lightpen {__version__} started with" in outcome.stderr
        assert "ERROR" in outcome.stderr
        assert "archive.missing: The archive " in outcome.stderr
        assert "ended with status 2" in outcome.stderr


def test_a_command_logs_to_a_data_folder_that_is_there(
    lightpen: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = tmp_path / "data"
    monkeypatch.setattr("lightpen.cli.usual_data_folder", lambda: data)

    assert "INFO" not in lightpen("archive", "list").stderr
    assert not data.exists()

    data.mkdir()
    lightpen("archive", "list", "--log-level", "Error")

    (line,) = log_file(data).read_text("utf-8").splitlines()
    assert "archive.missing" in line


def test_what_is_no_level_of_the_log_is_refused(
    lightpen: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    refused = lightpen("archive", "list", "--log-level", "loud")
    monkeypatch.setenv("LIGHTPEN_LOG_LEVEL", "loud")
    refused_too = lightpen("archive", "list")

    assert (refused.returncode, refused_too.returncode) == (2, 2)
    assert "argument --log-level: invalid choice: 'loud'" in refused.stderr
    assert refused_too.stderr == (
        "lightpen: LIGHTPEN_LOG_LEVEL is loud, which is not a log level. "
        "Set it to one of: debug, info, warning, error.\n"
    )
