"""The tip by the first images, by one more, and so on to all."""

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.estimation.pivot.pivot import fit_pivot
from lightpen.record.recomputing import fit_running_tip
from lightpen_extensions.simulator.swings import paper_pen, swing_poses

N_POSES = 40
FIRST = 8
TIP = np.array(paper_pen().nominal_tip)
NOISE = np.diag([1e-4, 2e-4, 1e-4, 0.01, 0.01, 0.05]) ** 2


def poses(noise: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return rotations, translations and covariances about one cone."""
    rng = np.random.default_rng(5)
    swing = swing_poses(N_POSES, rng)
    shifts = noise * rng.normal(size=(N_POSES, 3)) * [0.01, 0.01, 0.05]
    covariances = np.broadcast_to(NOISE, (N_POSES, 6, 6))
    return swing.rotations, swing.translations + shifts, covariances


def test_exact_poses_give_the_exact_tip_from_the_first_on() -> None:
    running = fit_running_tip(*poses(0.0), TIP, FIRST)

    assert running.tips.shape == (N_POSES - FIRST + 1, 3)
    np.testing.assert_allclose(running.tips - running.tips[-1], 0, atol=1e-9)


@pytest.mark.parametrize("n_images", [FIRST, 20, N_POSES])
def test_each_tip_is_that_of_the_pivot_fit_of_as_many_poses(n_images: int) -> None:
    rotations, translations, covariances = poses(1.0)
    fit = fit_pivot(
        *(rotations[:n_images], translations[:n_images], covariances[:n_images]),
        robust=False,
    )

    running = fit_running_tip(rotations, translations, covariances, TIP, FIRST)

    # The pivot fit weights by its own tip, which is some hundredths of a mm off.
    np.testing.assert_allclose(running.tips[n_images - FIRST], fit.tip_pen, atol=1e-4)
    np.testing.assert_allclose(
        np.diag(running.covariances[n_images - FIRST]),
        np.diag(fit.covariance)[:3],
        rtol=0.01,
    )


def test_one_more_image_never_makes_the_tip_less_certain() -> None:
    running = fit_running_tip(*poses(1.0), TIP, FIRST)

    variances = np.diagonal(running.covariances, axis1=1, axis2=2)
    assert (np.diff(variances, axis=0) < 0).all()
