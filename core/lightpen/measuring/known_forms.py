"""Touches on known form: they refine the points of a part, and with them the tip.

The corrections ``z`` of all points, of the ball radius and of the parameters of the
instrument have the joint covariance ``P``. With the distances ``d`` of the touches from
a feature of known size, their derivatives ``G`` by ``z``, ``M`` by the motions of the
feature and ``s`` by its size, exact touches have

    d + G z + M m + s v = 0

with the error ``v`` of the size. In the left null space of ``M`` that is a linear
observation of ``z``, which conditions it [1]_.

References
----------
.. [1] R. E. Kalman, "A new approach to linear filtering and prediction problems",
   J. Basic Eng. 82 (1960) 35-45.
"""

from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs

from lightpen.arrays import FloatArray
from lightpen.measuring.compensation import surface_of
from lightpen.measuring.features import fit_feature
from lightpen.measuring.plan import Plan, PlannedFeature, Side
from lightpen.measuring.surfaces import SURFACES, FeatureKind
from lightpen.measuring.touches import PartTouches
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.model.quantiles import chi_square_quantile

BY_CHANCE = 0.005  # probability of a larger deviation from a known form


@dataclass(frozen=True, eq=False)
class Refinement:
    """Refinement of the instrument by touches on known form."""

    names: tuple[str, ...]  # features of known form
    is_used: bool  # the touches agree with the known form; else they refine nothing
    shift: FloatArray  # (q,), of the parameters of the instrument
    before: FloatArray  # (q, q), covariance of the parameters
    after: FloatArray  # (q, q)
    chi_square: float  # deviation of the touches by their covariance
    n_free: int  # its degrees of freedom


def refine(
    plan: Plan, touches: PartTouches, sensitivity: FloatArray, covariance: FloatArray
) -> tuple[PartTouches, Refinement | None]:
    """Return touches refined by those on features of known form.

    ``sensitivity`` (3 N, q) is the derivative of the coordinates of the touches by the
    parameters of the instrument, ``covariance`` (q, q) is theirs.
    """
    known = [each for each in plan.features if each.known is not None]
    if not known:
        return touches, None
    n_inputs, n_parameters = touches.n_inputs, len(covariance)
    cross = sensitivity @ covariance
    P = np.zeros((n_inputs + n_parameters, n_inputs + n_parameters))
    P[:n_inputs, :n_inputs] = touches.inputs
    P[: len(cross), n_inputs:], P[n_inputs:, : len(cross)] = cross, cross.T
    P[n_inputs:, n_inputs:] = covariance
    observed = [_observed(each, touches) for each in known]
    y = np.concatenate([each[0] for each in observed])
    H = np.zeros((len(y), len(P)))
    H[:, :n_inputs] = np.concatenate([each[1] for each in observed])
    S, start = H @ P @ H.T, 0
    for own, _, of_size in observed:
        stop = start + len(own)
        S[start:stop, start:stop] += of_size
        start = stop
    gain = np.linalg.solve(S, H @ P).T
    z, after = -gain @ y, P - gain @ H @ P
    chi_square = float(y @ np.linalg.solve(S, y))
    is_used = chi_square <= chi_square_quantile(len(y), BY_CHANCE)
    refinement = Refinement(
        tuple(each.name for each in known),
        is_used,
        z[n_inputs:],
        covariance,
        after[n_inputs:, n_inputs:],
        chi_square,
        len(y),
    )
    if not is_used:
        return touches, refinement
    refined = replace(
        touches,
        points_cam=touches.points_cam + z[: n_inputs - 1].reshape(-1, 3),
        ball_radius=touches.ball_radius + float(z[n_inputs - 1]),
        joint=after[:n_inputs, :n_inputs],
    )
    return refined, refinement


def _observed(
    planned: PlannedFeature, touches: PartTouches
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return distances (M,) free of motions, by the inputs, and covariance by size."""
    assert planned.kind is not None
    assert planned.known is not None
    at = touches.first_of(planned.name)
    owner = touches.owners[at[0]]
    fit = fit_feature(planned.kind, touches.points_cam[at])
    model = SURFACES[planned.kind]
    q = (touches.points_cam[at] - fit.origin) @ fit.axes
    found, J = model.derivatives(q, fit.sizes)
    distances, J = found.values.ravel(), J.reshape(-1, model.n_unknowns)
    n_motions, k = len(model.free), found.values.shape[1]
    by_inputs = np.zeros((len(J), touches.n_inputs))
    by_point = found.by_point @ fit.axes.T
    for i, touch in enumerate(at.tolist()):
        by_inputs[i * k : i * k + k, 3 * touch : 3 * touch + 3] = by_point[i]
    by_size = np.zeros(len(J))
    if planned.kind is not FeatureKind.PLANE:
        surface = surface_of(structs.replace(planned, name=owner), fit, touches)
        sign = -1.0 if surface.side is Side.INSIDE else 1.0
        assert planned.nominal is not None
        assert planned.nominal.diameter is not None
        by_size = J[:, n_motions]
        size = planned.nominal.diameter / 2 + sign * touches.ball_radius
        distances = distances + by_size * (size - fit.sizes[0])
        by_inputs[:, -1] = sign * by_size
    left = np.linalg.svd(J[:, :n_motions])[0][:, n_motions:].T
    of_size = (planned.known / (2 * COVERAGE_FACTOR)) * (left @ by_size)
    return left @ distances, left @ by_inputs, np.outer(of_size, of_size)
