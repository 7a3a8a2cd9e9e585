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
from lightpen.estimation.uncertainty.instrument import (
    Instrument,
    adjusted_instrument,
    instrument_of_files,
    with_rig,
)
from lightpen.model.limits import USUAL
from lightpen.model.rigid import rig_of
from lightpen_extensions.simulator.scenes import row_of_cameras
from lightpen_extensions.simulator.swings import (
    PAPER_TIP,
    paper_camera,
    paper_pen,
    swing_poses,
)

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


TIP = np.diag([1e-6, 4e-6, 9e-6])  # mm^2
LOOSE = replace(PEN, scale_sigma=3e-5, diameter_sigma=0.03)


def test_an_instrument_of_files_is_as_uncertain_as_they_state() -> None:
    rig = row_of_cameras(3, 1000.0)
    found = instrument_of_files(rig, LOOSE, PAPER_TIP, TIP, 0.02)

    at, n_leds = found.parameters, LOOSE.n_leds
    sizes = [3, 9, 9, 9, 12, 1, 3 * n_leds]
    kinds = [at.tip, *at.cameras, at.extrinsics, at.diameter, at.leds]
    ends = np.cumsum(sizes).tolist()
    assert kinds == [slice(e - n, e) for e, n in zip(ends, sizes, strict=True)]
    leds = found.covariance[at.leds, at.leds]
    # Shifts and turns of all LEDs are none of their errors; the scale is about the tip.
    by_scale = (LOOSE.leds - PAPER_TIP).ravel()
    alone = leds - 3e-5**2 * np.outer(by_scale, by_scale)
    arms = LOOSE.leds - LOOSE.leds.mean(axis=0)
    for axis in np.eye(3):
        moves = np.tile(axis, n_leds), np.cross(axis, arms).ravel()
        np.testing.assert_allclose(alone @ np.column_stack(moves), 0, atol=1e-15)
    assert np.trace(alone) == pytest.approx((3 * n_leds - 6) * 0.002**2)
    parts = [TIP, *(each.covariance for each in rig.cameras), rig.covariance]
    parts += [np.array([[0.03**2]]), leds]
    for place, part in zip(kinds, parts, strict=True):
        assert part is not None
        np.testing.assert_allclose(found.covariance[place, place], part)
    for place in (*at.cameras, at.extrinsics, at.diameter):
        others = np.delete(found.covariance[place], np.r_[place], axis=1)
        assert not others.any()
    assert (found.sigma, found.tip_pen.tolist()) == (0.02, PAPER_TIP.tolist())


def test_a_stated_covariance_of_the_leds_is_taken_beside_their_scale() -> None:
    stated = np.diag(np.linspace(1e-6, 3e-6, 3 * PEN.n_leds))
    pens = [replace(LOOSE, led_covariance=stated), replace(LOOSE, led_sigma=None)]
    reported, silent = (instrument_of_files(RIG, p, PAPER_TIP, TIP, 0.02) for p in pens)

    leds = reported.parameters.leds
    more = reported.covariance - silent.covariance
    np.testing.assert_allclose(more[leds, leds], stated, atol=1e-18)


def test_an_instrument_before_another_rig_keeps_its_pen_and_tip(
    solved: tuple[Adjustment, Budget],
) -> None:
    old: Instrument = adjusted_instrument(*solved)
    rig = row_of_cameras(2, 1000.0)

    found = with_rig(old, rig)

    at, was = found.parameters, old.parameters
    kept, before = (np.r_[each.tip, each.diameter, each.leds] for each in (at, was))
    np.testing.assert_array_equal(
        found.covariance[np.ix_(kept, kept)], old.covariance[np.ix_(before, before)]
    )
    fresh = instrument_of_files(rig, PEN, old.tip_pen, TIP, old.sigma).covariance
    others = np.r_[(*at.cameras, at.extrinsics)]
    np.testing.assert_array_equal(
        found.covariance[np.ix_(others, others)], fresh[np.ix_(others, others)]
    )
    assert not found.covariance[np.ix_(others, kept)].any()
    assert (found.rig, found.pen, found.sigma) == (rig, old.pen, old.sigma)
    np.testing.assert_array_equal(found.tip_pen, old.tip_pen)
