"""The state of a swing: the dial."""

import numpy as np
import pytest

from lightpen.model.coverage import dial_counts, measure_coverage
from lightpen.model.limits import SwingLimits
from lightpen_extensions.simulator.swings import swing_poses


def test_the_dial_counts_every_posture_once_where_the_coverage_has_it() -> None:
    rotations = swing_poses(200, np.random.default_rng(0)).rotations
    counts = dial_counts(rotations)
    coverage = measure_coverage(rotations)

    assert counts.sum() == 200
    assert counts[0, 0] == coverage.n_upright
    assert not counts[0, 1:].any()
    np.testing.assert_array_equal(counts[1:], coverage.counts)


def test_the_dial_of_no_image_is_empty() -> None:
    assert not dial_counts(np.zeros((0, 3, 3))).any()


@pytest.mark.parametrize(
    "wrong",
    [
        {"max_uncertainty": 0.0},
        {"max_uncertainty": float("nan")},
        {"min_images": -1},
        {"max_images": 0},
        {"min_per_field": -1},
        {"spacing": -0.1},
    ],
)
def test_limits_that_no_swing_can_keep_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="Nothing can be swung"):
        SwingLimits(**wrong)  # type: ignore[arg-type]
