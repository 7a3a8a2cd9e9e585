"""Of several numbers of one file, those are named that contradict the images."""

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


# Two numbers would do for these, one of which agrees once the other is released.
@pytest.mark.parametrize("seed", [61, 260])
def test_no_number_is_named_that_agrees_once_the_others_are_released(seed: int) -> None:
    fit = drawn_fit(seed)
    named = fit.contradicted

    assert named
    assert min(fit.estimate_without(i, named).deviations for i in named) > LIMIT
