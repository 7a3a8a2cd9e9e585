"""What is known before the images: as the files state it, else as it is assumed."""

from dataclasses import replace

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.estimation.priors import priors_of
from lightpen.model.assumptions import USUAL, Assumptions
from lightpen.model.rig import Rig, rig_of
from lightpen.simulator.swings import paper_camera, paper_pen

CAMERA = paper_camera()
UNKNOWN = replace(CAMERA, covariance=None)
PEN = replace(paper_pen(), led_sigma=0.003)
BARE = replace(PEN, led_sigma=None, scale_sigma=None, diameter_sigma=None)


def pair(covariance: FloatArray | None) -> Rig:
    places = np.array([[0.0, 0, 0], [-1000.0, 0, 0]])
    return Rig((CAMERA, CAMERA), np.tile(np.eye(3), (2, 1, 1)), places, covariance)


def test_what_files_state_is_taken_as_stated() -> None:
    priors = priors_of(rig_of(CAMERA), PEN, USUAL)

    assert CAMERA.covariance is not None
    np.testing.assert_array_equal(priors.cameras[0].covariance, CAMERA.covariance)
    assert priors.led_sigma == 0.003
    np.testing.assert_allclose(priors.scale.covariance, [[5e-6**2]])
    np.testing.assert_allclose(priors.diameter.covariance, [[0.02**2]])
    stated = (*priors.cameras, priors.scale, priors.diameter)
    assert not any(prior.assumed for prior in stated)


def test_what_files_leave_out_is_assumed_and_not_zero() -> None:
    priors = priors_of(rig_of(UNKNOWN), BARE, USUAL)

    assumed = (*priors.cameras, priors.scale, priors.diameter)
    assert all(prior.assumed for prior in assumed)
    assert all((np.diag(prior.covariance)[:8] > 0).all() for prior in assumed)
    assert priors.led_sigma is None


def test_an_assumed_camera_has_its_focal_lengths_off_together() -> None:
    assumptions = Assumptions(focal_length=0.01, aspect=0.0003, principal_point=7.0)
    prior = priors_of(rig_of(UNKNOWN), PEN, assumptions).cameras[0].covariance

    ratio = np.array([-CAMERA.fy / CAMERA.fx, 1.0]) / CAMERA.fx
    assert np.sqrt(prior[0, 0]) == pytest.approx(0.01 * CAMERA.fx)
    assert np.sqrt(ratio @ prior[:2, :2] @ ratio) == pytest.approx(0.0003, rel=1e-3)
    np.testing.assert_allclose(np.sqrt(np.diag(prior)[2:4]), 7.0)


@pytest.mark.parametrize("n", [5, 8])
def test_coefficients_that_no_assumption_names_are_held(n: int) -> None:
    camera = replace(UNKNOWN, distortion=np.arange(n) / 1000)
    prior = priors_of(rig_of(camera), PEN, USUAL).cameras[0].covariance

    assert prior.shape == (4 + n, 4 + n)
    assert not prior[8:].any()


def test_one_camera_has_no_place_in_a_rig_to_know() -> None:
    assert priors_of(rig_of(CAMERA), PEN, USUAL).extrinsics is None


def test_where_cameras_stand_is_taken_as_stated_or_assumed() -> None:
    stated = priors_of(pair(4.0 * np.eye(6)), PEN, USUAL).extrinsics
    assumptions = Assumptions(rotation=0.01, translation=5.0)
    assumed = priors_of(pair(None), PEN, assumptions).extrinsics

    assert stated is not None
    assert assumed is not None
    np.testing.assert_array_equal(stated.covariance, 4.0 * np.eye(6))
    assert (stated.assumed, assumed.assumed) == (False, True)
    np.testing.assert_allclose(
        np.sqrt(np.diag(assumed.covariance)), [0.01] * 3 + [5.0] * 3
    )


@pytest.mark.parametrize("value", [-0.001, float("nan"), float("inf")])
def test_an_assumption_that_is_no_uncertainty_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="focal_length"):
        Assumptions(focal_length=value)
