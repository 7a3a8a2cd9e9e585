"""Exposure, focus and stray light of a live image."""

from collections.abc import Sequence

import cv2
import numpy as np
import pytest

from lightpen.arrays import Image
from lightpen.cameras.protocol import CameraSettings
from lightpen.detection.inspection import (
    SEARCHED_IMAGES,
    Advice,
    Exposure,
    StraySearch,
    advise,
    inspect,
    is_sharp,
    lasting_light,
    stray_light,
)
from lightpen.detection.labelling.labels import label_spots
from lightpen.detection.spots import Spots, detect_spots
from lightpen_extensions.simulator.image_plans import plan_scene, render_plan
from lightpen_extensions.simulator.render import Optics
from lightpen_extensions.simulator.scenes import Scene, Sensor
from lightpen_extensions.simulator.swings import paper_camera, paper_pen

NOTHING = detect_spots(np.zeros((512, 512), dtype=np.uint8))


def image(exposure: float = 1.0, sensor: Sensor | None = None) -> Image:
    optics = Optics(exposure=exposure)
    scene = Scene(n_images=1, optics=optics, sensor=sensor or Sensor())
    return render_plan(scene, plan_scene(scene).image_plans[0])


def lamps(*centers: tuple[float, float], radius: float = 8.0) -> Spots:
    """Spots of an image that shows these lamps."""
    picture = np.zeros((512, 512), dtype=np.uint8)
    for x, y in centers:
        place = round(16 * x), round(16 * y)
        size = round(16 * radius)
        cv2.circle(picture, place, size, 200, cv2.FILLED, cv2.LINE_AA, 4)
    return detect_spots(np.asarray(cv2.GaussianBlur(picture, (0, 0), 0.8), np.uint8))


def searched(images: Sequence[Spots], n_with_pen: int = 0) -> StraySearch:
    search = StraySearch()
    for i, spots in enumerate(images):
        search = search.after(spots, shows_pen=i < n_with_pen)
    return search


def test_a_good_exposure_has_ten_good_leds_in_focus() -> None:
    spots = detect_spots(image())
    found = inspect(spots, label_spots(spots, paper_camera(), paper_pen()))

    exposure = found.exposure
    assert (exposure.n_dark, exposure.n_good, exposure.n_saturated) == (0, 10, 0)
    assert exposure.are_leds
    assert is_sharp(found.edge_width)


def test_what_is_bright_is_no_led_until_it_is_labelled() -> None:
    spots = lamps((100.0, 200.0))

    assert not inspect(spots).exposure.are_leds
    labels = label_spots(spots, paper_camera(), paper_pen())
    assert not inspect(spots, labels).exposure.are_leds


def test_a_short_exposure_is_dark_and_a_long_one_saturated() -> None:
    assert inspect(detect_spots(image(0.15))).exposure.n_dark == 10
    assert inspect(detect_spots(image(3.0))).exposure.n_saturated == 10


def test_a_clipped_led_is_at_the_end_of_the_scale() -> None:
    assert inspect(detect_spots(image(3.0))).exposure.peaks == (1.0,) * 10


def test_each_led_is_dark_good_or_saturated() -> None:
    exposure = Exposure((0.1, 0.24, 0.26, 0.98, 1.0))

    assert (exposure.n_dark, exposure.n_good, exposure.n_saturated) == (2, 2, 1)


def test_defocus_is_not_sharp() -> None:
    soft = np.asarray(cv2.GaussianBlur(image(), (0, 0), 3), dtype=np.uint8)
    found = inspect(detect_spots(soft))

    assert not is_sharp(found.edge_width)
    assert found.edge_width > 5


def test_nothing_bright_has_no_edge() -> None:
    found = inspect(NOTHING)

    assert found.exposure == Exposure(are_leds=False)
    assert np.isnan(found.edge_width)
    assert not is_sharp(found.edge_width)


def test_masked_stray_light_is_seen_no_more() -> None:
    bright = image()
    mask = stray_light(detect_spots(bright))

    assert len(mask) == 10
    assert len(detect_spots(bright, mask)) == 0


def test_a_lamp_that_stays_is_one_circle() -> None:
    (circle,) = lasting_light([lamps((100.0, 200.0))] * 10)

    assert circle[:2] == pytest.approx([100, 200], abs=0.2)
    assert 8 < circle[2] < 20


def test_the_lamps_of_half_of_the_images_are_found_together() -> None:
    one, other = (100.0, 200.0), (400.0, 300.0)
    flicker = [lamps(one), lamps(one, other)] * 5

    assert len(lasting_light(flicker)) == 2


def test_what_is_bright_in_few_images_is_no_stray_light() -> None:
    images = [NOTHING] * 6 + [lamps((100.0, 200.0))] * 4

    assert len(lasting_light(images)) == 0


def test_lamps_of_one_image_do_not_pass_for_one_that_stays() -> None:
    crowd = lamps((100.0, 200.0), (130.0, 200.0), (160.0, 200.0), (190.0, 200.0))

    assert len(lasting_light([crowd, *[NOTHING] * 7])) == 0


def test_the_circle_covers_a_lamp_that_swings() -> None:
    places = [(100.0 + step, 200.0) for step in (0, -8, -4, 4, 8)]
    (circle,) = lasting_light([lamps(place) for place in places])

    for x, _ in places:
        assert abs(x - circle[0]) + 8 < circle[2]


def test_a_search_is_over_after_enough_images() -> None:
    search = searched([NOTHING] * (SEARCHED_IMAGES - 1))

    assert not search.is_over
    assert search.after(NOTHING, shows_pen=False).is_over


def test_a_search_beside_the_covered_pen_finds_the_lamp() -> None:
    search = searched([lamps((100.0, 200.0))] * 10, n_with_pen=2)

    assert not search.shows_pen
    assert len(search.circles()) == 1


def test_a_search_masks_nothing_while_the_pen_is_seen() -> None:
    search = searched([lamps((100.0, 200.0))] * 10, n_with_pen=5)

    assert search.shows_pen
    assert len(search.circles()) == 0


def test_what_moves_is_no_stray_light_but_not_dark_either() -> None:
    search = searched([lamps((100.0 + 30 * i, 200.0)) for i in range(10)])

    assert len(search.circles()) == 0
    assert not search.is_dark
    assert searched([NOTHING] * 10).is_dark


def test_clipped_leds_of_ten_bits_ask_for_less_light_and_not_for_more() -> None:
    of_ten_bits = (image(exposure=8.0, sensor=Sensor(bits=12)) >> 2).astype(np.uint16)
    spots = detect_spots(of_ten_bits)
    exposure = inspect(spots).exposure
    assert exposure.n_saturated == len(spots) > 0
    assert advise(exposure, CameraSettings(), None) is Advice.CLOSE_APERTURE
