"""The intrinsics of a camera from views of a board, with their covariance.

Residuals alone certify nothing: lens models, and whether the camera changed while the
views were taken, are judged by the prediction of views that did not take part. A set is
refused where that speaks against it, or where the views do not determine the camera;
anything else is a finding, and U contains it.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from datetime import date

import numpy as np

from lightpen.errors import CalibrationError
from lightpen.formats.camera_checks import LARGEST_FOLD
from lightpen.messages import Message, message
from lightpen.model.camera import Camera
from lightpen.model.coverage import normal_quantile
from lightpen_extensions.boards.adjustment import BoardFit
from lightpen_extensions.boards.changes import (
    FEWEST,
    CameraChange,
    change_error,
    changed_camera,
    find_change,
    find_rotated,
    message_on_change,
    rotated_message,
)
from lightpen_extensions.boards.distortion import (
    STIFFNESSES,
    Choice,
    choose_distortion,
    fit_camera,
    map_uncertainty,
)
from lightpen_extensions.boards.effects import MixedFit, fit_effects, rms_together
from lightpen_extensions.boards.observing import (
    Views,
    message_on_duplicates,
    without_duplicates,
)
from lightpen_extensions.boards.start import start_any_camera, start_board_poses

MIN_VIEWS = 5
ENOUGH_VIEWS = 15
OFF_POINT = 6.0  # robust standard deviations
OFF_VIEW = 4.0  # times the median rms of the views
FINEST = 1e-3  # px; exact points are off by rounding alone
MOST_OFF = 0.2  # of the points
WORST_RMS = 0.004  # of the image's longer side: no flat board of these squares
FOLDED = 0.1  # of the image: high orders are then held nearer to 0
UNCERTAIN = 0.005  # of the image's longer side, of projections over the image
FARTHEST = np.tan(np.radians(84.0))  # in the normalised plane
MIN_POINTS = 6  # of a view


@dataclass(frozen=True, eq=False)
class CameraCalibration:
    """Intrinsics of a camera."""

    camera: Camera
    views: Views  # views with a detected board; excluded points are NaN
    effects: MixedFit  # final fit, with the effects of board and lens
    duplicates: tuple[str, ...]  # views in which the board is where another has it
    left_out: tuple[str, ...]  # excluded views
    n_points_left_out: int  # excluded points in the accepted views
    choice: Choice
    remarks: tuple[Message, ...]  # warnings

    @property
    def adjustment(self) -> BoardFit:
        """The final fit."""
        return self.effects.adjustment

    @property
    def held_out_rms(self) -> float:
        """Distance of points in views that were not fitted to, px rms."""
        return rms_together(self.effects.held_out, self.views)

    @property
    def worst_first(self) -> list[int]:
        """Numbers of the views by their residuals, the largest first."""
        order = np.argsort(-self.adjustment.view_rms[:, 0], kind="stable")
        return [int(v) for v in order]


@dataclass(frozen=True, eq=False)
class _Found:
    """One camera that fits the views best, and what was found on the way."""

    views: Views
    choice: Choice
    effects: MixedFit
    change: CameraChange | None
    remarks: tuple[Message, ...] = ()


def calibrate_camera(
    views: Views,
    calibrated_on: date | None = None,
    report: Callable[[float], None] = lambda fraction: None,
) -> CameraCalibration:
    """Calibrate a camera by views of a board.

    Raises `CalibrationError` if the views do not determine the camera, or one camera
    cannot have taken them; the text says what is missing.
    """
    require_views(views)
    given = views
    start = start_any_camera(views)
    views = _before(views, start)
    views = views.chosen(
        np.isfinite(start_board_poses(start, views).translations[:, 0])
    )
    views, duplicates = without_duplicates(views)
    if duplicates and views.n_views < MIN_VIEWS:
        raise CalibrationError(
            "intrinsics.few-distinct", n_views=views.n_views, least=MIN_VIEWS
        )
    require_views(views)
    first, remarks = fit_camera(views, start), []
    report(0.1)
    try:
        kept = without_outliers(views, first)
    except CalibrationError as error:  # another board, or views of several cameras
        change = find_change(first)
        if change is not None and change.is_clear:
            raise change_error(change, views.names) from error
        raise
    found = _calibrated(kept, first, report)
    rotated = find_rotated(views, first, found.change)
    if rotated.any():
        remarks.append(rotated_message(views.names, rotated))
        if rotated.sum() >= FEWEST:
            raise CalibrationError(remarks[0])
        views = views.chosen(~rotated)
        first = fit_camera(views, found.effects.adjustment.state.cameras[0])
        found = _calibrated(without_outliers(views, first), first, report)
    change = found.change
    if change is not None and change.is_clear:
        if change.fewer.sum() >= FEWEST:
            raise change_error(change, found.views.names)
        remarks.append(message_on_change(change, found.views.names))
        others = found.views.chosen(~change.fewer)
        found = _calibrated(others, found.effects.adjustment, report)
    report(1.0)
    found = replace(found, remarks=(*remarks, *found.remarks))
    return _result(given, duplicates, found, calibrated_on)


def _calibrated(
    views: Views, near: BoardFit, report: Callable[[float], None]
) -> _Found:
    require_views(views)
    found: list[tuple[float, Choice, MixedFit]] = []
    for stiffness in STIFFNESSES:
        fitted = fit_camera(views, near.state.cameras[0], stiffness)
        report(0.2)
        choice, fitted = choose_distortion(views, fitted, report, stiffness)
        effects = fit_effects(views, fitted)
        share = effects.adjustment.state.cameras[0].folded_share
        found.append((share, choice, effects))
        if share <= FOLDED:
            break
    report(0.9)
    _, choice, effects = min(found, key=lambda each: each[0])
    fit = effects.adjustment
    return _Found(
        views, choice, effects, find_change(fit), tuple(_messages_on_lens(fit))
    )


def _result(
    given: Views, duplicates: tuple[str, ...], found: _Found, calibrated_on: date | None
) -> CameraCalibration:
    """Return the camera with all that its covariance holds, and the remarks."""
    views, choice, fit = found.views, found.choice, found.effects.adjustment
    at = fit.of_intrinsics(0)
    camera = replace(
        fit.state.cameras[0],
        covariance=fit.covariance[at, at],
        calibrated_on=calibrated_on,
        lens_field=found.effects.field,
    )
    remarks = [*found.remarks]
    if duplicates:
        remarks.append(message_on_duplicates(views.n_views, duplicates))
    if found.change is not None:
        remarks.append(message_on_change(found.change, views.names))
        camera = changed_camera(camera, found.change)
    counted = np.isin(given.names, views.names)
    others = set(given.names) - {*views.names, *duplicates}
    return CameraCalibration(
        camera=camera,
        views=views,
        effects=found.effects,
        duplicates=duplicates,
        left_out=tuple(name for name in given.names if name in others),
        n_points_left_out=int(given.seen[counted].sum()) - int(views.seen.sum()),
        choice=choice,
        remarks=tuple(remarks),
    )


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

    Raises `CalibrationError` if the points are far from any such board. Where too many
    of them would be left out, none is.
    """
    rms = fitted.view_rms
    kept = rms <= OFF_VIEW * np.maximum(np.nanmedian(rms, axis=0), FINEST)
    middle = np.nanmedian(np.abs(fitted.residuals), axis=(0, 2, 3))
    usual = np.maximum(middle / normal_quantile(0.25), FINEST)
    off = np.linalg.norm(fitted.residuals, axis=-1) > OFF_POINT * usual[:, None]
    pixels = np.where(off[..., None], np.nan, views.pixels)
    left = replace(views, pixels=pixels).chosen(np.all(kept | np.isnan(rms), axis=1))
    if int(left.seen.sum()) < (1 - MOST_OFF) * int(views.seen.sum()):
        left, usual = views, np.full(len(usual), fitted.rms)
    if (usual > WORST_RMS * np.max(views.image_sizes, axis=1)).any():
        raise CalibrationError(
            "intrinsics.misfit", rms=fitted.rms, board=views.board.name
        )
    return left


def _messages_on_lens(fitted: BoardFit) -> Iterator[Message]:
    """Yield the messages on a lens that the views leave open."""
    camera, at = fitted.state.cameras[0], fitted.of_intrinsics(0)
    share = camera.folded_share
    if share > LARGEST_FOLD:
        raise CalibrationError("intrinsics.folds")
    if share:
        yield message("camera-validity.fold", share=100 * share)
    px = map_uncertainty(camera, fitted.covariance[at, at]).typical
    if px > UNCERTAIN * max(camera.image_size):
        yield message("intrinsics.uncertain", px=px)
