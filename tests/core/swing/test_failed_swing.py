"""A swing without a tip: the likeliest cause first, residuals of each LED."""

from dataclasses import replace

import numpy as np
from tests.simulated_centers import simulate_centers

from lightpen.detection.pen_detection import detect_from_centers
from lightpen.estimation.contact.single_images import USUAL_SIGMA
from lightpen.messages import Code, message
from lightpen.model.pen import Pen
from lightpen.model.rigid import rig_of
from lightpen.swing.capture.kept_images import keep, none_kept
from lightpen.swing.capture.state import SwingSetup
from lightpen.swing.status import FailedSwing, failed_swing
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses

CAMERA, PEN = paper_camera(), paper_pen()
WHY = message("joint.not-settled", n_steps=100)


def failed(pen: Pen) -> FailedSwing:
    """A swing of the pen of the paper, read with another file."""
    swing, rng = swing_poses(12, np.random.default_rng(0)), np.random.default_rng(1)
    poses = swing.rotations, swing.translations
    pixels = simulate_centers(CAMERA, PEN, *poses, 0.0, rng)
    kept = none_kept(1, PEN.n_leds)
    for i, seen in enumerate(pixels):
        detection = detect_from_centers(
            *(CAMERA, pen, seen, swing.rotations[i], swing.translations[i])
        )
        kept = keep(rig_of(CAMERA), pen, kept, detection, i + 1, 0.1 * i)
    return failed_swing(SwingSetup(CAMERA, pen), kept, WHY)


def test_exact_images_have_no_residuals_and_the_cause_stands_alone() -> None:
    found = failed(PEN)

    assert found.causes == (WHY,)
    np.testing.assert_allclose(found.residuals, 0.0, atol=1e-6)


def test_leds_that_misfit_are_named_before_the_seat() -> None:
    found = failed(replace(PEN, leds=PEN.leds * (1.0, 1.05, 1.0)))

    assert [cause.code for cause in found.causes] == [Code.LEDS_MISFIT, WHY.code]
    assert np.sqrt(np.nanmean(found.residuals**2)) > USUAL_SIGMA


def test_a_displaced_led_has_the_largest_residuals() -> None:
    leds = PEN.leds.copy()
    leds[5] += (0.0, 0.3, 0.0)

    found = failed(replace(PEN, leds=leds))

    rms = np.sqrt(np.nanmean(found.residuals[:, 0] ** 2, axis=(0, 2)))
    assert np.nanargmax(rms) == 5


def test_a_swing_without_images_has_its_cause_only() -> None:
    found = failed_swing(SwingSetup(CAMERA, PEN), none_kept(1, PEN.n_leds), WHY)

    assert found.causes == (WHY,)
    assert found.residuals.shape == (0, 1, PEN.n_leds, 2)
