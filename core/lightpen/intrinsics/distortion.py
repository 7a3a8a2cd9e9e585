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
from lightpen.intrinsics.adjustment import FINEST, adjust_board
from lightpen.intrinsics.board_fit import N_SHAPE, BoardFit, BoardState
from lightpen.intrinsics.effects import held_out_errors
from lightpen.intrinsics.lens_conversion import convert_lens
from lightpen.intrinsics.start import BoardPoses, start_board_poses
from lightpen.intrinsics.views import Views
from lightpen.messages import Message, message
from lightpen.model.camera import Camera, LensModel

FEW, MANY, FISHEYE = 5, 8, 4  # distortion coefficients
WIDE = 0.6  # distance in the normalised plane: 31 degrees off the axis
FOLDING = {FEW: [4], MANY: [5, 6, 7]}  # which of them fold: k3, and the denominator's
PULLS = (0.1, 0.03, 0.01, 0.003, 0.001, 1e-4, 1e-10)  # the weakest first
USUAL_SIZE = 0.5  # of a coefficient that is drawn towards 0, rms
WORTH = 0.01  # by which 8 coefficients must lessen the held-out error
LARGE = 10.0  # of a coefficient, if the views do not determine it
ALIKE = 1.5  # times the held-out error: another model that is near to the views
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

    @property
    def message(self) -> Message:
        """The lens model and its cross-validated error as text."""
        own = self.held_out[self.n_coefficients]
        if self.n_coefficients == FISHEYE:
            return message("intrinsics.fisheye", held_out=own)
        n = self.n_coefficients
        return message("intrinsics.brown", n_coefficients=n, held_out=own)

    @property
    def pulls(self) -> tuple[float | None, ...]:
        """The pull, and all stronger ones."""
        pulls = PULLS if self.n_coefficients in FOLDING else ()
        given = self.pull
        return given, *(pull for pull in pulls if given is None or pull < given)

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
        if self.pull is None:
            return covariance
        folding = first + 4 + np.array(FOLDING[self.n_coefficients])
        moved = covariance[:, folding] / self.pull**2
        variance = max(USUAL_SIZE**2 - self.pull**2, 0.0)
        return np.asarray(covariance + variance * moved @ moved.T)

    @property
    def remark(self) -> Message | None:
        """Message if the corners of the image are undetermined."""
        if self.pull is None:
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


def choose_distortion(
    views: Views, fitted: BoardFit, report: Callable[[float], None]
) -> tuple[Choice, BoardFit]:
    """Return the lens model and its fit.

    A model with another number than 5 coefficients must be better.
    """
    first = _Drawn(fitted, None)
    is_plain = first.camera.lens is LensModel.BROWN
    if is_plain and first.camera.folded_share:
        first = _unfolded(views, first.camera) or first
    best, errors = first, held_out_errors(views, first.fitted)
    held_out = {best.n_coefficients: rms_together(errors, views)}
    is_off = is_wide(first.camera, views.pixels[:, 0])
    others = []
    if is_plain and _promises_more(views, first.fitted, errors):
        others.append(MANY)
    if not is_plain:
        others += [FEW, MANY]
    elif is_off:
        others.append(FISHEYE)
    for done, n in enumerate(others, 1):
        report(0.4 + 0.4 * done / len(others))
        with suppress(CalibrationError):  # the views do not determine so many
            trial = _trial(views, first.fitted, n)
            if trial is None:
                continue
            trial_errors = held_out_errors(views, trial.fitted)
            rms = held_out[n] = rms_together(trial_errors, views)
            before = held_out[best.n_coefficients]
            if n == FEW:  # the plain lens, unless contradicted
                is_better = not is_significantly_less(before, rms, errors, trial_errors)
            else:
                is_better = is_significantly_less(rms, before, trial_errors, errors)
            if is_better:
                best, errors = trial, trial_errors
    report(0.8)
    return Choice(best.n_coefficients, held_out, best.pull), best.fitted


def _promises_more(views: Views, fitted: BoardFit, errors: FloatArray) -> bool:
    """Return whether 3 more coefficients predict views better, to the first order."""
    camera = fitted.state.cameras[0]
    distortion = np.append(camera.distortion, np.zeros(MANY - FEW))
    cameras = (replace(camera, distortion=distortion),)
    n = len(fitted.prior)
    at = np.r_[0 : 4 + FEW, 4 + MANY : n + MANY - FEW]
    prior = np.eye(n + MANY - FEW) / LARGE**2
    prior[np.ix_(at, at)] = fitted.prior
    more = replace(fitted, state=replace(fitted.state, cameras=cameras), prior=prior)
    try:
        rms = rms_together(held_out_errors(views, more), views)
    except CalibrationError:  # the views do not determine so many
        return False
    return rms < (1 - WORTH) * rms_together(errors, views)


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


def _trial(views: Views, first: BoardFit, n_coefficients: int) -> "_Drawn | None":
    """Return the fit with another lens model, started from a fit."""
    camera = first.state.cameras[0]
    if n_coefficients != MANY:
        near = convert_lens(camera, n_coefficients)
        most = ALIKE * first.rms
        return None if near is None else _fit_whole(views, near, most)
    few = camera if camera.lens is LensModel.BROWN else convert_lens(camera, FEW)
    if few is None:
        near = convert_lens(camera, MANY)
        return None if near is None else _fit_whole(views, near)
    more = np.append(few.distortion, np.zeros(MANY - FEW))
    return _fit_whole(views, replace(few, distortion=more))


def _fit_whole(views: Views, near: Camera, most: float = np.inf) -> "_Drawn | None":
    """Return the fit with the weakest prior that does not fold the image.

    Just the strongest one if the residuals are more than `most` without any, px rms.
    """
    pulls: tuple[float, ...] = PULLS
    try:
        free = _Drawn(fit_camera(views, near), None)
        if not free.camera.folded_share:
            return free
        pulls = PULLS if free.fitted.rms < most else PULLS[-1:]
    except CalibrationError:  # the views do not determine so many coefficients
        if len(near.distortion) != MANY:
            raise
    is_fisheye = near.lens is LensModel.KANNALA_BRANDT
    return None if is_fisheye else _unfolded(views, near, pulls)


def fit_camera(views: Views, near: Camera, pull: float | None = None) -> BoardFit:
    """Fit camera, poses and board from an initial camera; see `Choice` for the pull."""
    known, poses = None, rough_poses(near, views)
    if pull is not None:
        distortion = near.distortion.copy()
        folding = FOLDING[len(distortion)]
        distortion[folding] = 0.0
        near = replace(near, distortion=distortion)
        known = np.zeros((len(near.intrinsics),) * 2)
        at = 4 + np.array(folding)
        known[at, at] = pull**-2
    state = BoardState(
        (near,), np.eye(3)[None], np.zeros((1, 3)), poses, np.zeros(N_SHAPE)
    )
    return adjust_board(views, state, (known,))


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
    views: Views, near: Camera, pulls: tuple[float, ...] = PULLS
) -> _Drawn | None:
    """Return the fit with the weakest regularisation that does not fold the image."""
    for pull in pulls:
        try:
            drawn = _Drawn(fit_camera(views, near, pull), pull)
        except CalibrationError:  # no convergence with so weak a prior
            continue
        if not drawn.camera.folded_share:
            return drawn
    return None


def rough_poses(near: Camera, views: Views) -> BoardPoses:
    """Return the poses of the views, also for a lens model that folds them."""
    try:
        return start_board_poses(near, views)
    except CalibrationError:
        straight = replace(near, distortion=np.zeros(FEW), lens=LensModel.BROWN)
        return start_board_poses(straight, views)
