import numpy as np
import pytest
from tests.faulty_camera import FaultyCamera
from tests.simulated_lights import Lamp

from lightpen.cameras.protocol import CameraSettings, Frame
from lightpen.detection.observations import Observations, observe_images
from lightpen.detection.pose import fit_poses
from lightpen.estimation.calibrate import calibrate
from lightpen.formats.images import ImageSource
from lightpen.model.camera import Camera
from lightpen_extensions.simulator.camera import SimulatedCamera, SkippingClock
from lightpen_extensions.simulator.hand import SimulatedOperator
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import PAPER_CONE, PAPER_TIP

SMALL = Camera(width=612, height=512, fx=1160, fy=1160, cx=305, cy=258)
SCENE = Scene(camera=SMALL)


class LateClock(SkippingClock):
    """A clock for which reading late is possible, as with a real one."""

    is_real = True


def seated_camera(
    scene: Scene = SCENE,
    clock: SkippingClock | None = None,
    others: tuple[Lamp, ...] = (),
) -> FaultyCamera:
    clock = clock or SkippingClock()
    operator = SimulatedOperator(clock, scene.seed, seated=True)
    camera = FaultyCamera(scene, clock, operator, others=others)
    camera.open()
    return camera


def streaming_camera(
    scene: Scene = SCENE,
    clock: SkippingClock | None = None,
    others: tuple[Lamp, ...] = (),
) -> FaultyCamera:
    camera = seated_camera(scene, clock, others)
    camera.start()
    return camera


def read(camera: SimulatedCamera, n_frames: int) -> list[Frame]:
    return [camera.read(1.0) for _ in range(n_frames)]


def observe(scene: Scene, frames: list[Frame]) -> Observations:
    loaders = [lambda image=frame.image: image for frame in frames]
    names = tuple(str(frame.seq) for frame in frames)
    source = ImageSource(names, (), lambda: iter(loaders))
    return observe_images(source, scene.camera, scene.pen, n_threads=1)


def led_level(frame: Frame) -> float:
    """Return the level of the brighter LEDs, fraction of full scale."""
    levels = frame.image / frame.full_scale
    return float(np.quantile(levels[levels > 0.1], 0.8))


def play(camera: FaultyCamera) -> list[Frame]:
    camera.operator.swing()
    frames = read(camera, 20)
    camera.operator.slip(0.5, 0.5)
    camera.set_exposure(700)
    return frames + read(camera, 20)


def test_the_same_commands_at_the_same_times_give_the_same_images() -> None:
    for one, other in zip(
        play(streaming_camera()), play(streaming_camera()), strict=True
    ):
        np.testing.assert_array_equal(one.image, other.image)
        assert one.host_ts_ns == other.host_ts_ns


def test_a_live_swing_calibrates_to_the_true_tip() -> None:
    scene = Scene(seed=3)
    camera = seated_camera(scene)
    camera.configure(CameraSettings(frame_rate=2.5))  # so that each leans elsewhere
    camera.start()
    camera.operator.swing()
    frames = read(camera, 30)
    calibration = calibrate(scene.camera, scene.pen, observe(scene, frames))

    assert calibration.used.all()
    # 30 images at 0.01 px fix the tip to some 3 um; blur by the movement adds to that.
    np.testing.assert_allclose(calibration.joint.tip_pen, PAPER_TIP, atol=0.015)


def test_a_slip_is_in_the_images() -> None:
    scene = Scene()
    camera = streaming_camera(scene)
    (seated,) = read(camera, 1)
    camera.operator.slip(2.0, 1.0)
    slipped = read(camera, 10)[-1]
    seen = observe(scene, [seated, slipped])
    poses = fit_poses(
        scene.camera, scene.pen, seen.pixels, seen.rotations, seen.translations
    )
    tips = poses.rotations @ PAPER_TIP + poses.translations
    distances = np.linalg.norm(tips - PAPER_CONE, axis=1)

    # One image fixes the depth of the tip to some 0.1 mm.
    np.testing.assert_allclose(distances, [0, 2], atol=0.3)


def test_images_come_at_the_frame_rate() -> None:
    clock = SkippingClock()
    camera = streaming_camera(clock=clock)
    camera.stop()
    camera.configure(CameraSettings(frame_rate=25))
    camera.start()
    frames = read(camera, 5)

    np.testing.assert_allclose(
        np.diff([frame.host_ts_ns for frame in frames]), 40e6, atol=10
    )


def test_a_quarter_of_the_images_is_made_while_none_is_displayed() -> None:
    clock = SkippingClock()
    camera = streaming_camera(clock=clock)
    read(camera, 1)
    camera.is_seen = False
    frames = read(camera, 4)

    np.testing.assert_allclose(
        np.diff([frame.host_ts_ns for frame in frames[1:]]), 200e6, atol=10
    )


def test_an_exposure_longer_than_the_period_slows_the_camera() -> None:
    camera = seated_camera()
    camera.configure(CameraSettings(exposure_us=40_000, frame_rate=100))
    camera.start()
    frames = read(camera, 3)

    np.testing.assert_allclose(
        np.diff([frame.host_ts_ns for frame in frames]), 40e6, atol=10
    )


def test_twice_the_exposure_gives_twice_the_light() -> None:
    camera = streaming_camera()
    levels = []
    for exposure_us in (300, 600):
        camera.set_exposure(exposure_us)
        levels.append(led_level(read(camera, 1)[0]))

    assert levels[1] == pytest.approx(2 * levels[0], rel=0.04)  # in steps of 1/255


def test_gain_makes_up_for_exposure_but_adds_noise() -> None:
    camera = streaming_camera()
    frames = []
    for exposure_us, gain_db in ((1000, 0.0), (250, 12.0)):
        camera.set_exposure(exposure_us)
        camera.set_gain(gain_db)
        frames.append(read(camera, 1)[0])
    long, short = frames

    assert led_level(short) == pytest.approx(led_level(long), rel=0.02)
    noise = [np.std(frame.image[:50].astype(float)) for frame in (long, short)]
    # Read noise of 0.18 steps of 1/255 is rounded away, four times that is not.
    assert noise[1] > 2 * noise[0]


def test_twelve_bits_come_in_sixteen() -> None:
    camera = seated_camera()
    camera.configure(CameraSettings(pixel_format="Mono12"))
    camera.start()
    (frame,) = read(camera, 1)

    assert frame.image.dtype == np.uint16
    assert frame.bits == 12
    assert 255 < frame.image.max() < 4096


def test_covered_leds_are_dark_and_foreign_lights_stay() -> None:
    lamp = Lamp(np.array([80.0, 60.0]), (6.0, 5.0))
    camera = streaming_camera(others=(lamp,))
    (before,) = read(camera, 1)
    camera.operator.cover()
    after = read(camera, 2)[-1]

    assert np.count_nonzero(before.image > 100) > 5 * np.count_nonzero(
        after.image > 100
    )
    left = np.argwhere(after.image > 100)
    np.testing.assert_allclose(left.mean(axis=0), lamp.center[::-1], atol=0.5)


def test_an_absent_pen_leaves_the_image_dark() -> None:
    camera = FaultyCamera(SCENE, SkippingClock())
    camera.open()
    camera.start()
    assert read(camera, 1)[0].image.max() < 10


@pytest.mark.parametrize(("n_late", "n_lost"), [(1, 0), (16, 0), (17, 1), (21, 5)])
def test_a_live_camera_loses_images_when_more_wait_than_it_buffers(
    n_late: int, n_lost: int
) -> None:
    clock = LateClock()
    camera = streaming_camera(clock=clock)
    (before,) = read(camera, 1)
    clock.wait((n_late + 0.5) * 0.05)
    (after,) = read(camera, 1)

    assert after.seq == before.seq + 1 + n_lost
    assert camera.stats().missed == n_lost


def test_a_simulated_camera_loses_no_images_on_a_busy_computer() -> None:
    clock = LateClock()
    camera = SimulatedCamera(SCENE, clock)
    camera.open()
    camera.start()
    (before,) = read(camera, 1)
    clock.wait(100.0)
    (after,) = read(camera, 1)

    assert after.seq == before.seq + 1
    assert after.host_ts_ns - before.host_ts_ns > 99e9
    assert camera.stats().missed == 0
