"""Images whose noise hangs together, against the whole covariance written out."""

import numpy as np
import pytest

from lightpen.arrays import BoolArray, FloatArray
from lightpen.estimation.bundle.reduced_normal_equations import ImageRows

N_IMAGES, N_ROWS, N_COMMON = 7, 8, 4
COEFFICIENTS = np.array([0.0, 0.5, 0.9])


def some_rows(used: BoolArray, n_own: int) -> ImageRows:
    rng = np.random.default_rng(4)
    own = rng.standard_normal((N_IMAGES, N_ROWS, n_own)) * used[..., None]
    common = rng.standard_normal((N_IMAGES, N_ROWS, N_COMMON)) * used[..., None]
    return ImageRows(
        eliminated=own,
        nuisance_covariance=np.zeros((N_IMAGES, n_own, n_own)),
        projected=common,
        common=common,
        residuals=rng.standard_normal((N_IMAGES, N_ROWS)) * used,
        used=used,
    )


def written_out(coefficient: float, used: BoolArray) -> FloatArray:
    """Return the covariance of all rows that are used, image by image."""
    places = np.argwhere(used)
    covariance = np.eye(len(places))
    for one, (i, row) in enumerate(places):
        for other, (j, same) in enumerate(places):
            between = used[min(i, j) : max(i, j) + 1, row]
            if row == same and between.all():
                covariance[one, other] = coefficient ** abs(i - j)
    return covariance


@pytest.mark.parametrize("jitter", [None, np.diag([0.5, 1.0, 2.0])])
@pytest.mark.parametrize("seen", [1.0, 0.8])
def test_noise_that_lasts_is_whitened_as_by_its_whole_covariance(
    jitter: FloatArray | None, seen: float
) -> None:
    used = np.random.default_rng(1).random((N_IMAGES, N_ROWS)) <= seen
    q = 3 if jitter is None else 6
    rows = some_rows(used, q)
    own = np.zeros((N_IMAGES, N_ROWS, N_IMAGES * q))
    for i in range(N_IMAGES):
        own[i, :, i * q : (i + 1) * q] = rows.eliminated[i]
    T, J, r = own[used], rows.common[used], rows.residuals[used]
    known = np.zeros((q, q))
    if jitter is not None:
        known[3:, 3:] = np.linalg.inv(jitter)

    for coefficient, found in zip(
        COEFFICIENTS, rows.whitened(COEFFICIENTS, jitter), strict=True
    ):
        covariance = written_out(coefficient, used)
        W = np.linalg.inv(covariance)
        inner = T.T @ W @ T + np.kron(np.eye(N_IMAGES), known)
        W_left = W - W @ T @ np.linalg.solve(inner, T.T @ W)
        np.testing.assert_allclose(found.information, J.T @ W_left @ J, rtol=1e-7)
        np.testing.assert_allclose(found.gradient, J.T @ W_left @ r, rtol=1e-7)
        assert found.squares == pytest.approx(r @ W_left @ r, rel=1e-7)
        volumes = np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(inner)[1]
        assert found.log_volume == pytest.approx(volumes, abs=1e-6)
        assert found.n_free == used.sum() - 3 * N_IMAGES
