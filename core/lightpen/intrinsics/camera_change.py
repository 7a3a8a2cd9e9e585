"""Change of a camera while its views were taken, by the scores of the views."""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.intrinsics.uncertainty_map import moved_in_image
from lightpen.intrinsics.variance_components import MixedFit
from lightpen.messages import Message, message
from lightpen.model.camera import Camera
from lightpen.model.quantiles import chi_square_quantile, normal_quantile

FEWEST = 3  # views of a group
CHANCE = 1e-3  # probability of a change by chance
N_WAYS = 3  # of a change: zoom; zoom and axis; all
LEAST_KNOWN = 1e-10  # least eigenvalue of an information matrix scaled to ones


@dataclass(frozen=True)
class CameraChange:
    """A camera that changed while its views were taken."""

    name: str  # first view after it; empty if the change is gradual
    # (4 + n,), of the intrinsics, after less before, or last less first.
    difference: FloatArray
    in_image: float  # difference of the projections of a point, px rms


def find_change(mixed: MixedFit, names: tuple[str, ...]) -> CameraChange | None:
    """Return the most significant change of the camera between named views, or None."""
    n_views = len(mixed.scores.scores)
    splits = range(FEWEST, n_views - FEWEST + 1)
    if not splits:
        return None
    order = np.arange(n_views)
    shares = [(order >= first).astype(float) for first in splits]
    found = _most_significant(mixed, [*shares, np.linspace(-0.5, 0.5, n_views)])
    if found is None:
        return None
    number, difference, in_image = found
    name = names[splits[number]] if number < len(splits) else ""
    return CameraChange(name, difference, in_image)


def find_alternation(mixed: MixedFit) -> CameraChange | None:
    """Return the change of every second view from the others, if it is significant."""
    order = np.arange(len(mixed.scores.scores))
    found = _most_significant(mixed, [(order % 2).astype(float)])
    return None if found is None else CameraChange("", *found[1:])


def find_apart(mixed: MixedFit, taken: BoolArray) -> BoolArray | None:
    """Return views that differ from the others by more than one lens explains, (W,).

    Views move to the other group one by one as long as that increases the difference of
    fx fy cx cy; its significance accounts for all ways of splitting the views. Views
    that were not ``taken`` (W,) for the fit stay in the first group.
    """
    at = mixed.adjustment.of_intrinsics(0)
    few = slice(at.start, at.start + 4)
    scores = mixed.scores.scores[:, few]
    columns = mixed.scores.information[..., few]
    known = columns[:, few]
    # As `ViewScores.change` has it, pair by pair.
    drawn = np.einsum(
        "vqs,qr,wrt->vwst", columns, mixed.scores.covariance, columns, optimize=True
    )
    n_views = len(scores)

    def size(which: BoolArray) -> float:
        if min(which.sum(), (~which).sum()) < FEWEST:
            return 0.0
        information = known[which].sum(axis=0)
        information = information - drawn[which][:, which].sum(axis=(0, 1))
        return _fitted_change(scores[which].sum(axis=0), information, np.eye(4))[1]

    order = np.arange(n_views)
    sigmas = np.sqrt(np.diag(mixed.scores.covariance)[at])
    main = np.linalg.svd(mixed.scores.scores[:, at] * sigmas, full_matrices=False)[0]
    best, most = np.zeros(n_views, dtype=np.bool_), 0.0
    for which in (order >= n_views // 2, order % 2 == 1, main[:, 0] > 0):
        reached, is_rising = size(which), True
        while is_rising:
            others = [which ^ (order == v) for v in range(n_views)]
            sizes = [size(other) for other in others]
            is_rising = max(sizes) > reached
            if is_rising:
                which, reached = others[int(np.argmax(sizes))], max(sizes)
        if reached > most:
            best, most = which, reached
    share = best.astype(np.float64)
    if _most_significant(mixed, [share], CHANCE / 2**n_views) is None:
        return None
    found = np.zeros(len(taken), dtype=np.bool_)
    found[taken] = best
    return found


def _most_significant(
    mixed: MixedFit, shares: list[FloatArray], chance: float = CHANCE
) -> tuple[int, FloatArray, float] | None:
    """Return number, difference and px in the image of the most significant change.

    Each array of ``shares`` (V,) is what the views have in one change.
    """
    camera = mixed.adjustment.state.cameras[0]
    at = mixed.adjustment.of_intrinsics(0)
    n = at.stop - at.start
    ways = (_zoom(camera), np.eye(n)[:, :4], np.eye(n))
    chance /= len(shares) * N_WAYS
    best, most = None, 1.0
    for number, share in enumerate(shares):
        score, information = mixed.scores.change(share)
        for way in ways:
            difference, squares = _fitted_change(score[at], information[at, at], way)
            ratio = squares / chi_square_quantile(way.shape[1], chance)
            if ratio > most:  # a change scatters the scores itself
                rest = mixed.scores.without(share, at, difference)
                ratio /= max(rest.clustering, 1.0)
            if ratio > most:
                most = ratio
                best = number, difference, moved_in_image(camera, difference)
    return best


def changed_camera(camera: Camera, change: CameraChange) -> Camera:
    """Return a camera whose covariance includes the change."""
    added = np.outer(change.difference, change.difference) / 4
    field, covariance = camera.lens_field, camera.covariance
    if field is not None and field.intrinsics_covariance is not None:
        beside = field.intrinsics_covariance + added
        field = replace(field, intrinsics_covariance=beside)
    if covariance is not None:
        covariance = covariance + added
    return replace(camera, covariance=covariance, lens_field=field)


def detectable_zoom(mixed: MixedFit) -> float:
    """Return the least zoom at the middle of the views that is found, relative.

    With 95 % probability; `find_change` tries all views as the first after it.
    """
    n_views, at = len(mixed.scores.scores), mixed.adjustment.of_intrinsics(0)
    share = (np.arange(n_views) >= n_views // 2).astype(np.float64)
    _, information = mixed.scores.change(share)
    zoom = _zoom(mixed.adjustment.state.cameras[0])[:, 0]
    clustering = max(mixed.scores.clustering, 1.0)
    sigma = np.sqrt(clustering / (zoom @ information[at, at] @ zoom))
    n_trials = max(n_views - 2 * FEWEST + 2, 1)
    least = chi_square_quantile(1, CHANCE / (n_trials * N_WAYS)) ** 0.5
    return float((least + normal_quantile(0.05)) * sigma)


def _zoom(camera: Camera) -> FloatArray:
    """Return the derivative of the intrinsics by a zoom, (4 + n, 1)."""
    zoom = np.zeros((len(camera.intrinsics), 1))
    zoom[:2, 0] = camera.fx, camera.fy
    return zoom


def _fitted_change(
    score: FloatArray, information: FloatArray, way: FloatArray
) -> tuple[FloatArray, float]:
    """Return the best change in directions (n, k), and its size by its covariance."""
    known = way.T @ information @ way
    if np.diag(known).min() <= 0:  # less than rounding
        return np.zeros(len(score)), 0.0
    scale = 1 / np.sqrt(np.maximum(np.diag(known), 1e-300))
    values, vectors = np.linalg.eigh(known * np.outer(scale, scale))
    if values[0] <= LEAST_KNOWN:  # one part alone does not show
        return np.zeros(len(score)), 0.0
    vectors = scale[:, None] * vectors
    found = (vectors / values) @ (vectors.T @ (way.T @ score))
    return way @ found, float(score @ way @ found)


def message_on_change(change: CameraChange) -> Message:
    """Return the message on a change that does not make the set useless."""
    fx, _, cx, cy, *_ = change.difference.tolist()
    if not change.name:
        return message("intrinsics.drift", px=change.in_image, fx=fx, cx=cx, cy=cy)
    return message(
        "intrinsics.step", name=change.name, px=change.in_image, fx=fx, cx=cx, cy=cy
    )


def message_on_alternation(change: CameraChange) -> Message:
    """Return the message on every second view that differs from the others."""
    fx, _, cx, cy, *_ = change.difference.tolist()
    return message("intrinsics.halves", px=change.in_image, fx=fx, cx=cx, cy=cy)
