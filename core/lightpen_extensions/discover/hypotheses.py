"""Hypotheses of mirror image and focal length, tried on a part of the swing.

Under weak perspective a shape and its mirror image along the line of sight have the
same tracks. Perspective distinguishes them: the wrong one fits hundreds of times worse.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.robust_residuals import NOISE_FLOOR
from lightpen.errors import CalibrationError
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.estimation.bundle.priors import prior_of_camera
from lightpen.model.camera import Camera
from lightpen.model.limits import USUAL
from lightpen.model.pen import Pen, moved, order_of_paper, pen_frame_from_raw
from lightpen.model.rigid import fit_rigid
from lightpen_extensions.discover.starts import (
    CameraPrior,
    KnownLength,
    Start,
    WeakShape,
    adjust_start,
    any_camera,
    factorise,
    farthest_apart,
    focal_length_of,
    free_focal_length,
    held_camera,
    ideal_camera,
    state_of,
    towards_camera,
)
from lightpen_extensions.discover.tracks import Pieces

USUAL_FOCAL = 1.7  # image widths, where the shape shows none
# Parts of the images, and what is assumed of the depth of a shape; in turn, until one
# fits well, with the focal length that the shape implies.
ATTEMPTS = (
    (0.0, 1.0, 1e-6),
    (0.0, 1.0, 0.2),
    (0.0, 0.67, 1e-6),
    (0.33, 1.0, 1e-6),
    (0.17, 0.83, 0.2),
    (0.25, 0.75, 1e-6),
)
SHORTEST, LONGEST = 0.3, 12.0  # image widths, of a focal length that may be
MIN_PIECES = 5  # of a part of the swing to begin with
MIN_IMAGES = 25
PRESENT = 0.7  # share of a part's images in which a piece is seen
SHOWN = 0.3  # the same, of a part of these
N_BOUNDS = 25  # images between which parts are sought
N_USED, N_CENTRES = 80, 1000  # images and centres of a part that are adjusted
UNIT = 100.0  # mm: the largest distance of two LEDs, until a length is known
POINT = 1e-3  # mm: radius of a disc before the size is known
ROUGH, FINER = 2.0, 0.5  # px: noise that residuals are measured by at first
FITTING = 0.7  # px: a start that fits
WELL = 0.1  # px: a start good enough to end the search
ALIKE = 0.02  # of the pen's size, within which two shapes are one
DECIDED = 2.0  # times the misfit of the best that the mirrored one must have


@dataclass(frozen=True)
class Hypothesis:
    """A start that was tried."""

    mirrored: bool  # near and far are exchanged against the first shape
    started_at: float  # focal length before the adjustment, px
    focal_length: float  # after it, px
    misfit: float  # robust noise of one coordinate about it, px
    is_best: bool = False  # ended at the shape that fits best, wherever it began


@dataclass(frozen=True, eq=False)
class Seed:
    """A part of the swing that is solved."""

    images: IntArray  # (M,)
    pieces: IntArray  # (L,)
    start: Start  # LED j is ``pieces[j]``
    hypotheses: tuple[Hypothesis, ...]
    margin: float  # least misfit of another shape, relative to the start's


def solve_seed(
    pieces: Pieces, size: tuple[int, int], known: Camera | None = None
) -> Seed:
    """Solve the part of a swing in which most track pieces are visible for longest.

    The size is width and height of the images, px; the camera is known where there is
    a file. Raises `CalibrationError` if no part is long enough, or shape and mirror
    image fit alike.
    """
    seed = _solved_in_part(pieces, size, known)
    fits = seed.start.sigma <= FITTING
    if fits and seed.margin >= DECIDED:
        return seed
    if fits:
        raise CalibrationError("discover.mirror-undecided")
    raise CalibrationError("discover.no-fit", misfit=seed.start.sigma)


def _solved_in_part(
    pieces: Pieces, size: tuple[int, int], known: Camera | None
) -> Seed:
    """Return the best of all hypotheses for a swing, or else for either half.

    A flat pen shows depth by perspective alone, and has wrong starts that nearly fit.
    These differ from part to part, and other LEDs are seen there.
    """
    every = np.arange(len(pieces.spots))
    solved, failures = list[Seed](), list[CalibrationError]()
    for some in (every, *np.array_split(every, 2)):
        part = Pieces(pieces.pixels[some], pieces.spots[some])
        try:
            seed = _solved(part, *_best_part(part), size, known)
        except CalibrationError as error:
            failures.append(error)
            continue
        solved.append(replace(seed, images=some[seed.images]))
        if _is_certain(seed):
            break
    if not solved:
        raise failures[0]
    return _best(solved)


def _is_certain(seed: Seed) -> bool:
    return seed.start.sigma < WELL and seed.margin >= DECIDED


def _solved(
    pieces: Pieces,
    images: IntArray,
    chosen: IntArray,
    size: tuple[int, int],
    known: Camera | None,
) -> Seed:
    """Return the best of all hypotheses for a part of a swing.

    Where none fits well, smaller parts and other depths of the shape are tried.
    """
    tried: list[Seed] = []
    for first, last, least_metric in ATTEMPTS:
        n = len(images)
        part = images[int(first * n) : int(last * n)]
        shown = (pieces.spots[np.ix_(part, chosen)] >= 0).mean(axis=0)
        own = chosen[shown >= SHOWN]
        if len(own) < MIN_PIECES or (tried and len(part) < MIN_IMAGES):
            continue
        pixels = pieces.pixels[np.ix_(part, own)]
        n_used = min(N_USED, N_CENTRES // len(own))
        used = np.unique(np.linspace(0, len(part) - 1, n_used).astype(int))
        shape = factorise(pixels, least_metric)
        shape = shape._replace(
            rotations=shape.rotations[used],
            scales=shape.scales[used],
            centroids=shape.centroids[used],
        )
        trial = _Trial(pixels[used], size, known)
        seed = _attempted(trial, shape, part[used], own)
        if seed is not None:
            tried.append(seed)
            if _is_certain(seed):
                break
    if not tried:
        raise CalibrationError("discover.no-start")
    return _best(tried)


def _best(tried: Sequence[Seed]) -> Seed:
    """Return the solution that fits best, with the hypotheses of all."""
    least = min(seed.start.sigma for seed in tried)
    near = [seed for seed in tried if seed.start.sigma <= DECIDED * least]
    decided = [seed for seed in near if seed.margin >= DECIDED]
    best = min(decided or near, key=lambda seed: seed.start.sigma)
    others = [each for seed in tried if seed is not best for each in seed.hypotheses]
    failed = tuple(replace(each, is_best=False) for each in others)
    return replace(best, hypotheses=best.hypotheses + failed)


def _attempted(
    trial: "_Trial", shape: WeakShape, images: IntArray, chosen: IntArray
) -> Seed | None:
    """Return the best of both mirror images; None without a focal length."""
    if trial.known is not None:
        focal = trial.known.fx
    else:
        # The mirrored shape has the same focal length, but for its sign.
        focal, width = abs(focal_length_of(shape)), trial.size[0]
        focal = focal if focal >= SHORTEST * width else USUAL_FOCAL * width
        if focal > LONGEST * width:
            return None
    tried = [
        trial.started(shape, focal, mirrored=False),
        trial.started(shape.mirrored, focal, mirrored=True),
    ]
    _, start = min(tried, key=lambda pair: pair[0].misfit)
    hypotheses = tuple(
        replace(each, is_best=_are_alike(other, start)) for each, other in tried
    )
    others = [each.misfit for each in hypotheses if not each.is_best]
    margin = min(others, default=np.inf) / max(start.sigma, NOISE_FLOOR)
    return Seed(images, chosen, start, hypotheses, margin)


def _are_alike(one: Start, other: Start) -> bool:
    """Return whether two starts have the same pen, not its mirror image."""
    leds, others = one.state.pen.leds, other.state.pen.leds
    R, t = fit_rigid(leds, others)
    return bool(np.abs(leds @ R.T + t - others).max() < ALIKE * UNIT)


@dataclass(frozen=True, eq=False)
class _Trial:
    """Data common to all hypotheses."""

    pixels: FloatArray
    size: tuple[int, int]
    known: Camera | None

    def started(
        self, shape: WeakShape, focal: float, *, mirrored: bool
    ) -> tuple[Hypothesis, Start]:
        """Return the result of the adjustment of a shape."""
        first, second, apart = farthest_apart(shape.points)
        length = (KnownLength(first, second, UNIT, 1e-4 * UNIT),)
        camera = self.known or ideal_camera(*self.size, focal)
        state, held = state_of(shape, camera, POINT, UNIT / apart), held_camera(camera)
        start = adjust_start(state, self.pixels, held, 12, length, ROUGH)
        if self.known is None:
            prior = free_focal_length(camera)
            start = adjust_start(start.state, self.pixels, prior, 20, length, FINER)
        prior = camera_prior(start.state.rig.cameras[0], self.known)
        start = adjust_start(start.state, self.pixels, prior, 40, length)
        after = start.state.rig.cameras[0].fx
        return Hypothesis(mirrored, float(focal), after, start.sigma), start


def camera_prior(camera: Camera, known: Camera | None) -> CameraPrior:
    """Return the prior of the given camera file, or of any camera."""
    if known is None:
        return any_camera(camera)
    return CameraPrior.of(known, prior_of_camera(known, USUAL).covariance)


def _best_part(pieces: Pieces) -> tuple[IntArray, IntArray]:
    """Return the images and the pieces of a part with many pieces for long."""
    seen = pieces.spots >= 0
    seen = np.concatenate([np.zeros((1, seen.shape[1]), int), np.cumsum(seen, axis=0)])
    n = len(seen) - 1
    bounds = np.unique(np.linspace(0, n, N_BOUNDS).astype(int))
    best, score = (0, 0), 0.0
    for a in bounds:
        for b in bounds[bounds >= a + MIN_IMAGES]:
            n_pieces = int((seen[b] - seen[a] >= PRESENT * (b - a)).sum())
            if n_pieces >= MIN_PIECES and (n_pieces - 3) * (b - a) > score:
                best, score = (int(a), int(b)), float((n_pieces - 3) * (b - a))
    a, b = best
    if score == 0:
        raise CalibrationError("discover.not-followed", n_images=n, needed=MIN_IMAGES)
    chosen = np.flatnonzero(seen[b] - seen[a] >= PRESENT * (b - a))
    images = np.arange(a, b)
    enough = (pieces.spots[a:b, chosen] >= 0).sum(axis=1) >= min(4, len(chosen))
    return images[enough], chosen


ROW = 0.02  # of the pen's size: LEDs of one row differ less in height


def number_by_place(state: BundleState) -> IntArray:
    """Return the LEDs in the order of their numbers.

    From the tip upwards, those of a row from left to right as the camera sees them; a
    pen of the paper's layout has the paper's numbers.
    """
    leds = state.pen.leds - state.tip_pen
    towards = towards_camera(state)
    up = _normalised(leds.mean(axis=0) - (leds.mean(axis=0) @ towards) * towards)
    right = np.cross(up, towards)
    paper = order_of_paper(leds, up)
    if paper is not None:
        return paper
    heights, places = leds @ up, leds @ right
    row = ROW * float(np.ptp(leds, axis=0).max())
    order = np.argsort(heights)
    rows = np.cumsum(np.diff(heights[order], prepend=heights[order[0]]) > row)
    return np.asarray(order[np.lexsort((places[order], rows))])


def framed(pen: Pen, tip: FloatArray) -> tuple[Pen, FloatArray, FloatArray]:
    """Return a numbered pen in its frame, and R, t that brought it there.

    The frame is the paper's for a pen of its layout. Otherwise LED 1 is the origin, y
    runs to the last LED, and z, at right angles to it, is next to the normal of the
    discs. The tip (3,) is in mm.
    """
    leds = pen.leds
    if order_of_paper(leds, leds.mean(axis=0) - tip) is not None:
        R, t = pen_frame_from_raw(leds)
    else:
        R, t = _frame_of(pen)
    return moved(pen, R, t), R, t


def _frame_of(pen: Pen) -> tuple[FloatArray, FloatArray]:
    """Return R, t of the frame of a pen of another layout, see `framed`."""
    y = _normalised(pen.leds[-1] - pen.leds[0])
    z = pen.normals.mean(axis=0)
    z = _normalised(z - (z @ y) * y)
    R = np.stack([np.cross(y, z), y, z])
    return R, -R @ pen.leds[0]


def _normalised(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / np.linalg.norm(vector))
