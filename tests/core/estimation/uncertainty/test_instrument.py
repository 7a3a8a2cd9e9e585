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
from lightpen.model.assumptions import USUAL
from lightpen.model.rig import rig_of
from lightpen.simulator.swings import paper_camera, paper_pen, swing_poses

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

    # Beside mechanics, which are none of the instrument, noise makes the tip less sure.
    noises = adjustment.unshrunk.independent_noise, adjustment.whole.independent_noise
    own, beside_mechanics = (np.trace(each[:3, :3]) for each in noises)
    expected = 3 * np.trace(noise.covariance[:3, :3]) * own / beside_mechanics
    assert added == pytest.approx(expected)


def test_what_holding_back_changed_is_part_of_the_instrument(
    solved: tuple[Adjustment, Budget],
) -> None:
    adjustment, budget = solved
    state = adjustment.bundle.state
    moved = replace(state, tip_pen=state.tip_pen + np.array([0.01, 0, -0.02]))
    held = replace(adjustment, bundle=replace(adjustment.bundle, state=moved))

    added = tip_variance(held, budget) - tip_variance(adjustment, budget)

    assert added == pytest.approx(0.01**2 + 0.02**2)
