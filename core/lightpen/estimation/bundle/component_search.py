"""Joint estimation of all variance components."""

from collections.abc import Callable
from functools import partial

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.image_fields import size_of
from lightpen.estimation.bundle.unknowns import (
    NO_COMPONENTS,
    NONE,
    Components,
    Unknowns,
)
from lightpen.estimation.variance_components import (
    FITTED,
    Component,
    find_beside,
    find_component,
)
from lightpen.model.coverage import inverse

ROUNDS = 3  # of finding each component beside the others


def find_components(
    unknowns: Unknowns, information: FloatArray, right: FloatArray, before: Components
) -> Components:
    """Estimate the components jointly, given those of the previous pass.

    ``information`` (p, p) and ``right`` (p,) are of images and measurements.
    """
    now = before
    for _ in range(ROUNDS):
        known, now = now, _found_once(unknowns, information, right, now)
        if now.sigmas == known.sigmas:  # converged
            break
    return now


def _found_once(
    unknowns: Unknowns, information: FloatArray, right: FloatArray, before: Components
) -> Components:
    at, prior = unknowns.layout, unknowns.prior_information(before)
    covariance = inverse(information + prior)
    by_priors = unknowns.prior_right()
    values = covariance @ (right + by_priors)

    def own(place: slice) -> tuple[FloatArray, FloatArray]:
        known = inverse(covariance[place, place])
        return known - prior[place, place], known @ values[place] - by_priors[place]

    def find(place: slice, stated: float = 0.0) -> Component:
        return find_component(*own(place), stated)

    oval, seat = _found_seat(unknowns, *own(at.whole_seat), before)
    return before._replace(
        leds=_found_leds(unknowns, find),
        seat=seat,
        oval=oval,
        drift=_likely(find(at.drift)),
        fields=tuple(
            size_of(field, *own(place))
            for field, place in zip(unknowns.fields, at.fields, strict=True)
        ),
    )


def _found_seat(
    unknowns: Unknowns, information: FloatArray, right: FloatArray, before: Components
) -> tuple[Component, tuple[Component, ...]]:
    """Return the components of an oval seat and of its modes.

    An oval, equation (7), is a combination of modes, and either can explain the other.
    The likelier is fitted; the other is expected by its likelihood ratio to that.
    ``information`` (21, 21) and ``right`` (21,) are of all modes, without any prior.
    """
    find = partial(find_beside, information, right)
    truest = unknowns.seat_variances(NO_COMPONENTS)
    alone = find(unknowns.oval, np.diag(truest))
    waves_alone = found = _found_waves(unknowns, find, truest, NONE)
    ahead = 0.5 * (alone.gain - max(wave.gain for wave in waves_alone))
    oval = _likely(alone) if ahead >= 0 else NONE
    variances = unknowns.seat_variances(before)
    if oval.sigma > 0 or (variances > truest).any():
        found = _found_waves(unknowns, find, variances, oval)
    waves = tuple(_likely(wave, unknowns.priors.form_error) for wave in found)
    if oval.sigma > 0:
        doubt = float(np.exp(-0.5 * np.logaddexp(0.0, ahead)))
        waves = tuple(
            wave._replace(expected_sigma=max(wave.expected_sigma, doubt * other.sigma))
            for wave, other in zip(waves, waves_alone, strict=True)
        )
    elif any(wave.sigma > 0 for wave in waves):
        doubt = float(np.exp(-0.5 * np.logaddexp(0.0, -ahead)))
        oval = NONE._replace(expected_sigma=doubt * alone.sigma)
    else:
        oval = NONE._replace(expected_sigma=alone.expected_sigma)
    return oval, waves


def _found_waves(
    unknowns: Unknowns,
    find: Callable[..., Component],
    variances: FloatArray,
    oval: Component,
) -> list[Component]:
    """Return the component of each kind of mode, given the variances of the others."""
    by_oval = oval.sigma**2 * unknowns.oval @ unknowns.oval.T
    first = unknowns.layout.whole_seat.start
    waves = []
    for place in unknowns.layout.seat:
        some = slice(place.start - first, place.stop - first)
        others = variances.copy()
        others[some] = 0.0
        moves = np.eye(len(variances))[:, some]
        beside_it = by_oval + np.diag(others)
        waves.append(find(moves, beside_it, unknowns.priors.form_error))
    return waves


def _found_leds(
    unknowns: Unknowns, find: Callable[[slice, float], Component]
) -> Component:
    stated, of_leds = unknowns.priors.led_sigma, unknowns.priors.led_covariance
    if of_leds is not None:  # by the least known direction
        stated = float(np.sqrt(np.linalg.eigvalsh(of_leds)[-1]))
    component = find(unknowns.layout.leds, stated or 0.0)
    if stated is None or (component.is_significant and component.sigma > stated):
        return component
    return NONE


def _likely(found: Component, stated: float = 0.0) -> Component:
    """Return a component if it is significant; else one of standard deviation 0."""
    if found.sigma > stated and found.exceeds(FITTED):
        return found
    return NONE._replace(expected_sigma=found.expected_sigma)
