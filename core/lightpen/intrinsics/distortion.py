"""Choice of the lens model by cross-validation: 5 or 8 coefficients, or a fisheye.

The gain by more coefficients is that in views which they were not fitted to. Where no
view reaches the corners of the image, the coefficients may fold it there; then a prior
draws those that do towards 0, as weak as keeps the image whole.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.formats.camera_checks import folds
from lightpen.intrinsics.adjustment import (
    CONVERGED,
    FINEST,
    adjust_board,
    fit_board_poses,
)
from lightpen.intrinsics.board_fit import N_SHAPE, BoardFit, BoardState
from lightpen.intrinsics.lens_conversion import convert_lens
from lightpen.intrinsics.start import BoardPoses, start_board_poses
from lightpen.intrinsics.uncertainty_map import apart_in_image
from lightpen.intrinsics.unevenness import fit_unevenness
from lightpen.intrinsics.views import BoardTolerances, Views
from lightpen.messages import Message, message
from lightpen.model.camera import Camera, LensModel

FEW, MANY, FISHEYE = 5, 8, 4  # distortion coefficients
WIDE = 0.6  # distance in the normalised plane: 31 degrees off the axis
FOLDING = {FEW: [4], MANY: [5, 6, 7]}  # which of them fold: k3, and the denominator's
PULLS = (0.1, 0.03, 0.01, 0.003, 0.001, 1e-4, 1e-10)  # the weakest first
NO_K3 = 1e-12  # the pull of a model without k3
USUAL_SIZE = 0.5  # of a coefficient that is drawn towards 0, rms
N_FOLDS = 5
WORTH = 0.01  # by which 8 coefficients must lessen the held-out error
ALIKE = 1.5  # times the held-out error: another model that is near to the views
ROUGHLY = 1e-5  # of the sum of squares; open coefficients would drift on for long
EVEN = np.zeros(3)  # mm: all points lie where the board has them
SIGMAS = 2.0  # of the gain of all views
MUCH = 1.0  # gain of all views together, of the logarithm of their errors


@dataclass(frozen=True)
class Choice:
    """Choice of the lens model."""

    n_coefficients: int  # 5 or 8, or 4 of a fisheye
    # Cross-validated residual, px rms, by number of coefficients.
    held_out: dict[int, float]
    # Prior standard deviation of k3, or of k4 k5 k6, that keeps the image from folding;
    # None if it does not fold.
    pull: float | None = None
    # Distance of the images by this model and by another that fits a wide lens as well,
    # px rms; largest where no view shows the board.
    apart: float = 0.0

    @property
    def message(self) -> Message:
        """The reason as text."""
        own = self.held_out[self.n_coefficients]
        if self.pull == NO_K3:
            return message("intrinsics.four", held_out=own)
        others = tuple(
            _other_model(n, rms)
            for n, rms in self.held_out.items()
            if n != self.n_coefficients
        )
        return _model(self.n_coefficients, own, others)

    @property
    def pulls(self) -> tuple[float | None, ...]:
        """The pull, and all stronger ones."""
        pulls = PULLS if self.n_coefficients in FOLDING else ()
        given = self.pull
        return given, *(pull for pull in pulls if given is None or pull < given)

    @property
    def draws_in(self) -> bool:
        """Whether the corners of the image are undetermined."""
        return self.pull is not None and self.pull != NO_K3

    def with_shrinkage(self, covariance: FloatArray, first: int = 0) -> FloatArray:
        """Return a covariance of the intrinsics with what the pull may take away.

        The estimate lies off by ``C L k`` where the pull has the information L and its
        coefficients in truth the values k, of a usual size.

        Parameters
        ----------
        covariance : (q, q) array
            C, by the fit, for which the pull is a measurement.
        first : int
            Index of the intrinsics in it.
        """
        if self.pull is None or not self.draws_in:
            return covariance
        folding = first + 4 + np.array(FOLDING[self.n_coefficients])
        moved = covariance[:, folding] / self.pull**2
        variance = max(USUAL_SIZE**2 - self.pull**2, 0.0)
        return np.asarray(covariance + variance * moved @ moved.T)

    @property
    def remark(self) -> Message | None:
        """Message if the corners of the image are undetermined."""
        if not self.draws_in:
            return None
        return message("intrinsics.drawn-in", coefficients=self.drawn_coefficients)

    @property
    def drawn_coefficients(self) -> str:
        """Names of the coefficients that a pull draws towards 0."""
        return "k3" if self.n_coefficients == FEW else "(k4, k5, k6)"


def choice_record(choice: Choice) -> dict[str, object]:
    """Return the record of a choice; without an error where nothing was held out."""
    return {
        "coefficients": choice.n_coefficients,
        "held_out_rms_px_5": choice.held_out.get(FEW),
        "held_out_rms_px_8": choice.held_out.get(MANY),
        "held_out_rms_px_fisheye": choice.held_out.get(FISHEYE),
        "reason": choice.message if choice.held_out else None,
    }


def _model(n_coefficients: int, own: float, others: tuple[Message, ...]) -> Message:
    """Return the message on the chosen model."""
    match n_coefficients, bool(others):
        case 5, True:
            return message("intrinsics.five", held_out=own, others=others)
        case 5, False:
            return message("intrinsics.five-only", held_out=own)
        case 8, True:
            return message("intrinsics.eight", held_out=own, others=others)
        case 8, False:
            return message("intrinsics.eight-only", held_out=own)
        case _, True:
            return message("intrinsics.fisheye", held_out=own, others=others)
        case _:
            return message("intrinsics.fisheye-only", held_out=own)


def _other_model(n_coefficients: int, rms: float) -> Message:
    """Return the message on a model that was tried besides."""
    match n_coefficients:
        case 5:
            return message("held-out.five", held_out=rms)
        case 8:
            return message("held-out.eight", held_out=rms)
        case _:
            return message("held-out.fisheye", held_out=rms)


def choose_distortion(
    views: Views,
    tolerances: BoardTolerances,
    fitted: BoardFit,
    report: Callable[[float], None],
    *,
    has_k3: bool = True,
) -> tuple[Choice, BoardFit, FloatArray]:
    """Return the lens model, its fit, and the cross-validation errors.

    A model with another number than 5 coefficients must be better. Without ``has_k3``,
    the lens models are a fisheye and the one with 4 coefficients, k3 being 0.
    """
    first = _Drawn(fitted, None)
    others: list[Callable[[], _Drawn | None]]
    if not has_k3:
        plain = convert_lens(first.camera, FEW) or first.camera
        others = [lambda: _converted(views, tolerances, first.fitted, FISHEYE)]
        if len(plain.distortion) == FEW:
            first = _Drawn(fit_camera(views, tolerances, plain, NO_K3), NO_K3)
    elif first.camera.lens is LensModel.BROWN:
        if folds(first.camera):
            first = _unfolded(views, tolerances, first.camera) or first
        others = [lambda: _richer(views, tolerances, first.camera)]
        if is_wide(first.camera, views.pixels[:, 0]):
            others.append(lambda: _converted(views, tolerances, first.fitted, FISHEYE))
    else:
        others = [
            lambda: _converted(views, tolerances, first.fitted, FEW),
            lambda: _rational(views, tolerances, first.fitted),
        ]
    best, errors = first, _held_out(views, tolerances, first)
    held_out = {best.n_coefficients: rms_together(errors, views)}
    tried = {best.n_coefficients: best.camera}
    report(0.5)
    for other in others:
        with suppress(CalibrationError):  # part of the views does not determine so many
            trial = other()
            if trial is None:
                continue
            trial_errors = _held_out(views, tolerances, trial)
            rms = rms_together(trial_errors, views)
            held_out[trial.n_coefficients] = rms
            tried[trial.n_coefficients] = trial.camera
            before = held_out[best.n_coefficients]
            if trial.n_coefficients == FEW:  # the plain lens, unless contradicted
                is_better = not is_significantly_less(before, rms, errors, trial_errors)
            else:
                is_better = is_significantly_less(rms, before, trial_errors, errors)
            if is_better:
                best, errors = trial, trial_errors
    report(0.8)
    own = best.n_coefficients
    another = {FEW: FISHEYE, FISHEYE: FEW}.get(own, own)
    apart = 0.0
    if another in tried and held_out[another] < ALIKE * held_out[own]:
        seen = views.pixels[views.seen]
        apart = apart_in_image(best.camera, tried[another], seen)
    return Choice(own, held_out, best.pull, apart), best.fitted, errors


def is_significantly_less(
    rms: float, rms_before: float, errors: FloatArray, errors_before: FloatArray
) -> bool:
    """Return whether a lens model predicts images better than the one before.

    Parameters
    ----------
    rms, rms_before : float
        Cross-validated error of all points, px.
    errors, errors_before : (V,) array
        That of each image, px.
    """
    # By how many times, so that no one image decides alone...
    gains = np.log(np.maximum(errors_before, FINEST) / np.maximum(errors, FINEST))
    chance = float(gains.std(ddof=1)) * len(gains) ** 0.5
    # ... unless it gains much more than others lose: few may reach the rim.
    losses = float(np.sqrt(2 * np.sum(np.minimum(gains, 0.0) ** 2)))
    least = SIGMAS * min(chance, max(losses, MUCH / SIGMAS))
    return bool(rms < (1 - WORTH) * rms_before and gains.sum() > least)


def is_wide(camera: Camera, pixels: FloatArray) -> bool:
    """Return whether points were seen so far off the axis that a fisheye differs.

    ``pixels`` (..., 2) are NaN where one was not seen.
    """
    off = (pixels - [camera.cx, camera.cy]) / [camera.fx, camera.fy]
    return bool(np.nanmax(np.linalg.norm(off, axis=-1)) > WIDE)


def _converted(
    views: Views, tolerances: BoardTolerances, fitted: BoardFit, n_coefficients: int
) -> "_Drawn | None":
    """Return the fit with another lens model, started from a fit."""
    near = convert_lens(fitted.state.cameras[0], n_coefficients)
    most = ALIKE * fitted.rms
    return None if near is None else _fit_whole(views, tolerances, near, most)


def _rational(
    views: Views, tolerances: BoardTolerances, fisheye: BoardFit
) -> "_Drawn | None":
    """Return the fit with all coefficients, from a fisheye near to it."""
    few = convert_lens(fisheye.state.cameras[0], FEW)
    if few is None:
        return _converted(views, tolerances, fisheye, MANY)
    return _richer(views, tolerances, few)


def _fit_whole(
    views: Views, tolerances: BoardTolerances, near: Camera, most: float = np.inf
) -> "_Drawn | None":
    """Return the fit with the weakest prior that does not fold the image.

    Just the strongest one if the residuals are more than `most` without any, px rms.
    """
    pulls: tuple[float, ...] = PULLS
    try:
        free = _Drawn(fit_camera(views, tolerances, near), None)
        if not folds(free.camera):
            return free
        pulls = PULLS if free.fitted.rms < most else PULLS[-1:]
    except CalibrationError:  # the views do not determine so many coefficients
        if len(near.distortion) != MANY:
            raise
    is_fisheye = near.lens is LensModel.KANNALA_BRANDT
    return None if is_fisheye else _unfolded(views, tolerances, near, pulls)


def fit_camera(
    views: Views,
    tolerances: BoardTolerances,
    near: Camera,
    pull: float | None = None,
    offsets: FloatArray = EVEN,
    poses: BoardPoses | None = None,
) -> BoardFit:
    """Fit camera, poses and board from an initial camera; see `Choice` for the pull.

    Parameters
    ----------
    offsets : (3,) or (N, 3) array
        Of the points of the board, mm.
    poses : BoardPoses, optional
        Initial poses, of a fit to more views: this one then ends at larger steps.
    """
    known = None
    converged = ROUGHLY if poses else CONVERGED
    poses = poses or rough_poses(near, views)
    if pull is not None:
        distortion = near.distortion.copy()
        folding = FOLDING[len(distortion)]
        distortion[folding] = 0.0
        near = replace(near, distortion=distortion)
        known = np.zeros((len(near.intrinsics),) * 2)
        at = 4 + np.array(folding)
        known[at, at] = pull**-2
    state = BoardState(
        (near,), np.eye(3)[None], np.zeros((1, 3)), poses, np.zeros(N_SHAPE), offsets
    )
    return adjust_board(views, state, tolerances, (known,), converged)


def fit_determined(
    views: Views,
    tolerances: BoardTolerances,
    near: Camera,
    pull: float | None = None,
    offsets: FloatArray = EVEN,
    poses: BoardPoses | None = None,
) -> BoardFit:
    """Fit as `fit_camera`, by the weakest prior where the views leave a lens open."""
    try:
        return fit_camera(views, tolerances, near, pull, offsets, poses)
    except CalibrationError:
        if pull is not None or len(near.distortion) != MANY:
            raise
        return fit_camera(views, tolerances, near, PULLS[0], offsets, poses)


def rms_together(errors: FloatArray, views: Views) -> float:
    """Return the error of all points, px rms, given the error of each view."""
    counts = views.seen.sum(axis=(1, 2))
    return float(np.sqrt(np.average(errors**2, weights=counts)))


@dataclass(frozen=True, eq=False)
class _Drawn:
    """A fit, and the pull that it was found with."""

    fitted: BoardFit
    pull: float | None

    @property
    def camera(self) -> Camera:
        return self.fitted.state.cameras[0]

    @property
    def n_coefficients(self) -> int:
        return len(self.camera.distortion)


def _unfolded(
    views: Views,
    tolerances: BoardTolerances,
    near: Camera,
    pulls: tuple[float, ...] = PULLS,
) -> _Drawn | None:
    """Return the fit with the weakest regularisation that does not fold the image."""
    for pull in pulls:
        try:
            drawn = _Drawn(fit_camera(views, tolerances, near, pull), pull)
        except CalibrationError:  # no convergence with so weak a prior
            continue
        if not folds(drawn.camera):
            return drawn
    return None


def _richer(views: Views, tolerances: BoardTolerances, few: Camera) -> _Drawn | None:
    """Return the fit with all coefficients."""
    more = np.append(few.distortion, np.zeros(MANY - FEW))
    return _fit_whole(views, tolerances, replace(few, distortion=more))


def _held_out(views: Views, tolerances: BoardTolerances, found: _Drawn) -> FloatArray:
    """Return the error of each view by a fit of the others, (V,), px rms.

    Uneven squares add the same error to every lens model and would hide its gain.
    """
    errors = np.full(views.n_views, np.nan)
    fold_of = np.arange(views.n_views) % min(N_FOLDS, views.n_views)
    fitted = found.fitted
    poses = fitted.state.poses
    for fold in range(int(fold_of.max()) + 1):
        own = fold_of == fold
        others, start = views.chosen(~own), poses.chosen(~own)
        near = replace(
            fitted,
            state=replace(fitted.state, poses=start),
            residuals=fitted.residuals[~own],
        )
        uneven, _ = fit_unevenness((others,), [near])
        state = fit_determined(
            others, tolerances, found.camera, found.pull, uneven, start
        ).state
        state = replace(state, poses=poses.chosen(own))
        residuals = fit_board_poses(views.chosen(own), state)
        squares = np.square(residuals).sum(axis=-1)
        errors[own] = np.sqrt(np.nanmean(squares, axis=(1, 2)))
    return errors


def rough_poses(near: Camera, views: Views) -> BoardPoses:
    """Return the poses of the views, also for a lens model that folds them."""
    try:
        return start_board_poses(near, views)
    except CalibrationError:
        straight = replace(near, distortion=np.zeros(FEW), lens=LensModel.BROWN)
        return start_board_poses(straight, views)
