"""A swing before two cameras: both images of each moment are kept and solved."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from lightpen.cameras.protocol import CameraSettings, sealed
from lightpen.detection.pen_detection import PenDetection, detect_pen
from lightpen.errors import FileError
from lightpen.formats.decoding import decode_image
from lightpen.formats.own_json import with_checksum
from lightpen.formats.rig_files import read_rig
from lightpen.record.swings.reading import open_record
from lightpen.record.swings.solving import source
from lightpen.swing.preparation import MissingInput, SourceChoice, SourceKind
from lightpen.swing.swing_recorder import read_resumable
from lightpen_extensions.simulator.camera import SimulatedCamera
from lightpen_extensions.simulator.scene_files import write_sample_files

if TYPE_CHECKING:
    from tests.core.conftest import Station

N_IMAGES = 14
FRAME_RATE = 6.0  # 1/s, of the station
Command = Callable[[Path], dict[str, Any]]


@pytest.fixture
def by_two(station: "Station", swung: Callable[..., Path]) -> Path:
    """An interrupted swing before two cameras among the records."""
    folder = station.records / "interrupted"
    shutil.copytree(swung(N_IMAGES, by_two=True), folder)
    return folder


def test_both_images_of_a_moment_are_recorded_with_what_they_show(by_two: Path) -> None:
    record = open_record(by_two)
    found = source(record)

    assert found.rig is not None
    assert found.rig.names == ("left", "right")
    assert record.header.cameras[1].source == "simulated"
    for image in record.images:
        (other,) = image.others
        assert image.device_time_ns == other.device_time_ns
        own, others = image.rig_pixels
        assert np.isfinite(own).all(axis=1).sum() >= 6
        assert np.isfinite(others).all(axis=1).sum() >= 6
        assert not np.allclose(own, others, atol=1)
    data = (by_two / "images-2/000001.png").read_bytes()
    assert decode_image(data, "it").shape == (1024, 1224)


@pytest.mark.slow
def test_running_fit_and_solution_are_of_both_cameras(
    station: "Station", by_two: Path, command: Command
) -> None:
    station.go_on(by_two)
    running = station.state.kept
    station.solve()
    calibration = station.solution.calibration
    U = calibration.budget.expanded_uncertainty[:3]

    assert calibration.bundle.state.rig.n_cameras == 2
    assert (
        np.abs(np.array(station.tip) - station.camera.scene.tip_pen) < 1.5 * U
    ).all()
    assert running.joint is not None
    np.testing.assert_allclose(running.joint.tip_pen, station.tip, atol=U.max())
    reached = running.predicted.uncertainty
    assert reached == pytest.approx(calibration.budget.weakest_uncertainty, rel=0.35)

    again = command(by_two)
    assert again["tip_pen_mm"] == station.tip
    assert [each["name"] for each in again["rig"]["cameras"]] == ["left", "right"]
    files = [Path(each["file"]).name for each in again["inputs"]["cameras"]]
    assert files == ["camera.yaml", "camera-2.yaml"]
    assert len(again["inputs"]["observations"]) == 2 * N_IMAGES

    station.runner.ask(lambda workflow: workflow.solving.exclude([3]))
    station.wait_until(
        lambda: not station.status.is_solving and 3 in station.solution.excluded
    )
    for images in station.solution.calibration.cameras:
        assert not images.used[2]


def capture_more(
    station: "Station", folder: Path, n_more: int, *, is_first_blind: bool = False
) -> None:
    """Go on with a swing before two cameras until it has so many more images."""
    setup = read_resumable(folder).setup
    second = SimulatedCamera(
        *(station.camera.scene, station.clock, station.operator), rig=setup.rig
    )
    second.open()
    second.configure(CameraSettings(frame_rate=FRAME_RATE))
    second.start()
    station.go_on(folder)
    last: list[PenDetection | None] = [None, None]
    n_wanted = station.state.n_kept + n_more
    while station.state.n_kept < n_wanted:
        first, other = station.camera.read(1.0), second.read(1.0)
        if is_first_blind:
            first = replace(first, image=sealed(np.zeros_like(first.image)))
        last = [
            detect_pen(frame.image, camera, setup.pen, before=before)
            for frame, camera, before in zip(
                (first, other), setup.rig.cameras, last, strict=True
            )
        ]
        detection, beside = last
        assert detection is not None
        assert beside is not None
        station.runner.process_image(
            replace(first, others=(other,)),
            replace(detection, others=(beside,)),
            station.status.setup,
        )


@pytest.mark.slow
def test_moments_that_only_the_second_camera_shows_count_live_and_on_files(
    station: "Station", by_two: Path
) -> None:
    capture_more(station, by_two, 3, is_first_blind=True)
    live = station.state.kept
    again = read_resumable(by_two).state.kept
    for kept in (live, again):
        assert len(kept) == N_IMAGES + 3
        assert np.isnan(kept.pixels[-3:, 0]).all()
        assert kept.joint is not None
        assert kept.joint.used[-3:].any(axis=1).all()
    np.testing.assert_allclose(again.rotations, live.rotations, atol=1e-3)
    np.testing.assert_allclose(again.translations, live.translations, atol=0.3)

    station.solve()
    first, second = station.solution.calibration.cameras
    assert not first.used[-3:].any()
    assert second.used[-3:].all()


@pytest.mark.slow
def test_an_interrupted_swing_goes_on_with_both_cameras(
    station: "Station", by_two: Path
) -> None:
    swing = read_resumable(by_two)
    one = SourceChoice(SourceKind.SIMULATED)
    assert swing.is_of([one, one])
    assert swing.source_choices == (one, one)
    assert not swing.is_of([one])

    capture_more(station, by_two, 1)
    newest = open_record(by_two).images[-1]
    assert newest.number == N_IMAGES + 1
    assert len(newest.others) == 1


def test_a_lost_image_of_the_second_camera_costs_that_image_alone(
    station: "Station", by_two: Path
) -> None:
    (by_two / "images-2/000003.png").unlink()
    station.go_on(by_two)
    station.solve()
    first, second = station.solution.calibration.cameras
    assert first.used[2]
    assert not second.used[2]


def test_a_copy_of_the_rig_that_was_changed_is_reported(by_two: Path) -> None:
    file = by_two / "rig.json"
    file.write_bytes(file.read_bytes() + b" ")
    with pytest.raises(
        FileError, match=r"was modified after recording \(wrong checksum\)."
    ):
        open_record(by_two)


def test_a_line_without_what_the_second_camera_saw_is_damage(by_two: Path) -> None:
    file = by_two / "journal.jsonl"
    line, *others = file.read_bytes().splitlines()
    entries = json.loads(line)
    del entries["others"], entries["checksum"]
    short = with_checksum(json.dumps(entries).encode())
    file.write_bytes(b"\n".join([short, *others, b""]))
    with pytest.raises(FileError, match=r"Line 1 of .* is damaged"):
        open_record(by_two)


def test_what_a_second_camera_lacks_is_said_step_by_step(
    station: "Station", tmp_path: Path
) -> None:
    prepared = station.preparation
    assert not prepared.camera_missing_inputs()
    without = prepared.with_second(SourceChoice("aravis"))
    assert without.camera_missing_inputs() == (
        MissingInput.SECOND_DEVICE,
        MissingInput.RIG_FILE,
    )
    there = without.with_second(SourceChoice("aravis", "127.0.0.1"))
    assert there.camera_missing_inputs() == (
        MissingInput.SECOND_IMAGES,
        MissingInput.RIG_FILE,
    )
    files = write_sample_files(station.camera.scene, tmp_path)
    rig_file = read_rig(files.rig)
    whole = there.with_rig(rig_file)
    assert whole.second is not None
    size = rig_file.rig.cameras[1].image_size
    small = replace(whole, second=replace(whole.second, image_size=(10, 10)))
    assert small.camera_missing_inputs() == (MissingInput.SECOND_IMAGE_SIZE,)
    ready = replace(whole, second=replace(whole.second, image_size=size))
    assert not ready.camera_missing_inputs()
    assert not ready.swings_like(prepared)
