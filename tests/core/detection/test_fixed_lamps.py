"""Lamps that stay where they are, beside a pen that moves."""

from dataclasses import replace

import numpy as np
from tests.simulated_lights import Lamp

from lightpen.arrays import FloatArray, Image
from lightpen.detection.fixed_lamps import fixed_lamps, lamps_among, masked_lights
from lightpen.detection.labelling.labels import Labels, label_images
from lightpen.detection.pen_detection import PenDetection, detections_of
from lightpen.detection.spots import detect_spots
from lightpen.model.camera import Camera
from lightpen_extensions.simulator.image_plans import plan_scene, render_plan
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import paper_pen

SMALL = Camera(320, 240, 600.0, 600.0, 160.0, 120.0)
PEN = paper_pen()
MASK = np.array([[80.0, 60.0, 20.0]])


def disc_at(*places: tuple[float, float]) -> Image:
    y, x = np.mgrid[:240, :320]
    image = np.zeros((240, 320))
    for u, v in places:
        image += 180 * np.clip(8.5 - np.hypot(x - u, y - v), 0, 1)
    return image.astype(np.uint8)


def seen(image: Image) -> PenDetection:
    spots = detect_spots(image)
    return detections_of([spots], label_images([spots], SMALL, PEN), SMALL)[0]


def nothing_masked(n_images: int) -> FloatArray:
    return np.zeros((n_images, 0, 2))


def test_the_light_in_a_masked_circle_is_measured() -> None:
    found = masked_lights(disc_at((82.3, 58.6), (200.0, 100.0)), MASK)
    np.testing.assert_allclose(found, [[82.3, 58.6]], atol=0.02)


def test_a_masked_circle_without_light_shows_none() -> None:
    assert np.isnan(masked_lights(disc_at((200.0, 100.0)), MASK)).all()
    outside = np.array([[900.0, 900.0, 10.0]])
    assert np.isnan(masked_lights(disc_at((200.0, 100.0)), outside)).all()


def test_a_spot_that_stays_is_a_lamp_and_one_that_moves_is_none() -> None:
    detections = [
        seen(disc_at((80.0, 60.0), (100.0 + 15 * i, 180.0))) for i in range(8)
    ]
    lamps = fixed_lamps(nothing_masked(8), detections)
    assert lamps.shape == (8, 1, 2)
    np.testing.assert_allclose(lamps[:, 0], [[80.0, 60.0]] * 8, atol=0.02)


def test_a_lamp_that_few_images_show_is_none() -> None:
    detections = [seen(disc_at(*[(80.0, 60.0)] * (i < 4))) for i in range(8)]
    assert fixed_lamps(nothing_masked(8), detections).shape == (8, 0, 2)


def test_lights_of_a_masked_circle_that_stay_nowhere_are_no_lamp() -> None:
    masked = np.array([[[70.0, 60.0]], [[90.0, 60.0]]])
    assert lamps_among(masked, [np.zeros((0, 2))] * 2).shape == (2, 0, 2)


def test_lamps_that_all_jump_at_once_are_the_lamps_they_were() -> None:
    """One comes to lie nearer to where another was than to where it was itself."""
    places = np.array([[80.0, 60.0], [80.0, 100.0], [250.0, 200.0]])
    lights = [places + (0.0 if i < 14 else (4.0, 30.0)) for i in range(20)]
    lamps = lamps_among(nothing_masked(20), lights)
    order = np.lexsort(lamps[0].T)
    np.testing.assert_allclose(lamps[:, order], np.stack(lights))


def test_a_lamp_that_jumps_out_of_its_masked_circle_is_found_beside_it() -> None:
    masked = np.full((20, 1, 2), np.nan)
    masked[:17] = 82.0, 58.0
    lights = [np.zeros((0, 2))] * 17 + [np.array([[150.0, 58.0]])] * 3
    lamps = lamps_among(masked, lights)
    np.testing.assert_allclose(lamps[:17, 0], [[82.0, 58.0]] * 17)
    np.testing.assert_allclose(lamps[17:, 0], [[150.0, 58.0]] * 3)


def test_a_reflection_that_goes_from_place_to_place_with_the_pen_is_no_lamp() -> None:
    lights = [np.array([[50.0 + 30 * (i // 5), 80.0]]) for i in range(25)]
    assert lamps_among(nothing_masked(25), lights).shape == (25, 0, 2)


def test_an_led_that_passes_through_a_masked_circle_is_passed_over() -> None:
    masked = np.full((8, 1, 2), [82.0, 58.0])
    masked[3] = 95.0, 70.0
    lamps = fixed_lamps(masked, [seen(disc_at())] * 8)
    assert np.isnan(lamps[3]).all()
    assert np.isfinite(np.delete(lamps, 3, axis=0)).all()


def test_the_leds_of_the_pen_are_no_lamps() -> None:
    scene = Scene(n_images=1, seed=4)
    plan = plan_scene(scene).image_plans[0]
    lamp = Lamp(np.array([240.0, 240.0]), (10.0, 10.0), level=0.6)
    image = render_plan(scene, replace(plan, view=replace(plan.view, others=(lamp,))))
    spots = detect_spots(image)
    labels: list[Labels] = label_images([spots], scene.camera, scene.pen)
    detection = detections_of([spots], labels, scene.camera)[0]
    lamps = fixed_lamps(nothing_masked(1), [detection])
    assert len(spots) == scene.pen.n_leds + 1
    assert lamps.shape == (1, 1, 2)
