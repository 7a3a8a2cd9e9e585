"""U is predicted as images come in, as if all were linearised together."""

from dataclasses import replace

import numpy as np
import pytest

from lightpen.estimation.contact.joint import ContactModel, JointFit, fit_contact
from lightpen.estimation.uncertainty.prediction import (
    GROWTH,
    UncertaintyPrediction,
    predict_uncertainty,
)
from lightpen.model.limits import USUAL
from lightpen.model.rigid import rig_of
from lightpen_extensions.simulator.swings import (
    paper_camera,
    paper_pen,
    simulate_centers,
    swing_poses,
)

CAMERA, PEN = paper_camera(), replace(paper_pen(), led_sigma=0.002)
RNG = np.random.default_rng(0)
SWING = swing_poses(26, RNG)
PIXELS = simulate_centers(CAMERA, PEN, SWING.rotations, SWING.translations, 0.03, RNG)[
    :, None
]


def fit(n_images: int) -> JointFit:
    return fit_contact(
        ContactModel.of(CAMERA, PEN, PIXELS[:n_images, 0]),
        *(SWING.rotations[:n_images], SWING.tip_pen, SWING.cone_cam),
    )


def prediction(
    n_images: int, before: UncertaintyPrediction | None = None
) -> UncertaintyPrediction:
    return predict_uncertainty(
        *(rig_of(CAMERA), PEN, PIXELS[:n_images], fit(n_images), 0.03, USUAL), before
    )


def test_equations_of_added_images_are_about_the_tip_and_cone_of_the_first() -> None:
    """All are linear about nearly the same poses: they solve for the same tip."""
    before = prediction(20)
    added, whole = prediction(22, before), prediction(22)

    assert (added.n_images, added.n_whole, whole.n_whole) == (22, 20, 22)
    one, other = added.equations, whole.equations
    scale = np.sqrt(np.diag(other.N))
    off = (one.N - other.N) / np.outer(scale, scale)
    np.testing.assert_allclose(off, 0.0, atol=1e-3)
    np.testing.assert_allclose(one.cone_rows, other.cone_rows, rtol=0.01, atol=10.0)
    # From the one tip and cone to the other.
    at, there = added.state, whole.state
    step = np.zeros(len(other.b))
    step[:3] = there.cone_rig - at.cone_rig
    step[-3 * PEN.n_leds :] = np.tile(at.tip_pen - there.tip_pen, PEN.n_leds)
    assert np.abs(step[:3]).max() > 0.005
    right = other.b + other.N @ step
    np.testing.assert_allclose(one.b / scale, right / scale, atol=0.02)
    by_image = other.cone_right + other.cone_rows @ step
    largest = np.abs(other.cone_rows @ step).max()
    np.testing.assert_allclose(one.cone_right, by_image, atol=0.1 * largest)


def test_u_by_added_images_is_that_by_all_together() -> None:
    joint, before = fit(22), prediction(20)
    added, whole = (
        each.predicted(joint, 0.03, USUAL)
        for each in (prediction(22, before), prediction(22))
    )

    assert added.uncertainty == pytest.approx(whole.uncertainty, rel=0.05)
    assert added.floor == pytest.approx(
        before.predicted(fit(20), 0.03, USUAL).floor, rel=0.1
    )


def test_all_images_are_linearised_again_once_a_tenth_more_have_come() -> None:
    assert GROWTH == 1.1
    before = prediction(20)
    assert prediction(22, before).n_whole == 20
    assert prediction(23, before).n_whole == 23
