"""Each choice of a source has its camera, which goes by the surroundings' clock."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lightpen.cameras.pairing import MachineClock
from lightpen.cameras.protocol import CameraSettings, DeviceNotFound
from lightpen.detection.pen_detection import detect_pen
from lightpen.live.sources import SourceEnvironment, cameras_of
from lightpen.record.swings.reading import open_record
from lightpen.swing.preparation import SourceChoice, SourceKind
from lightpen_extensions.simulator.camera import SimulatedCamera, SkippingClock
from lightpen_extensions.simulator.scenes import Scene, beside
from lightpen_extensions.simulator.simulator import SceneSimulator

SCENE = Scene(seed=7)


@pytest.fixture
def around() -> SourceEnvironment:
    return SourceEnvironment(SceneSimulator(SCENE), SkippingClock())


def test_usually_the_simulated_pen_is_seen_in_real_time() -> None:
    around = SourceEnvironment(SceneSimulator())

    assert isinstance(around.clock, MachineClock)
    assert cameras_of([SourceChoice()], around)[0].serial == "SIM-1"


def test_the_simulated_camera_shows_the_scene_of_the_surroundings(
    around: SourceEnvironment,
) -> None:
    camera = cameras_of([SourceChoice(SourceKind.SIMULATED)], around)[0]

    assert isinstance(camera, SimulatedCamera)
    assert camera.scene is SCENE


def test_a_record_is_played_from_end_to_end_again_and_again(
    around: SourceEnvironment, swung: Callable[..., Path]
) -> None:
    n_images = len(open_record(swung()).images)
    camera = cameras_of([SourceChoice(SourceKind.RECORDED, str(swung()))], around)[0]
    camera.open()
    camera.configure(CameraSettings(frame_rate=math.inf))
    camera.start()
    frames = [camera.read(1.0) for _ in range(n_images + 1)]

    assert camera.caps.n_images == n_images
    assert (frames[0].image == frames[-1].image).all()
    assert around.clock.now_ns() == 0
    camera.close()


def test_a_recording_waits_by_the_clock_of_the_surroundings(
    around: SourceEnvironment, swung: Callable[..., Path]
) -> None:
    camera = cameras_of([SourceChoice(SourceKind.RECORDED, str(swung()))], around)[0]
    camera.open()
    camera.start()
    for _ in range(3):
        camera.read(1.0)

    assert around.clock.now_ns() == pytest.approx(2 * 0.05e9)
    camera.close()


def test_a_recording_that_is_not_there_is_found_missing_when_it_is_opened(
    around: SourceEnvironment, tmp_path: Path
) -> None:
    choice = SourceChoice(SourceKind.RECORDED, str(tmp_path / "gone"))
    camera = cameras_of([choice], around)[0]
    with pytest.raises(DeviceNotFound, match="no folder, video or image at"):
        camera.open()


def test_two_simulated_cameras_see_one_pen_from_two_places(
    around: SourceEnvironment,
) -> None:
    first, second = cameras_of([SourceChoice(), SourceChoice()], around)
    assert isinstance(first, SimulatedCamera)
    assert isinstance(second, SimulatedCamera)
    assert first.operator is second.operator
    assert first.serial != second.serial
    first.operator.seat()
    around.clock.wait(6.0)  # until the pen is there
    images = []
    for camera in (first, second):
        camera.open()
        camera.start()
        images.append(camera.read(1.0).image)
    rig = beside(SCENE.camera, SCENE.cone_cam)
    pen, tip, cone = SCENE.pen, SCENE.tip_pen, SCENE.cone_cam
    seen = [
        detect_pen(image, camera, pen)
        for image, camera in zip(images, rig.cameras, strict=True)
    ]
    assert all(detection.has_pose for detection in seen)
    in_second = seen[1].rotation @ tip + seen[1].translation
    back = rig.rotations[1].T @ (in_second - rig.translations[1])
    np.testing.assert_allclose(
        back, seen[0].rotation @ tip + seen[0].translation, atol=1.0
    )
    assert np.linalg.norm(back - cone) < 100
