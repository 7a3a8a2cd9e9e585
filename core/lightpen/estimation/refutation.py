"""Which numbers of a file the images refute, all of its numbers looked at together.

A number of a file is beyond belief where what was fitted lies farther from it than the
file's uncertainty and that of the images explain: the deviation of a posterior mean
from a prior mean has the covariance of the prior less that of the posterior. But one
wrong number moves what is fitted for others. So the smallest set of numbers is sought
that, let go, leaves no other one beyond belief, and of several such sets the one by
which images and file agree best.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle import Bundle
from lightpen.estimation.information import inverse, known_by
from lightpen.sentences import Sentence

LIMIT = 3.0  # standard deviations
ROUNDING = 1e-6  # of a variance
LET_GO = 100.0  # times what is stated, or what the images want of it: says nothing
TRIED_TOGETHER = 3  # numbers; more that are wrong are found one by one


@dataclass(frozen=True, eq=False)
class FileNumber:
    """A number of a file that people know by a name.

    ``by`` takes it from the unknowns of the file, ``along`` moves them by one of it,
    (k,) each; ``size`` is what that is in its unit.
    """

    what: Sentence
    unit: str
    value: float
    by: FloatArray
    along: FloatArray
    size: float = 1.0
    camera: str = ""  # of the rig, if its file says so


@dataclass(frozen=True, eq=False)
class _Estimate:
    """What file and images make of the file's unknowns, some numbers let go."""

    values: FloatArray
    covariance: FloatArray
    lasting: FloatArray
    gain: float  # in agreement, twice a logarithm of likelihood


@dataclass(frozen=True)
class WantedNumber:
    """What the images want a number to be, in the unit of the unknowns.

    Attributes
    ----------
    change, sigma : float
        Off the file, as they have it without that number.
    stated_sigma : float
        Of the file.
    deviations : float
        Standard deviations that lie between.
    """

    change: float
    sigma: float
    stated_sigma: float
    deviations: float


@dataclass(frozen=True, eq=False)
class FileFit:
    """What the images say of the unknowns of one file, all others as fitted.

    Attributes
    ----------
    statements : tuple of FileNumber
    stated : (k, k) array
        Covariance that the file states.
    information, right : (k, k) and (k,) array
        Of the images.
    lasting : (k, k) array
        By what the covariance of ``right`` is larger than the information has it.
    """

    statements: tuple[FileNumber, ...]
    stated: FloatArray
    information: FloatArray
    right: FloatArray
    lasting: FloatArray

    @classmethod
    def of(
        cls,
        statements: Iterable[FileNumber],
        stated: FloatArray,
        bundle: Bundle,
        place: slice,
        excess: FloatArray | None,
    ) -> "FileFit":
        """Return what a fit says of the unknowns at a place.

        Parameters
        ----------
        excess : (p, p) array or None
            By what the covariance of the fitted values is larger than the fit has it,
            as noise lasts.
        """
        known = inverse(bundle.covariance[place, place])
        by_excess = np.zeros_like(known) if excess is None else excess[place, place]
        return cls(
            statements=tuple(statements),
            stated=inverse(known_by(stated)),
            information=known - bundle.prior_information[place, place],
            right=known @ bundle.values[place],
            lasting=known @ by_excess @ known,
        )

    @cached_property
    def refuted(self) -> tuple[int, ...]:
        """Numbers of the statements that are beyond belief; empty if none is."""
        if not self._beyond(()):
            return ()
        told = [i for i in range(len(self.statements)) if self._is_told(i)]
        sets = [
            [s for s in combinations(told, size) if self._explains(s)]
            for size in range(1, TRIED_TOGETHER + 1)
        ]
        for each in sets:
            if each:
                return max(each, key=lambda s: self._solved(s).gain)
        return self._one_by_one()

    @property
    def most(self) -> float:
        """The most standard deviations that file and images are apart as stated."""
        return max(self._beyond(()).values(), default=0.0)

    def wanted(self, i: int, let_go: tuple[int, ...]) -> WantedNumber:
        """Return what a number is wanted to be, some others let go, too."""
        by, before = self.statements[i].by, self._before(i)
        others = tuple(j for j in let_go if j != i)
        free = self._solved((*others, i))
        own = float(by @ (free.covariance + free.lasting) @ by)
        return WantedNumber(
            change=float(by @ free.values),
            sigma=float(np.sqrt(max(own, ROUNDING * before))),
            stated_sigma=float(np.sqrt(before)),
            deviations=self._deviations(i, others),
        )

    def _before(self, i: int) -> float:
        by = self.statements[i].by
        return float(by @ self.stated @ by)

    def _is_told(self, i: int) -> bool:
        """Tell whether the images say anything of a number."""
        by, before = self.statements[i].by, self._before(i)
        return float(before - by @ self._as_stated.covariance @ by) > ROUNDING * before

    def _deviations(self, i: int, let_go: tuple[int, ...]) -> float:
        """Return how many standard deviations file and images are apart in a number."""
        by, before, solved = (
            self.statements[i].by,
            self._before(i),
            self._solved(let_go),
        )
        learned = before - float(by @ solved.covariance @ by)
        if learned <= ROUNDING * before:
            return 0.0
        variance = max(learned + float(by @ solved.lasting @ by), ROUNDING * before)
        return abs(float(by @ solved.values)) / float(np.sqrt(variance))

    def _beyond(self, let_go: tuple[int, ...]) -> dict[int, float]:
        """Return the deviations of numbers beyond belief, some others let go."""
        rest = (i for i in range(len(self.statements)) if i not in let_go)
        each = {i: self._deviations(i, let_go) for i in rest}
        return {i: deviations for i, deviations in each.items() if deviations > LIMIT}

    def _is_beyond(self, i: int, let_go: tuple[int, ...]) -> bool:
        """Tell whether one of those let go would be beyond belief without that."""
        others = tuple(j for j in let_go if j != i)
        return self._deviations(i, others) > LIMIT

    def _explains(self, let_go: tuple[int, ...]) -> bool:
        """Tell whether these numbers are beyond belief, and no others beside them."""
        return not self._beyond(let_go) and all(
            self._is_beyond(i, let_go) for i in let_go
        )

    def _one_by_one(self) -> tuple[int, ...]:
        """Return numbers to let go, each the worst beside those before."""
        let_go: tuple[int, ...] = ()
        while beyond := self._beyond(let_go):
            let_go = (*let_go, max(beyond, key=lambda i: beyond[i]))
        return tuple(i for i in let_go if self._is_beyond(i, let_go))

    @cached_property
    def _as_stated(self) -> _Estimate:
        return self._solved_with(self.stated)

    @cached_property
    def _solutions(self) -> dict[tuple[int, ...], _Estimate]:
        return {(): self._as_stated}

    def _solved(self, let_go: tuple[int, ...]) -> _Estimate:
        key = tuple(sorted(let_go))
        if key not in self._solutions:
            freed = self.stated
            for i in key:
                each = self.statements[i]
                change = abs(float(each.by @ self._as_stated.values))
                width = LET_GO * max(change, float(np.sqrt(self._before(i))))
                freed = freed + width**2 * np.outer(each.along, each.along)
            self._solutions[key] = self._solved_with(freed)
        return self._solutions[key]

    def _solved_with(self, stated: FloatArray) -> _Estimate:
        covariance = inverse(self.information + inverse(stated))
        values = covariance @ self.right
        lasting = covariance @ self.lasting @ covariance
        return _Estimate(values, covariance, lasting, float(self.right @ values))
