"""The budget: its shares, blocks, halves and the weakest direction."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_calibrations import CAMERA, PEN, lasting, observed
from tests.simulated_centers import simulate_centers
from tests.simulated_swings import swing_of_kind

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.adjustment import Adjustment, adjust
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.estimation.bundle.priors import priors_of
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.contact.joint import ContactModel, JointFit, fit_contact
from lightpen.estimation.uncertainty.budget import (
    Budget,
    ContributionName,
    center_errors,
    combine,
    compare_halves,
    contributions_of,
)
from lightpen.model.camera import Camera
from lightpen.model.limits import USUAL
from lightpen.model.pen import Pen
from lightpen.model.rigid import rig_of
from lightpen_extensions.simulator.swings import Swing, swing_poses

SWING = swing_poses(100, np.random.default_rng(0))
FEW = swing_poses(40, np.random.default_rng(0))


def seen(errors: FloatArray, swing: Swing = SWING) -> FloatArray:
    return errors + simulate_centers(
        CAMERA,
        PEN,
        *(swing.rotations, swing.translations, 0.0),
        np.random.default_rng(0),
    )


def fit(errors: FloatArray, swing: Swing = SWING) -> JointFit:
    return fit_contact(
        ContactModel.of(CAMERA, PEN, seen(errors, swing)),
        *(swing.rotations, swing.tip_pen, swing.cone_cam),
    )


def calibrated(
    errors: FloatArray, swing: Swing = FEW, camera: Camera = CAMERA, pen: Pen = PEN
) -> Calibration:
    return calibrate(camera, pen, observed(swing, errors, camera, pen))


def of_images(joint: JointFit, some: slice) -> JointFit:
    """Return what some of the images say about the same solution."""
    return replace(
        joint,
        rotations=joint.rotations[some],
        residuals=joint.residuals[some],
        used=joint.used[some],
        information=joint.information[some],
        gradients=joint.gradients[some],
    )


# That count what may be there besides, and is no part of the fit.
DOUBTED = (
    *(ContributionName.SEAT, ContributionName.FORM, ContributionName.DRIFT),
    *(ContributionName.LENS, ContributionName.CAMERA),
)
OF_STATION = {ContributionName.FORM}


def adjusted(calibration: Calibration) -> Adjustment:
    """Return the adjustment of the same images."""
    pixels = calibration.observations.pixels[calibration.used]
    fit = calibration.joint
    state = BundleState(rig_of(CAMERA), PEN, fit.tip_pen, fit.cone_cam, fit.rotations)
    return adjust(state, pixels[:, None], priors_of(state.rig, PEN, USUAL))


def without(budget: Budget, *names: ContributionName) -> FloatArray:
    """Return the covariance without some shares, (6, 6)."""
    kept = (s.covariance for s in budget.shares if s.name not in names)
    return np.asarray(sum(kept))


def variance_of(budget: Budget, name: ContributionName) -> FloatArray:
    """Return what one share adds to the variances of tip and cone, (6,); 0 if none."""
    found = [np.diag(s.covariance) for s in budget.shares if s.name is name]
    return found[0] if found else np.zeros(6)


def test_blocks_of_independent_noise_scatter_as_that_noise_does() -> None:
    adjustment = adjusted(calibrated(0.05 * lasting(0, 0.0)))
    ratios, raised = [], []
    for seed in range(10):
        joint = fit(0.05 * lasting(seed, 0.0, 100))
        for first in range(0, 99, 9):  # three blocks each
            budget = combine(adjustment, of_images(joint, slice(first, first + 9)))
            ratios.append(budget.block_ratio)
            raised.append(budget.correlation_factor > 1)

    # 110 draws of 12 degrees of freedom fix the mean to 4 %.
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.15)
    # Chi-square of 12 degrees of freedom is beyond 26.217 once in a hundred.
    np.testing.assert_array_equal(raised, np.array(ratios) > 26.217 / 12)


@pytest.mark.slow
def test_independent_noise_is_hardly_ever_raised() -> None:
    factors = [
        calibrated(0.05 * lasting(seed, 0.0)).budget.correlation_factor
        for seed in range(20)
    ]

    assert np.mean(np.array(factors) > 1) <= 0.1


# The scatter is 11 times the independent one. 10 draws fix a variance to 45 %.
@pytest.mark.slow
def test_correlated_noise_raises_the_uncertainty_to_the_scatter_it_has() -> None:
    swing = swing_of_kind(60, np.random.default_rng(0), "operator")
    errors, independent, raised = [], [], []
    for seed in range(10):
        result = calibrated(0.05 * lasting(seed, 0.9, 60), swing)
        errors.append(result.joint.tip_pen - swing.tip_pen)
        independent.append(np.diag(result.budget.independent_noise)[:3])
        # What seat and centres may do besides is counted, not drawn.
        raised.append(np.diag(without(result.budget, *DOUBTED))[:3])
    scatter = np.mean(np.square(errors), axis=0)

    assert (scatter > 1.5 * np.mean(independent, axis=0)).all()
    # The files' shares are covered, not drawn.
    assert (np.mean(raised, axis=0) > 0.5 * scatter).all()
    assert (np.mean(raised, axis=0) < 3.0 * scatter).all()


def test_halves_differ_as_predicted() -> None:
    outside = 0
    for seed in range(100):
        halves = compare_halves(fit(0.05 * lasting(seed, 0.0, 100)))
        beyond = np.abs(halves.difference) > halves.expanded_uncertainty
        outside += int(beyond.sum())

    assert 3 <= outside <= 30  # 4.6 % of 300 lie beyond two standard deviations


def test_halves_agree_with_two_fits_of_half_the_images() -> None:
    errors = 0.05 * lasting(1, 0.0, 100)
    errors[1::2, :4] = np.nan  # so that one half knows more than the other
    odd, even = (
        fit_contact(
            ContactModel.of(CAMERA, PEN, seen(errors)[k::2]),
            *(SWING.rotations[k::2], SWING.tip_pen, SWING.cone_cam),
        )
        for k in (0, 1)
    )

    halves = compare_halves(fit(errors))

    np.testing.assert_allclose(halves.difference, odd.tip_pen - even.tip_pen, atol=2e-4)
    variances = np.diag(odd.covariance + even.covariance)[:3]
    # Each half has a noise of its own.
    np.testing.assert_allclose(
        halves.expanded_uncertainty, 2 * np.sqrt(variances), rtol=0.05
    )


@pytest.mark.slow
def test_the_shares_add_up_to_the_covariance() -> None:
    for correlation in (0.0, 0.9):
        result = calibrated(0.05 * lasting(8, correlation, 40))
        budget, bundle = result.budget, adjusted(result).bundle
        np.testing.assert_allclose(
            budget.covariance, sum(share.covariance for share in budget.shares)
        )
        np.testing.assert_allclose(
            budget.expanded_uncertainty, 2 * np.sqrt(np.diag(budget.covariance))
        )
        if correlation == 0.0:  # then they are those of the bundle itself
            assert budget.correlation_factor == 1
            at = bundle.layout
            whole = bundle.effective @ bundle.gain.T
            besides = bundle.part(*at.seat) + bundle.part(at.drift)
            besides += sum(map(bundle.part, (*at.fields, at.scale, *at.cameras)))
            np.testing.assert_allclose(
                np.diag(without(budget, *DOUBTED)), np.diag(whole - besides), rtol=0.01
            )


def test_what_a_file_may_be_off_beyond_its_prior_counts_as_camera() -> None:
    bundle = adjusted(calibrated(0.05 * lasting(8, 0.0))).bundle
    at, unknowns = bundle.layout.cameras[0], bundle.unknowns
    (stated,) = unknowns.priors.cameras
    # As much again as its prior.
    doubted = replace(stated, beyond=stated.covariance)
    priors = replace(unknowns.priors, cameras=(doubted,))
    given = replace(bundle, unknowns=replace(unknowns, priors=priors))

    plain, more = (
        next(
            s.covariance
            for s in contributions_of(each, 40, np.eye(6))
            if s.name is ContributionName.CAMERA
        )
        for each in (bundle, given)
    )

    # Its prior counts variances of 1e-6 as exact.
    np.testing.assert_allclose(
        np.diag(more - plain), np.diag(bundle.part(at)), rtol=5e-3
    )


def test_a_camera_whose_file_states_nothing_makes_the_share_assumed() -> None:
    bundle = adjusted(calibrated(0.05 * lasting(8, 0.0))).bundle
    unknowns = bundle.unknowns
    (stated,) = unknowns.priors.cameras
    for assumed in (False, True):
        priors = replace(unknowns.priors, cameras=(replace(stated, assumed=assumed),))
        given = replace(bundle, unknowns=replace(unknowns, priors=priors))
        shares = contributions_of(given, 40, np.eye(6))
        (camera,) = (s for s in shares if s.name is ContributionName.CAMERA)
        assert camera.assumed == assumed


def test_the_camera_has_the_share_by_which_a_perfect_one_would_shrink_u() -> None:
    errors = 0.03 * lasting(2, 0.0)
    assert CAMERA.covariance is not None
    exact = replace(CAMERA, covariance=1e-8 * CAMERA.covariance)

    with_camera = calibrated(errors).budget
    without = calibrated(errors, camera=exact).budget

    # What a camera may turn with the lean stays.
    shares = (variance_of(b, ContributionName.CAMERA) for b in (with_camera, without))
    by_camera = np.subtract(*shares)
    assert (by_camera > 0).all()
    # What a lens may leave depends on the camera by the images alone.
    kept = (variance_of(each, ContributionName.LENS) for each in (with_camera, without))
    lens = np.subtract(*kept)
    drop = np.diag(with_camera.covariance - without.covariance) - lens
    # Solved for, a camera also lets more of the noise in.
    assert (drop >= 0.9 * by_camera).all()


def test_a_camera_that_states_nothing_is_assumed_and_counted() -> None:
    errors = 0.03 * lasting(3, 0.0)
    assumed = calibrated(errors, camera=replace(CAMERA, covariance=None)).budget

    marked = {share.name for share in assumed.shares if share.assumed}
    assert marked == {ContributionName.CAMERA, *OF_STATION}


def test_a_pen_that_states_nothing_is_assumed_and_counted() -> None:
    bare = replace(PEN, led_sigma=None, scale_sigma=None, diameter_sigma=None)
    budget = calibrated(0.03 * lasting(4, 0.0), pen=bare).budget

    marked = {share.name for share in budget.shares if share.assumed}
    assert marked == {ContributionName.DIAMETER, *OF_STATION}


def test_of_files_that_state_all_only_the_station_is_assumed() -> None:
    budget = calibrated(0.03 * lasting(5, 0.0)).budget

    assert {share.name for share in budget.shares if share.assumed} == OF_STATION


def test_the_scale_of_the_pen_is_no_uncertainty_of_its_tip() -> None:
    errors = 0.03 * lasting(6, 0.0)
    exact, loose = (
        calibrated(errors, pen=replace(PEN, scale_sigma=sigma)).budget
        for sigma in (1e-7, 1e-3)
    )

    np.testing.assert_allclose(
        loose.expanded_uncertainty[:3], exact.expanded_uncertainty[:3], rtol=1e-3
    )


def test_too_few_images_for_blocks_are_said_so() -> None:
    calibration = calibrated(0.01 * lasting(4, 0.0))

    some = of_images(fit(0.01 * lasting(4, 0.0, 100)), slice(8))
    budget = combine(adjusted(calibration), some)

    assert budget.block_ratio == 1
    assert budget.correlation_factor == 1


def test_the_weakest_direction_is_where_the_covariance_is_largest() -> None:
    budget = calibrated(0.05 * lasting(5, 0.0)).budget
    weakest = budget.weakest_direction
    tip = budget.covariance[:3, :3]

    assert weakest @ tip @ weakest == pytest.approx(np.linalg.eigvalsh(tip)[-1])
    assert budget.weakest_uncertainty == pytest.approx(
        2 * np.sqrt(weakest @ tip @ weakest)
    )
    squares = [budget.weakest_share(share) ** 2 for share in budget.shares]
    assert sum(squares) == pytest.approx(budget.weakest_uncertainty**2)
    assert budget.weakest_share(budget.largest_share) ** 2 == max(squares)


def test_a_seat_that_jitters_counts_as_seat_and_not_as_noise_too() -> None:
    rng = np.random.default_rng(8)
    for _ in range(3):
        jitter = 0.01 * rng.standard_normal(SWING.translations.shape)
        moved = replace(SWING, translations=SWING.translations + jitter)
        budget = calibrated(0.03 * lasting(8, 0.0, 100), moved).budget

        assert any(share.name is ContributionName.SEAT for share in budget.shares)
        # Chance alone makes it 1.5 once in a hundred; the jitter would make it 2.5.
        assert budget.block_ratio < 2
        assert budget.correlation_factor < 2


def test_errors_of_the_centres_shrink_with_up_to_thirty_images() -> None:
    bundle = adjusted(calibrated(0.05 * lasting(8, 0.0))).bundle

    once = (USUAL.center_bias / bundle.sigma) ** 2 * bundle.independent_noise
    # Of fewer images each has a posture of its own; of more, postures repeat.
    for n_images, times in ((5, 1.0), (30, 1.0), (60, 2.0), (300, 10.0)):
        np.testing.assert_allclose(center_errors(bundle, n_images), times * once)
