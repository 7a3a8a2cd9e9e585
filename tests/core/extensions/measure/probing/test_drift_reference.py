"""Tests of `lightpen_extensions.measure.probing.drift_reference`."""

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.comparisons.assessment import VERIFY_AGAIN, check
from lightpen.estimation.reports.verdict import Grade
from lightpen.messages import message
from lightpen.model.limits import VerificationLimits
from lightpen_extensions.measure.probing.drift_reference import (
    BLOCK,
    LampImages,
    LampObservations,
    drift_of_images,
    drift_of_lamps,
    judged_with,
    lamp_drift_entries,
)
from lightpen_extensions.simulator.swings import paper_camera

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
    assert found.assessment.grade is Grade.STEADY
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


@pytest.mark.parametrize(
    ("n_images", "n_blocks"), [(23, 0), (24, 3), (79, 9), (80, 10), (200, 10)]
)
def test_moves_and_noise_are_those_of_blocks_of_eight_images_or_more(
    n_images: int, n_blocks: int
) -> None:
    rng = np.random.default_rng(2)
    shifts = rng.normal(0, 0.03, (n_images, 2)) + 0.01 * np.arange(n_images)[:, None]
    places = np.array([[100.0, 200.0], [700.0, 50.0]])
    found = drift_of_lamps(places + shifts[:, None], SCALE, LIMITS)
    if not n_blocks:
        assert found is None
        return

    assert found is not None
    blocks = np.array_split(shifts, n_blocks)
    means = np.array([block.mean(axis=0) for block in blocks])
    within = np.concatenate([block - block.mean(axis=0) for block in blocks])
    n = n_images / n_blocks
    deviation = np.sqrt(np.mean(within**2) * n / (n - 1))  # with a mean of each block
    moves = SCALE * (means - means[0])
    np.testing.assert_allclose(found.moves, moves, atol=1e-12)
    assert found.uncertainty == pytest.approx(2 * SCALE * deviation * np.sqrt(2 / n))
    np.testing.assert_allclose(found.lamps, places + shifts.mean(axis=0))
    assert found.moved == pytest.approx(np.hypot(*moves.T).max())
    farthest = np.abs(moves).max(axis=0)
    np.testing.assert_allclose(found.share, [*farthest / np.sqrt(3), 0.0])
    assert lamp_drift_entries(None) is None
    entries = lamp_drift_entries(found)
    assert entries is not None
    assert entries["moved_mm"] == found.moved
    assert entries["expanded_uncertainty_mm"] == found.uncertainty
    assert entries["grade"] == found.assessment.grade.value


@pytest.mark.parametrize(
    ("by", "grade"), [(1.001, Grade.STEADY), (0.999, Grade.REPEAT)]
)
def test_lamps_are_judged_by_the_limit_of_a_drift_alone(
    by: float, grade: Grade
) -> None:
    usual = drift_of_lamps(lamps(shift=0.5), SCALE, LIMITS)
    assert usual is not None
    limits = VerificationLimits(drift=by * usual.moved)
    found = drift_of_lamps(lamps(shift=0.5), SCALE, limits)

    assert found is not None
    assert found.assessment.grade is grade
    said = found.assessment.reason.values
    assert said["limit"] == limits.drift
    assert (said["moved"], said["uncertainty"]) == (usual.moved, usual.uncertainty)
    if grade is Grade.REPEAT:
        assert said["shift"] == pytest.approx(usual.moved / SCALE)
    other = check(message("drift.too-few"), VERIFY_AGAIN)
    judged = other if grade is Grade.STEADY else found.assessment
    assert judged_with(other, found) is judged
    assert judged_with(other, None) is other


def test_of_several_cameras_the_one_counts_that_moved_farthest() -> None:
    camera = paper_camera()
    still, moved = (
        LampImages(tuple(lamps(shift=shift)), (1000.0,) * 48) for shift in (0.0, 0.5)
    )
    none = LampObservations()
    seen = none.then(LampObservations((still, moved))).then(none)

    assert len(seen.cameras) == 2
    found = seen.lamp_drift((camera, camera), LIMITS)
    alone = drift_of_images(moved, camera.fx, LIMITS)
    assert found is not None
    assert alone is not None
    assert found.moved == alone.moved
    assert none.lamp_drift((camera,), LIMITS) is None
    twice = still.then(moved)
    assert twice.lights == still.lights + moved.lights
    assert twice.distances == still.distances + moved.distances
