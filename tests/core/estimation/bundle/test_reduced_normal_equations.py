"""Images whose noise hangs together, against the whole covariance written out."""

import numpy as np
import pytest
from tests.simulated_centers import simulate_rig_centers
from tests.simulated_rigs import from_first, row_of_cameras

from lightpen.arrays import BoolArray, FloatArray
from lightpen.estimation.bundle.image_fields import image_fields, seat_modes_of
from lightpen.estimation.bundle.linearised import BundleState, eliminate
from lightpen.estimation.bundle.noise_correlation import (
    ImageRows,
    rows_of,
    summed_products,
)
from lightpen.estimation.bundle.priors import priors_of
from lightpen.estimation.bundle.unknowns import Unknowns
from lightpen.model.limits import USUAL
from lightpen_extensions.simulator.swings import paper_pen, seen_from, swing_poses

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


@pytest.mark.parametrize("jitter", [None, np.diag([1e-4, 4e-4, 1e-4])])
def test_rows_of_images_add_up_to_the_system_of_the_unknowns(
    jitter: FloatArray | None,
) -> None:
    """Of two cameras, with a drift along a lamp, and all fields."""
    rng = np.random.default_rng(5)
    row, pen = row_of_cameras(2, 1000.0), paper_pen()
    rig = from_first(row)
    swing = seen_from(swing_poses(9, rng), row.rotations[0], row.translations[0])
    state = BundleState(rig, pen, swing.tip_pen, swing.cone_cam, swing.rotations)
    pixels = simulate_rig_centers(rig, pen, swing, 0.05, rng)
    used = np.isfinite(pixels[..., 0]) & (rng.random(pixels.shape[:-1]) < 0.9)
    pixels[~used] = np.nan
    fields = image_fields(pixels, used, state)
    unknowns = Unknowns.of(
        *(state, priors_of(rig, pen, USUAL)),
        seat_modes_of(state.rotations, rng.standard_normal((9, 1))),
        fields,
        rng.uniform(0.5, 2.0, used.shape),
    )
    views = unknowns.views_at(state, pixels)
    each = eliminate(views, used, 0.05, jitter)
    information, gradient = unknowns.system(each)

    rows = rows_of(unknowns, views, used, 0.05, each.nuisance_covariance)
    (found,) = rows.whitened(np.zeros(1), jitter)

    scale = np.sqrt(np.diag(information))
    projected = np.einsum("nmp,nmq->pq", rows.common, rows.projected)
    for other in (found.information, projected):
        off = (other - information) / np.outer(scale, scale)
        # The one holds what an image hardly shows a little tighter than the other.
        np.testing.assert_allclose(off, 0.0, atol=1e-5)
    np.testing.assert_allclose(found.gradient / scale, gradient / scale, atol=1e-4)
    assert found.n_free == 2 * used.sum() - 3 * 9
    # Those of the cone are among them, and follow a change as its step does.
    by_image = unknowns.sensitivity(each.cone_rows)
    of_cone = information[unknowns.layout.cone]
    np.testing.assert_allclose(by_image.sum(axis=0), of_cone, atol=1e-6)
    change = rng.standard_normal(unknowns.number) / scale
    step, shifts = unknowns.step(change)
    np.testing.assert_allclose(
        by_image @ change,
        each.cone_rows @ step
        + np.einsum("nij,nj->ni", each.cone_rows[..., :3], shifts),
    )


def test_products_of_all_pairs_of_images_fall_off_with_their_distance() -> None:
    rows = np.random.default_rng(6).standard_normal((5, 3, 2))
    images = np.arange(5)
    share = 0.7 ** np.abs(images[:, None] - images)

    found = summed_products(rows, 0.7)

    expected = np.einsum("nm,nip,miq->pq", share, rows, rows)
    np.testing.assert_allclose(found, expected, atol=1e-12)
