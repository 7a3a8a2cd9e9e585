"""Images of 12 bits are measured at their full depth, and no worse than those of 8."""

from typing import Literal

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.detection.pen_detection import detect_pen
from lightpen.model.ellipse import disc_images
from lightpen_extensions.simulator.image_plans import plan_scene, render_plan
from lightpen_extensions.simulator.render import Optics
from lightpen_extensions.simulator.scenes import Scene, Sensor
from lightpen_extensions.simulator.swings import leds_in_camera, paper_camera

N_IMAGES = 8
USUAL, DIM = 1.0, 0.08  # exposures; of the dim one 8 bits resolve some ten steps


def errors(
    bits: Literal[8, 12], exposure: float, *, cut_to_8: bool = False
) -> FloatArray:
    """Return by how far the centres of LEDs are off in rendered images, px."""
    scene = Scene(
        n_images=N_IMAGES,
        camera=paper_camera(binning=2),
        optics=Optics(exposure=exposure),
        sensor=Sensor(bits=bits),
    )
    off = []
    for plan in plan_scene(scene).image_plans:
        image, full_scale = render_plan(scene, plan), scene.sensor.full_scale
        if cut_to_8:
            image, full_scale = (image >> 4).astype(np.uint8), 255
        seen = detect_pen(image, scene.camera, scene.pen, full_scale=full_scale)
        places = leds_in_camera(scene.pen, plan.rotation, plan.translation)
        truth = disc_images(scene.camera, *places, scene.pen.diameter / 2).centers
        off.append(seen.pixels - truth)
    return np.array(off)


def rms(off: FloatArray) -> float:
    return float(np.sqrt(np.nanmean(np.square(off))))


@pytest.mark.slow
@pytest.mark.parametrize("exposure", [USUAL, DIM])
def test_centres_are_no_worse_with_12_bits_than_with_8(exposure: float) -> None:
    deep, flat = errors(12, exposure), errors(8, exposure)
    assert np.isfinite(deep).mean() >= np.isfinite(flat).mean() > 0.9
    # Both draw other noise: the root mean square of 150 values is known to 6 %.
    assert rms(deep) < 1.06 * rms(flat)


def test_the_low_bits_of_dim_leds_are_used() -> None:
    deep, cut = errors(12, DIM), errors(12, DIM, cut_to_8=True)
    assert rms(deep) < 0.95 * rms(cut)  # of the same images
