"""A pen that moved little is labelled by where its LEDs were; else it is sought."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_leds import with_leds
from tests.simulated_plans import live_plan

from lightpen.detection.pen_detection import PenDetection, detect_pen, follow_spots
from lightpen.detection.spots import SpotFlaw, Spots, detect_spots
from lightpen_extensions.simulator.image_plans import render_plan
from lightpen_extensions.simulator.scenes import Scene

SCENE = Scene()


def detected(time: float) -> PenDetection:
    image = render_plan(SCENE, live_plan(SCENE, 0, time))
    return detect_pen(image, SCENE.camera, SCENE.pen)


BEFORE, NOW = detected(1.0), detected(1.05)


def followed(spots: Spots | None) -> PenDetection | None:
    assert spots is not None
    return follow_spots(spots, SCENE.camera, SCENE.pen, BEFORE)


def test_labels_and_pose_are_those_of_a_search() -> None:
    found = followed(NOW.spots)
    assert found is not None
    assert found.labels is not None
    assert NOW.labels is not None
    np.testing.assert_array_equal(found.labels.spot, NOW.labels.spot)
    # A thousandth of what noise moves the pose by.
    np.testing.assert_allclose(found.rotation, NOW.rotation, atol=1e-6)
    np.testing.assert_allclose(found.translation, NOW.translation, atol=1e-4)
    np.testing.assert_allclose(found.seen_pixels, NOW.seen_pixels, atol=1e-9)


def test_a_foreign_light_beside_an_led_is_not_taken_for_it() -> None:
    assert NOW.spots is not None
    assert NOW.labels is not None
    centers = NOW.spots.centers.copy()
    centers[3] += [2.0, 0.0]
    found = followed(replace(NOW.spots, centers=centers))
    assert found is not None
    assert found.labels is not None
    wanted = np.where(NOW.labels.spot == 3, -1, NOW.labels.spot)
    np.testing.assert_array_equal(found.labels.spot, wanted)
    np.testing.assert_allclose(found.rotation, NOW.rotation, atol=3e-4)


def test_leds_that_changed_their_size_are_left_to_a_search() -> None:
    assert NOW.spots is not None
    areas = NOW.spots.areas.copy()
    areas[2] *= 2
    assert followed(replace(NOW.spots, areas=areas)) is None


def test_motion_beyond_half_the_way_to_the_next_led_is_left_to_a_search() -> None:
    assert followed(detected(1.6).spots) is None


def test_too_few_whole_spots_are_left_to_a_search() -> None:
    assert NOW.spots is not None
    flaws = NOW.spots.flaws.copy()
    flaws[:6] = SpotFlaw.CUT
    assert followed(replace(NOW.spots, flaws=flaws)) is None


def test_nothing_is_followed_into_the_dark() -> None:
    assert followed(Spots.none()) is None


def test_a_cut_spot_on_its_led_is_labelled_but_not_used() -> None:
    assert NOW.spots is not None
    flaws = NOW.spots.flaws.copy()
    flaws[0] = SpotFlaw.CUT
    found = followed(replace(NOW.spots, flaws=flaws))
    assert found is not None
    assert found.labels is not None
    led = int(np.flatnonzero(found.labels.spot == 0)[0])
    assert not found.labels.whole[led]


@pytest.mark.parametrize("look", ["hot-spot", "dome"])
def test_rims_found_from_the_image_before_are_those_found_anew(look: str) -> None:
    scene = with_leds(SCENE, look)
    first, second = (render_plan(scene, live_plan(scene, 0, t)) for t in (1.0, 1.05))
    before = detect_spots(first)
    anew, known = detect_spots(second), detect_spots(second, before=before)
    np.testing.assert_array_equal(known.flaws, anew.flaws)
    np.testing.assert_allclose(known.centers, anew.centers, atol=0.003)
    np.testing.assert_allclose(known.areas, anew.areas, rtol=1e-3)
    assert abs(np.mean(known.areas / anew.areas) - 1) < 3e-4


@pytest.mark.parametrize(
    "look", ["hot-spot", pytest.param("board", marks=pytest.mark.slow)]
)
def test_rims_beside_a_shining_board_are_found_from_the_image_before(
    look: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = with_leds(SCENE, look)
    first, second = (render_plan(scene, live_plan(scene, 0, t)) for t in (1.0, 1.05))
    before, anew = detect_spots(first), detect_spots(second)
    monkeypatch.delattr("lightpen.detection.edge_fit._onto_steepest")
    known = detect_spots(second, before=before)

    np.testing.assert_allclose(known.centers, anew.centers, atol=0.01)
