"""Exposure, focus and stray light of a live image."""

import cv2
import numpy as np

from lightpen.arrays import Image
from lightpen.inspection import inspect, stray_light
from lightpen.labelling.labels import label_spots
from lightpen.simulator.scenery import Optics
from lightpen.simulator.scenes import Scene
from lightpen.simulator.shots import plan_scene, render_shot
from lightpen.simulator.swings import paper_camera, paper_pen
from lightpen.spots import detect_spots


def image(exposure: float = 1.0) -> Image:
    scene = Scene(n_images=1, optics=Optics(exposure=exposure))
    return render_shot(scene, plan_scene(scene).shots[0])


def test_a_good_exposure_has_ten_good_leds_in_focus() -> None:
    spots = detect_spots(image())
    found = inspect(spots, label_spots(spots, paper_camera(), paper_pen()))

    assert (found.n_dark, found.n_good, found.n_saturated) == (0, 10, 0)
    assert found.is_sharp


def test_a_short_exposure_is_dark_and_a_long_one_saturated() -> None:
    assert inspect(detect_spots(image(0.15))).n_dark == 10
    assert inspect(detect_spots(image(3.0))).n_saturated == 10


def test_defocus_is_not_sharp() -> None:
    soft = np.asarray(cv2.GaussianBlur(image(), (0, 0), 3), dtype=np.uint8)
    found = inspect(detect_spots(soft))

    assert not found.is_sharp
    assert found.edge_width > 5


def test_nothing_bright_has_no_edge() -> None:
    found = inspect(detect_spots(np.zeros((512, 512), dtype=np.uint8)))

    assert (found.n_dark, found.n_good, found.n_saturated) == (0, 0, 0)
    assert np.isnan(found.edge_width)
    assert not found.is_sharp


def test_masked_stray_light_is_seen_no_more() -> None:
    bright = image()
    mask = stray_light(detect_spots(bright))

    assert len(mask) == 10
    assert len(detect_spots(bright, mask)) == 0
