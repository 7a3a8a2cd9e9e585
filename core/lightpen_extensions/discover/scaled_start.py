"""Start of the adjustment of a labelled swing: numbers, scale, lens and frame."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.detection.pose import MIN_POSE_LEDS, fit_poses
from lightpen.detection.robust_residuals import NOISE_FLOOR
from lightpen.errors import CalibrationError
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.model.camera import Camera, lens_model_of
from lightpen.model.pen import Pen
from lightpen.model.rigid import fit_rigid, rig_of
from lightpen_extensions.boards.distortion import FEW, FISHEYE, MANY, Choice, is_wide
from lightpen_extensions.boards.effects import WORTH, is_significantly_less
from lightpen_extensions.discover.found import MIN_LEDS, Halves
from lightpen_extensions.discover.hypotheses import (
    camera_prior,
    framed,
    number_by_place,
)
from lightpen_extensions.discover.labelling import Labelled
from lightpen_extensions.discover.scale import (
    MeasuredLength,
    Request,
    known_lengths,
    scale_by,
)
from lightpen_extensions.discover.starts import (
    CameraPrior,
    KnownLength,
    Start,
    adjust_start,
    any_camera,
    focal_sigma,
    scaled_to,
    towards_camera,
)

SHARES = (0.95, 0.7, 0.4)  # of the image, round its middle, the first that both image
SIDE = 15  # samples
STEPS = 12
WIDEST = np.tan(np.radians(75.0))  # of a polynomial in the normalised plane


def convert_lens(camera: Camera, n_coefficients: int) -> Camera | None:
    """Return the camera with another number of distortion coefficients.

    Gauss-Newton steps on the pixels of directions over the image; None where no such
    camera images them.
    """
    blank = replace(
        camera,
        distortion=np.zeros(n_coefficients),
        lens=lens_model_of(n_coefficients),
        covariance=None,
        lens_field=None,
    )
    for share in SHARES:
        try:
            found = _fitted(camera, blank, share)
        except (CalibrationError, np.linalg.LinAlgError):
            continue
        if found is not None:
            return found
    return None


def _fitted(camera: Camera, blank: Camera, share: float) -> Camera | None:
    steps = 0.5 + 0.5 * share * np.linspace(-1, 1, SIDE)
    size = np.array(camera.image_size) - 1.0
    pixels = (np.stack(np.meshgrid(steps, steps), axis=-1) * size).reshape(-1, 2)
    directions = camera.unproject(pixels[camera.sees(pixels)])
    directions = directions[np.linalg.norm(directions, axis=1) < WIDEST]
    if len(directions) < len(blank.intrinsics):
        return None
    wanted = camera.pixels(directions)
    found = blank
    with np.errstate(all="ignore"):
        for _ in range(STEPS):
            left = (wanted - found.pixels(directions)).reshape(-1)
            J = found.intrinsics_jacobian(directions).reshape(len(left), -1)
            scale = np.linalg.norm(J, axis=0)
            step = np.linalg.lstsq(J / scale, left, rcond=1e-9)[0] / scale
            found = found.with_intrinsics(found.intrinsics + step)
        left = wanted - found.pixels(directions)
    is_near = np.isfinite(left).all() and np.abs(left).max() < 0.02 * max(size)
    return found if is_near and found.fx > 0 and found.fy > 0 else None


# Choice of the lens model by cross-validation, by the rule that boards follow.
#
# Images that a model was not fitted to are its test: each fifth of the swing is held
# out in turn. A model that fits hardly better the images that it is fitted to is not
# tested.


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
    start: Start, pixels: FloatArray, lengths: tuple[KnownLength, ...]
) -> tuple[BundleState, Choice]:
    """Return the start with the lens model that predicts images best, and the choice.

    The start has 5 coefficients. Pixels (M, L, 2) are LED centres; NaN where one was
    not seen.
    """
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
    start: Start, n: int, pixels: FloatArray, lengths: tuple[KnownLength, ...]
) -> _Trial | None:
    """Return the adjustment with n coefficients.

    None where it is hardly better, or folds the image.
    """
    near = convert_lens(start.state.rig.cameras[0], n)
    if near is None:
        return None
    prior, state = any_camera(near), replace(start.state, rig=rig_of(near))
    found = adjust_start(state, pixels, prior, N_STEPS, lengths)
    is_better = found.sigma <= (1 - WORTH) * start.sigma
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


N_ADJUSTED = 100  # images that the start is adjusted to
N_HALF_STEPS = 15
MIN_SHARE, MIN_SEEN = 0.05, 10  # of the images, and images, in which an LED is seen
APART, TOGETHER = 0.03, 0.1  # of the pen's size, and of the images of the LED seen less
USUAL_DISC = 0.05  # of the largest distance of two LEDs
RELATIVE = 100.0  # the largest distance of two LEDs, where no length is known
LEAST_LENGTH_SIGMA = 1e-4  # mm


class ScaledStart(NamedTuple):
    """Start of the adjustment of all images."""

    state: BundleState
    lengths: tuple[KnownLength, ...]  # one at least; relative where none is known
    choice: Choice | None  # why this lens model; None where the camera is known


def numbered(found: Labelled) -> Labelled:
    """Return the labelling by LED numbers.

    Without LEDs that hardly any image shows, and without the reflections of others.
    """
    seen = (found.spots >= 0).astype(int)
    n_seen = seen.sum(axis=0)
    is_good = n_seen >= max(MIN_SHARE * len(seen), MIN_SEEN)
    good = np.flatnonzero(
        is_good & ~_are_in_place_of_others(found.state.pen.leds, seen)
    )
    if len(good) < MIN_LEDS:
        raise CalibrationError(
            "discover.too-few-leds", n_leds=len(good), needed=MIN_LEDS
        )
    state = _of_leds(found.state, good)
    order = number_by_place(state)
    return replace(
        found, state=_of_leds(state, order), spots=found.spots[:, good[order]]
    )


def _are_in_place_of_others(leds: FloatArray, seen: IntArray) -> BoolArray:
    """Return which LEDs (L, 3) duplicate a near one that is seen more often, (L,)."""
    n_seen = seen.sum(axis=0)
    apart = np.linalg.norm(leds[:, None] - leds, axis=2)
    is_near = apart < APART * apart.max()
    is_alternative = seen.T @ seen < TOGETHER * n_seen[:, None]
    is_less = n_seen[:, None] < n_seen
    return np.asarray((is_near & is_alternative & is_less).any(axis=1))


def _of_leds(state: BundleState, order: IntArray) -> BundleState:
    pen = state.pen
    pen = replace(pen, leds=pen.leds[order], normals=pen.normals[order])
    return replace(state, pen=pen)


def scaled_start(request: Request, found: Labelled, pixels: FloatArray) -> ScaledStart:
    """Return the start of the adjustment to pixels (N, L, 2), in the pen's frame."""
    state, leds = found.state, found.state.pen.leds
    measured = request.lengths or (MeasuredLength(None, RELATIVE, 0.0),)
    lengths = tuple(
        replace(each, sigma=max(each.sigma, LEAST_LENGTH_SIGMA))
        for each in known_lengths(measured, leds)
    )
    state = scaled_to(state, scale_by(lengths, leds))
    normals = np.tile(towards_camera(state), (len(leds), 1))
    pen, known = _with_discs(state.pen, request), request.camera
    pen = replace(pen, normals=normals)
    state = replace(state, pen=pen)
    some = np.unique(np.linspace(0, len(found.images) - 1, N_ADJUSTED).astype(int))
    part = replace(state, rotations=state.rotations[some])
    pixels = pixels[found.images]
    start, choice = Start(part, np.inf), None
    for n_steps in (40, 40):  # the second time about the focal length found
        prior = camera_prior(start.state.rig.cameras[0], known)
        start = adjust_start(start.state, pixels[some], prior, n_steps, lengths)
    part = start.state
    if known is None:
        part, choice = choose_lens(start, pixels[some], lengths)
    turned, _ = fit_rigid(state.pen.leds, part.pen.leds)
    every = replace(part, rotations=state.rotations @ turned.T)
    prior = camera_prior(part.rig.cameras[0], known)
    every = adjust_start(every, pixels, prior, 40, lengths).state
    pen, R, t = framed(every.pen, every.tip_pen)
    tip, rotations = R @ every.tip_pen + t, every.rotations @ R.T
    every = replace(every, pen=pen, tip_pen=tip, rotations=rotations)
    return ScaledStart(every, lengths, choice)


def adjust_halves(
    start: ScaledStart, pixels: FloatArray, known: Camera | None
) -> Halves:
    """Adjust each half of the images of the start, with pixels (N, L, 2), alone."""
    state, n = start.state, len(pixels)
    prior = camera_prior(state.rig.cameras[0], known)
    found, sigmas, noise = np.empty(2), np.empty(2), np.empty(2)
    halves = [
        half[np.unique(np.linspace(0, len(half) - 1, N_ADJUSTED // 2).astype(int))]
        for half in np.array_split(np.arange(n), 2)
    ]
    for k, some in enumerate(halves):
        part = replace(state, rotations=state.rotations[some])
        alone = adjust_start(part, pixels[some], prior, N_HALF_STEPS, start.lengths)
        found[k], noise[k] = alone.state.rig.cameras[0].fx, alone.sigma
        sigmas[k] = focal_sigma(alone, pixels[some], prior, start.lengths)
    both = np.concatenate(halves)
    together = replace(state, rotations=state.rotations[both])
    common = adjust_start(together, pixels[both], prior, 0, start.lengths).sigma
    return Halves(found, sigmas, common / max(noise.max(), NOISE_FLOOR))


def _with_discs(pen: Pen, request: Request) -> Pen:
    if request.lengths:
        return replace(pen, diameter=request.diameter)
    usual = USUAL_DISC * RELATIVE  # nothing shows how large they are
    return replace(pen, diameter=usual, diameter_sigma=usual / 2)
