"""Choice of the lens model by cross-validation, by the rule that boards follow.

Images that a model was not fitted to are its test: each fifth of the swing is held out
in turn. A model that fits hardly better the images that it is fitted to is not tested.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.pose import MIN_POSE_LEDS, fit_poses
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.model.camera import Camera
from lightpen.model.rig import rig_of
from lightpen_extensions.boards.distortion import FEW, FISHEYE, MANY, Choice, is_wide
from lightpen_extensions.boards.effects import WORTH, is_significantly_less
from lightpen_extensions.discover.lens_conversion import convert_lens
from lightpen_extensions.discover.starts import (
    CameraPrior,
    KnownLength,
    Start,
    adjust_start,
    any_camera,
)

N_FOLDS = 5
N_STEPS, N_FOLD_STEPS = 20, 6
OUTLYING = 4.0  # times the usual residual of an image: it tests no lens


class _Trial(NamedTuple):
    """The adjustment of a lens model."""

    start: Start
    prior: CameraPrior

    @property
    def camera(self) -> Camera:
        return self.start.state.rig.cameras[0]


def choose_lens(
    start: Start,
    pixels: FloatArray,
    lengths: tuple[KnownLength, ...],
    needed: int | None = None,
) -> tuple[BundleState, Choice]:
    """Return the start with the lens model that predicts images best, and the choice.

    The start has 5 coefficients; ``needed`` are used instead, unless they fold
    the image. Pixels (M, L, 2) are LED centres; NaN where one was not seen.
    """
    if needed is not None and needed != FEW:
        only = _refitted(start, needed, pixels, lengths, worth=-np.inf)
        if only is not None:
            return only.start.state, Choice(needed, {})
    if needed is not None:
        return start.state, Choice(FEW, {})
    best = _Trial(start, any_camera(start.state.rig.cameras[0]))
    models = (MANY, FISHEYE) if is_wide(best.camera, pixels) else (MANY,)
    found = (_refitted(start, n, pixels, lengths) for n in models)
    trials = [trial for trial in found if trial is not None]
    if not trials:
        return start.state, Choice(FEW, {})
    n_seen = np.isfinite(pixels[..., 0]).sum(axis=1)
    errors = _held_out(best, pixels, lengths)
    usable = errors < OUTLYING * np.median(errors)
    held_out = {FEW: _rms(errors, n_seen, usable)}
    for trial in trials:
        n, n_best = len(trial.camera.distortion), len(best.camera.distortion)
        its_errors = _held_out(trial, pixels, lengths)
        held_out[n] = _rms(its_errors, n_seen, usable)
        both = its_errors[usable], errors[usable]
        if is_significantly_less(held_out[n], held_out[n_best], *both):
            best, errors = trial, its_errors
    choice = Choice(len(best.camera.distortion), held_out)
    return best.start.state, choice


def _refitted(
    start: Start,
    n: int,
    pixels: FloatArray,
    lengths: tuple[KnownLength, ...],
    worth: float = WORTH,
) -> _Trial | None:
    """Return the adjustment with n coefficients.

    None where it is hardly better, or folds the image.
    """
    near = convert_lens(start.state.rig.cameras[0], n)
    if near is None:
        return None
    prior, state = any_camera(near), replace(start.state, rig=rig_of(near))
    found = adjust_start(state, pixels, prior, N_STEPS, lengths)
    is_better = found.sigma <= (1 - worth) * start.sigma
    trial = _Trial(found, prior)
    return trial if is_better and not trial.camera.folded_share else None


def _held_out(
    trial: _Trial, pixels: FloatArray, lengths: tuple[KnownLength, ...]
) -> FloatArray:
    """Return the error of each image by a fit of the others, (M,), px rms."""
    state = trial.start.state
    n_seen = np.isfinite(pixels[..., 0]).sum(axis=1)
    errors = np.full(len(pixels), np.inf)
    fold_of = np.arange(len(pixels)) * N_FOLDS // len(pixels)
    for fold in range(N_FOLDS):
        others = fold_of != fold
        own = ~others & (n_seen >= MIN_POSE_LEDS)
        by = adjust_start(
            replace(state, rotations=state.rotations[others]),
            pixels[others],
            trial.prior,
            N_FOLD_STEPS,
            lengths,
        ).state
        R = state.rotations[own]
        places = by.cone_rig - R @ by.tip_pen
        poses = fit_poses(by.rig.cameras[0], by.pen, pixels[own], R, places)
        errors[own] = poses.rms
    return errors


def _rms(errors: FloatArray, n_seen: FloatArray, usable: BoolArray) -> float:
    squares = np.average(errors[usable] ** 2, weights=n_seen[usable])
    return float(np.sqrt(squares))
