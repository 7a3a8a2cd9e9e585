"""Choice of the lens model by cross-validation: 5 or 8 coefficients, or a fisheye.

The gain by more coefficients is that in views which they were not fitted to. Where no
view reaches the corners of the image, the coefficients of the highest orders would be
left open and fold it there; each has a prior of what it usually does in a corner.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.messages import Message, message
from lightpen.model.camera import Camera, LensModel
from lightpen.model.rigid import skew
from lightpen_extensions.boards.adjustment import (
    N_SHAPE,
    BoardFit,
    BoardState,
    adjust_board,
)
from lightpen_extensions.boards.effects import (
    held_out_errors,
    is_significantly_less,
    rms_together,
)
from lightpen_extensions.boards.observing import Views
from lightpen_extensions.boards.start import start_board_poses, start_camera

FEW, MANY, FISHEYE = 5, 8, 4  # distortion coefficients
WIDE = 0.6  # distance in the normalised plane: 31 degrees off the axis
# Standard deviations of what k2, k3, and k4 k5 k6, do to the distance of a corner.
OF_K2, OF_K3, OF_RATIONAL = 1.0, 0.1, 1.0
# How much stiffer these priors become, of k2 and of the others, if the image folds.
STIFFNESSES = ((0.0, 1.0), (0.0, 10.0), (0.0, 100.0), (3.0, 100.0), (30.0, 100.0))


@dataclass(frozen=True)
class Choice:
    """Choice of the lens model."""

    n_coefficients: int  # 5 or 8, or 4 of a fisheye
    # Cross-validated residual, px rms, by number of coefficients.
    held_out: dict[int, float]

    @property
    def message(self) -> Message:
        """The lens model and its cross-validated error as text."""
        n, own = self.n_coefficients, self.held_out[self.n_coefficients]
        if n == FISHEYE:
            return message("intrinsics.fisheye", held_out=own)
        return message("intrinsics.brown", n_coefficients=n, held_out=own)


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
    views: Views,
    fitted: BoardFit,
    report: Callable[[float], None],
    stiffness: tuple[float, float] = STIFFNESSES[0],
) -> tuple[Choice, BoardFit]:
    """Return the lens model and its fit; see `usual_distortion` for ``stiffness``.

    A model with another number than 5 coefficients must be better.
    """
    camera, errors = fitted.state.cameras[0], held_out_errors(views, fitted)
    n_first = n_best = len(camera.distortion)
    best, held_out = fitted, {n_first: rms_together(errors, views)}
    models = (
        (FEW, MANY, FISHEYE) if is_wide(camera, views.pixels[:, 0]) else (FEW, MANY)
    )
    others = [n for n in models if n != n_first]
    for done, n in enumerate(others, 1):
        report(0.4 + 0.4 * done / len(others))
        with suppress(CalibrationError):  # the views do not determine so many
            near = start_camera(views, n)
            if (n_first, n) == (FEW, MANY):
                more = np.append(camera.distortion, np.zeros(n - n_first))
                near = replace(camera, distortion=more)
            trial = fit_camera(views, near, stiffness)
            if trial.state.cameras[0].folded_share > camera.folded_share:
                continue
            trial_errors = held_out_errors(views, trial)
            rms = held_out[n] = rms_together(trial_errors, views)
            before = held_out[n_best]
            if n == FEW:  # the plain lens, unless contradicted
                is_better = not is_significantly_less(before, rms, errors, trial_errors)
            else:
                is_better = is_significantly_less(rms, before, trial_errors, errors)
            if is_better:
                n_best, best, errors = n, trial, trial_errors
    report(0.8)
    return Choice(n_best, held_out), best


def is_wide(camera: Camera, pixels: FloatArray) -> bool:
    """Return whether points were seen so far off the axis that a fisheye differs.

    ``pixels`` (..., 2) are NaN where one was not seen.
    """
    off = (pixels - [camera.cx, camera.cy]) / [camera.fx, camera.fy]
    return bool(np.nanmax(np.linalg.norm(off, axis=-1)) > WIDE)


def usual_distortion(
    camera: Camera, stiffness: tuple[float, float] = STIFFNESSES[0]
) -> FloatArray:
    """Return the information of intrinsics by what lenses usually do, (4 + n, 4 + n).

    It is of the coefficients that fold the corners of an image, about 0. ``stiffness``
    is that of k2, and of those of higher order.
    """
    information = np.zeros((len(camera.intrinsics),) * 2)
    if camera.lens is LensModel.BROWN:
        corner = 0.5 * np.hypot(*camera.image_size) / camera.fx
        information[8, 8] = (OF_K3 / corner**6) ** -2
        at = np.arange(9, len(information))
        information[at, at] = (OF_RATIONAL / corner ** (2 * at - 16.0)) ** -2
        information *= stiffness[1] ** 2
        information[5, 5] = (stiffness[0] * corner**4 / OF_K2) ** 2
    return information


def fit_camera(
    views: Views, near: Camera, stiffness: tuple[float, float] = STIFFNESSES[0]
) -> BoardFit:
    """Fit camera, poses and board from an initial camera; see `usual_distortion`."""
    straight = replace(near, distortion=np.zeros_like(near.distortion))
    try:
        poses = start_board_poses(near, views)
    except CalibrationError:  # a lens model that folds the views
        poses = start_board_poses(straight, views)
    state = BoardState(
        (near,), np.eye(3)[None], np.zeros((1, 3)), poses, np.zeros(N_SHAPE)
    )
    origin = replace(state, cameras=(straight,))
    return adjust_board(views, state, (usual_distortion(near, stiffness),), origin)


# Projection uncertainty of intrinsics over the image.
#
# An error of the intrinsics that is equivalent to a rotation of the camera does not
# count: the orientation is estimated anew in each use. So the turn that explains most
# of it is taken out of the field of errors over the image [1]_.
#
# References
# ----------
# .. [1] D. Kogan, mrcal, "Projection uncertainty": the implied rotation.


COLUMNS, ROWS = 9, 7


@dataclass(frozen=True, eq=False)
class UncertaintyMap:
    """Standard uncertainty of projections over the image."""

    pixels: FloatArray  # (7, 9, 2), positions in the image, px
    # (7, 9), along the worst direction there, px; NaN where nothing is seen.
    sigmas: FloatArray

    @property
    def center(self) -> float:
        """In the middle of the image, px."""
        return float(self.sigmas[ROWS // 2, COLUMNS // 2])

    @property
    def typical(self) -> float:
        """Root mean square over the image, px."""
        return float(np.sqrt(np.nanmean(self.sigmas**2)))

    @property
    def worst(self) -> float:
        """The largest, px."""
        return float(np.nanmax(self.sigmas))


def map_uncertainty(camera: Camera, covariance: FloatArray) -> UncertaintyMap:
    """Return the projection uncertainty by a covariance of the intrinsics."""
    fields = error_fields(camera)
    by_place = fields @ covariance @ np.swapaxes(fields, -1, -2)
    sigmas = np.sqrt(np.maximum(np.linalg.eigvalsh(by_place)[..., -1], 0.0))
    sigmas[~camera.sees(_pixels(camera).reshape(-1, 2))] = np.nan
    return UncertaintyMap(_pixels(camera), sigmas.reshape(ROWS, COLUMNS))


def error_fields(camera: Camera) -> FloatArray:
    """Return the derivatives of image points by the intrinsics, (63, 2, 4 + n), px.

    The turn that explains most of each is left out; 0 where the camera sees nothing.
    """
    pixels = _pixels(camera).reshape(-1, 2)
    seen = camera.sees(pixels)
    directions = np.zeros_like(pixels)
    directions[seen] = camera.unproject(pixels[seen])
    points = np.concatenate([directions, np.ones((len(directions), 1))], axis=1)
    by_point = camera.project_with_jacobian(points).jacobian
    by_point[~seen] = 0.0
    turns = (-by_point @ skew(points)).reshape(-1, 3)
    fields = camera.intrinsics_jacobian(directions)
    fields[~seen] = 0.0
    flat = fields.reshape(len(turns), -1)
    explained = turns @ np.linalg.lstsq(turns, flat, rcond=None)[0]
    return np.asarray((flat - explained).reshape(fields.shape))


def moved_in_image(camera: Camera, difference: FloatArray) -> float:
    """Return the rms image shift by a difference of the intrinsics, px."""
    moves = error_fields(camera) @ difference
    return float(np.sqrt(np.mean(np.square(moves).sum(axis=-1))))


def _pixels(camera: Camera) -> FloatArray:
    grid = np.meshgrid(
        np.linspace(0, camera.width - 1, COLUMNS),
        np.linspace(0, camera.height - 1, ROWS),
    )
    return np.stack(grid, axis=-1)
