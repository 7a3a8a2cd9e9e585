"""The intrinsics of a camera from views of a board, with their covariance.

Residuals alone certify nothing: lens models are compared by cross-validation, parts of
the views by their difference and its covariance, and the covariance contains the random
effects of board, lens and views beside the model. Views that no single camera can have
taken are refused, with the likely cause.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import date
from functools import cached_property

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.errors import CalibrationError
from lightpen.formats.camera_checks import folds
from lightpen.intrinsics.alternatives import HALVED, explain, matters
from lightpen.intrinsics.board_findings import (
    board_contradictions,
    messages_on_board,
    messages_on_size,
    released_tolerances,
    require_plausible_bend,
)
from lightpen.intrinsics.board_fit import BoardFit
from lightpen.intrinsics.camera_change import (
    CameraChange,
    changed_camera,
    detectable_zoom,
    find_alternation,
    find_apart,
    find_change,
    message_on_alternation,
    message_on_change,
)
from lightpen.intrinsics.distortion import (
    FEW,
    NO_K3,
    Choice,
    choose_distortion,
    fit_camera,
    rms_together,
)
from lightpen.intrinsics.duplicates import message_on_duplicates, without_duplicates
from lightpen.intrinsics.start import start_board_poses, start_camera
from lightpen.intrinsics.uncertainty_map import map_uncertainty, moved_in_image
from lightpen.intrinsics.variance_components import (
    MixedFit,
    fit_effects,
    without_fields,
)
from lightpen.intrinsics.views import BoardTolerances, Views
from lightpen.messages import Message, message
from lightpen.model.camera import Camera
from lightpen.model.quantiles import normal_quantile

MIN_VIEWS = 5
ENOUGH_VIEWS = 15
OFF_POINT = 6.0  # robust standard deviations
OFF_VIEW = 4.0  # times the median rms of the views
FINEST = 1e-3  # px; exact points are off by rounding alone
MOST_OFF = 0.2  # of the points
WORST_RMS = 0.004  # of the image's longer side: no flat board of these squares
# Uncertainty of projections over the image, of its longer side.
UNCERTAIN, MOST_UNCERTAIN = 0.005, 0.02
FARTHEST = np.tan(np.radians(84.0))  # in the normalised plane
MIN_POINTS = 6  # of a view
LARGEST_FOCAL_SIGMA = 0.02  # relative
LEAST_TILT = np.radians(10.0)  # between the views that are tilted apart most
CLUSTERED = 2.0  # times the variance that views of one camera scatter by
LEAST_SKEW = 2e-3  # rad, of a residual field: a lens may have less
LEAST_NOISE = 0.01  # px: beside less, usual fields and blur look large
SKEW_ALONE = 0.1  # of a field's squares, that an affine map may leave
UNEVEN_VIEWS = 2.0  # times the noise; no blur makes such errors of views


@dataclass(frozen=True, eq=False)
class ViewHalves:
    """Split-half check: odd views against even ones."""

    difference: FloatArray  # (4,), of fx fy cx cy, px
    expanded_uncertainty: FloatArray  # (4,), U (k = 2) of it
    in_image: float  # difference of the two projections of a point, px rms
    detectable_zoom: float  # smallest zoom found between the halves in time, relative


@dataclass(frozen=True, eq=False)
class CameraCalibration:
    """Intrinsics of a camera."""

    camera: Camera
    views: Views  # views with a detected board; excluded points are NaN
    effects: MixedFit  # final fit, with the random effects of board, lens and views
    duplicates: tuple[str, ...]  # views in which the board is where another has it
    left_out: tuple[str, ...]  # excluded views
    n_points_left_out: int  # excluded points in the accepted views
    choice: Choice
    held_out: FloatArray  # (V,), cross-validated residual of each view, px rms
    # In time, or between alternate views; too small to refuse the set, but in U.
    change: CameraChange | None
    halves: ViewHalves | None  # None where there are too few views
    remarks: tuple[Message, ...]  # warnings

    @property
    def adjustment(self) -> BoardFit:
        """The final fit."""
        return self.effects.adjustment

    @property
    def held_out_rms(self) -> float:
        """Distance of points in views that were not fitted to, px rms."""
        return rms_together(self.held_out, self.views)

    @property
    def worst_first(self) -> list[int]:
        """Numbers of the views by their residuals, the largest first."""
        order = np.argsort(-self.adjustment.view_rms[:, 0], kind="stable")
        return [int(v) for v in order]


def calibrate_camera(
    views: Views,
    tolerances: BoardTolerances,
    calibrated_on: date | None = None,
    report: Callable[[float], None] = lambda fraction: None,
    *,
    has_k3: bool = True,
) -> CameraCalibration:
    """Calibrate a camera by views of a board.

    Without ``has_k3`` the lens model is one that the form of Kalibr holds. Raises
    `CalibrationError` if the views do not determine the camera; the text says what is
    missing.
    """
    require_views(views)
    start = start_camera(views, FEW)
    views = _before(views, start)
    placed = np.isfinite(start_board_poses(start, views).translations[:, 0])
    views, unplaced = _parted(views, placed)
    views, duplicates = without_duplicates(views)
    if duplicates and views.n_views < MIN_VIEWS:
        raise CalibrationError(
            "intrinsics.few-distinct", n_views=views.n_views, least=MIN_VIEWS
        )
    require_views(views)
    first = fit_camera(views, tolerances, start)
    try:
        found = _calibrated(views, tolerances, first, report, has_k3)
    except CalibrationError as error:
        better = explain(views, tolerances, first, None, lessened=HALVED)
        if better is None and error.message.code == "intrinsics.misfit":
            _refuse_bent(views, tolerances, first)
        raise (better or error) from error
    change = find_change(found.effects, found.views.names)
    alternation = find_alternation(found.effects)
    taken = np.isin(views.names, found.views.names)
    apart = find_apart(found.effects, taken)
    if apart is None and alternation is not None and matters(alternation, views):
        apart = np.zeros(views.n_views, dtype=np.bool_)
        apart[np.flatnonzero(taken)[1::2]] = True
    changes = (change, alternation, apart)
    if found.is_suspicious or any(each is not None for each in changes):
        released = released_tolerances(tolerances) if found.denied.any() else None
        fields = found.effects.fields
        even = views if found.skew else without_fields(views, fields)
        better = explain(
            even, tolerances, found.adjustment, change, released, apart=apart
        )
        if better is not None:
            raise better
    require_plausible_bend(found.adjustment)
    remarks = [
        *messages_on_board(found.adjustment, tolerances, found.denied),
        *messages_on_size(views.board),
    ]
    if duplicates:
        remarks.append(message_on_duplicates(views.n_views, duplicates))
    if change is not None:
        remarks.append(message_on_change(change))
    elif alternation is not None:
        remarks.append(message_on_alternation(alternation))
    open_lens = _message_on_projection(found.adjustment, found.choice.apart)
    remarks += [each for each in (found.choice.remark, open_lens) if each is not None]
    at = found.adjustment.of_intrinsics(0)
    camera = found.adjustment.state.cameras[0]
    if found.choice.pull == NO_K3:
        camera = replace(camera, distortion=np.append(camera.distortion[:4], 0.0))
    camera = replace(
        camera,
        covariance=found.choice.with_shrinkage(found.adjustment.covariance[at, at]),
        calibrated_on=calibrated_on,
        lens_field=found.effects.fields[0],
    )
    found_change = change or alternation
    if found_change is not None:
        camera = changed_camera(camera, found_change)
    return CameraCalibration(
        camera=camera,
        views=found.views,
        change=found_change,
        effects=found.effects,
        duplicates=duplicates,
        left_out=unplaced + found.left_out,
        n_points_left_out=_n_points_left_out(views, found.views),
        choice=found.choice,
        held_out=found.held_out,
        halves=_halves(found.effects),
        remarks=tuple(remarks),
    )


@dataclass(frozen=True, eq=False)
class _Found:
    """One camera that fits the views best."""

    views: Views
    left_out: tuple[str, ...]
    denied: BoolArray
    choice: Choice
    held_out: FloatArray
    effects: MixedFit

    @property
    def adjustment(self) -> BoardFit:
        return self.effects.adjustment

    @property
    def is_suspicious(self) -> bool:
        """Whether something else than one camera may be before the board."""
        components = self.effects.components
        noise = max(components.noise, LEAST_NOISE)
        return bool(
            self.denied.any()
            or self.left_out
            or self.effects.clustering > CLUSTERED
            or components.view > UNEVEN_VIEWS * noise
            or abs(self.skew) > LEAST_SKEW
        )

    @cached_property
    def skew(self) -> float:
        """Skew of the image, rad, by a lens field that is nothing but an affine map.

        No lens has such a field; 0 if it is another.
        """
        even = without_fields(self.views, self.effects.fields)
        at = self.views.pixels[self.views.seen]
        moves = at - even.pixels[self.views.seen]
        moves -= moves.mean(axis=0)
        affine, left = np.linalg.lstsq(at - at.mean(axis=0), moves, rcond=None)[:2]
        is_affine = left.sum() < SKEW_ALONE * float(np.sum(moves**2))
        return float(affine[0, 1] + affine[1, 0]) if is_affine else 0.0


def _calibrated(
    views: Views,
    tolerances: BoardTolerances,
    first: BoardFit,
    report: Callable[[float], None],
    has_k3: bool,
) -> _Found:
    kept = without_outliers(views, first)
    require_views(kept)
    left_out = tuple(name for name in views.names if name not in kept.names)
    fitted = fit_camera(kept, tolerances, first.state.cameras[0])
    denied = board_contradictions(fitted, tolerances)
    if denied.any():  # the views contradict the tolerances
        tolerances = released_tolerances(tolerances)
        fitted = fit_camera(kept, tolerances, fitted.state.cameras[0])
    report(0.2)
    choice, fitted, held_out = choose_distortion(
        kept, tolerances, fitted, report, has_k3=has_k3
    )
    _require_determined(fitted)
    if folds(fitted.state.cameras[0]):
        raise CalibrationError("intrinsics.folds")
    _message_on_projection(fitted)
    choice, effects = _fit_unfolded(kept, tolerances, choice, fitted)
    return _Found(kept, left_out, denied, choice, held_out, effects)


def _fit_unfolded(
    views: Views, tolerances: BoardTolerances, choice: Choice, fitted: BoardFit
) -> tuple[Choice, MixedFit]:
    """Return the fit with effects; they may fold the image where the fit does not."""
    near = fitted.state.cameras[0]
    for pull in choice.pulls:
        if pull != choice.pull:
            fitted = fit_camera(views, tolerances, near, pull)
        try:
            effects = fit_effects(views, fitted)
        except CalibrationError as error:
            if error.message.code != "camera.distortion-folds":
                raise
            continue
        if not folds(effects.adjustment.state.cameras[0]):
            return replace(choice, pull=pull), effects
    raise CalibrationError("intrinsics.folds")


def _before(views: Views, camera: Camera) -> Views:
    """Return the views without points that may be behind the camera."""
    with np.errstate(invalid="ignore"):
        off = np.linalg.norm(camera.unproject(views.pixels[:, 0]), axis=-1)
    is_far = off > FARTHEST
    if not is_far.any():
        return views
    pixels = np.where(is_far[:, None, :, None], np.nan, views.pixels)
    left = replace(views, pixels=pixels)
    return left.chosen(left.seen.sum(axis=(1, 2)) >= MIN_POINTS)


def require_views(views: Views) -> None:
    """Raise `CalibrationError` if there are too few views."""
    if views.n_views < MIN_VIEWS:
        raise CalibrationError(
            "intrinsics.few-views",
            n_views=views.n_views,
            least=MIN_VIEWS,
            enough=ENOUGH_VIEWS,
        )


def without_outliers(views: Views, fitted: BoardFit) -> Views:
    """Return the views without points, and without views, that fit no others.

    Raises `CalibrationError` if they are so many that it is the board which is another.
    """
    rms = fitted.view_rms
    kept = rms <= OFF_VIEW * np.maximum(np.nanmedian(rms, axis=0), FINEST)
    middle = np.nanmedian(np.abs(fitted.residuals), axis=(0, 2, 3))
    usual = np.maximum(middle / normal_quantile(0.25), FINEST)
    off = np.linalg.norm(fitted.residuals, axis=-1) > OFF_POINT * usual[:, None]
    pixels = np.where(off[..., None], np.nan, views.pixels)
    left = replace(views, pixels=pixels).chosen(np.all(kept | np.isnan(rms), axis=1))
    longer = np.max(views.image_sizes, axis=1)
    if (
        int(left.seen.sum()) < (1 - MOST_OFF) * int(views.seen.sum())
        or (usual > WORST_RMS * longer).any()
    ):
        raise CalibrationError(
            "intrinsics.misfit", rms=fitted.rms, board=views.board.name
        )
    return left


def _refuse_bent(views: Views, tolerances: BoardTolerances, flat: BoardFit) -> None:
    """Refuse views of a board that is bent as none is, if that explains them."""
    released = released_tolerances(tolerances)
    try:
        bent = fit_camera(views, released, flat.state.cameras[0])
    except CalibrationError:
        return
    if bent.rms < HALVED * flat.rms:
        require_plausible_bend(bent)


def _parted(views: Views, kept: BoolArray) -> tuple[Views, tuple[str, ...]]:
    """Return the chosen views, and the names of the others."""
    others = zip(views.names, kept, strict=True)
    return views.chosen(kept), tuple(name for name, keep in others if not keep)


def _n_points_left_out(views: Views, kept: Views) -> int:
    """Return the number of excluded points in accepted views."""
    taking_part = np.isin(views.names, kept.names)
    return int(views.seen[taking_part].sum()) - int(kept.seen.sum())


def _message_on_projection(fitted: BoardFit, apart: float = 0.0) -> Message | None:
    """Return the message on a lens that the views leave open; ``apart`` as in `Choice`.

    Raises `CalibrationError` if they do so over most of the image.
    """
    camera, at = fitted.state.cameras[0], fitted.of_intrinsics(0)
    px = map_uncertainty(camera, fitted.covariance[at, at]).typical
    share = px / max(camera.image_size)
    if share > MOST_UNCERTAIN:
        raise CalibrationError("intrinsics.uncertain", px=px)
    px = float(np.hypot(px, apart))
    is_open = px > UNCERTAIN * max(camera.image_size)
    return message("intrinsics.uncertain", px=px) if is_open else None


def _require_determined(fitted: BoardFit) -> None:
    """Refuse views that are too alike to determine the focal length."""
    at = fitted.of_intrinsics(0).start
    focal = fitted.state.cameras[0].fx
    share = float(np.sqrt(fitted.covariance[at, at])) / focal
    normals = fitted.state.poses.rotations[..., 2]
    apart = np.arccos(np.clip(normals @ normals.T, -1, 1)).max()
    if share > LARGEST_FOCAL_SIGMA or apart < LEAST_TILT:
        raise CalibrationError(
            "intrinsics.alike", apart=float(np.degrees(apart)), share=2 * share
        )


def _halves(effects: MixedFit) -> ViewHalves | None:
    """Return the split-half difference of the camera: every second view vs. others."""
    n_views = len(effects.scores.scores)
    if n_views < 2 * MIN_VIEWS:
        return None
    at = effects.adjustment.of_intrinsics(0)
    share = np.where(np.arange(n_views) % 2 == 0, 1.0, 0.0)
    score, information = effects.scores.change(share)
    covariance = np.linalg.pinv(information[at, at], rcond=1e-14, hermitian=True)
    covariance *= max(effects.scores.clustering, 1.0)
    change = covariance @ score[at] / max(effects.scores.clustering, 1.0)
    return ViewHalves(
        change[:4],
        2 * np.sqrt(np.diag(covariance)[:4]),
        moved_in_image(effects.adjustment.state.cameras[0], change),
        detectable_zoom(effects),
    )
