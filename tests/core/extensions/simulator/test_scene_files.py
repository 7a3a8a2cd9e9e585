import json
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from tests.simulated_disturbances import (
    Disturbances,
    flags_of,
    hidden_fractions,
    plan_disturbed,
    write_disturbed,
)

from lightpen.arrays import Image
from lightpen.errors import Cancelled, FileError
from lightpen.formats.camera_files import read_camera
from lightpen.formats.pen_files import read_pen
from lightpen.model.camera import Camera
from lightpen.model.rigid import fit_rigid
from lightpen_extensions.simulator.image_plans import plan_scene
from lightpen_extensions.simulator.render import render_view
from lightpen_extensions.simulator.scene_files import (
    scene_truth,
    write_rig_scene,
    write_scene,
)
from lightpen_extensions.simulator.scenes import Scene, Sensor, beside
from lightpen_extensions.simulator.swings import PAPER_CONE, PAPER_TIP, paper_camera


def quarter_camera() -> Camera:
    """A camera of 612 x 512 pixels with the paper's field of view."""
    full = paper_camera()
    return replace(
        full,
        width=full.width // 4,
        height=full.height // 4,
        fx=full.fx / 4,
        fy=full.fy / 4,
        cx=(full.cx + 0.5) / 4 - 0.5,
        cy=(full.cy + 0.5) / 4 - 0.5,
    )


SMALL = Scene(n_images=3, seed=5, camera=quarter_camera())


def read_png(path: Path) -> Image:
    image = cv2.imdecode(np.frombuffer(path.read_bytes(), np.uint8), -1)
    assert image is not None
    return image  # type: ignore[return-value]


def read_truth(folder: Path) -> Any:
    return json.loads((folder / "truth.json").read_text())


def test_set_holds_camera_pen_images_and_truth(tmp_path: Path) -> None:
    folder = tmp_path / "Schwünge 摆"
    write_scene(SMALL, folder)
    camera = read_camera(folder / "camera.yaml")
    np.testing.assert_array_equal(camera.intrinsics, SMALL.camera.intrinsics)
    plan = plan_scene(SMALL)
    pen = read_pen(folder / "leds.csv")
    np.testing.assert_array_equal(pen.leds, plan.measured_pen.leds)
    names = sorted(path.name for path in (folder / "images").iterdir())
    assert names == ["frame_0001.png", "frame_0002.png", "frame_0003.png"]
    image = read_png(folder / "images/frame_0002.png")
    assert image.shape == (512, 612)
    image_plan = plan.image_plans[1]
    light = render_view(SMALL.camera, SMALL.pen, image_plan.view, image_plan.optics)
    difference = image - 255.0 * light.levels
    # Shot noise of a bright pixel is 2.3 DN.
    assert np.abs(difference).max() < 14
    truth = read_truth(folder)
    assert truth["set"] == folder.name
    assert [frame["file"] for frame in truth["frames"]] == [
        f"images/{n}" for n in names
    ]


def test_same_scene_writes_the_same_bytes(tmp_path: Path) -> None:
    scene = replace(SMALL, n_images=6)
    for name in ("one/set", "two/set"):
        write_disturbed(scene, tmp_path / name)
    files = sorted(path for path in (tmp_path / "one").rglob("*") if path.is_file())
    assert len(files) == 10  # images, two files, the truth, the mark
    for path in files:
        twin = tmp_path / "two" / path.relative_to(tmp_path / "one")
        assert path.read_bytes() == twin.read_bytes()


@pytest.mark.parametrize(("bits", "top"), [(12, 4095), (16, 65535)])
def test_more_bits_are_written_as_16_bit_images(
    tmp_path: Path, bits: int, top: int
) -> None:
    sensor = Sensor(bits=bits)  # type: ignore[arg-type]
    write_scene(replace(SMALL, n_images=1, sensor=sensor), tmp_path)
    image = read_png(tmp_path / "images/frame_0001.png")
    assert image.dtype == np.uint16
    assert 0.6 * top < image.max() < 0.9 * top


def test_truth_brings_the_tip_into_the_measured_frame() -> None:
    scene = replace(SMALL, led_noise=0.05)
    plan = plan_scene(scene)
    pen = scene_truth(plan)["pen"]
    R, t = fit_rigid(scene.pen.leds, plan.measured_pen.leds)
    np.testing.assert_allclose(
        pen["tip_in_leds_csv_frame_bestfit"], R @ PAPER_TIP + t, atol=1e-12
    )
    assert 0.001 < np.linalg.norm(R @ PAPER_TIP + t - PAPER_TIP) < 0.5


def test_truth_of_slipped_frames_says_where_the_tip_was() -> None:
    plan = plan_disturbed(replace(SMALL, n_images=8), Disturbances(slipped=0.5))
    frames = scene_truth(plan)["frames"]
    for frame, image_plan in zip(frames, plan.image_plans, strict=True):
        at = np.array(frame["R"]) @ PAPER_TIP + frame["T"]
        np.testing.assert_allclose(at, frame["tip_cam"], atol=1e-9)
        in_cone = np.allclose(frame["tip_cam"], PAPER_CONE, atol=1e-9)
        assert (
            frame["tip_in_cone"] == in_cone == ("slipped" not in flags_of(image_plan))
        )
    assert sum(frame["tip_in_cone"] for frame in frames) == 4


def test_truth_of_hidden_missing_and_saturated_leds() -> None:
    scene = replace(SMALL, n_images=12)
    wanted = Disturbances(fingers=1.0, missing=0.5, saturated=0.5)
    plan = plan_disturbed(scene, wanted)
    n_hidden = 0
    for frame, image_plan in zip(
        scene_truth(plan)["frames"], plan.image_plans, strict=True
    ):
        light = render_view(scene.camera, scene.pen, image_plan.view, image_plan.optics)
        shares = hidden_fractions(scene, image_plan)
        gains = image_plan.view.gains
        for led, gain, hidden in zip(frame["leds"], gains, shares, strict=True):
            x, y = np.rint(led["proj"]).astype(int)
            level = light.levels[y, x]
            n_hidden += hidden > 0.05
            assert led["visible"] == (gain > 0)
            if hidden == 0:
                assert led["saturated"] == (level >= 1)
                assert (level > 0.3) == led["visible"]
            if hidden == 1:
                assert level < 0.1
    assert n_hidden >= 6


@pytest.mark.parametrize("name", ["camera.yaml", "leds.csv", "notes.txt"])
def test_nothing_is_written_into_a_folder_that_holds_something(
    tmp_path: Path, name: str
) -> None:
    """A real file in it would be taken for a simulated one by the mark beside it."""
    (tmp_path / name).write_text("real")
    with pytest.raises(FileError, match=f"not empty: it contains {name}"):
        write_scene(SMALL, tmp_path)
    assert [path.read_text() for path in tmp_path.iterdir()] == ["real"]


@pytest.mark.parametrize("n_images", [1, 2])
def test_a_set_is_not_written_over_nor_mixed_with_another(
    tmp_path: Path, n_images: int
) -> None:
    folder = tmp_path / "set"
    write_scene(replace(SMALL, n_images=1), folder)
    before = {path: path.read_bytes() for path in folder.rglob("*.*")}
    other = replace(SMALL, n_images=n_images, seed=6)
    rig = beside(SMALL.camera, PAPER_CONE)
    for write in (partial(write_scene, other), partial(write_rig_scene, other, rig)):
        with pytest.raises(FileError, match="nothing is overwritten"):
            write(folder)
    assert {path: path.read_bytes() for path in folder.rglob("*.*")} == before


def test_folder_that_is_a_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "set"
    path.write_text("something")
    with pytest.raises(FileError, match=r"not a folder|a file of that name"):
        write_scene(SMALL, path)
    assert path.read_text() == "something"


def test_progress_runs_to_one_and_can_stop_the_writing(tmp_path: Path) -> None:
    fractions: list[float] = []
    write_scene(SMALL, tmp_path / "all", fractions.append)
    np.testing.assert_allclose(fractions, [1 / 3, 2 / 3, 1])

    def stop(fraction: float) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        write_scene(SMALL, tmp_path / "some", stop)
    assert not (tmp_path / "some/truth.json").exists()
