"""Alternatives to a wrong board: views that are not from one unchanged camera.

Each alternative is fitted to the views: the camera changed at some image, some images
are turned by 180 degrees, the images are of two cameras, the rows of pixels are not
perpendicular to the columns. The one that describes the points in the fewest digits is
chosen [1]_: residuals, numbers of the further parameters, and which view belongs to
which group are counted together.

References
----------
.. [1] J. Rissanen, "Modeling by shortest data description", Automatica 14 (1978)
   465-471.
"""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.errors import CalibrationError
from lightpen.intrinsics.adjustment import FINEST, fit_board_poses
from lightpen.intrinsics.board_fit import N_SHAPE, BoardFit
from lightpen.intrinsics.distortion import fit_camera, rough_poses
from lightpen.intrinsics.uncertainty_map import error_fields
from lightpen.intrinsics.variance_components import MixedFit
from lightpen.intrinsics.views import BoardTolerances, Views
from lightpen.messages import Message, message
from lightpen.model.camera import Camera
from lightpen.model.quantiles import chi_square_quantile

FEWEST = 3  # views of a group
MAX_ROUNDS = 8
LESSENED = 0.97  # of the rms without it, or an alternative is no explanation
HALVED = 0.5  # the same, of views that no single camera fits
CHANCE = 1e-3  # of a change, by chance
LEAST_KNOWN = 1e-10  # least eigenvalue of an information matrix scaled to ones
USELESS = 0.001  # of the image's longer side, by which a change moves the image
SHEARED = 0.01  # of the slope of the columns, first step
MOST_SINGLE = 40  # views that are turned one by one
SHOWN = 6  # names


@dataclass(frozen=True)
class CameraChange:
    """A camera that changed while its views were taken.

    Attributes
    ----------
    name : str
        Of the first view after it; empty if it continued gradually.
    difference : (4 + n,) array
        Of the intrinsics, after less before, or last less first.
    in_image : float
        Distance that it puts between the images of one point, px rms.
    """

    name: str
    difference: FloatArray
    in_image: float


def find_change(mixed: MixedFit, names: tuple[str, ...]) -> CameraChange | None:
    """Return the most significant change of the camera in time, if one is.

    Parameters
    ----------
    names : tuple of str
        Of the views.
    """
    n_views = len(mixed.scores.scores)
    splits = range(FEWEST, n_views - FEWEST + 1)
    if not splits:
        return None
    order = np.arange(n_views)
    trials = [(first, (order >= first).astype(float)) for first in splits]
    trials.append((0, np.linspace(-0.5, 0.5, n_views)))
    camera = mixed.adjustment.state.cameras[0]
    at = mixed.adjustment.of_intrinsics(0)
    n = at.stop - at.start
    zoom = np.zeros((n, 1))
    zoom[:2, 0] = camera.fx, camera.fy
    ways = (zoom, np.eye(n)[:, :4], np.eye(n))
    clustering = max(mixed.scores.clustering, 1.0)
    best, most = None, 1.0
    for first, share in trials:
        score, information = mixed.scores.change(share)
        for way in ways:
            difference, squares = _fitted_change(score[at], information[at, at], way)
            chance = CHANCE / (len(trials) * len(ways))
            least = clustering * chi_square_quantile(way.shape[1], chance)
            if squares > most * least:
                most = squares / least
                moves = error_fields(camera) @ difference
                in_image = float(np.sqrt(np.mean(np.square(moves).sum(axis=-1))))
                best = CameraChange(names[first] if first else "", difference, in_image)
    return best


def _fitted_change(
    score: FloatArray, information: FloatArray, way: FloatArray
) -> tuple[FloatArray, float]:
    """Return the change that fits best of some kind, and its size by its covariance.

    Parameters
    ----------
    way : (n, k) array
        Its directions.
    """
    known = way.T @ information @ way
    scale = 1 / np.sqrt(np.maximum(np.diag(known), 1e-300))
    values, vectors = np.linalg.eigh(known * np.outer(scale, scale))
    if values[0] <= LEAST_KNOWN:  # one part alone does not show
        return np.zeros(len(score)), 0.0
    vectors = scale[:, None] * vectors
    found = (vectors / values) @ (vectors.T @ (way.T @ score))
    return way @ found, float(score @ way @ found)


@dataclass(frozen=True, eq=False)
class _BoardKnown:
    """What is known of the board."""

    tolerances: BoardTolerances
    offsets: FloatArray


def explain(
    views: Views,
    tolerances: BoardTolerances,
    fitted: BoardFit,
    change: CameraChange | None,
    released: BoardFit | None = None,
    offsets: FloatArray | None = None,
    lessened: float = LESSENED,
) -> CalibrationError | None:
    """Return why views do not fit one camera, if an alternative does explain it.

    Parameters
    ----------
    fitted : BoardFit
        Of some or all of the views by one camera.
    change : CameraChange or None
        The most significant change in time.
    released : BoardFit, optional
        With another board than it is said to be; that explains the views, too.
    offsets : (N, 3) array, optional
        Of the points of the board as one camera has them, mm.
    lessened : float
        Share of the residuals by one camera, below which an alternative explains them.
    """
    board = _BoardKnown(
        tolerances, fitted.state.offsets if offsets is None else offsets
    )
    near = fitted.state.cameras[0]
    n = 2 * int(views.seen.sum())
    nothing = _rms(_residuals_by(views, board, near))
    cost_of_groups = 2 * np.log(2) * views.n_views
    cost_of_camera = len(near.intrinsics) * np.log(n)
    found: list[tuple[float, float, CalibrationError | None]] = []

    def consider(rms: float, cost: float, error: CalibrationError | None) -> None:
        found.append((n * np.log(max(rms, FINEST) ** 2) + cost, rms, error))

    useless: CalibrationError | None = None
    turned = _turned(views, board, near)
    if turned is not None:
        which, rms = turned
        names, n_named = _fewer(views, which)
        turned_error = CalibrationError(
            "intrinsics.turned", names=names, n_named=n_named, n_views=views.n_views
        )
        consider(rms, cost_of_groups, turned_error)
    if change is not None and change.name:
        after = np.arange(views.n_views) >= views.names.index(change.name)
        parted = _two_cameras(views, board, near, after, rounds=0)
        if parted is not None and _differ(parted[2]):
            which, rms, cameras = parted
            consider(
                rms,
                cost_of_camera + 2 * np.log(views.n_views),
                _change_error(views, which, cameras),
            )
            if change.in_image > USELESS * max(views.image_sizes[0]):
                useless = _change_error(views, which, cameras)
    groups = _best_groups(views, board, near)
    if groups is not None and _differ(groups[2]):
        which, rms, cameras = groups
        names, n_named = _fewer(views, which)
        error = CalibrationError(
            "intrinsics.two-cameras",
            names=names,
            n_named=n_named,
            n_views=views.n_views,
            fx=cameras[0].fx,
            other_fx=cameras[1].fx,
        )
        consider(rms, cost_of_camera + cost_of_groups, error)
    skewed = _skewed(views, board, near)
    if skewed is not None:
        skew, rms = skewed
        consider(
            rms,
            np.log(n),
            CalibrationError("intrinsics.skewed", degrees=float(np.degrees(skew))),
        )
    if released is not None:
        consider(_rms(released.residuals), N_SHAPE * np.log(n), None)
    n_digits = n * np.log(max(nothing, FINEST) ** 2)
    best = min(found, key=lambda each: each[0], default=(np.inf, np.inf, None))
    is_better = best[0] < n_digits and best[1] < lessened * nothing
    return best[2] if is_better else useless


def _differ(cameras: tuple[Camera, Camera]) -> bool:
    """Return whether two cameras image a point at places that matter."""
    one, other = cameras
    try:
        moves = error_fields(one) @ (other.intrinsics - one.intrinsics)
    except CalibrationError:  # one of them folds the image
        return False
    in_image = float(np.sqrt(np.mean(np.square(moves).sum(axis=-1))))
    return in_image > USELESS * max(one.image_size)


def _change_error(
    views: Views, which: BoolArray, cameras: tuple[Camera, Camera]
) -> CalibrationError:
    """Return the error of a camera that was another from some view on."""
    first = int(np.argmax(which))
    return CalibrationError(
        "intrinsics.changed",
        name=views.names[first],
        before=cameras[0].fx,
        cx_before=cameras[0].cx,
        cy_before=cameras[0].cy,
        after=cameras[1].fx,
        cx_after=cameras[1].cx,
        cy_after=cameras[1].cy,
        n_before=int(np.sum(~which)),
        n_after=int(np.sum(which)),
    )


def message_on_change(change: CameraChange) -> Message:
    """Return the message on a change that does not make the set useless."""
    if not change.name:
        return message(
            "intrinsics.drift",
            px=change.in_image,
            fx=float(change.difference[0]),
            cx=float(change.difference[2]),
            cy=float(change.difference[3]),
        )
    return message(
        "intrinsics.step",
        name=change.name,
        px=change.in_image,
        fx=float(change.difference[0]),
        cx=float(change.difference[2]),
        cy=float(change.difference[3]),
    )


def _fewer(views: Views, which: BoolArray) -> tuple[str, int]:
    """Return the names of the fewer views of two groups, and their number."""
    fewer = which if which.sum() <= len(which) / 2 else ~which
    names = [n for n, own in zip(views.names, fewer, strict=True) if own]
    shown = ", ".join(names[:SHOWN]) + (" ..." if len(names) > SHOWN else "")
    return shown, len(names)


def _rms(residuals: FloatArray | None) -> float:
    """Return the size of residuals, px rms; endless without a fit."""
    if residuals is None:
        return float("inf")
    return float(np.sqrt(np.nanmean(np.square(residuals))))


def _fitted(views: Views, board: _BoardKnown, near: Camera) -> BoardFit | None:
    try:
        return fit_camera(views, board.tolerances, near, offsets=board.offsets)
    except CalibrationError:
        return None


def _residuals_by(views: Views, board: _BoardKnown, near: Camera) -> FloatArray | None:
    found = _fitted(views, board, near)
    return None if found is None else found.residuals


def _sizes(views: Views, fitted: BoardFit) -> FloatArray:
    """Return the residuals of each view by a camera, its pose fitted, px rms, (V,)."""
    try:
        state = replace(fitted.state, poses=rough_poses(fitted.state.cameras[0], views))
        residuals = fit_board_poses(views, state)
    except CalibrationError:
        return np.full(views.n_views, np.inf)
    return np.asarray(np.sqrt(np.nanmean(np.square(residuals), axis=(1, 2, 3))))


def _turned(
    views: Views, board: _BoardKnown, near: Camera
) -> tuple[BoolArray, float] | None:
    """Return which images are turned by 180 degrees, and the rms with them so."""
    size = np.array(views.image_sizes[0]) - 1.0
    other = replace(views, pixels=size - views.pixels)

    def fitted(which: BoolArray) -> BoardFit | None:
        pixels = np.where(which[:, None, None, None], other.pixels, views.pixels)
        return _fitted(replace(views, pixels=pixels), board, near)

    which = np.zeros(views.n_views, dtype=np.bool_)
    found = fitted(which)
    for _ in range(MAX_ROUNDS):
        if found is None:
            return None
        now = _sizes(other, found) < _sizes(views, found)
        if np.array_equal(now, which):
            break
        which = now
        found = fitted(which)
    # Views that the others pulled along are found one by one.
    least = np.inf if found is None else _rms(found.residuals)
    for v in range(min(views.n_views, MOST_SINGLE)):
        trial = which.copy()
        trial[v] = not trial[v]
        beside = fitted(trial)
        if beside is not None and _rms(beside.residuals) < least:
            which, least = trial, _rms(beside.residuals)
    if which.sum() > views.n_views / 2:
        which = ~which
    return (which, least) if which.any() else None


def _best_groups(
    views: Views, board: _BoardKnown, near: Camera
) -> tuple[BoolArray, float, tuple[Camera, Camera]] | None:
    """Return the best of some ways of taking the views for those of two cameras."""
    alone = _fitted(views, board, near)
    order = np.arange(views.n_views)
    starts = [order >= views.n_views // 2, order % 2 == 0]
    if alone is not None:
        sizes = alone.view_rms[:, 0]
        starts.append(sizes > np.median(sizes))
        means = np.nanmean(alone.residuals[:, 0] * _outwards(views), axis=(1, 2))
        starts.append(means > np.median(means))
    tried = [
        found
        for start in starts
        if (found := _two_cameras(views, board, near, start)) is not None
    ]
    return min(tried, key=lambda each: each[1], default=None)


def _outwards(views: Views) -> FloatArray:
    """Return where points lie from the middle of the image, (V, N, 2), of its size."""
    size = np.array(views.image_sizes[0])
    return np.asarray(views.pixels[:, 0] / size - 0.5)


def _two_cameras(
    views: Views,
    board: _BoardKnown,
    near: Camera,
    which: BoolArray,
    rounds: int = MAX_ROUNDS,
) -> tuple[BoolArray, float, tuple[Camera, Camera]] | None:
    """Return the views that belong to the second of two cameras, the rms, and them."""
    for left in range(rounds, -1, -1):
        if min(which.sum(), (~which).sum()) < FEWEST:
            return None
        fits = [_fitted(views.chosen(own), board, near) for own in (~which, which)]
        one, other = fits
        if one is None or other is None:
            return None
        if left > 0:
            now = _sizes(views, other) < _sizes(views, one)
            if not np.array_equal(now, which):
                which = now
                continue
        squares = sum(np.nansum(np.square(fit.residuals)) for fit in (one, other))
        rms = float(np.sqrt(squares / (2 * views.seen.sum())))
        return which, rms, (one.state.cameras[0], other.state.cameras[0])
    return None


def _skewed(
    views: Views, board: _BoardKnown, near: Camera
) -> tuple[float, float] | None:
    """Return the slope of the columns of pixels that fits best, rad, and the rms."""
    slopes = np.array([-SHEARED, 0.0, SHEARED])
    squares = [_rms(_sheared(views, board, near, s)) ** 2 for s in slopes.tolist()]
    if not np.isfinite(squares).all():
        return None
    curve = np.polyfit(slopes, squares, 2)
    if curve[0] <= 0:
        return None
    slope = float(np.clip(-0.5 * curve[1] / curve[0], -10 * SHEARED, 10 * SHEARED))
    return slope, _rms(_sheared(views, board, near, slope))


def _sheared(
    views: Views, board: _BoardKnown, near: Camera, slope: float
) -> FloatArray | None:
    """Return the residuals if the columns of pixels slope."""
    pixels = views.pixels.copy()
    pixels[..., 0] -= slope * (pixels[..., 1] - near.cy)
    return _residuals_by(replace(views, pixels=pixels), board, near)
