"""Choice of the lens model by cross-validation, by the rule that boards follow.

Images that a model was not fitted to are its test: each fifth of the swing is held out
in turn. A model that fits hardly better the images that it is fitted to is not tested.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.pose import MIN_POSE_LEDS, fit_poses
from lightpen.discovery.starts import (
    CameraPrior,
    KnownLength,
    Start,
    adjust_start,
    any_camera,
    any_covariance,
)
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.intrinsics.distortion import (
    FEW,
    FISHEYE,
    FOLDING,
    MANY,
    PULLS,
    WORTH,
    Choice,
    is_significantly_less,
    is_wide,
)
from lightpen.intrinsics.lens_conversion import convert_lens
from lightpen.model.camera import Camera
from lightpen.model.rig import rig_of

N_FOLDS = 5
N_STEPS, N_FOLD_STEPS = 20, 6
OUTLYING = 4.0  # times the usual residual of an image: it tests no lens


class _Trial(NamedTuple):
    """The adjustment of a lens model; ``pull`` as in `Choice`."""

    start: Start
    prior: CameraPrior
    pull: float | None = None

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
            return only.start.state, Choice(needed, {}, only.pull)
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
    choice = Choice(len(best.camera.distortion), held_out, best.pull)
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
    for pull in (None, *(PULLS if n in FOLDING else ())):
        camera, prior = near, any_camera(near)
        if pull is not None:
            camera = pulled(near, pull)
            prior = _prior(camera)
        state = replace(start.state, rig=rig_of(camera))
        found = adjust_start(state, pixels, prior, N_STEPS, lengths)
        if found.sigma > (1 - worth) * start.sigma:
            return None
        if not found.state.rig.cameras[0].folded_share:
            return _Trial(found, prior, pull)
    return None


def pulled(near: Camera, pull: float) -> Camera:
    """Return a camera with wide priors, its folding coefficients drawn towards 0."""
    folding = 4 + np.array(FOLDING[len(near.distortion)])
    values, covariance = near.intrinsics.copy(), any_covariance(near)
    values[folding] = 0.0
    covariance[folding, folding] = pull**2
    return replace(near.with_intrinsics(values), covariance=covariance)


def _prior(camera: Camera) -> CameraPrior:
    assert camera.covariance is not None
    known = CameraPrior.of(camera, camera.covariance).information
    return CameraPrior(any_camera(camera).intrinsics, known)


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
