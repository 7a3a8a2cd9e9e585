"""Search for effects of a station that improve a fit without them.

The information about the unknowns of all effects takes one pass about the fit, with all
other unknowns marginalised. An effect whose likelihood gains is a candidate: it
is fitted, and so are mechanics. The others are held at 0, and what they may be all the
same moves tip and cone by its own covariance.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.estimation.bundle.bundle import Bundle
from lightpen.estimation.bundle.components import NO_COMPONENTS
from lightpen.estimation.bundle.effects import (
    Effect,
    EffectComponent,
    effects_of,
    gain_of,
    prior_of,
    size_of,
)
from lightpen.estimation.bundle.linearised import (
    N_CONE,
    CameraView,
    eliminate,
    views_at,
)
from lightpen.model.information import inverse, known_by


@dataclass(frozen=True, eq=False)
class SearchedEffect:
    """An effect beside a fit without it.

    Attributes
    ----------
    covariance : (6, 6) array
        Of (tip, cone) by what the effect may be where it is held at 0, mm^2.
    is_supported : bool
        Whether the images support it: by itself, or among all mechanics.
    is_candidate : bool
        Whether it is fitted: the images support it, or it is one of mechanics.
    """

    effect: Effect
    component: EffectComponent
    covariance: FloatArray
    is_supported: bool
    is_candidate: bool


def search_effects(
    bundle: Bundle,
    pixels: FloatArray,
    compliance: float,
    residuals_at: FloatArray | None = None,
) -> tuple[SearchedEffect, ...]:
    """Search a fit without effects for them.

    Parameters
    ----------
    pixels : (N, C, L, 2) array
        LED centres, px.
    compliance : float
        Standard deviation that is assumed, mm.
    residuals_at : (p,) array or None
        Values of the unknowns to which the residuals belong; None are those of the fit.
    """
    state, used, sigma = bundle.state, bundle.used, bundle.weight_sigma
    views = views_at(state, pixels)
    effects = effects_of(
        views,
        pixels,
        used,
        state.rotations,
        state.pen.leds,
        state.rig.cameras,
        compliance,
    )
    columns = np.concatenate([each.columns for each in effects], axis=-1)
    noise = bundle.unknowns.noise
    views = tuple(view.in_units_of(noise[:, c]) for c, view in enumerate(views))
    columns = columns / noise[..., None, None]
    own, with_others, right = _information(bundle, views, columns, used, sigma)
    at_best = inverse(bundle.covariance) @ bundle.values
    start = bundle.values if residuals_at is None else residuals_at
    prior = bundle.unknowns.prior_information(NO_COMPONENTS)
    plain = inverse(bundle.information + bundle.measured_information + prior)
    models = []
    for covariance in (bundle.covariance, plain):
        change = covariance @ at_best - start
        S = own - with_others.T @ covariance @ with_others
        models.append((0.5 * (S + S.T), right - with_others.T @ change))
    by_all = -bundle.covariance[:6] @ with_others
    ends = np.cumsum([effect.number for effect in effects])
    places = [
        np.arange(end - x.number, end) for end, x in zip(ends, effects, strict=True)
    ]
    mechanical = [i for i, effect in enumerate(effects) if effect.is_mechanical]
    of_all = np.concatenate([places[i] for i in mechanical])
    S, b = models[0]
    gain, shares = _of_mechanics(
        [effects[i] for i in mechanical],
        S[np.ix_(of_all, of_all)],
        b[of_all],
        by_all[:, of_all],
    )
    found = []
    for i, (effect, at) in enumerate(zip(effects, places, strict=True)):
        sizes = [size_of(effect, S[np.ix_(at, at)], b[at]) for S, b in models]
        share = by_all[:, at] @ sizes[0].expected @ by_all[:, at].T
        is_supported = any(size.is_supported for size in sizes)
        if i in mechanical:
            share = shares[mechanical.index(i)]
            is_supported |= gain > 0
        is_candidate = is_supported or i in mechanical
        found.append(
            SearchedEffect(effect, sizes[0], share, is_supported, is_candidate)
        )
    return tuple(found)


def _of_mechanics(
    effects: list[Effect], S: FloatArray, right: FloatArray, by_all: FloatArray
) -> tuple[float, list[FloatArray]]:
    """Return the gain by mechanics, and their shares in the covariance of (tip, cone).

    Held at 0 together, they err together: half of what two have in common counts to
    each.

    Parameters
    ----------
    S, right : (k, k), (k,) array
        Information about their unknowns and its right side.
    by_all : (6, k) array
        Error of (tip, cone) by these where they are held at 0.
    """
    prior = prior_of(effects)
    covariance = inverse(S + known_by(prior))
    gain = gain_of(S, right, prior)
    if gain <= 0:  # an estimate does not follow them
        mean = covariance @ right
        covariance = covariance + np.outer(mean, mean)
    ends = np.cumsum([effect.number for effect in effects]).tolist()
    places = [
        slice(end - effect.number, end)
        for effect, end in zip(effects, ends, strict=True)
    ]
    halves = [by_all[:, at] @ covariance[at] @ by_all.T for at in places]
    return gain, [0.5 * (half + half.T) for half in halves]


def _information(
    bundle: Bundle,
    views: tuple[CameraView, ...],
    columns: FloatArray,
    used: BoolArray,
    sigma: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return information of effects (E, E), with the unknowns (p, E), and right (E,).

    The unknowns of each image are eliminated.
    """
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
    row = N_CONE
    for c, view in enumerate(views):
        k = view.own.shape[-1]
        seen = used[:, c, :, None]
        of_view = A[:, c].reshape(-1, E)
        rows = np.where(seen[..., None], view.own, 0.0).reshape(-1, k) / sigma
        with_columns[row : row + k] += rows.T @ of_view
        row += k
        rows = np.where(seen, view.diameter, 0.0).reshape(-1) / sigma
        with_columns[K - 3 * n_leds - 1] += rows @ of_view
        led = np.where(seen[..., None], view.led, 0.0) / sigma
        led = np.swapaxes(led, 0, 1).reshape(n_leds, -1, 3)
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
