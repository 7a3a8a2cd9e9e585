"""The search for effects beside a fit knows what a fit with them would know."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import simulate_rig_centers

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.adjustment import with_effects
from lightpen.estimation.bundle.bundle import Bundle, fit_bundle
from lightpen.estimation.bundle.effect_search import search_effects
from lightpen.estimation.bundle.effects import lens_and_timing, mechanics_of, size_of
from lightpen.estimation.bundle.linearised import BundleState, eliminate, views_at
from lightpen.estimation.bundle.priors import priors_of
from lightpen.estimation.bundle.seat_modes import axes_of_cone, seat_modes_of
from lightpen.estimation.bundle.unknowns import Unknowns
from lightpen.model.assumptions import USUAL
from lightpen.model.rig import Rig, from_first, rig_of
from lightpen.simulator.samples import row_of_cameras
from lightpen.simulator.swings import paper_camera, paper_pen, seen_from, swing_poses

PEN = replace(paper_pen(), led_sigma=0.002)
ROW = row_of_cameras(2, 1000.0)
RIGS = {"one": rig_of(paper_camera()), "two": from_first(ROW)}
SECOND = np.arange(24) > 15


def fitted(rig: Rig, jitter: float) -> tuple[Bundle, FloatArray]:
    """Return a fit with all mechanics and uneven noise, and the pixels.

    Of one camera the last images are of a second cone.
    """
    rng = np.random.default_rng(3)
    swing = swing_poses(24, rng)
    if rig.n_cameras > 1:
        swing = seen_from(swing, ROW.rotations[0], ROW.translations[0])
    between = np.array([30.0, 5.0, 0.0])
    moves = jitter * rng.standard_normal((24, 3)) + np.outer(SECOND, between)
    moved = replace(swing, translations=swing.translations + moves)
    if rig.n_cameras > 1:
        moved = replace(
            moved, translations=moved.translations - np.outer(SECOND, between)
        )
    noise = rng.uniform(0.5, 2.0, (rig.n_cameras, PEN.n_leds))
    pixels = simulate_rig_centers(rig, PEN, moved, 0.0, rng)
    pixels += 0.03 * noise[..., None] * rng.standard_normal(pixels.shape)
    pixels[rng.random(pixels.shape[:-1]) < 0.1] = np.nan
    state = BundleState(rig, PEN, swing.tip_pen, swing.cone_cam, swing.rotations)
    if rig.n_cameras == 1:
        state = replace(state, at_second=SECOND, between_rig=between)
    views, axes = views_at(state, pixels), axes_of_cone(swing.rotations)
    effects = mechanics_of(views, swing.rotations, axes, PEN.leds, 0.003)
    priors, modes = priors_of(rig, PEN, USUAL), seat_modes_of(swing.rotations)
    bundle = fit_bundle(
        *(pixels, state, priors, modes, 1.0), effects=effects, noise=noise
    )
    assert (bundle.components.jitter.covariance is not None) == (jitter > 0)
    return bundle, pixels


@pytest.mark.parametrize("jitter", [0.0, 0.03])
@pytest.mark.parametrize("rig", RIGS)
def test_effects_beside_a_fit_have_the_equations_of_fitted_ones(
    rig: str, jitter: float
) -> None:
    bundle, pixels = fitted(RIGS[rig], jitter)
    state, unknowns, used = bundle.state, bundle.unknowns, bundle.used
    sigma, seat = bundle.weight_sigma, bundle.components.jitter.covariance
    searched = lens_and_timing(pixels, used, state.rig.cameras)
    both = Unknowns.of(
        *(unknowns.start, unknowns.priors, seat_modes_of(unknowns.start.rotations)),
        *((*unknowns.effects, *searched), unknowns.noise),
    )
    views = both.views_at(state, pixels)
    eliminated = eliminate(views, used, sigma, seat)
    information, _ = both.system(eliminated)

    at = [both.layout.effects[len(unknowns.effects) + k] for k in range(len(searched))]
    new = np.concatenate([np.arange(place.start, place.stop) for place in at])
    rest = np.delete(np.arange(both.number), new)
    coupled = information[np.ix_(rest, new)]
    step = 1e-3 * np.random.default_rng(1).standard_normal(len(bundle.values))
    found = search_effects(bundle, pixels, bundle.values - step)
    columns = np.concatenate([each.columns for each in searched], axis=-1)
    left = np.where(used[..., None], bundle.residuals, 0.0)
    weighed = left / (sigma * unknowns.noise[..., None]) ** 2
    right = np.einsum("nclie,ncli->e", columns, weighed) - coupled.T @ step
    S = information[np.ix_(new, new)] - coupled.T @ bundle.covariance @ coupled
    for each, place, effect in zip(found, at, searched, strict=True):
        own = np.isin(new, np.arange(place.start, place.stop))
        moves = -bundle.covariance[:6] @ coupled[:, own]
        np.testing.assert_allclose(each.by_unknowns, moves, rtol=1e-5, atol=1e-9)
        size = size_of(effect, S[np.ix_(own, own)], right[own])
        assert each.component.sigma == size.sigma
        assert each.component.gain == pytest.approx(size.gain, rel=1e-6, abs=1e-6)
        expected = each.by_unknowns @ size.expected @ each.by_unknowns.T
        np.testing.assert_allclose(each.covariance, expected, rtol=1e-5, atol=1e-15)


def test_what_the_images_say_does_not_depend_on_the_priors() -> None:
    """Play and sag are expected downward, which is no right side of the images."""
    bundle, _ = fitted(RIGS["one"], 0.0)
    held = tuple(each.at_zero for each in bundle.unknowns.effects)
    free = with_effects(bundle, bundle.unknowns.effects)

    assert np.abs(free.unknowns.prior_right(free.components)).max() > 0
    scale = np.sqrt(np.diag(bundle.information))
    for each in (free, with_effects(bundle, held)):
        np.testing.assert_allclose(each.right / scale, bundle.right / scale, atol=1e-6)
