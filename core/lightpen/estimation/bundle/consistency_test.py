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
from itertools import combinations

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.bundle import Bundle
from lightpen.messages import Message
from lightpen.model.information import inverse, known_by

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
