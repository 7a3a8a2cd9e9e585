from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tests.simulated_disturbances import (
    HARD,
    SLIP,
    Disturbances,
    Finger,
    flags_of,
    plan_disturbed,
)
from tests.simulated_lights import Lamp
from tests.simulated_pens import SAMPLE_PENS
from tests.simulated_plans import live_plan

from lightpen.arrays import Image
from lightpen_extensions.simulator.image_plans import plan_scene, render_plan
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import (
    PAPER_CONE,
    leds_in_camera,
    paper_camera,
)

CAMERA = paper_camera()


def test_same_seed_gives_the_same_images_in_any_order() -> None:
    scene = Scene(n_images=20, seed=3)
    one, two = plan_disturbed(scene), plan_disturbed(scene)
    for index in (7, 2):
        np.testing.assert_array_equal(
            render_plan(scene, one.image_plans[index]),
            render_plan(scene, two.image_plans[index]),
        )
    np.testing.assert_array_equal(one.measured_pen.leds, two.measured_pen.leds)


def test_other_seed_gives_another_swing() -> None:
    one, two = (plan_scene(Scene(n_images=5, seed=seed)) for seed in (1, 2))
    assert np.abs(one.swing.rotations - two.swing.rotations).max() > 0.1
    assert np.abs(one.gains - two.gains).max() > 0.01


def test_each_disturbance_hits_its_fraction_of_the_images() -> None:
    plan = plan_disturbed(Scene(n_images=100, seed=5))
    for name, fraction in vars(HARD).items():
        n_hit = sum(name in flags_of(image_plan) for image_plan in plan.image_plans)
        assert n_hit == round(100 * fraction), name


def test_spoilt_images_suffer_nothing_else() -> None:
    plan = plan_disturbed(Scene(n_images=100, seed=6))
    for image_plan in plan.image_plans:
        if {"empty", "blurred_away"} & set(flags_of(image_plan)):
            assert len(flags_of(image_plan)) == 1
        assert not {"saturated", "dim"} <= set(flags_of(image_plan))


def test_clean_scene_is_undisturbed() -> None:
    plan = plan_scene(Scene(n_images=10))
    assert not any(image_plan.view.others for image_plan in plan.image_plans)
    assert not plan.swing.slipped.any()


def test_slipped_images_have_their_tip_out_of_the_cone() -> None:
    scene = Scene(n_images=30, seed=7)
    plan = plan_disturbed(scene, Disturbances(slipped=0.5))
    flagged = np.array(
        ["slipped" in flags_of(image_plan) for image_plan in plan.image_plans]
    )
    np.testing.assert_array_equal(plan.swing.slipped, flagged)
    distances = np.linalg.norm(plan.swing.tips_cam - PAPER_CONE, axis=1)
    assert (distances[flagged] >= SLIP[0] - 1e-9).all()
    assert (distances[flagged] <= SLIP[1] + 1e-9).all()
    for image_plan, tip in zip(plan.image_plans, plan.swing.tips_cam, strict=True):
        at = image_plan.rotation @ scene.tip_pen + image_plan.translation
        np.testing.assert_allclose(at, tip, atol=1e-9)


def test_missing_leds_are_dark_and_one_to_four() -> None:
    wanted = Disturbances(missing=1.0)
    plan = plan_disturbed(Scene(n_images=30, seed=8), wanted)
    n_off = [int((image_plan.view.gains == 0).sum()) for image_plan in plan.image_plans]
    assert set(n_off) == {1, 2, 3, 4}
    image_plan = plan.image_plans[0]
    image = render_plan(plan.scene, image_plan)
    leds, _ = leds_in_camera(
        plan.scene.pen, image_plan.rotation, image_plan.translation
    )
    columns, rows = np.rint(CAMERA.project(leds)).astype(int).T
    np.testing.assert_array_equal(image[rows, columns] < 10, image_plan.view.gains == 0)


def test_pen_of_six_leds_keeps_at_least_four() -> None:
    scene = Scene(n_images=30, pen=SAMPLE_PENS["six"]())
    for image_plan in plan_disturbed(scene, Disturbances(missing=1.0)).image_plans:
        assert (image_plan.view.gains > 0).sum() >= 4


def rendered(wanted: Disturbances) -> Image:
    """Return the only image of a scene."""
    scene = Scene(n_images=1)
    return render_plan(scene, plan_disturbed(scene, wanted).image_plans[0])


def test_empty_image_holds_noise_only() -> None:
    image = rendered(Disturbances(empty=1.0))
    assert image.max() <= 2


def test_image_blurred_away_has_no_edges() -> None:
    image = rendered(Disturbances(blurred_away=1.0)).astype(float)
    assert image.max() > 10
    # A disc in focus rises by 100 in one pixel.
    smooth = image.reshape(512, 4, 612, 4).mean(axis=(1, 3))
    assert np.abs(np.diff(smooth, axis=1)).max() < 20


def test_dim_and_saturated_images_differ_in_exposure_only() -> None:
    wanted = Disturbances(), Disturbances(dim=1.0), Disturbances(saturated=1.0)
    peaks = [np.percentile(rendered(each), 99.8) for each in wanted]
    assert 170 < peaks[0] < 215
    assert 10 < peaks[1] < 60
    assert peaks[2] == 255


@pytest.mark.slow
def test_clutter_and_fingers_leave_most_leds_whole() -> None:
    wanted = Disturbances(clutter=1.0, fingers=1.0)
    scene = Scene(n_images=12, seed=9)
    n_touched = []
    for image_plan in plan_disturbed(scene, wanted).image_plans:
        others = image_plan.view.others
        assert [isinstance(each, Finger) for each in others].count(True) == 1
        assert any(isinstance(each, Lamp) for each in others)
        leds, _ = leds_in_camera(scene.pen, image_plan.rotation, image_plan.translation)
        columns, rows = np.rint(CAMERA.project(leds)).astype(int).T
        image = render_plan(scene, image_plan).astype(float)
        alone = replace(image_plan.view, others=())
        free = render_plan(scene, replace(image_plan, view=alone)).astype(float)
        n_touched.append(int((np.abs(image - free)[rows, columns] > 40).sum()))
    assert max(n_touched) <= 4
    assert sum(n_touched) > 0


def test_live_swing_keeps_the_tip_in_the_cone_and_moves_on() -> None:
    scene = Scene(seed=11)
    image_plans = [live_plan(scene, index, index / 20) for index in range(40)]
    for image_plan in image_plans:
        tips = image_plan.view.rotations @ scene.tip_pen + image_plan.view.translations
        np.testing.assert_allclose(tips, np.tile(PAPER_CONE, (len(tips), 1)), atol=1e-9)
    steps = [
        np.linalg.norm(after.rotation - before.rotation)
        for before, after in pairwise(image_plans)
    ]
    assert 1e-3 < np.median(steps) < 0.1
    image = render_plan(scene, image_plans[3])
    assert image.shape == (CAMERA.height, CAMERA.width)
    assert image.max() > 150


def test_longer_exposure_blurs_the_live_image_more() -> None:
    scene = Scene(seed=11)
    short, long = (live_plan(scene, 0, 1.0, seconds) for seconds in (1e-4, 0.05))
    np.testing.assert_allclose(short.rotation, long.rotation, atol=1e-12)
    assert len(long.view.rotations) > len(short.view.rotations)


def test_impossible_fractions_are_refused() -> None:
    with pytest.raises(ValueError, match="clutter"):
        Disturbances(clutter=1.5)
    with pytest.raises(ValueError, match="together"):
        Disturbances(slipped=0.5, empty=0.6)
