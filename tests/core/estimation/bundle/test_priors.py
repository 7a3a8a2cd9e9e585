"""What is known before the images: as the files state it, else as it is assumed."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_rigs import row_of_cameras

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.priors import priors_of, thermal_growth
from lightpen.model.fisheye import LensField
from lightpen.model.limits import USUAL, Assumptions
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig, rig_of
from lightpen_extensions.simulator.swings import paper_camera, paper_pen

CAMERA = paper_camera()
UNKNOWN = replace(CAMERA, covariance=None)
PEN = replace(paper_pen(), led_sigma=0.003)
BARE = replace(
    PEN, led_sigma=None, scale_sigma=None, diameter_sigma=None, expansion=None
)


def pair(covariance: FloatArray | None) -> Rig:
    places = np.array([[0.0, 0, 0], [-1000.0, 0, 0]])
    return Rig((CAMERA, CAMERA), np.tile(np.eye(3), (2, 1, 1)), places, covariance)


def test_intrinsics_beside_a_field_are_without_what_goes_with_the_field() -> None:
    field = LensField.of(CAMERA.width, CAMERA.height, 0.02, 500.0)
    own = np.diag(np.full(len(CAMERA.intrinsics), 1e-6))
    with_field = replace(CAMERA, lens_field=replace(field, intrinsics_covariance=own))

    (found,) = priors_of(rig_of(with_field), PEN, USUAL).cameras
    np.testing.assert_array_equal(found.covariance, own)
    assert not found.assumed


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

    assumed = (*priors.cameras, priors.scale, priors.temperature, priors.diameter)
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


def test_each_further_camera_is_assumed_to_stand_as_uncertainly() -> None:
    three = replace(row_of_cameras(3, 1000.0), covariance=None)
    assumptions = Assumptions(rotation=0.01, translation=5.0)
    assumed = priors_of(three, PEN, assumptions).extrinsics

    assert assumed is not None
    sigmas = 2 * (3 * [0.01] + 3 * [5.0])
    np.testing.assert_allclose(assumed.covariance, np.diag(np.square(sigmas)))


@pytest.mark.parametrize(
    ("pen", "assumptions", "sigma", "is_assumed"),
    [
        # Measured, with the expansion as uncertain as a tenth of it.
        (PEN, Assumptions(temperature_c=26.0, temperature=0.5), (0.5, 0.6), False),
        (PEN, Assumptions(temperature_c=26.0, expansion_share=0.2), (0.5, 1.2), False),
        (PEN, Assumptions(warmth=3.0), (3.0, 0.0), True),
        # All of what is not corrected.
        (BARE, Assumptions(temperature_c=26.0, temperature=0.2), (0.2, 6.0), True),
    ],
)
def test_the_size_is_as_uncertain_as_temperature_and_expansion(
    pen: Pen, assumptions: Assumptions, sigma: tuple[float, float], is_assumed: bool
) -> None:
    """In kelvins of the expansion: by the temperature, and by the expansion."""
    expansion = pen.expansion or assumptions.expansion
    stated = replace(pen, expansion_sigma=None, temperature_c=None)
    prior = priors_of(rig_of(CAMERA), stated, assumptions).temperature

    assert np.sqrt(prior.covariance[0, 0]) == pytest.approx(
        expansion * np.hypot(*sigma)
    )
    assert prior.assumed == is_assumed


def test_a_warm_pen_is_larger_by_its_expansion() -> None:
    warm = Assumptions(temperature_c=26.0, temperature=0.5)
    pen = replace(PEN, expansion=2e-5, expansion_sigma=1e-6, temperature_c=21.0)
    prior = priors_of(rig_of(CAMERA), pen, warm).temperature

    assert thermal_growth(pen, warm) == pytest.approx(5 * 2e-5)
    # Half a kelvin of 20 ppm, and five of 1 ppm.
    assert prior.covariance[0, 0] == pytest.approx(1e-5**2 + 5e-6**2)
    assert not prior.assumed


def test_a_pen_is_measured_at_20_degrees_unless_its_file_says_otherwise() -> None:
    pen = replace(PEN, expansion=2e-5, temperature_c=None)
    assert thermal_growth(pen, Assumptions(temperature_c=23.0)) == pytest.approx(6e-5)


def test_an_unknown_temperature_corrects_nothing_and_is_assumed() -> None:
    pen = replace(PEN, expansion=2e-5)
    prior = priors_of(rig_of(CAMERA), pen, USUAL).temperature

    assert thermal_growth(pen, USUAL) == 0.0
    assert np.sqrt(prior.covariance[0, 0]) == pytest.approx(2e-5 * USUAL.warmth)
    assert prior.assumed


def test_an_unknown_expansion_corrects_nothing_and_counts_all_warmth() -> None:
    warm = Assumptions(temperature_c=30.0)
    prior = priors_of(rig_of(CAMERA), BARE, warm).temperature

    assert thermal_growth(BARE, warm) == 0.0
    assert np.sqrt(prior.covariance[0, 0]) > 10 * USUAL.expansion
    assert prior.assumed


@pytest.mark.parametrize("value", [-0.001, float("nan"), float("inf")])
def test_an_assumption_that_is_no_uncertainty_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="focal_length"):
        Assumptions(focal_length=value)
