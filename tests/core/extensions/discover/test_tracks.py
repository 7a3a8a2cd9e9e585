"""Tracks of unlabelled spots from image to image."""

import numpy as np
import pytest

from lightpen_extensions.discover.tracks import follow

WIDTH = 1224  # px, of the images
BEGIN = [90.0, 75.0, 45.0, 25.0]  # px an image, as a hand that takes the pen up


@pytest.mark.parametrize("seed", [11, 33, 49, 93])
def test_a_pen_that_jumps_is_followed_once_it_moves_evenly(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pen = 500 + rng.uniform([0, 0], [130, 390], (10, 2))
    steps = [*BEGIN, *(8 + 6 * np.sin(np.arange(36) / 4))]
    path = np.cumsum([0, *steps])[:, None] * [0.5, 0.866]

    _, joined = follow([pen + place for place in path], WIDTH)

    assert (joined.lengths >= 36).sum() == len(pen)
