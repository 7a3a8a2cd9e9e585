"""Alternatives to a wrong board: views that are not from one unchanged camera.

Each alternative is fitted to the views: the camera changed at some image or drifted,
some images are turned by 180 degrees, the images are of two cameras or settings, the
rows of pixels are not perpendicular to the columns. The one that describes the points
in the fewest digits is chosen [1]_: residuals, numbers of the further parameters, and
which view belongs to which group are counted together. The points of the board are
estimated with each of them, as uneven squares are with any camera.

References
----------
.. [1] J. Rissanen, "Modeling by shortest data description", Automatica 14 (1978)
   465-471.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.errors import CalibrationError
from lightpen.intrinsics.adjustment import FINEST, adjust_board, fit_board_poses
from lightpen.intrinsics.board_fit import N_SHAPE, BoardFit
from lightpen.intrinsics.camera_change import (
    CHANCE,
    FEWEST,
    CameraChange,
    message_on_change,
)
from lightpen.intrinsics.distortion import FEW, FISHEYE, fit_determined, rough_poses
from lightpen.intrinsics.lens_conversion import convert_lens
from lightpen.intrinsics.uncertainty_map import moved_in_image
from lightpen.intrinsics.unevenness import fit_unevenness
from lightpen.intrinsics.views import BoardTolerances, Views, listed_names
from lightpen.messages import Message, message
from lightpen.model.camera import Camera
from lightpen.model.quantiles import chi_square_quantile

MAX_ROUNDS = 8
CORRELATED = 4.0  # points of a view that count as one independent point
MAX_PASSES = 8  # of turning one view
ENOUGH = 0.998  # of the rms before; less gain justifies no further turned view
LESSENED = 0.97  # of the rms without it; above, an alternative explains nothing
LEAST_EFFECT = 0.01  # px rms, that turned images remove; less is a lens's field
HALVED = 0.5  # the same, of views that no single camera fits
USELESS = 0.001  # of the image's longer side, by which a change moves the image
# Larger differences than these, beyond SIGMAS, mean two cameras and not two settings:
OTHER_CENTER = 0.005  # shift of the principal point, of that side
OTHER_ASPECT = 0.002  # of fx/fy, relative
OTHER_DISTORTION = 0.002  # of the distortion, rms over the image, of that side
SIGMAS = 3.0
TURNED = 0.2  # of the drop in squares by two cameras; turned images lack less
SKEW_ALONE = 0.8  # of the rms without a skew; a lens field hardly looks like one
SHEARED = 0.01  # of the slope of the columns, first step
MOST_SINGLE = 40  # views that are turned one by one


def explain(
    views: Views,
    tolerances: BoardTolerances,
    fitted: BoardFit,
    change: CameraChange | None,
    released: BoardTolerances | None = None,
    lessened: float = LESSENED,
    apart: BoolArray | None = None,
) -> CalibrationError | None:
    """Return why views do not fit one camera, if an alternative does explain it.

    Parameters
    ----------
    fitted : BoardFit
        Of some or all of the views by one camera.
    change : CameraChange or None
        The most significant change in time.
    released : BoardTolerances, optional
        Of another board than it is said to be; that explains the views, too.
    lessened : float
        Share of the residuals by one camera, below which an alternative explains them.
    apart : (V,) array of bool, optional
        Views that differ from the others by more than one lens explains.
    """
    near = fitted.state.cameras[0]
    n = 2 * int(views.seen.sum()) / CORRELATED
    one_camera = [
        (n * np.log(max(rms, FINEST) ** 2) + len(lens.intrinsics) * np.log(n), rms)
        for lens in (near, *_other_lenses(near))
        for rms in [_rms_by(views, tolerances, lens)]
    ]
    n_digits, nothing = min(one_camera)
    n_digits -= len(near.intrinsics) * np.log(n)
    cost_of_groups = 2 * np.log(2) * views.n_views
    cost_of_camera = len(near.intrinsics) * np.log(n)
    found: list[tuple[float, float, CalibrationError | None]] = []

    def consider(rms: float, cost: float, error: CalibrationError | None) -> None:
        found.append((n * np.log(max(rms, FINEST) ** 2) + cost, rms, error))

    def error_of(groups: _Groups) -> CalibrationError:
        if _are_turned(views, tolerances, groups, nothing):
            return _turned_error(views, groups.which)
        return _groups_error(views, groups)

    useless: CalibrationError | None = None
    if change is not None:
        order = np.arange(views.n_views)
        first = views.names.index(change.name) if change.name else views.n_views // 2
        parted = _two_cameras(views, tolerances, near, order >= first, rounds=0)
        if parted is not None and _differ(parted):
            error = error_of(parted)
            if not change.name:
                error = CalibrationError(message_on_change(change))
            cost = cost_of_camera + 2 * np.log(views.n_views)
            consider(parted.rms, cost, error)
            if matters(change, views):
                useless = error
    groups = _best_groups(views, tolerances, near, apart)
    if apart is not None:
        by_scores = _two_cameras(views, tolerances, near, apart, rounds=0)
        if not groups or (by_scores and groups.rms > LESSENED * by_scores.rms):
            groups = by_scores
    elif groups and groups.rms > HALVED * nothing:
        groups = None  # smaller differences are rather of the lens
    if groups is not None and _differ(groups):
        error = error_of(groups)
        consider(groups.rms, cost_of_camera + cost_of_groups, error)
        if apart is not None:
            useless = useless or error
    turned, enough = _turned(views, tolerances, near), HALVED * nothing
    if groups is not None:  # turned images explain the whole difference
        enough = groups.rms / LESSENED
    if turned is not None and nothing**2 - turned[1] ** 2 > LEAST_EFFECT**2:
        which, rms = turned
        if rms < enough:
            consider(rms, cost_of_groups, _turned_error(views, which))
    skewed = _skewed(views, tolerances, near)
    height, longer = views.image_sizes[0][1], max(views.image_sizes[0])
    # Less is also a lens's field, unless there is a board to be blamed for it.
    least = 0.0 if released is not None else 2 * USELESS * longer / height
    if skewed is not None:
        skew, rms = skewed
        skewed_error = CalibrationError(
            "intrinsics.skewed", degrees=float(np.degrees(skew))
        )
        is_sure = rms < SKEW_ALONE * nothing and abs(skew) > least
        consider(rms, np.log(n), skewed_error if is_sure else None)
    if released is not None:
        rms = _rms_by(views, released, near)
        consider(rms, N_SHAPE * np.log(n), None)
    best = min(found, key=lambda each: each[0], default=(np.inf, np.inf, None))
    is_better = best[0] < n_digits and best[1] < lessened * nothing
    return best[2] if is_better else useless


def _other_lenses(camera: Camera) -> list[Camera]:
    """Return cameras of the other lens models that image nearly the same."""
    few = convert_lens(camera, FEW)
    many = few and replace(few, distortion=np.append(few.distortion, np.zeros(3)))
    all_models = (few, many, convert_lens(camera, FISHEYE))
    own = len(camera.distortion)
    return [each for each in all_models if each and len(each.distortion) != own]


class _Groups(NamedTuple):
    """Views of two cameras: which are of the second, the px rms, and their fits."""

    which: BoolArray
    rms: float
    fits: tuple[BoardFit, BoardFit]

    @property
    def cameras(self) -> tuple[Camera, Camera]:
        one, other = self.fits
        return one.state.cameras[0], other.state.cameras[0]


def matters(change: CameraChange, views: Views) -> bool:
    """Return whether a change moves the image so far that the views are useless."""
    return change.in_image > USELESS * max(views.image_sizes[0])


def _differ(groups: _Groups) -> bool:
    """Return whether two cameras image a point at places that matter."""
    one, other = groups.cameras
    try:
        in_image = moved_in_image(one, other.intrinsics - one.intrinsics)
    except CalibrationError:  # one of them folds the image
        return False
    return in_image > USELESS * max(one.image_size)


def _are_two_cameras(groups: _Groups) -> bool:
    """Return whether two cameras differ by more than zoom and focus of one."""
    one, other = groups.cameras
    longer, at = max(one.image_size), groups.fits[0].of_intrinsics(0)
    known = np.sum([fit.covariance[at, at] for fit in groups.fits], axis=0)
    change, sigmas = other.intrinsics - one.intrinsics, np.sqrt(np.diag(known))
    shift = np.abs(change[2:4]) - SIGMAS * sigmas[2:4]
    aspect = abs(other.fx / other.fy / (one.fx / one.fy) - 1)
    of_ratio = np.array([1, -1]) / one.fx
    aspect -= SIGMAS * float(np.sqrt(of_ratio @ known[:2, :2] @ of_ratio))
    bend, n = change[4:], len(change) - 4
    size = float(bend @ np.linalg.solve(known[4:, 4:], bend))
    bends = moved_in_image(one, np.r_[np.zeros(4), bend]) / longer
    is_bent = size > chi_square_quantile(n, CHANCE) and bends > OTHER_DISTORTION
    return bool(shift.max() > OTHER_CENTER * longer or aspect > OTHER_ASPECT or is_bent)


def _groups_error(views: Views, groups: _Groups) -> CalibrationError:
    """Return the error of two cameras, or of one with two settings."""
    which, (one, other) = groups.which, groups.cameras
    if which[0]:
        which, one, other = ~which, other, one
    first = int(np.argmax(which))
    before, after = _setting(views, ~which, one), _setting(views, which, other)
    if _are_two_cameras(groups):
        return CalibrationError("intrinsics.two-cameras", one=before, other=after)
    if which[first:].all():
        name = views.names[first]
        return CalibrationError(
            "intrinsics.changed", name=name, before=before, after=after
        )
    return CalibrationError("intrinsics.two-settings", one=before, other=after)


def _setting(views: Views, which: BoolArray, camera: Camera) -> Message:
    """Return the intrinsics of some of the views, and the views' names."""
    names = tuple(n for n, own in zip(views.names, which, strict=True) if own)
    return message(
        "intrinsics.setting",
        fx=camera.fx,
        cx=camera.cx,
        cy=camera.cy,
        n_views=len(names),
        names=listed_names(names),
    )


def _are_turned(
    views: Views, tolerances: BoardTolerances, groups: _Groups, alone: float
) -> bool:
    """Return whether two cameras are one, its images turned by 180 degrees.

    By what turning the images of the second leaves of the residuals of a single camera,
    `alone`, px rms.
    """
    rms = _rms_by(_with_turned(views, groups.which), tolerances, groups.cameras[0])
    return bool(rms**2 - groups.rms**2 < TURNED * (alone**2 - groups.rms**2))


def _turned_error(views: Views, which: BoolArray) -> CalibrationError:
    """Return the error of images that are turned, naming the fewer."""
    fewer = which if which.sum() <= len(which) / 2 else ~which
    names = tuple(n for n, own in zip(views.names, fewer, strict=True) if own)
    return CalibrationError(
        "intrinsics.turned",
        names=listed_names(names),
        n_named=len(names),
        n_views=views.n_views,
    )


def _fitted(views: Views, tolerances: BoardTolerances, near: Camera) -> BoardFit | None:
    fits = _fitted_groups((views,), tolerances, near)
    return None if fits is None else fits[0]


def _fitted_groups(
    groups: tuple[Views, ...], tolerances: BoardTolerances, near: Camera
) -> list[BoardFit] | None:
    """Return the fits of a camera to each group, with one uneven board for all."""
    try:
        fits = [fit_determined(views, tolerances, near) for views in groups]
        offsets, _ = fit_unevenness(groups, fits)
        fits = [
            adjust_board(
                views,
                replace(fit.state, shape=np.zeros(N_SHAPE), offsets=offsets),
                tolerances,
            )
            for views, fit in zip(groups, fits, strict=True)
        ]
    except CalibrationError:
        return None
    return fits


def _rms_by(views: Views, tolerances: BoardTolerances, near: Camera) -> float:
    """Return the residuals of a camera and an uneven board, px rms."""
    try:
        return fit_unevenness((views,), [fit_determined(views, tolerances, near)])[1]
    except CalibrationError:
        return np.inf


def _sizes(views: Views, fitted: BoardFit) -> FloatArray:
    """Return the residuals of each view by a camera, its pose fitted, px rms, (V,)."""
    try:
        state = replace(fitted.state, poses=rough_poses(fitted.state.cameras[0], views))
        residuals = fit_board_poses(views, state)
    except CalibrationError:
        return np.full(views.n_views, np.inf)
    return np.asarray(np.sqrt(np.nanmean(np.square(residuals), axis=(1, 2, 3))))


def _turned(
    views: Views, tolerances: BoardTolerances, near: Camera
) -> tuple[BoolArray, float] | None:
    """Return which images are turned by 180 degrees, and the rms with them so."""
    other = _with_turned(views, np.ones(views.n_views, dtype=np.bool_))
    which = np.zeros(views.n_views, dtype=np.bool_)
    found = _fitted(views, tolerances, near)
    for _ in range(MAX_ROUNDS):
        if found is None:
            return None
        now = _sizes(other, found) < _sizes(views, found)
        if np.array_equal(now, which):
            break
        which = now
        found = _fitted(_with_turned(views, which), tolerances, near)
    # Views that the others pulled along are found one by one.
    least = _rms_by(_with_turned(views, which), tolerances, near)
    tried = np.arange(min(views.n_views, MOST_SINGLE))
    for turn in range(MAX_PASSES):
        if not tried.size:
            break
        trials = [which ^ (np.arange(views.n_views) == v) for v in tried]
        sizes = [
            _rms_by(_with_turned(views, trial), tolerances, near) for trial in trials
        ]
        best = int(np.argmin(sizes))
        if sizes[best] >= ENOUGH * least:
            break
        which, least = trials[best], sizes[best]
        order = np.argsort(sizes)[1:]
        tried = tried[order[: len(order) // 2] if turn == 0 else order]
    if which.sum() > views.n_views / 2:
        which = ~which
    found = (
        _fitted(_with_turned(views, which), tolerances, near) if which.any() else None
    )
    if found is None:
        return None
    return which, float(np.sqrt(np.nanmean(np.square(found.residuals))))


def _with_turned(views: Views, which: BoolArray) -> Views:
    """Return the views with the chosen images turned by 180 degrees."""
    turned = np.array(views.image_sizes[0]) - 1.0 - views.pixels
    pixels = np.where(which[:, None, None, None], turned, views.pixels)
    return replace(views, pixels=pixels)


def _best_groups(
    views: Views,
    tolerances: BoardTolerances,
    near: Camera,
    apart: BoolArray | None = None,
) -> _Groups | None:
    """Return the best of several splits of the views into those of two cameras."""
    alone = _fitted(views, tolerances, near)
    order = np.arange(views.n_views)
    starts = [order >= views.n_views // 2, order % 2 == 0]
    if apart is not None:
        starts.append(apart)
    if alone is not None:
        sizes = alone.view_rms[:, 0]
        starts.append(sizes > np.median(sizes))
        means = np.nanmean(alone.residuals[:, 0] * _outwards(views), axis=(1, 2))
        starts.append(means > np.median(means))
    tried = [
        found
        for start in starts
        if (found := _two_cameras(views, tolerances, near, start)) is not None
    ]
    return min(tried, key=lambda each: each.rms, default=None)


def _outwards(views: Views) -> FloatArray:
    """Return where points lie from the middle of the image, (V, N, 2), of its size."""
    size = np.array(views.image_sizes[0])
    return np.asarray(views.pixels[:, 0] / size - 0.5)


def _two_cameras(
    views: Views,
    tolerances: BoardTolerances,
    near: Camera,
    which: BoolArray,
    rounds: int = MAX_ROUNDS,
) -> _Groups | None:
    """Return the views that belong to the second of two cameras, and both."""
    for left in range(rounds, -1, -1):
        if min(which.sum(), (~which).sum()) < FEWEST:
            return None
        parts = (views.chosen(~which), views.chosen(which))
        fits = _fitted_groups(parts, tolerances, near)
        if fits is None:
            return None
        one, other = fits
        if left > 0:
            now = _sizes(views, other) < _sizes(views, one)
            if not np.array_equal(now, which):
                which = now
                continue
        squares = sum(np.nansum(np.square(fit.residuals)) for fit in (one, other))
        rms = float(np.sqrt(squares / (2 * views.seen.sum())))
        return _Groups(which, rms, (one, other))
    return None


def _skewed(
    views: Views, tolerances: BoardTolerances, near: Camera
) -> tuple[float, float] | None:
    """Return the slope of the columns of pixels that fits best, rad, and the rms."""

    def rms_of(slope: float) -> float:
        pixels = views.pixels.copy()
        pixels[..., 0] -= slope * (pixels[..., 1] - near.cy)
        return _rms_by(replace(views, pixels=pixels), tolerances, near)

    slopes = np.array([-SHEARED, 0.0, SHEARED])
    squares = [rms_of(slope) ** 2 for slope in slopes.tolist()]
    if not np.isfinite(squares).all():
        return None
    curve = np.polyfit(slopes, squares, 2)
    if curve[0] <= 0:
        return None
    slope = float(np.clip(-0.5 * curve[1] / curve[0], -10 * SHEARED, 10 * SHEARED))
    return slope, rms_of(slope)
