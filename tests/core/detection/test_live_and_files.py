"""Live images and files go by one rule: what is refused, and why, is the same."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import cv2
import numpy as np
import pytest
from tests.simulated_disturbances import HARD, Finger, Glare, plan_disturbed
from tests.simulated_lights import Backlight, Defocus, Lamp
from tests.simulated_pens import six_led_pen
from tests.simulated_plans import live_plan

from lightpen.arrays import FloatArray, Image
from lightpen.cameras.replay import ReplayCamera
from lightpen.detection.observations import Observations, observe_images
from lightpen.detection.pen_detection import (
    PenDetection,
    detect_from_centers,
    detect_pen,
)
from lightpen.detection.reasons import Reason
from lightpen.errors import CalibrationError
from lightpen.formats.images import ImageSource
from lightpen.model.ellipse import disc_images, ellipse_centers
from lightpen.model.pen import Pen
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.image_plans import ImagePlan, render_plan
from lightpen_extensions.simulator.render import OtherLight
from lightpen_extensions.simulator.scenes import Scene, Sensor
from lightpen_extensions.simulator.swings import flat_pen, leds_in_camera

SCENE = Scene()
CAMERA, PEN = SCENE.camera, SCENE.pen
SHOT = live_plan(SCENE, 0, 1.0)
DISCS = disc_images(
    CAMERA, *leds_in_camera(PEN, SHOT.rotation, SHOT.translation), PEN.diameter / 2
)
RADIUS = 20.0  # px, of the discs
AWAY = np.array([1e4, 0.0])  # px, out of the image
# Of a start that is not sure, which the image before may settle.
UNSURE = (Reason.BLURRED, Reason.NOT_THE_PEN, Reason.AMBIGUOUS)


def shown(shot: ImagePlan = SHOT, scene: Scene = SCENE) -> Image:
    return render_plan(scene, shot)


def with_others(shot: ImagePlan, *others: OtherLight) -> ImagePlan:
    return replace(shot, view=replace(shot.view, others=others))


def blurred(radius: float, shot: ImagePlan = SHOT) -> Image:
    return shown(with_others(shot, *shot.view.others, Defocus(radius)))


def exposed(times: float) -> Image:
    return shown(replace(SHOT, optics=replace(SHOT.optics, exposure=times)))


def backlit(background: float, shot: ImagePlan = SHOT) -> Image:
    gradient = (0.4 * background, 0.2 * background)
    return shown(with_others(shot, Backlight(background, gradient)))


def tiny(diameter: float) -> Image:
    """Return LEDs of some 2 px."""
    sharp = replace(SHOT, optics=replace(SHOT.optics, psf_sigma=0.6))
    return shown(sharp, replace(SCENE, pen=replace(PEN, diameter=diameter)))


def streaked() -> Image:
    """Return what a pen leaves that moves by far more than its discs."""
    return np.asarray(cv2.blur(shown(), (1, 401)), dtype=np.uint8)


def lit(*leds: int) -> ImagePlan:
    gains = np.zeros(PEN.n_leds)
    gains[list(leds)] = 1.0
    return replace(SHOT, view=replace(SHOT.view, gains=gains))


def merged(n_leds: int) -> ImagePlan:
    """Return the pen with a small light at the rim of so many LEDs."""
    places = DISCS.centers[:n_leds] - np.array([0.0, RADIUS])
    return lamplit(*places, radius=5.0)


def covered(start: FloatArray, radius: float) -> ImagePlan:
    """Return the pen with a finger before it, from there to the right."""
    return with_others(SHOT, Finger(start, start + AWAY, radius))


def lamplit(
    *places: FloatArray, radius: float = RADIUS, shot: ImagePlan = SHOT
) -> ImagePlan:
    return with_others(shot, *(Lamp(place, (radius, radius)) for place in places))


def moved(right: float) -> ImagePlan:
    """Return the pen moved to the right in the image, px."""
    shift = np.array([right * SHOT.translation[2] / CAMERA.fx, 0.0, 0.0])
    view = replace(SHOT.view, translations=SHOT.view.translations + shift)
    return replace(SHOT, view=view)


def of_pen(pen: Pen, defocus: float = 0.0) -> Image:
    scene = replace(SCENE, pen=pen)
    shot = live_plan(scene, 0, 1.0)
    return shown(with_others(shot, Defocus(defocus)) if defocus else shot, scene)


def of_depth(sensor: Sensor) -> Image:
    return shown(scene=replace(SCENE, sensor=sensor))


def in_motion(exposure_time: float) -> Image:
    return shown(live_plan(SCENE, 0, 1.0, exposure_time))


def strewn_lamps() -> list[FloatArray]:
    rng = np.random.default_rng(2)
    return [np.array([100.0 + 150 * i, rng.uniform(100, 500)]) for i in range(8)]


def window() -> ImagePlan:
    corners = np.array([[100.0, 100], [400, 150], [380, 900], [90, 800]])
    return with_others(SHOT, Glare(corners, 1.2))


FEW = (0, 2, 4, 6)
SCENES: dict[str, tuple[Callable[[], Image], Reason]] = {
    "clean": (shown, Reason.NONE),
    "12 bit": (partial(of_depth, Sensor(bits=12)), Reason.NONE),
    "16 bit": (partial(of_depth, Sensor(bits=16)), Reason.NONE),
    "slipped": (lambda: shown(moved(30.0)), Reason.NONE),
    "dim": (partial(exposed, 0.1), Reason.NONE),
    "too dim": (partial(exposed, 0.01), Reason.EMPTY),
    "saturated": (partial(exposed, 5.0), Reason.NONE),
    "bright background": (partial(backlit, 0.2), Reason.NONE),
    "noise only": (
        lambda: np.random.default_rng(8).integers(0, 40, (2048, 2448), dtype=np.uint8),
        Reason.EMPTY,
    ),
    "LEDs off": (lambda: shown(lit()), Reason.EMPTY),
    "LEDs off before a bright background": (lambda: backlit(0.05, lit()), Reason.EMPTY),
    "six LEDs lit": (lambda: shown(lit(0, 1, 2, 3, 4, 5)), Reason.NONE),
    "five LEDs lit": (lambda: shown(lit(*FEW, 8)), Reason.NONE),
    "four LEDs lit": (lambda: shown(lit(*FEW)), Reason.TOO_FEW_LEDS),
    "one LED merged": (lambda: shown(merged(1)), Reason.NONE),
    "four LEDs whole": (lambda: shown(merged(6)), Reason.NONE),
    "three LEDs whole": (lambda: shown(merged(7)), Reason.TOO_FEW_LEDS),
    "no LED whole": (lambda: shown(merged(10)), Reason.TOO_FEW_LEDS),
    "seven LEDs inside": (lambda: shown(moved(-1330.0)), Reason.NONE),
    "LEDs cut": (lambda: shown(moved(-1360.0)), Reason.NOT_THE_PEN),
    "three LEDs inside": (lambda: shown(moved(-1500.0)), Reason.TOO_FEW_LEDS),
    "finger": (
        lambda: shown(covered(DISCS.centers[2] + RADIUS / 2, RADIUS)),
        Reason.NONE,
    ),
    "hand": (lambda: shown(covered(DISCS.centers[2], 300.0)), Reason.TOO_FEW_LEDS),
    "out of focus": (partial(blurred, 4.0), Reason.NONE),
    "far out of focus": (partial(blurred, 30.0), Reason.BLURRED),
    "few and out of focus": (lambda: blurred(8.0, lit(*FEW)), Reason.BLURRED),
    "merged by defocus": (lambda: blurred(8.0, merged(7)), Reason.BLURRED),
    "in motion": (partial(in_motion, 0.1), Reason.NONE),
    "in fast motion": (partial(in_motion, 0.5), Reason.BLURRED),
    "blurred away": (streaked, Reason.BLURRED),
    "among lamps": (lambda: shown(lamplit(*strewn_lamps())), Reason.NONE),
    "beside a window": (lambda: shown(window()), Reason.NONE),
    "lamps alone": (
        lambda: shown(lamplit(*strewn_lamps(), shot=lit())),
        Reason.NOT_THE_PEN,
    ),
    "mirror image": (
        lambda: of_pen(replace(PEN, leds=PEN.leds * [-1, 1, 1])),
        Reason.NONE,
    ),
    "another pen": (lambda: of_pen(six_led_pen()), Reason.NOT_THE_PEN),
    "tiny": (lambda: tiny(0.5), Reason.TOO_SMALL),
    "wrong size": (lambda: shown()[:, 4:], Reason.WRONG_SIZE),
    "upright": (lambda: shown().T.copy(), Reason.WRONG_SIZE),
}


@pytest.fixture(scope="module")
def clean() -> Image:
    return shown()


@pytest.fixture(scope="module")
def others() -> list[Image]:
    return [shown(live_plan(SCENE, index, 1.0 + 0.3 * index)) for index in (1, 2)]


@pytest.fixture(scope="module")
def before(clean: Image) -> PenDetection:
    return detect_pen(clean, CAMERA, PEN)


def loader(image: Image) -> Callable[[], Image]:
    return lambda: image


def on_files(
    images: Sequence[Image], pen: Pen = PEN, mask: FloatArray | None = None
) -> Observations:
    names = tuple(f"frame_{i}.png" for i in range(len(images)))
    source = ImageSource(names, (), lambda: map(loader, images))
    return observe_images(source, CAMERA, pen, mask=mask)


def assert_alike(live: PenDetection, files: Observations, index: int) -> None:
    """Assert that an image shows the same on files as live, from nothing."""
    assert live.reason is files.reasons[index]
    assert_same = partial(np.testing.assert_allclose, rtol=0, atol=1e-9)  # px; rounding
    assert_same(live.pixels, files.pixels[index])
    assert_same(live.seen_pixels, files.seen_pixels[index])
    assert_same(live.areas, files.areas[index])
    assert_same(live.edge_width, files.edge_widths[index])
    assert live.has_pose == np.isfinite(files.rotations[index]).all()


def usual_and_slow() -> Iterator[Any]:
    """Return the names of the scenes; those of a reason beyond two are slow."""
    seen: Counter[Reason] = Counter()
    for name, (_, reason) in SCENES.items():
        seen[reason] += 1
        yield pytest.param(name, marks=[pytest.mark.slow] if seen[reason] > 2 else [])


@pytest.mark.parametrize("name", [*usual_and_slow()])
def test_an_image_shows_the_same_live_and_on_files(
    name: str, others: list[Image], before: PenDetection
) -> None:
    render, reason = SCENES[name]
    image = render()
    live = detect_pen(image, CAMERA, PEN)

    assert live.reason is reason
    # Most of a set must be of use, or the set as a whole is refused or diagnosed.
    assert_alike(live, on_files([*others, image]), 2)
    assert detect_pen(image, CAMERA, PEN, before=before).reason is reason


def test_every_reason_that_one_image_can_have_is_among_the_scenes() -> None:
    reasons = {reason for _, reason in SCENES.values()}
    of_many_images = {
        *(Reason.MISFIT, Reason.SLIPPED, Reason.TAKEN_OUT, Reason.COPY),
        Reason.OUTSIDE,
    }
    elsewhere = {
        Reason.UNREADABLE,  # a file; a live image comes whole or not at all
        Reason.UNHANDLED,  # a mistake of the program, made in the tests of both ways
        Reason.AMBIGUOUS,  # a pen that looks the same when it is turned, below
        *(Reason.ABSENT, Reason.OTHER_MOMENT),  # of several cameras
    }
    assert reasons == set(Reason) - of_many_images - elsewhere


@pytest.mark.slow
def test_hard_images_show_the_same_live_and_on_files() -> None:
    """Tracking refuses no image that a start labels, and for no other reason.

    It may label one that a start is not sure of.
    """
    disturbances = replace(HARD, blurred_away=0.1, empty=0.1)
    scene = Scene(n_images=20, seed=3)
    plan = plan_disturbed(scene, disturbances)
    images = [render_plan(scene, shot) for shot in plan.image_plans]
    files = on_files(images)
    assert len(set(files.reasons)) > 2
    for i, (image, shot) in enumerate(zip(images, plan.image_plans, strict=True)):
        live = detect_pen(image, CAMERA, PEN)
        assert_alike(live, files, i)
        tracked = detect_pen(image, CAMERA, PEN, before=turned(shot, PEN))
        if tracked.has_pose and not live.has_pose:
            assert live.reason in UNSURE
        else:
            assert tracked.reason is live.reason


def test_only_the_image_before_tells_how_a_symmetric_pen_is_held() -> None:
    """Blurred, it is refused as blurred: that must be mended first."""
    grid = [(x, y, 0.0) for x in (-25.0, 25.0) for y in (20.0, 70.0, 120.0, 170.0)]
    pen = flat_pen("symmetric", grid)
    image = of_pen(pen)
    start = detect_pen(image, CAMERA, pen)
    tracked = detect_pen(image, CAMERA, pen, before=turned(SHOT, pen))

    assert start.reason is Reason.AMBIGUOUS
    assert_alike(start, on_files([image], pen), 0)
    assert tracked.has_pose
    np.testing.assert_allclose(tracked.rotation, SHOT.rotation, atol=1e-3)
    assert detect_pen(of_pen(pen, defocus=8.0), CAMERA, pen).reason is Reason.BLURRED


@pytest.mark.parametrize("n_dark", [0, 3])
def test_a_mirrored_pen_is_refused_also_among_images_without_it(n_dark: int) -> None:
    """A swing that was captured does not keep such images."""
    image = of_pen(replace(PEN, leds=PEN.leds * [-1, 1, 1]))
    with pytest.raises(CalibrationError, match="mirror image of the pen"):
        on_files([image, *[np.zeros_like(image)] * n_dark])


def test_images_without_the_pen_neither_show_a_lamp_nor_hide_that_others_do() -> None:
    lamp = np.array([300.0, 300.0])
    beside_pen, alone = shown(lamplit(lamp)), shown(lamplit(lamp, shot=lit()))
    images = [beside_pen, alone, beside_pen, np.zeros_like(alone)]
    lamps = on_files(images).lamps

    assert lamps.shape == (4, 1, 2)
    np.testing.assert_allclose(lamps[[0, 2], 0], [lamp, lamp], atol=0.1)
    assert np.isnan(lamps[[1, 3]]).all()


def test_a_recorded_image_is_as_deep_as_on_files() -> None:
    """One hot pixel tells that 4095 is not full scale, so the discs are not clipped."""
    scene = replace(SCENE, sensor=Sensor(bits=12))
    image = shown(replace(SHOT, optics=replace(SHOT.optics, exposure=2.0)), scene)
    assert image.max() == 4095
    image[3, 5] = 2**16 - 1
    camera = ReplayCamera(
        "", lambda: ImageSource(("",), (), lambda: iter([loader(image)]))
    )
    camera.open()
    camera.start()
    frame = camera.read(1.0)
    live = detect_pen(frame.image, CAMERA, PEN, full_scale=frame.full_scale)

    assert np.isfinite(live.areas).all()
    assert_alike(live, on_files([image]), 0)


def test_light_that_is_masked_is_no_smear() -> None:
    streak = np.array([[300.0, 300], [1500, 420], [1500, 430], [300, 320]])
    glare = Glare(streak, 0.5, softness=5.0)
    image = shown(replace(SHOT, view=replace(lit().view, others=(glare,))))
    mask = np.array([[900.0, 365.0, 700.0]])

    for circles, reason in ((None, Reason.BLURRED), (mask, Reason.EMPTY)):
        live = detect_pen(image, CAMERA, PEN, circles)
        assert live.reason is reason
        assert_alike(live, on_files([image], mask=circles), 0)


def turned(shot: ImagePlan, pen: Pen) -> PenDetection:
    """Return the sighting of a pen an image before, turned a little about its tip."""
    R = rotation_from_vector(np.array([0.010, -0.008, 0.006])) @ shot.rotation
    t = shot.translation + (shot.rotation - R) @ SCENE.tip_pen
    centers = ellipse_centers(CAMERA, *leds_in_camera(pen, R, t), pen.diameter / 2)
    return detect_from_centers(CAMERA, pen, centers, R, t)
