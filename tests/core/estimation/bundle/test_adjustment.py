"""Assumed camera priors shrink to what images show; single numbers stay in doubt."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import simulate_rig_centers

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.adjustment import (
    MOST_SHRUNK,
    Adjustment,
    _expected_squares,
    adjust,
)
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.estimation.bundle.priors import priors_of
from lightpen.estimation.uncertainty.budget import ContributionName, contributions_of
from lightpen.model.limits import USUAL
from lightpen.model.rigid import rig_of
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses

CAMERA = replace(paper_camera(), covariance=None)
PEN = replace(paper_pen(), led_sigma=0.002)
CY = 3


def adjusted(off: float, seed: int = 1) -> tuple[Adjustment, FloatArray]:
    """Return the adjustment by a file with cy off, px, and the error of the tip, mm."""
    rng = np.random.default_rng(seed)
    swing = swing_poses(60, rng)
    pixels = simulate_rig_centers(rig_of(CAMERA), PEN, swing, 0.03, rng)
    file = CAMERA.with_intrinsics(CAMERA.intrinsics + off * np.eye(9)[CY])
    rig = rig_of(file)
    state = BundleState(rig, PEN, swing.tip_pen, swing.cone_cam, swing.rotations)
    found = adjust(state, pixels, priors_of(rig, PEN, USUAL))
    return found, found.bundle.tip_pen - swing.tip_pen


def test_a_right_file_that_states_nothing_is_taken_as_it_is() -> None:
    found, _ = adjusted(0.0)
    (prior,) = found.bundle.unknowns.priors.cameras
    (assumed,) = found.priors.cameras

    np.testing.assert_allclose(
        prior.covariance, MOST_SHRUNK**2 * assumed.covariance, rtol=1e-6
    )
    assert prior.beyond is not None
    # Its cy is seen to 1 px; so much it may be off, with even odds before the images.
    assert 0.05 < np.sqrt(prior.beyond[CY, CY]) < 1.5


@pytest.mark.parametrize("off", [1.0, 2.0, 5.0, 12.0])
def test_u_covers_a_file_that_is_off_and_states_nothing(off: float) -> None:
    found, error = adjusted(off)
    bundle = found.bundle
    shares = contributions_of(bundle, 60, found.correlation.noise)
    covariance = sum((each.covariance for each in shares), np.zeros((6, 6)))

    assert (np.abs(error) < 2.5 * np.sqrt(np.diag(covariance)[:3])).all()
    assert {each.name for each in shares if each.assumed} >= {ContributionName.CAMERA}


def test_one_number_is_off_as_likely_as_the_images_let_it() -> None:
    seen, deviation = 400.0, np.array([0.0, 0.05, 0.15, 2.0])
    for off in deviation:
        (found,) = _expected_squares(np.array([[seen]]), np.array([seen * off]), 0.0)

        # Of exact, and of a standard deviation of 1: densities of what is seen.
        exact = np.exp(-0.5 * seen * off**2) * np.sqrt(seen)
        wide = 1 / seen + 1
        loose = np.exp(-0.5 * off**2 / wide) / np.sqrt(wide)
        mean, variance = off * seen / (seen + 1), 1 / (seen + 1)
        expected = loose / (loose + exact) * (mean**2 + variance)
        assert found == pytest.approx(expected, rel=1e-6)
