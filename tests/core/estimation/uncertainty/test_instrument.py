"""What a swing leaves to measure with is as uncertain as its tip."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import simulate_rig_centers

from lightpen.estimation.bundle.adjustment import Adjustment, adjust
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.estimation.bundle.priors import priors_of
from lightpen.estimation.contact.joint import ContactModel, fit_contact
from lightpen.estimation.uncertainty.budget import Budget, ContributionName, combine
from lightpen.estimation.uncertainty.instrument import adjusted_instrument
from lightpen.model.limits import USUAL
from lightpen.model.rigid import rig_of
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses

RIG = rig_of(paper_camera())
PEN = replace(paper_pen(), led_sigma=0.002)


@pytest.fixture(scope="module")
def solved() -> tuple[Adjustment, Budget]:
    rng = np.random.default_rng(0)
    swing = swing_poses(30, rng)
    pixels = simulate_rig_centers(RIG, PEN, swing, 0.03, rng)
    joint = fit_contact(
        ContactModel(RIG, PEN, pixels),
        *(swing.rotations, swing.tip_pen, swing.cone_cam),
    )
    state = BundleState(RIG, PEN, joint.tip_pen, joint.cone_cam, joint.rotations)
    adjustment = adjust(state, pixels, priors_of(RIG, PEN, USUAL))
    return adjustment, combine(adjustment, joint)


def tip_variance(adjustment: Adjustment, budget: Budget) -> float:
    """Return the variance of the tip by an instrument, summed over x y z, mm^2."""
    instrument = adjusted_instrument(adjustment, budget)
    at = instrument.parameters.tip
    return float(np.trace(instrument.covariance[at, at]))


def test_noise_that_counts_more_than_once_does_so_in_the_instrument(
    solved: tuple[Adjustment, Budget],
) -> None:
    adjustment, budget = solved
    (noise,) = (each for each in budget.shares if each.name is ContributionName.NOISE)
    others = tuple(each for each in budget.shares if each is not noise)
    raised = replace(noise, covariance=4 * noise.covariance)
    more = replace(budget, shares=(raised, *others))

    added = tip_variance(adjustment, more) - tip_variance(adjustment, budget)

    assert added == pytest.approx(3 * np.trace(noise.covariance[:3, :3]))


def test_what_a_file_may_be_off_beyond_its_prior_is_part_of_the_instrument(
    solved: tuple[Adjustment, Budget],
) -> None:
    adjustment, budget = solved
    bundle, priors = adjustment.bundle, adjustment.bundle.unknowns.priors
    at, first = bundle.layout.cameras[0], priors.cameras[0]
    doubted = replace(first, beyond=3 * first.covariance)
    cameras = (doubted, *priors.cameras[1:])
    unknowns = replace(bundle.unknowns, priors=replace(priors, cameras=cameras))
    wider = replace(adjustment, bundle=replace(bundle, unknowns=unknowns))

    added = tip_variance(wider, budget) - tip_variance(adjustment, budget)

    gain = bundle.gain[:3, at] @ bundle.prior_information[at, at]
    assert added == pytest.approx(3 * np.trace(gain @ first.covariance @ gain.T))
