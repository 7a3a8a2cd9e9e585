"""Joint test of the numbers of one file against the images.

The deviation of a posterior mean from a prior mean has the covariance of the prior less
that of the posterior: equation (8) of method.md. A number is inconsistent where
it deviates by more than three such standard deviations. As one wrong number moves what
is fitted for others, the smallest set of numbers is sought which, released from its
prior, leaves no other number inconsistent; of several such sets, the likeliest.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, combinations_with_replacement
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.estimation.bundle.bundle import Bundle
from lightpen.estimation.bundle.linearised import BundleState, views_at
from lightpen.messages import Message
from lightpen.model.coverage import inverse, known_by, normal_quantile
from lightpen.model.rigid import nearest_rotation, vector_from_rotation

LIMIT = 3.0  # standard deviations
ROUNDING = 1e-6  # of a variance
RELEASED_WIDTH = 100.0  # times stated deviation or fitted change: no information
TRIED_TOGETHER = 3  # numbers; further wrong ones are found one by one


@dataclass(frozen=True, eq=False)
class FileNumber:
    """A named number of a file, as a linear function of the k unknowns of that file."""

    what: Message
    unit: str
    value: float  # stated value in ``unit``
    by: FloatArray  # (k,), derivative of the number by the unknowns
    # (k,), change of the unknowns that changes the number, and no other one, by 1.
    along: FloatArray
    size: float = 1.0  # unit of the unknowns in ``unit``
    camera: str = ""  # name of the camera whose file states it


@dataclass(frozen=True, eq=False)
class _Estimate:
    """Posterior of the unknowns of a file, some numbers released."""

    values: FloatArray
    covariance: FloatArray
    correlation_excess: FloatArray
    gain: float  # twice the gain in log likelihood over the file's values


@dataclass(frozen=True)
class ImageEstimate:
    """Estimate of a number without its prior, in the unit of the unknowns."""

    # `change` and `sigma`: difference from the file, with its standard deviation.
    change: float
    sigma: float
    stated_sigma: float  # standard deviation that the file states
    deviations: float  # the difference in standard deviations, by equation (8)


@dataclass(frozen=True, eq=False)
class FileFit:
    """Prior and likelihood of the k unknowns of one file, all others marginalised."""

    numbers: tuple[FileNumber, ...]
    stated: FloatArray  # (k, k), covariance that the file states
    # `information` and `right`: (k, k) and (k,), of the images.
    information: FloatArray
    right: FloatArray
    # (k, k), covariance of ``right`` beyond the information, by correlated noise.
    correlation_excess: FloatArray

    @classmethod
    def of(
        cls,
        numbers: Iterable[FileNumber],
        stated: FloatArray,
        bundle: Bundle,
        place: slice,
        excess: FloatArray | None,
        mean: float = 0.0,
    ) -> "FileFit":
        """Return prior and likelihood of the unknowns at a place of a fit.

        ``stated`` (k, k) is the prior covariance, ``excess`` (p, p) that of
        `lightpen.estimation.bundle.noise_correlation.Correlation`; deviations are from
        the prior's ``mean``.
        """
        known = inverse(bundle.covariance[place, place])
        by_excess = np.zeros_like(known) if excess is None else excess[place, place]
        return cls(
            numbers=tuple(numbers),
            stated=inverse(known_by(stated)),
            information=known - bundle.prior_information[place, place],
            right=known @ (bundle.values[place] - mean),
            correlation_excess=known @ by_excess @ known,
        )

    @cached_property
    def contradicted(self) -> tuple[int, ...]:
        """Indices of the numbers that the images contradict."""
        if not self._inconsistent(()):
            return ()
        observable = [i for i in range(len(self.numbers)) if self._is_observable(i)]
        sets = [
            [s for s in combinations(observable, size) if self._explains(s)]
            for size in range(1, TRIED_TOGETHER + 1)
        ]
        for each in sets:
            if each:
                return max(each, key=lambda s: self._solved(s).gain)
        return self._one_by_one()

    @property
    def max_deviation(self) -> float:
        """Largest deviation of a number that is inconsistent as stated, else 0."""
        return max(self._inconsistent(()).values(), default=0.0)

    def estimate_without(self, i: int, released: tuple[int, ...]) -> ImageEstimate:
        """Estimate a number without its prior and the priors of the released ones."""
        by, prior = self.numbers[i].by, self._prior_variance(i)
        others = tuple(j for j in released if j != i)
        free = self._solved((*others, i))
        variance = float(by @ (free.covariance + free.correlation_excess) @ by)
        return ImageEstimate(
            change=float(by @ free.values),
            sigma=float(np.sqrt(max(variance, ROUNDING * prior))),
            stated_sigma=float(np.sqrt(prior)),
            deviations=self._deviations(i, others),
        )

    def _prior_variance(self, i: int) -> float:
        by = self.numbers[i].by
        return float(by @ self.stated @ by)

    def _is_observable(self, i: int) -> bool:
        """Return whether the images determine a number at all."""
        by, prior = self.numbers[i].by, self._prior_variance(i)
        return float(prior - by @ self._solved(()).covariance @ by) > ROUNDING * prior

    def _deviations(self, i: int, released: tuple[int, ...]) -> float:
        """Return the deviation of a number in standard deviations, equation (8)."""
        by, prior, solved = (
            self.numbers[i].by,
            self._prior_variance(i),
            self._solved(released),
        )
        learned = prior - float(by @ solved.covariance @ by)
        if learned <= ROUNDING * prior:
            return 0.0
        variance = max(
            learned + float(by @ solved.correlation_excess @ by), ROUNDING * prior
        )
        return abs(float(by @ solved.values)) / float(np.sqrt(variance))

    def _inconsistent(self, released: tuple[int, ...]) -> dict[int, float]:
        """Return the deviations of inconsistent numbers, some others released."""
        rest = (i for i in range(len(self.numbers)) if i not in released)
        each = {i: self._deviations(i, released) for i in rest}
        return {i: deviations for i, deviations in each.items() if deviations > LIMIT}

    def _is_inconsistent(self, i: int, released: tuple[int, ...]) -> bool:
        """Return whether a released number is inconsistent when it alone is not."""
        others = tuple(j for j in released if j != i)
        return self._deviations(i, others) > LIMIT

    def _explains(self, released: tuple[int, ...]) -> bool:
        """Return whether releasing exactly these numbers resolves the contradiction."""
        return not self._inconsistent(released) and all(
            self._is_inconsistent(i, released) for i in released
        )

    def _one_by_one(self) -> tuple[int, ...]:
        """Return numbers to release, found one at a time, the worst first."""
        released: tuple[int, ...] = ()
        while inconsistent := self._inconsistent(released):
            released = (*released, max(inconsistent, key=lambda i: inconsistent[i]))
        return tuple(i for i in released if self._is_inconsistent(i, released))

    @cached_property
    def _solutions(self) -> dict[tuple[int, ...], _Estimate]:
        return {}

    def _solved(self, released: tuple[int, ...]) -> _Estimate:
        key = tuple(sorted(released))
        if key not in self._solutions:
            covariance = self.stated
            for i in key:
                each = self.numbers[i]
                change = abs(float(each.by @ self._solved(()).values))
                width = RELEASED_WIDTH * max(
                    change, float(np.sqrt(self._prior_variance(i)))
                )
                covariance = covariance + width**2 * np.outer(each.along, each.along)
            self._solutions[key] = self._solved_with(covariance)
        return self._solutions[key]

    def _solved_with(self, stated: FloatArray) -> _Estimate:
        covariance = inverse(self.information + inverse(stated))
        values = covariance @ self.right
        correlation_excess = covariance @ self.correlation_excess @ covariance
        return _Estimate(
            values, covariance, correlation_excess, float(self.right @ values)
        )


# Self-check of the model without an artefact: half of the LEDs predict the others.
#
# In each image the pose by one half of the LEDs, the tip not held in its cone, predicts
# the other half; the halves go round. Noise alone makes such errors differ from image
# to image at random. Wrong files, a pen that bends or a lens that the model does not
# follow make them follow the posture, however small they are in one image. So the
# errors are divided by their standard uncertainty and parted into what a polynomial of
# the posture explains and the rest: the check value is the square root of the ratio of
# both per degree of freedom (F test [1]_), 1 by chance.
#
# References
# ----------
# .. [1] G. A. F. Seber, A. J. Lee, "Linear regression analysis", 2nd ed., Wiley 2003,
#    section 4.3.


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
