"""Tests of `lightpen.verification.probing.drift_reference`."""

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.estimation.reports.verdict import Grade
from lightpen.model.limits import VerificationLimits
from lightpen.verification.probing.drift_reference import (
    BLOCK,
    LampImages,
    drift_of_images,
    drift_of_lamps,
)

SCALE = 0.2  # mm a pixel
NOISE = 0.02  # px
LIMITS = VerificationLimits()


def lamps(
    n_blocks: int = 6, n_lamps: int = 2, shift: float = 0.0, seed: int = 1
) -> FloatArray:
    """Two lamps, of which the images shift in the last half."""
    rng = np.random.default_rng(seed)
    n = n_blocks * BLOCK
    places = rng.uniform(100, 900, (n_lamps, 2))
    seen = places + NOISE * rng.standard_normal((n, n_lamps, 2))
    seen[n // 2 :, :, 0] += shift
    return seen


def test_lamps_that_stay_show_that_the_camera_stands_still() -> None:
    found = drift_of_lamps(lamps(), SCALE, LIMITS)

    assert found is not None
    assert found.assessment.grade is Grade.PASS
    assert found.moved < 2 * found.uncertainty


def test_a_camera_that_moved_is_reported_by_how_much() -> None:
    found = drift_of_lamps(lamps(shift=0.5), SCALE, LIMITS)

    assert found is not None
    assert found.moved == pytest.approx(0.1, abs=2 * found.uncertainty)
    assert found.assessment.grade is Grade.REPEAT
    assert found.assessment.reason.code == "witness.moved"


def test_a_hard_bump_of_the_camera_is_reported_in_pixels() -> None:
    images = LampImages(tuple(lamps(shift=60.0)), (1000.0,) * 48)
    found = drift_of_images(images, 5000.0, LIMITS)

    assert found is not None
    assert found.assessment.grade is Grade.REPEAT
    assert "The camera moved by 60.0 px" in str(found.assessment.reason)
    assert found.share[0] == pytest.approx(60 * 0.2 / np.sqrt(3), rel=0.01)


def test_an_image_that_does_not_show_a_lamp_takes_no_part() -> None:
    seen = lamps()
    seen[3, 0] = seen[7] = np.nan
    found = drift_of_lamps(seen, SCALE, LIMITS)

    assert found is not None
    assert np.isfinite(found.moves).all()


def test_the_uncertainty_agrees_with_the_scatter_of_lamps_that_stay() -> None:
    found = [drift_of_lamps(lamps(seed=seed), SCALE, LIMITS) for seed in range(50)]
    moves = np.concatenate([each.moves[1:] for each in found if each is not None])
    reported = np.mean([each.uncertainty for each in found if each is not None])

    # U is two standard deviations; 500 moves tell theirs to 3 %, and share the first.
    assert 2 * moves.std() == pytest.approx(reported, rel=0.15)


def test_without_a_lamp_or_with_few_images_nothing_is_reported() -> None:
    assert drift_of_lamps(lamps(n_lamps=0), SCALE, LIMITS) is None
    assert drift_of_lamps(lamps(n_blocks=2), SCALE, LIMITS) is None
    assert drift_of_images(LampImages(), 4638.0, LIMITS) is None


def test_noise_alone_hardly_counts_in_what_was_touched() -> None:
    found = drift_of_lamps(lamps(n_blocks=60), SCALE, LIMITS)

    assert found is not None
    assert found.share.max() < 0.003
    assert found.share[2] == 0


def test_a_camera_that_moved_counts_as_if_it_had_been_anywhere_between() -> None:
    found = drift_of_lamps(lamps(shift=0.5), SCALE, LIMITS)

    assert found is not None
    # GUM 4.3.7: the half-width over the square root of three.
    assert found.share[0] == pytest.approx(0.1 / np.sqrt(3), rel=0.1)
