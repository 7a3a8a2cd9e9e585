from dataclasses import replace
from pathlib import Path

import numpy as np
from tests.simulated_centers import simulate_centers

from lightpen.arrays import FloatArray
from lightpen.detection.observations import observe_centers
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.uncertainty.disc_normals import (
    effect_of_normals,
    turned_normals,
)
from lightpen.formats.observation_files import Centers
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses

CAMERA, PEN = paper_camera(), replace(paper_pen(), led_sigma=0.002)
TURN = np.array([0.03, -0.02])  # rad


def calibrated(
    turn: FloatArray, sigma: float | None = None, tilt: float = 0.0
) -> Calibration:
    """Return the calibration by a pen file whose normals are turned.

    The camera turns by ``tilt``, px, times the sine of the lean.
    """
    rng = np.random.default_rng(3)
    swing = swing_poses(120, rng, pen=PEN, camera=CAMERA)
    pixels = simulate_centers(
        CAMERA, PEN, swing.rotations, swing.translations, 0.005, rng
    )
    pixels[..., 1] += tilt * swing.rotations[:, 2, 1, None]
    centers = Centers(np.arange(len(pixels)), pixels, Path("centers.csv"))
    of_normals = None if sigma is None else sigma**2 * np.eye(3)
    pen = replace(
        PEN, normals=turned_normals(PEN.normals, turn), normal_covariance=of_normals
    )
    return calibrate(CAMERA, pen, observe_centers(centers, CAMERA, pen))


def test_a_turn_of_all_normals_is_budgeted_where_the_pen_file_states_it() -> None:
    without, stated = calibrated(TURN), calibrated(TURN, 0.3)

    np.testing.assert_allclose(stated.joint.tip_pen, without.joint.tip_pen)
    before = without.budget.expanded_uncertainty[:3]
    assert (before < stated.budget.expanded_uncertainty[:3]).all()
    more = np.diag(stated.instrument.covariance - without.instrument.covariance)
    assert (more[:3] > 0).all()


def test_the_effect_of_a_turn_is_the_change_of_the_tip_by_it() -> None:
    straight, turned = calibrated(np.zeros(2)), calibrated(TURN)

    effect = effect_of_normals(straight.bundle)

    change = turned.bundle.state.tip_pen - straight.bundle.state.tip_pen
    largest = np.abs(change).max()
    np.testing.assert_allclose(effect.gain[:3] @ TURN, change, atol=0.1 * largest)
    assert (np.linalg.eigvalsh(effect.information) > 0).all()


def test_the_effect_of_a_turn_is_found_beside_a_camera_that_turns() -> None:
    straight, turned = (calibrated(turn, tilt=0.3) for turn in (np.zeros(2), TURN))

    assert straight.bundle.unknowns.fields
    effect = effect_of_normals(straight.bundle)
    assert effect.gain.shape == (straight.bundle.unknowns.number, 2)
    change = turned.bundle.state.tip_pen - straight.bundle.state.tip_pen
    largest = np.abs(change).max()
    np.testing.assert_allclose(effect.gain[:3] @ TURN, change, atol=0.1 * largest)
