"""Start of the adjustment of a labelled swing: numbers, scale, lens and frame."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.detection.robust_residuals import NOISE_FLOOR
from lightpen.errors import CalibrationError
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.model.rigid import fit_rigid
from lightpen_extensions.boards.distortion import Choice
from lightpen_extensions.discover.hypotheses import camera_prior
from lightpen_extensions.discover.labelling import Labelled
from lightpen_extensions.discover.lens_choice import choose_lens
from lightpen_extensions.discover.normals import towards_camera
from lightpen_extensions.discover.numbering import (
    framed,
    number_by_place,
    number_by_sketch,
)
from lightpen_extensions.discover.request import Request
from lightpen_extensions.discover.requirements import MIN_LEDS, Halves
from lightpen_extensions.discover.scale import MeasuredLength, known_lengths, scale_by
from lightpen_extensions.discover.starts import (
    KnownLength,
    Start,
    adjust_start,
    focal_sigma,
    scaled_to,
)

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


def numbered(found: Labelled, request: Request) -> Labelled:
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
    order = (
        number_by_place(state)
        if request.sketch is None
        else number_by_sketch(state.pen.leds, request.sketch.leds)
    )
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
        part, choice = choose_lens(start, pixels[some], lengths, request.n_coefficients)
    turned, _ = fit_rigid(state.pen.leds, part.pen.leds)
    every = replace(part, rotations=state.rotations @ turned.T)
    prior = camera_prior(part.rig.cameras[0], known)
    every = adjust_start(every, pixels, prior, 40, lengths).state
    pen, R, t = framed(every.pen, every.tip_pen, request.rough_leds)
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
