"""Images that are copies of others count once."""

import numpy as np
from tests.simulated_centers import calibrate_pixels, observe_pixels, simulate_centers

from lightpen.arrays import FloatArray
from lightpen.detection.observations import without_copies
from lightpen.detection.reasons import Reason
from lightpen.estimation.reports.report_warnings import warnings_of
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses

CAMERA, PEN = paper_camera(), paper_pen()


def swung(n_images: int = 40) -> FloatArray:
    rng = np.random.default_rng(0)
    swing = swing_poses(n_images, rng)
    return simulate_centers(CAMERA, PEN, swing.rotations, swing.translations, 0.03, rng)


def reasons(pixels: FloatArray) -> list[Reason]:
    return list(without_copies(observe_pixels(pixels, CAMERA, PEN)).reasons)


def test_images_of_a_pen_at_rest_differ_by_their_noise() -> None:
    pixels = swung()
    again = pixels[:5] + 0.01 * np.random.default_rng(1).normal(size=(5, 10, 2))
    assert Reason.COPY not in reasons(np.concatenate([pixels, again]))


def test_images_given_three_times_are_worth_as_much_as_once() -> None:
    pixels = swung()
    once, thrice = (
        calibrate_pixels(given, CAMERA, PEN)
        for given in (pixels, np.concatenate([pixels] * 3))
    )
    np.testing.assert_allclose(thrice.joint.tip_pen, once.joint.tip_pen, atol=1e-9)
    np.testing.assert_allclose(
        thrice.budget.expanded_uncertainty, once.budget.expanded_uncertainty
    )
    codes = [each.code for each in warnings_of(thrice)]
    assert "warning.copies" in codes
    assert "warning.copies" not in [each.code for each in warnings_of(once)]
