"""Joint estimation of all variance components."""

from collections.abc import Callable

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.image_fields import size_of
from lightpen.estimation.bundle.unknowns import NONE, Components, Unknowns
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

    return before._replace(
        leds=_found_leds(unknowns, find),
        seat=_found_seat(unknowns, *own(at.whole_seat), before),
        drift=_likely(find(at.drift)),
        fields=tuple(
            size_of(field, *own(place))
            for field, place in zip(unknowns.fields, at.fields, strict=True)
        ),
    )


def _found_seat(
    unknowns: Unknowns, information: FloatArray, right: FloatArray, before: Components
) -> tuple[Component, ...]:
    """Return the component of each kind of seat mode beside those of the others.

    ``information`` (21, 21) and ``right`` (21,) are of all modes, without any prior.
    """
    variances, form_error = unknowns.seat_variances(before), unknowns.priors.form_error
    first, seat = unknowns.layout.whole_seat.start, []
    for place in unknowns.layout.seat:
        some = slice(place.start - first, place.stop - first)
        others = variances.copy()
        others[some] = 0.0
        moves = np.eye(len(variances))[:, some]
        found = find_beside(information, right, moves, np.diag(others), form_error)
        seat.append(_likely(found, form_error))
    return tuple(seat)


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
