"""Search for effects of lens and timing that improve a fit without them.

The information about the unknowns of all effects takes one pass about the fit, with all
other unknowns marginalised. An effect whose likelihood gains is a candidate: it
is fitted. The others are held at 0, and what they may be all the same moves tip and
cone by its own covariance.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.bundle import Bundle
from lightpen.estimation.bundle.components import NO_COMPONENTS
from lightpen.estimation.bundle.effects import (
    Effect,
    EffectComponent,
    lens_and_timing,
    size_of,
)
from lightpen.estimation.bundle.linearised import N_CONE, CameraView, eliminate
from lightpen.model.information import inverse


@dataclass(frozen=True, eq=False)
class SearchedEffect:
    """An effect beside a fit without it."""

    effect: Effect
    component: EffectComponent
    # (6, k), error of (tip, cone) per unknown of the effect if it is left out.
    by_unknowns: FloatArray
    is_candidate: bool  # whether the images support it

    @property
    def covariance(self) -> FloatArray:
        """Covariance of (tip, cone) by the possible size of the effect, (6, 6)."""
        G = self.by_unknowns
        return np.asarray(G @ self.component.expected @ G.T)


def search_effects(
    bundle: Bundle, pixels: FloatArray, residuals_at: FloatArray
) -> tuple[SearchedEffect, ...]:
    """Search a fit without effects of lens and timing for them.

    ``pixels`` (N, C, L, 2) are the LED centres, px; the residuals of the fit belong to
    the values ``residuals_at`` (p,) of the unknowns.
    """
    state, used, unknowns = bundle.state, bundle.used, bundle.unknowns
    effects = lens_and_timing(pixels, used, state.rig.cameras)
    columns = np.concatenate([each.columns for each in effects], axis=-1)
    columns /= unknowns.noise[..., None, None]
    views = unknowns.views_at(state, pixels)
    own, with_others, right = _information(bundle, views, columns)
    nothing = NO_COMPONENTS.with_no_effects(unknowns.effects)
    prior = unknowns.prior_information(nothing)
    plain = inverse(bundle.information + bundle.measured_information + prior)
    models = []
    without = plain @ bundle.right
    for covariance, values in ((bundle.covariance, bundle.values), (plain, without)):
        change = values - residuals_at
        S = own - with_others.T @ covariance @ with_others
        models.append((0.5 * (S + S.T), right - with_others.T @ change))
    found, first = [], 0
    by_all = -bundle.covariance[:6] @ with_others
    for effect in effects:
        at = slice(first, first + effect.number)
        first = at.stop
        sizes = [size_of(effect, S[at, at], b[at]) for S, b in models]
        is_candidate = any(size.is_supported for size in sizes)
        found.append(SearchedEffect(effect, sizes[0], by_all[:, at], is_candidate))
    return tuple(found)


def _information(
    bundle: Bundle, views: tuple[CameraView, ...], columns: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return information of effects (E, E), with the unknowns (p, E), and right (E,).

    The unknowns of each image are eliminated.
    """
    used, sigma = bundle.used, bundle.weight_sigma
    eliminated = eliminate(views, used, sigma, bundle.components.jitter.covariance)
    n_images, _, n_leds = used.shape
    unknowns, q = bundle.unknowns, eliminated.nuisance_covariance.shape[-1]
    K = unknowns.mixing.shape[0]
    mask = used[..., None, None]
    A = np.where(mask, columns, 0.0) / sigma
    E = A.shape[-1]
    flat = A.reshape(-1, E)
    by_image = A.reshape(n_images, -1, E)
    inner = np.concatenate(
        [
            np.stack([view.turn for view in views], axis=1),
            np.stack([view.cone for view in views], axis=1),
        ],
        axis=-1,
    )
    inner = np.where(mask, inner, 0.0) / sigma
    crossed = np.swapaxes(inner.reshape(n_images, -1, inner.shape[-1]), 1, 2) @ by_image
    to_inner = crossed[:, :q]  # (N, q, E)
    half = np.linalg.cholesky(eliminated.nuisance_covariance)
    left = (np.swapaxes(half, 1, 2) @ to_inner).reshape(-1, E)
    own = flat.T @ flat - left.T @ left
    # Of the columns of the normal equations, cone first, LEDs last.
    with_columns = np.tensordot(eliminated.turn_by_step, to_inner, ([0, 1], [0, 1]))
    by_cone = crossed[:, N_CONE : 2 * N_CONE]
    with_columns[:N_CONE] += by_cone.sum(axis=0)
    at_diameter = K - 3 * n_leds - 1
    at_effects = slice(at_diameter - views[0].effects.shape[-1], at_diameter)
    row = N_CONE
    for c, view in enumerate(views):
        k = view.own.shape[-1]
        of_view = A[:, c].reshape(-1, E)
        rows = view.own.reshape(-1, k) / sigma
        with_columns[row : row + k] += rows.T @ of_view
        row += k
        rows = view.effects.reshape(len(of_view), -1) / sigma
        with_columns[at_effects] += rows.T @ of_view
        rows = np.nan_to_num(view.diameter).reshape(-1) / sigma
        with_columns[at_diameter] += rows @ of_view
        led = np.swapaxes(view.led, 0, 1).reshape(n_leds, -1, 3) / sigma
        of_led = np.swapaxes(A[:, c], 0, 1).reshape(n_leds, -1, E)
        with_columns[K - 3 * n_leds :] += (np.swapaxes(led, 1, 2) @ of_led).reshape(
            3 * n_leds, E
        )
    coupled = eliminated.turn_by_step[..., :N_CONE]  # (N, q, 3)
    cones = by_cone + np.swapaxes(coupled, 1, 2) @ to_inner
    shifted = np.tensordot(unknowns.forms, cones, ([0], [0])).reshape(-1, E)
    with_others = np.concatenate([unknowns.mixing.T @ with_columns, shifted])
    residuals = bundle.residuals / unknowns.noise[..., None]
    residuals = np.where(used[..., None], residuals, 0.0) / sigma
    return own, with_others, flat.T @ residuals.ravel()
