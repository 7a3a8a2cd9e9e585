"""The state of a swing: the dial."""

import numpy as np

from lightpen.coverage import measure_coverage
from lightpen.session.swing_state import dial_counts
from lightpen.simulator.swings import swing_poses


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
