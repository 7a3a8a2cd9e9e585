"""One live image: found from nothing, tracked, or refused with the reason."""

from dataclasses import replace

import numpy as np
import pytest

from lightpen.arrays import Image
from lightpen.detection.pose import fit_poses
from lightpen.detection.reasons import Reason
from lightpen.detection.sighting import look, sight_centers
from lightpen.detection.spots import Flaw
from lightpen.simulator.image_plans import ImagePlan, live_plan, render_plan
from lightpen.simulator.scenes import Scene

SCENE = Scene()


def seen(time: float) -> tuple[Image, ImagePlan]:
    image_plan = live_plan(SCENE, 0, time)
    return render_plan(SCENE, image_plan), image_plan


def test_the_pen_is_found_from_nothing() -> None:
    image, image_plan = seen(1.0)
    sighting = look(image, SCENE.camera, SCENE.pen)

    assert sighting.has_pose
    assert sighting.n_leds == SCENE.pen.n_leds
    np.testing.assert_allclose(sighting.rotation, image_plan.rotation, atol=2e-4)
    deviations = np.sqrt(np.diag(sighting.cofactors)[3:]) * sighting.sigma
    assert (
        np.abs(sighting.translation - image_plan.translation) < 5 * deviations
    ).all()


def test_tracked_and_found_from_nothing_are_the_same() -> None:
    before = look(seen(1.0)[0], SCENE.camera, SCENE.pen)
    image, _ = seen(1.05)
    tracked = look(image, SCENE.camera, SCENE.pen, before=before)
    fresh = look(image, SCENE.camera, SCENE.pen)

    np.testing.assert_array_equal(tracked.pixels, fresh.pixels)
    np.testing.assert_allclose(tracked.rotation, fresh.rotation, atol=1e-9)


def test_a_pen_that_is_followed_is_where_the_whole_image_has_it() -> None:
    last = look(seen(1.0)[0], SCENE.camera, SCENE.pen)
    mask = np.array([[60.0, 60.0, 40.0]])
    for time in (1.05, 1.1, 1.15, 1.2):
        image, _ = seen(time)
        image[:200, :200] = 255  # far from the pen
        last = look(image, SCENE.camera, SCENE.pen, mask, last, is_followed=True)
        whole = look(image, SCENE.camera, SCENE.pen)

        assert last.spots is not None
        assert len(last.spots) == last.n_leds == SCENE.pen.n_leds
        # Background and noise are those of fewer pixels.
        np.testing.assert_allclose(last.pixels, whole.pixels, atol=0.003)


def test_a_pen_that_is_no_longer_there_is_sought_in_the_whole_image() -> None:
    before = look(seen(1.0)[0], SCENE.camera, SCENE.pen)
    image, image_plan = seen(4.0)
    for is_followed in (False, True):
        sighting = look(
            *(image, SCENE.camera, SCENE.pen, None, before), is_followed=is_followed
        )
        np.testing.assert_allclose(sighting.rotation, image_plan.rotation, atol=2e-4)


def test_masked_light_is_not_seen() -> None:
    image, _ = seen(1.0)
    whole = look(image, SCENE.camera, SCENE.pen)
    circle = np.array([[*whole.pixels[4], 40.0]])
    masked = look(image, SCENE.camera, SCENE.pen, mask=circle)
    assert masked.has_pose
    np.testing.assert_array_equal(
        np.isnan(masked.pixels[:, 0]), np.arange(SCENE.pen.n_leds) == 4
    )


def test_masked_light_is_not_seen_where_the_pen_is_followed() -> None:
    image, _ = seen(1.0)
    before = look(image, SCENE.camera, SCENE.pen)
    circle = np.array([[*before.pixels[4], 40.0]])
    followed = look(image, SCENE.camera, SCENE.pen, circle, before, is_followed=True)
    np.testing.assert_array_equal(
        np.isnan(followed.pixels[:, 0]), np.arange(SCENE.pen.n_leds) == 4
    )


def test_the_area_of_a_saturated_led_is_not_known() -> None:
    sighting = look(seen(1.0)[0], SCENE.camera, SCENE.pen)
    assert sighting.spots is not None
    assert sighting.labels is not None
    assert np.isfinite(sighting.areas).all()
    flaws = sighting.spots.flaws.copy()
    flaws[sighting.labels.spot[4]] |= Flaw.SATURATED
    glaring = replace(sighting, spots=replace(sighting.spots, flaws=flaws))
    np.testing.assert_array_equal(
        np.isnan(glaring.areas), np.arange(SCENE.pen.n_leds) == 4
    )


def test_the_width_of_the_rims_is_that_of_the_leds_alone() -> None:
    sighting = look(seen(1.0)[0], SCENE.camera, SCENE.pen)
    assert sighting.spots is not None
    assert sighting.labels is not None
    labelled = sighting.labels.spot.copy()
    lamp, labelled[4] = labelled[4], -1
    widths = sighting.spots.edge_widths.copy()
    widths[lamp] = 100.0
    beside_lamp = replace(
        sighting,
        spots=replace(sighting.spots, edge_widths=widths),
        labels=replace(sighting.labels, spot=labelled),
    )
    assert beside_lamp.edge_width == pytest.approx(np.delete(widths, lamp).mean())


def test_a_dark_image_is_empty() -> None:
    dark = np.zeros((SCENE.camera.height, SCENE.camera.width), np.uint8)
    sighting = look(dark, SCENE.camera, SCENE.pen)
    assert sighting.reason is Reason.EMPTY
    assert not sighting.has_pose
    assert np.isnan(sighting.rotation).all()


def test_another_pen_is_not_taken_for_this_one() -> None:
    leds = SCENE.pen.leds * np.array([1.6, 0.7, 2.0])
    other = replace(SCENE.pen, leds=leds)
    assert look(seen(1.0)[0], SCENE.camera, other).reason is Reason.NOT_THE_PEN


@pytest.mark.parametrize(
    ("n_seen", "reason"), [(0, Reason.EMPTY), (3, Reason.TOO_FEW_LEDS)]
)
def test_too_few_centres_give_no_pose(n_seen: int, reason: Reason) -> None:
    image, image_plan = seen(1.0)
    pixels = look(image, SCENE.camera, SCENE.pen).pixels
    pixels[n_seen:] = np.nan
    sighting = sight_centers(
        SCENE.camera, SCENE.pen, pixels, image_plan.rotation, image_plan.translation
    )
    assert sighting.reason is reason


def test_the_covariance_is_that_of_the_pose_for_the_noise_of_one_pixel() -> None:
    image, image_plan = seen(1.0)
    sighting = look(image, SCENE.camera, SCENE.pen)
    poses = fit_poses(
        *(SCENE.camera, SCENE.pen, sighting.pixels[None]),
        *(image_plan.rotation[None], image_plan.translation[None]),
    )
    np.testing.assert_allclose(
        sighting.cofactors * sighting.sigma**2, poses.covariances[0], rtol=1e-3
    )
