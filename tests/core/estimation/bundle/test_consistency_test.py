"""Of several numbers of one file, those are named that contradict the images."""

from dataclasses import replace

import numpy as np
import pytest

from lightpen.estimation.bundle.consistency_test import LIMIT, FileFit, FileNumber
from lightpen.messages import message


def drawn_fit(seed: int) -> FileFit:
    """Return five numbers known to 1 by their file and to 0.1 to 1 by the images."""
    rng = np.random.default_rng([seed, 5])
    unit = np.eye(5)
    mixed = rng.standard_normal((5, 5))
    information = 10 * mixed @ mixed.T
    change = 3 * rng.standard_normal(5)
    noise = np.linalg.cholesky(information) @ rng.standard_normal(5)
    return FileFit(
        numbers=tuple(
            FileNumber(message("file.distortion", name=f"k{i}"), "", 0.0, each, each)
            for i, each in enumerate(unit)
        ),
        stated=unit,
        information=information,
        right=information @ change + noise,
        correlation_excess=np.zeros((5, 5)),
    )


def diagonal(
    changes: list[float], excess: float = 0.0, sigma: float = 0.1, width: float = 1.0
) -> FileFit:
    """Return numbers that the images show to be off, each by itself, to ``sigma``."""
    n = len(changes)
    unit, known = np.eye(n), sigma**-2
    return FileFit(
        numbers=tuple(
            FileNumber(message("file.distortion", name=f"k{i}"), "", 0.0, each, each)
            for i, each in enumerate(unit)
        ),
        stated=width**2 * unit,
        information=known * unit,
        right=known * np.array(changes),
        correlation_excess=excess * unit,
    )


@pytest.mark.parametrize("excess", [0.0, 300.0])
@pytest.mark.parametrize("times", [2.99, 3.01])
def test_a_number_is_contradicted_beyond_three_standard_deviations(
    times: float, excess: float
) -> None:
    """The file knows it to 1, the images to 0.1: their difference has both."""
    sigma = np.sqrt(1.0 + 0.01 + excess * 0.01**2)
    fit = diagonal([times * sigma, 0.0], excess)

    assert fit.contradicted == ((0,) if times > 3 else ())
    assert fit.max_deviation == pytest.approx(times if times > 3 else 0.0)
    found = fit.estimate_without(0, fit.contradicted)
    assert found.change == pytest.approx(times * sigma, rel=1e-4)
    assert found.sigma == pytest.approx(np.sqrt(0.01 + excess * 1e-4), rel=1e-4)
    assert found.stated_sigma == 1.0
    assert found.deviations == pytest.approx(times)


@pytest.mark.parametrize("n_wrong", [1, 2, 3, 4, 5])
def test_all_wrong_numbers_are_named_together(n_wrong: int) -> None:
    changes = [5.0 + i for i in range(n_wrong)] + 3 * [0.1]
    assert sorted(diagonal(changes).contradicted) == list(range(n_wrong))


def test_of_more_than_three_wrong_numbers_the_worst_is_found_first() -> None:
    assert diagonal([5.0, 7.0, 6.0, 8.0]).contradicted == (3, 1, 2, 0)


def test_a_number_that_no_image_shows_is_not_contradicted() -> None:
    hidden = diagonal([5.0, 5.0])
    information = hidden.information * [[1.0, 0.0], [0.0, 1e-9]]
    fit = replace(hidden, information=information, right=information @ [5.0, 5.0])

    assert fit.contradicted == (0,)
    assert fit.estimate_without(1, (0,)).deviations == 0.0


# Two numbers would do for these, one of which agrees once the other is released.
@pytest.mark.parametrize("seed", [61, 260])
def test_no_number_is_named_that_agrees_once_the_others_are_released(seed: int) -> None:
    fit = drawn_fit(seed)
    named = fit.contradicted

    assert named
    assert min(fit.estimate_without(i, named).deviations for i in named) > LIMIT
