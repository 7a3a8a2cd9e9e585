"""Self-check of the model without an artefact: half of the LEDs predict the others.

In each image the pose by one half of the LEDs, the tip not held in its cone, predicts
the other half; the halves go round. Noise alone makes such errors differ from image to
image at random. Wrong files, a pen that bends or a lens that the model does not follow
make them follow the posture, however small they are in one image. So the errors are
divided by their standard uncertainty and parted into what a polynomial of the posture
explains and the rest: the check value is the square root of the ratio of both per
degree of freedom (F test [1]_), 1 by chance.

References
----------
.. [1] G. A. F. Seber, A. J. Lee, "Linear regression analysis", 2nd ed., Wiley 2003,
   section 4.3.
"""

from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.estimation.bundle.linearised import BundleState, views_at
from lightpen.model.quantiles import normal_quantile
from lightpen.model.rigid import nearest_rotation, vector_from_rotation

FEWEST_LEDS = 4  # of the half that predicts
N_POSE = 6
DEGREE = 2  # of the polynomial of the posture
FEWEST_IMAGES = 30
MOSTLY_USED = 0.7  # of the images, by an LED that takes part
CHANCE = 0.01  # that noise alone exceeds the limit
RIDGE = 1e-9  # of the trace of the normal matrix of a pose


class SelfCheck(NamedTuple):
    """Cross-validation: prediction of LEDs by the others."""

    value: float  # 1 by chance; larger where errors follow the posture
    limit: float  # 99 % quantile for noise alone

    @property
    def is_passed(self) -> bool:
        """Whether chance may make the value."""
        return self.value <= self.limit


def check_prediction(
    state: BundleState,
    residuals: FloatArray,
    used: BoolArray,
    noise: FloatArray,
    correlation_factor: float = 1.0,
) -> SelfCheck | None:
    """Predict LEDs by others; None with too few LEDs or images.

    Parameters
    ----------
    residuals : (N, C, L, 2) array
        Observed minus modelled centres at the state, px; a move of the pen as a whole
        makes no difference.
    used : (N, C, L) array of bool
    noise : (N, C, L) array
        Noise of the LEDs' centres, by that of a usual one.
    correlation_factor : float
        Factor on the variance of a mean by noise that is correlated between images.
    """
    views = views_at(state, residuals)  # whose derivatives alone are needed
    J = np.stack(
        [np.concatenate([view.turn, view.cone], axis=-1) for view in views], axis=1
    )
    weights = np.where(used, 1 / noise, 0.0)[..., None]
    # LEDs that few images use, or none, would leave no image that uses all.
    seen = np.asarray(used.any(axis=1))
    taking_part = seen.mean(axis=0) >= MOSTLY_USED
    n_leds = int(taking_part.sum())
    n_half = max((n_leds + 1) // 2, FEWEST_LEDS)
    whole = np.asarray(seen[:, taking_part].all(axis=1))
    if n_leds <= n_half or whole.sum() < FEWEST_IMAGES:
        return None
    basis = _posture_basis(state.rotations[whole])
    at = np.ix_(whole, np.arange(used.shape[1]), taking_part)
    used, weights = used[at], weights[at]
    residuals = weights * np.where(used[..., None], residuals[at], 0.0)
    J = weights[..., None] * J[at]
    by_led = np.einsum("nclik,nclim->nlkm", J, J)
    right = np.einsum("nclik,ncli->nlk", J, residuals)
    explained = total = 0.0
    for first in range(n_leds):
        predicts = (np.arange(n_leds) - first) % n_leds < n_half
        known = by_led[:, predicts].sum(axis=1)
        trace = np.trace(known, axis1=1, axis2=2)[:, None, None]
        covariance = np.linalg.inv(known + RIDGE * trace * np.eye(N_POSE))
        pose = np.einsum("nkm,nm->nk", covariance, right[:, predicts].sum(axis=1))
        others = J[:, :, ~predicts]
        errors = residuals[:, :, ~predicts] - np.einsum("nclik,nk->ncli", others, pose)
        variances = 1 + np.einsum("nclik,nkm,nclim->ncli", others, covariance, others)
        flat = (errors / np.sqrt(variances)).reshape(len(errors), -1)
        explained += float(np.sum((basis.T @ flat) ** 2))
        total += float(np.sum(flat**2))
    n_images, n_functions = basis.shape
    if total <= explained:
        return None
    ratio = explained / n_functions / ((total - explained) / (n_images - n_functions))
    # The errors of one image are as many as its coordinates less those of a pose.
    n_free = n_functions * float(2 * np.median(used.sum(axis=(1, 2))) - N_POSE)
    spread = normal_quantile(CHANCE) * np.sqrt(2 / n_free)
    limit = np.sqrt(max(correlation_factor, 1.0) * (1 + spread))
    return SelfCheck(float(np.sqrt(ratio)), float(limit))


def _posture_basis(rotations: FloatArray) -> FloatArray:
    """Return orthonormal polynomials of the turn against the mean posture, (N, q)."""
    mean = nearest_rotation(rotations.mean(axis=0))
    turns = vector_from_rotation(mean.T @ rotations)
    columns = [
        np.prod(turns[:, chosen], axis=1)
        for degree in range(DEGREE + 1)
        for chosen in map(list, combinations_with_replacement(range(3), degree))
    ]
    return np.asarray(np.linalg.qr(np.stack(columns, axis=1))[0])
