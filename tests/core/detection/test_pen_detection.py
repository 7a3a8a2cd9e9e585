"""One live image: found from nothing, tracked, or refused with the reason."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from tests.simulated_plans import live_plan

from lightpen.arrays import Image
from lightpen.detection.pen_detection import detect_from_centers, detect_pen
from lightpen.detection.pose import fit_poses
from lightpen.detection.reasons import Reason
from lightpen.detection.spots import SpotFlaw
from lightpen_extensions.simulator.image_plans import ImagePlan, render_plan
from lightpen_extensions.simulator.scenes import Scene

SCENE = Scene()


def seen(time: float) -> tuple[Image, ImagePlan]:
    image_plan = live_plan(SCENE, 0, time)
    return render_plan(SCENE, image_plan), image_plan


def test_the_pen_is_found_from_nothing() -> None:
    image, image_plan = seen(1.0)
    detection = detect_pen(image, SCENE.camera, SCENE.pen)

    assert detection.has_pose
    assert detection.n_leds == SCENE.pen.n_leds
    np.testing.assert_allclose(detection.rotation, image_plan.rotation, atol=2e-4)
    deviations = np.sqrt(np.diag(detection.cofactors)[3:]) * detection.sigma
    assert (
        np.abs(detection.translation - image_plan.translation) < 5 * deviations
    ).all()


def test_tracked_and_found_from_nothing_are_the_same() -> None:
    before = detect_pen(seen(1.0)[0], SCENE.camera, SCENE.pen)
    image, _ = seen(1.05)
    tracked = detect_pen(image, SCENE.camera, SCENE.pen, before=before)
    fresh = detect_pen(image, SCENE.camera, SCENE.pen)

    np.testing.assert_array_equal(tracked.pixels, fresh.pixels)
    np.testing.assert_allclose(tracked.rotation, fresh.rotation, atol=1e-9)


def test_a_pen_that_is_followed_is_where_the_whole_image_has_it() -> None:
    last = detect_pen(seen(1.0)[0], SCENE.camera, SCENE.pen)
    mask = np.array([[60.0, 60.0, 40.0]])
    for time in (1.05, 1.1, 1.15, 1.2):
        image, _ = seen(time)
        image[:200, :200] = 255  # far from the pen
        last = detect_pen(image, SCENE.camera, SCENE.pen, mask, last, is_followed=True)
        whole = detect_pen(image, SCENE.camera, SCENE.pen)

        assert last.spots is not None
        assert len(last.spots) == last.n_leds == SCENE.pen.n_leds
        # Background and noise are those of fewer pixels.
        np.testing.assert_allclose(last.pixels, whole.pixels, atol=0.003)


def test_a_pen_that_is_no_longer_there_is_sought_in_the_whole_image() -> None:
    before = detect_pen(seen(1.0)[0], SCENE.camera, SCENE.pen)
    image, image_plan = seen(4.0)
    for is_followed in (False, True):
        detection = detect_pen(
            *(image, SCENE.camera, SCENE.pen, None, before), is_followed=is_followed
        )
        np.testing.assert_allclose(detection.rotation, image_plan.rotation, atol=2e-4)


def test_light_where_the_distortion_folds_is_not_used() -> None:
    camera = replace(SCENE.camera, distortion=np.array([-1.3, 0, 0, 0, 0]))
    scene = replace(SCENE, camera=camera)
    image_plan = live_plan(scene, 0, 1.0)
    image = render_plan(scene, image_plan)
    cv2.circle(image, (14, 14), 9, 200, -1, cv2.LINE_AA)
    assert camera.folded_share > 0
    assert not camera.sees(np.array([14.0, 14.0]))

    detection = detect_pen(image, camera, scene.pen)

    assert detection.n_leds == scene.pen.n_leds
    np.testing.assert_allclose(detection.rotation, image_plan.rotation, atol=2e-4)


def test_masked_light_is_not_seen() -> None:
    image, _ = seen(1.0)
    whole = detect_pen(image, SCENE.camera, SCENE.pen)
    circle = np.array([[*whole.pixels[4], 40.0]])
    masked = detect_pen(image, SCENE.camera, SCENE.pen, mask=circle)
    assert masked.has_pose
    np.testing.assert_array_equal(
        np.isnan(masked.pixels[:, 0]), np.arange(SCENE.pen.n_leds) == 4
    )


def test_masked_light_is_not_seen_where_the_pen_is_followed() -> None:
    image, _ = seen(1.0)
    before = detect_pen(image, SCENE.camera, SCENE.pen)
    circle = np.array([[*before.pixels[4], 40.0]])
    followed = detect_pen(
        image, SCENE.camera, SCENE.pen, circle, before, is_followed=True
    )
    np.testing.assert_array_equal(
        np.isnan(followed.pixels[:, 0]), np.arange(SCENE.pen.n_leds) == 4
    )


def test_the_area_of_a_saturated_led_is_not_known() -> None:
    detection = detect_pen(seen(1.0)[0], SCENE.camera, SCENE.pen)
    assert detection.spots is not None
    assert detection.labels is not None
    assert np.isfinite(detection.areas).all()
    flaws = detection.spots.flaws.copy()
    flaws[detection.labels.spot[4]] |= SpotFlaw.SATURATED
    glaring = replace(detection, spots=replace(detection.spots, flaws=flaws))
    np.testing.assert_array_equal(
        np.isnan(glaring.areas), np.arange(SCENE.pen.n_leds) == 4
    )


def test_the_width_of_the_rims_is_that_of_the_leds_alone() -> None:
    detection = detect_pen(seen(1.0)[0], SCENE.camera, SCENE.pen)
    assert detection.spots is not None
    assert detection.labels is not None
    labelled = detection.labels.spot.copy()
    lamp, labelled[4] = labelled[4], -1
    widths = detection.spots.edge_widths.copy()
    widths[lamp] = 100.0
    beside_lamp = replace(
        detection,
        spots=replace(detection.spots, edge_widths=widths),
        labels=replace(detection.labels, spot=labelled),
    )
    assert beside_lamp.edge_width == pytest.approx(np.delete(widths, lamp).mean())


def test_a_dark_image_is_empty() -> None:
    dark = np.zeros((SCENE.camera.height, SCENE.camera.width), np.uint8)
    detection = detect_pen(dark, SCENE.camera, SCENE.pen)
    assert detection.reason is Reason.EMPTY
    assert not detection.has_pose
    assert np.isnan(detection.rotation).all()


def test_another_pen_is_not_taken_for_this_one() -> None:
    leds = SCENE.pen.leds * np.array([1.6, 0.7, 2.0])
    other = replace(SCENE.pen, leds=leds)
    assert detect_pen(seen(1.0)[0], SCENE.camera, other).reason is Reason.NOT_THE_PEN


@pytest.mark.parametrize(
    ("n_seen", "reason"), [(0, Reason.EMPTY), (3, Reason.TOO_FEW_LEDS)]
)
def test_too_few_centres_give_no_pose(n_seen: int, reason: Reason) -> None:
    image, image_plan = seen(1.0)
    pixels = detect_pen(image, SCENE.camera, SCENE.pen).pixels
    pixels[n_seen:] = np.nan
    detection = detect_from_centers(
        SCENE.camera, SCENE.pen, pixels, image_plan.rotation, image_plan.translation
    )
    assert detection.reason is reason


def test_the_covariance_is_that_of_the_pose_for_the_noise_of_one_pixel() -> None:
    image, image_plan = seen(1.0)
    detection = detect_pen(image, SCENE.camera, SCENE.pen)
    poses = fit_poses(
        *(SCENE.camera, SCENE.pen, detection.pixels[None]),
        *(image_plan.rotation[None], image_plan.translation[None]),
    )
    np.testing.assert_allclose(
        detection.cofactors * detection.sigma**2, poses.covariances[0], rtol=1e-3
    )
