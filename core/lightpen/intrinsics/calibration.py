"""The intrinsics of a camera from views of a board, with their covariance.

Residuals alone certify nothing: what a model with more coefficients gains is asked of
views that it was not fitted to, halves of the views are compared by what their
difference may be, and where residuals hang together within a view the covariance is
enlarged by as much.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import date

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.errors import CalibrationError
from lightpen.intrinsics.board_fit import N_SHAPE, BoardFit
from lightpen.intrinsics.distortion import (
    FEW,
    Choice,
    choose_distortion,
    fit_camera,
    folds,
    rms_together,
)
from lightpen.intrinsics.start import start_board_poses, start_camera
from lightpen.intrinsics.uncertainty_map import error_fields
from lightpen.intrinsics.views import BoardTolerances, Views
from lightpen.messages import Message, message
from lightpen.model.camera import Camera
from lightpen.model.quantiles import normal_quantile

MIN_VIEWS = 5
ENOUGH_VIEWS = 15
SIGMAS = 2.0  # of the correlation by chance
OFF_POINT = 6.0  # robust standard deviations
OFF_VIEW = 4.0  # times the median rms of the views
FINEST = 1e-3  # px; exact points are off by rounding alone
MOST_OFF = 0.2  # of the points
WORST_RMS = 0.004  # of the image's longer side: no flat board of these squares
LARGEST_FOCAL_SIGMA = 0.02  # relative
LEAST_TILT = np.radians(10.0)  # between the views that are tilted apart most
CONTRADICTED = 3.0  # standard deviations
STRETCHED = 1e-3  # relative: less is no printer's doing
LET_GO, LET_GO_MM = 0.1, 5.0  # of a board that is not what it was said to be


@dataclass(frozen=True, eq=False)
class ViewHalves:
    """Split-half check: odd views against even ones.

    Attributes
    ----------
    difference : (4,) array
        Of fx fy cx cy, px.
    expanded_uncertainty : (4,) array
        U (k = 2) of it.
    in_image : float
        Distance that the two put between the images of one point, px rms.
    """

    difference: FloatArray
    expanded_uncertainty: FloatArray
    in_image: float


@dataclass(frozen=True, eq=False)
class CameraCalibration:
    """Intrinsics of a camera.

    Attributes
    ----------
    views : Views
        Views with a detected board; excluded points are NaN.
    left_out : tuple of str
        Views that fit no other.
    n_points_left_out : int
        Excluded points in the accepted views.
    held_out : (V,) array
        Distance of the points of each view by the others, px rms.
    correlation : float
        Factor applied to the variances of independent noise.
    halves : ViewHalves or None
        None where there are too few views.
    remarks : tuple of Message
        Warnings.
    """

    camera: Camera
    views: Views
    adjustment: BoardFit
    left_out: tuple[str, ...]
    n_points_left_out: int
    choice: Choice
    held_out: FloatArray
    correlation: float
    halves: ViewHalves | None
    remarks: tuple[Message, ...]

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
) -> CameraCalibration:
    """Calibrate a camera by views of a board.

    Raises
    ------
    CalibrationError
        The views do not determine the camera; the text says what is missing.
    """
    require_views(views)
    start = start_camera(views, FEW)
    placed = np.isfinite(start_board_poses(start, views).translations[:, 0])
    views, unplaced = _parted(views, placed)
    require_views(views)
    first = fit_camera(views, tolerances, start)
    kept, left_out = _without_outliers(views, first)
    fitted = fit_camera(kept, tolerances, first.state.cameras[0])
    denied = _denied(fitted, tolerances)
    stated = tolerances
    if denied.any():  # then the views tell how it is, and not what was said of it
        tolerances = BoardTolerances(LET_GO_MM, LET_GO, stated.scale)
        fitted = fit_camera(kept, tolerances, fitted.state.cameras[0])
    report(0.2)
    choice, fitted, held_out = choose_distortion(kept, tolerances, fitted, report)
    remarks = _messages_on_board(fitted, denied, stated)
    if choice.remark is not None:
        remarks = (*remarks, choice.remark)
    _require_determined(fitted)
    correlation = _significant(fitted)
    at = fitted.of_intrinsics(0)
    camera = replace(
        fitted.state.cameras[0],
        covariance=correlation * fitted.covariance[at, at],
        calibrated_on=calibrated_on,
    )
    _require_no_fold(camera)
    return CameraCalibration(
        camera=camera,
        views=kept,
        adjustment=fitted,
        left_out=unplaced + left_out,
        n_points_left_out=_n_points_left_out(views, kept),
        choice=choice,
        held_out=held_out,
        correlation=correlation,
        halves=_halves(kept, tolerances, camera, choice),
        remarks=remarks,
    )


def require_views(views: Views) -> None:
    """Refuse views of which there are too few.

    Raises
    ------
    CalibrationError
        There are.
    """
    if views.n_views < MIN_VIEWS:
        raise CalibrationError(
            "intrinsics.few-views",
            n_views=views.n_views,
            least=MIN_VIEWS,
            enough=ENOUGH_VIEWS,
        )


def _without_outliers(views: Views, fitted: BoardFit) -> tuple[Views, tuple[str, ...]]:
    """Return the views without points, and without views, that fit no others.

    Raises
    ------
    CalibrationError
        They are so many that it is the board which is another.
    """
    rms = fitted.view_rms[:, 0]
    kept = rms <= OFF_VIEW * max(float(np.median(rms)), FINEST)
    distances = np.linalg.norm(fitted.residuals, axis=-1)
    middle = float(np.nanmedian(np.abs(fitted.residuals)))
    usual = max(middle / normal_quantile(0.25), FINEST)
    off = distances > OFF_POINT * usual
    pixels = np.where(off[..., None], np.nan, views.pixels)
    left = replace(views, pixels=pixels).chosen(kept)
    longer = max(views.image_sizes[0])
    if (
        int(left.seen.sum()) < (1 - MOST_OFF) * int(views.seen.sum())
        or usual > WORST_RMS * longer
    ):
        raise CalibrationError(
            "intrinsics.misfit", rms=fitted.rms, board=views.board.name
        )
    require_views(left)
    return left, _parted(views, kept)[1]


def _parted(views: Views, kept: BoolArray) -> tuple[Views, tuple[str, ...]]:
    """Return some of the views, and the names of the others."""
    others = zip(views.names, kept, strict=True)
    return views.chosen(kept), tuple(name for name, keep in others if not keep)


def _n_points_left_out(views: Views, kept: Views) -> int:
    """Return the number of excluded points in accepted views."""
    taking_part = np.isin(views.names, kept.names)
    return int(views.seen[taking_part].sum()) - int(kept.seen.sum())


def _denied(fitted: BoardFit, tolerances: BoardTolerances) -> BoolArray:
    """Tell which errors of the board contradict its tolerances, (5,)."""
    sigmas = np.sqrt(np.diag(fitted.covariance)[fitted.of_shape])
    priors = np.repeat([tolerances.squareness, tolerances.flatness], [2, 3])
    learned = np.sqrt(np.maximum(priors**2 - sigmas**2, 1e-30))
    return np.asarray(np.abs(fitted.state.shape) > CONTRADICTED * learned)


def _messages_on_board(
    fitted: BoardFit, denied: BoolArray, tolerances: BoardTolerances
) -> tuple[Message, ...]:
    """Return messages on a board that contradicts its tolerances."""
    values = fitted.state.shape
    remarks = []
    stretch, shear = values[:2].tolist()
    if denied[:2].any() and max(abs(stretch), abs(shear)) > STRETCHED:
        remarks.append(
            message(
                "intrinsics.board-stretched",
                board=fitted.board.name,
                stretch=stretch,
                shear=float(np.degrees(shear)),
            )
        )
    if denied[2:].any():
        remarks.append(
            message(
                "intrinsics.board-bent",
                bend=float(np.abs(values[2:]).max()),
                stated=tolerances.flatness,
            )
        )
    return tuple(remarks)


def _require_no_fold(camera: Camera) -> None:
    if folds(camera):
        raise CalibrationError("intrinsics.folds")


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


def _significant(fitted: BoardFit) -> float:
    """Return the factor by correlation of the residuals, 1 if not significant."""
    n_unknowns = fitted.scores.shape[1] - N_SHAPE
    chance = 1 + SIGMAS * float(np.sqrt(2 / n_unknowns))
    found = fitted.correlation
    return found if found > chance else 1.0


def _halves(
    views: Views, tolerances: BoardTolerances, near: Camera, choice: Choice
) -> ViewHalves | None:
    if views.n_views < 2 * MIN_VIEWS:
        return None
    is_even = np.arange(views.n_views) % 2 == 0
    try:
        one, other = (
            fit_camera(views.chosen(which), tolerances, near, choice.pull)
            for which in (is_even, ~is_even)
        )
        first, second = one.state.cameras[0], other.state.cameras[0]
        change = first.intrinsics - second.intrinsics
        moves = error_fields(second) @ change
    except CalibrationError:  # half of the views are too alike, or fold the image
        return None
    at = one.of_intrinsics(0)
    variances = np.diag(one.covariance[at, at]) + np.diag(other.covariance[at, at])
    return ViewHalves(
        change[:4],
        2 * np.sqrt(variances[:4]),
        float(np.sqrt(np.mean(np.square(moves).sum(axis=-1)))),
    )
