"""Assignment of spots to LEDs by the shape of the pen found so far.

Rotations are fitted outwards from the images that are solved, with the tip in the cone.
A piece of a track that stays where an LED is predicted is that LED; one that does not,
yet is seen from all sides to be fixed to the pen, is an LED not known before. Images
where all tracks broke are found again among all postures within a hand's reach.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.detection.robust_residuals import (
    cauchy_weights,
    disc_residuals,
    normal_equations,
    robust_sigma,
)
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.model.rigid import reflection, rotation_from_vector
from lightpen_extensions.discover.hypotheses import Seed
from lightpen_extensions.discover.tracks import Pieces, assign, padded

OUTWARDS = 6  # images, farther than which no rotation is carried at once
MIN_TURN_LEDS = 3  # that fix a rotation about the tip
MIN_FOUND = 5  # LEDs by which an image is found again
AT_LED = 0.003  # of the image width: a spot that is an LED
SURE = 0.0015  # of the image width, of an LED in an image that is found again
FIXED_TO_PEN = 1.0e-3  # of the image width: rms of a spot that goes with the pen
TRIMMED, OFF, MOSTLY = 4, 4.0, 0.8  # passes, times the median, and share of the images
MIN_TRIANGULATED = 12  # images that show a spot that may be a new LED
MIN_PARALLAX = 0.1  # rad, between its rays
REACH, GRID = 4, np.radians(8)  # steps of a turn to each side, and rad a step
MOST_IN_VAIN = 30  # images sought so, all over the swing, before the rest is given up
N_NEAREST = 8  # postures that an image found again is begun with
ROUNDS = 400
STEPS = 8
RIDGE = 1e-9


@dataclass(frozen=True, eq=False)
class Labelled:
    """The spots of all N images by LED."""

    state: BundleState  # of the M images that have a rotation
    images: IntArray  # (M,)
    spots: IntArray  # (N, L), spot of each LED in each image; -1 without one
    unexplained: BoolArray  # (N, P), where moving pieces that are no LEDs are seen


def label(
    seed: Seed, certain: Pieces, spots: Sequence[FloatArray], width: int
) -> Labelled:
    """Label the spots (S, 2), px, of all images from a part that is solved.

    Certain pieces are labelled as a whole; ``width`` is the width of the images, px.
    """
    search = _Search(seed.start.state, certain, spots, width)
    search.rotations[seed.images] = seed.start.state.rotations
    search.solved[seed.images] = True
    # Of the joined pieces, the certain ones that make the seed fit.
    search.name_pieces()
    for _ in range(ROUNDS):
        progressed = search.turn_next()
        progressed |= search.name_pieces()
        if not progressed and not search.find_again():
            break
    labels = search.labelled_spots()
    done = np.flatnonzero(search.solved)
    state = replace(search.state, rotations=search.rotations[done])
    are_leds = (certain.spots[:, :, None] == labels[:, None]).any(axis=2)
    unexplained = (certain.spots >= 0) & ~are_leds & (search.led < 0)
    return Labelled(state, done, labels, unexplained)


class _Search:
    """The labelling in progress: rotations of images, LEDs of pieces."""

    def __init__(
        self,
        state: BundleState,
        pieces: Pieces,
        spots: Sequence[FloatArray],
        width: int,
    ) -> None:
        n = len(pieces.pixels)
        self.state = state
        self.pieces = pieces
        self.spots = spots
        self.width = width
        self.rotations = np.tile(np.eye(3), (n, 1, 1))
        self.solved = np.zeros(n, bool)
        self.failed = np.zeros(n, bool)
        self.sought = np.zeros(n, bool)
        self.led = np.full(pieces.spots.shape[1], -1)

    def predicted(self, rotations: FloatArray) -> FloatArray:
        """Return where the LEDs are by rotations (M, 3, 3), (M, L, 2), px."""
        state, camera = self.state, self.state.rig.cameras[0]
        leds = state.pen.leds @ np.swapaxes(rotations, 1, 2)
        with np.errstate(all="ignore"):
            return camera.project(leds + state.cone_rig)

    def pixels_of_leds(self, images: IntArray) -> FloatArray:
        """Return the labelled centres of images, (M, L, 2), px; NaN without."""
        pixels = np.full((len(images), self.state.pen.n_leds, 2), np.nan)
        for p in np.flatnonzero(self.led >= 0):
            seen = self.pieces.spots[images, p] >= 0
            pixels[seen, self.led[p]] = self.pieces.pixels[images[seen], p]
        return pixels

    def turn_next(self) -> bool:
        """Fit the rotations of images beside those that are solved."""
        solved = np.flatnonzero(self.solved)
        waiting = np.flatnonzero(~self.solved & ~self.failed)
        if not len(waiting) or not len(solved):
            return False
        at = np.clip(np.searchsorted(solved, waiting), 1, max(len(solved) - 1, 1))
        before, after = solved[at - 1], solved[np.minimum(at, len(solved) - 1)]
        nearest = np.where(waiting - before <= after - waiting, before, after)
        near = np.abs(waiting - nearest) <= OUTWARDS
        images, nearest = waiting[near], nearest[near]
        pixels = self.pixels_of_leds(images)
        enough = np.isfinite(pixels[..., 0]).sum(axis=1) >= MIN_TURN_LEDS
        images, nearest, pixels = images[enough], nearest[enough], pixels[enough]
        if not len(images):
            return False
        self.rotations[images] = self.rotations[nearest]
        good = self.fit_turns(images, pixels)
        self.solved[images[good]] = True
        self.failed[images[~good]] = True
        return True

    def fit_turns(self, images: IntArray, pixels: FloatArray) -> BoolArray:
        """Fit rotations (in place) to LEDs; return which fit.

        A flat pen that passes the view from the front may seem to turn back: near and
        far exchanged fit almost as well there, so both are fitted, and the better kept.
        """
        R, lengths = self._fitted(self.rotations[images], pixels)
        others, lengths_then = self._fitted(self._near_and_far_exchanged(R), pixels)
        threshold = AT_LED * self.width
        is_better = _loss(lengths_then, threshold) < _loss(lengths, threshold)
        self.rotations[images] = np.where(is_better[:, None, None], others, R)
        lengths = np.where(is_better[:, None], lengths_then, lengths)
        inside = np.nan_to_num(lengths, nan=np.inf) < threshold
        n_seen = np.isfinite(lengths).sum(axis=1)
        n_inside = inside.sum(axis=1)
        least = min(MIN_TURN_LEDS, self.state.pen.n_leds)
        return np.asarray((n_inside >= least) & (2 * n_inside > n_seen))

    def _fitted(
        self, R: FloatArray, pixels: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return rotations fitted from R (M, 3, 3), and residuals (M, L), px."""
        for _ in range(STEPS):
            residuals, J = self._linearised(R, pixels)
            weights = cauchy_weights(residuals, max(robust_sigma(residuals, 3), 1.0))
            H, g = normal_equations(J[..., :3], residuals, weights)
            H += RIDGE * np.trace(H, axis1=1, axis2=2)[:, None, None] * np.eye(3)
            turns = np.asarray(np.linalg.solve(H, g[..., None]), dtype=np.float64)
            R = rotation_from_vector(turns[..., 0]) @ R
        residuals, _ = self._linearised(R, pixels)
        return R, np.linalg.norm(residuals, axis=2)

    def _near_and_far_exchanged(self, R: FloatArray) -> FloatArray:
        """Return the rotations that show the plane of the LEDs alike from afar."""
        leds = self.state.pen.leds
        middle = leds.mean(axis=0)
        normal = np.linalg.svd(leds - middle)[2][2]
        sight = R @ middle + self.state.cone_rig
        sight /= np.linalg.norm(sight, axis=1, keepdims=True)
        return reflection(sight) @ R @ reflection(normal)

    def _linearised(
        self, R: FloatArray, pixels: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        state, turned = self.state, np.swapaxes(R, 1, 2)
        lever = state.pen.leds @ turned
        with np.errstate(all="ignore"):
            return disc_residuals(
                state.rig.cameras[0],
                lever,
                lever + state.cone_rig,
                state.pen.normals @ turned,
                state.pen.diameter / 2,
                pixels,
            )

    def name_pieces(self) -> bool:
        """Name the pieces that are LEDs by where LEDs are predicted, or add LEDs."""
        images = np.flatnonzero(self.solved)
        there = self.predicted(self.rotations[images])
        named = False
        lengths = (self.pieces.spots[images] >= 0).sum(axis=0)
        for p in np.argsort(-lengths, kind="stable"):
            if self.led[p] >= 0 or not lengths[p]:
                continue
            own = self.pieces.spots[images, p] >= 0
            at = self.pieces.pixels[images[own], p]
            misses = np.linalg.norm(there[own] - at[:, None], axis=2)
            typical = np.median(misses, axis=0)
            j = int(np.argmin(typical))
            if typical[j] < AT_LED * self.width and not self._taken(p, j):
                self.led[p] = j
                named = True
        if not named:
            named = self._add_led(images, lengths)
        return named

    def _taken(self, p: int, j: int) -> bool:
        """Return whether another piece is that LED in an image of this one."""
        others = self.pieces.spots[:, self.led == j] >= 0
        return bool((others.any(axis=1) & (self.pieces.spots[:, p] >= 0)).any())

    def _add_led(self, images: IntArray, lengths: IntArray) -> bool:
        """Add the longest piece that is fixed to the pen as a new LED."""
        state = self.state
        for p in np.argsort(-lengths, kind="stable"):
            if lengths[p] < MIN_TRIANGULATED:
                return False
            if self.led[p] >= 0:
                continue
            own = images[self.pieces.spots[images, p] >= 0]
            point = self._fixed_to_pen(own, self.pieces.pixels[own, p])
            if point is not None:
                pen = state.pen
                self.state = replace(
                    state,
                    pen=replace(
                        pen,
                        leds=np.concatenate([pen.leds, point[None]]),
                        normals=np.concatenate([pen.normals, pen.normals[:1]]),
                    ),
                )
                self.led[p] = pen.n_leds
                self.sought[:] = False
                return True
        return False

    def _fixed_to_pen(self, images: IntArray, pixels: FloatArray) -> FloatArray | None:
        """Return the point of the pen, (3,), that is seen at pixels (M, 2), or None.

        Of a few images the turn is wrong, as hardly any LED is known there.
        """
        camera, cone = self.state.rig.cameras[0], self.state.cone_rig
        rays, R = camera.unproject(pixels), self.rotations[images]
        good = np.ones(len(images), bool)
        for _ in range(TRIMMED):
            point = _triangulated(rays[good], R[good], cone)
            if point is None:
                return None
            places = R @ point + cone
            with np.errstate(all="ignore"):
                misses = np.linalg.norm(camera.project(places) - pixels, axis=1)
            good = misses <= OFF * np.median(misses)
        rms = np.sqrt(np.mean(misses[good] ** 2))
        in_front = places[good, 2].min() > 0
        is_fixed = in_front and rms < FIXED_TO_PEN * self.width
        return point if is_fixed and np.mean(good) > MOSTLY else None

    def find_again(self) -> bool:
        """Look for an image in which tracks broke, by all spots and any posture."""
        u, _, vt = np.linalg.svd(self.rotations[self.solved].mean(axis=0))
        steps = GRID * np.arange(-REACH, REACH + 1)
        turns = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
        rotations = rotation_from_vector(turns) @ (u @ vt)
        there = self.predicted(rotations)
        n_left = max(MOST_IN_VAIN - int((self.sought & ~self.solved).sum()), 0)
        left = np.flatnonzero(~self.solved & ~self.sought)
        for i in np.random.default_rng(0).permutation(left)[:n_left].tolist():
            spots = self.spots[i]
            if len(spots) < MIN_FOUND:
                continue
            self.sought[i] = True
            apart = np.linalg.norm(there[:, :, None] - spots, axis=3).min(axis=2)
            for k in np.argsort(apart.mean(axis=1))[:N_NEAREST]:
                self.rotations[i] = rotations[k]
                if self._settles(i, spots):
                    self.solved[i] = True
                    return True
        return False

    def _settles(self, i: int, spots: FloatArray) -> bool:
        """Fit the rotation of an image to all its spots, closer and closer."""
        image = np.array([i])
        for threshold in (0.06, 0.03, 0.01, AT_LED, SURE):
            there = self.predicted(self.rotations[image])[0]
            match = assign(there, spots, threshold * self.width)
            found = match >= 0
            if found.sum() < MIN_FOUND:
                return False
            pixels = np.full((1, len(match), 2), np.nan)
            pixels[0, found] = spots[match[found]]
            self.rotations[image], _ = self._fitted(self.rotations[image], pixels)
        n_enough = 0.6 * min(len(spots), len(match))
        return bool(found.sum() >= max(MIN_FOUND, n_enough))

    def labelled_spots(self) -> IntArray:
        """Return the spot of each LED in each image that is solved, (N, L)."""
        labels = np.full((len(self.spots), self.state.pen.n_leds), -1)
        images = np.flatnonzero(self.solved)
        there = self.predicted(self.rotations[images])
        for i, predicted in zip(images.tolist(), there, strict=True):
            labels[i] = assign(predicted, self.spots[i], AT_LED * self.width)
        return labels


def _loss(lengths: FloatArray, threshold: float) -> FloatArray:
    """Return the sum of squared residuals (M, L), px, (M,); each is bounded."""
    return np.asarray(np.sum(np.fmin(lengths, threshold) ** 2, axis=1))


def pixels_of(labels: IntArray, spots: Sequence[FloatArray]) -> FloatArray:
    """Return the centres of LEDs by their spots, (N, L, 2), px; NaN without."""
    every = padded(spots)
    pixels = every[np.arange(len(labels))[:, None], np.maximum(labels, 0)]
    return np.where((labels >= 0)[..., None], pixels, np.nan)


def _triangulated(
    rays: FloatArray, rotations: FloatArray, cone: FloatArray
) -> FloatArray | None:
    """Return the point of the pen, (3,), mm, that is seen along rays (M, 2).

    None where the rays are too much alike from the pen.
    """
    directions = np.column_stack([rays, np.ones(len(rays))])
    seen_from_pen = np.einsum("nji,nj->ni", rotations, directions)
    seen_from_pen /= np.linalg.norm(seen_from_pen, axis=1, keepdims=True)
    spread = seen_from_pen - seen_from_pen.mean(axis=0)
    if np.linalg.norm(spread, axis=1).max() < MIN_PARALLAX:
        return None
    # x (R_3 p + c_3) = R_1 p + c_1, and likewise y.
    rows = rays[..., None] * rotations[:, 2:] - rotations[:, :2]
    right = cone[:2] - rays * cone[2]
    return np.asarray(
        np.linalg.lstsq(rows.reshape(-1, 3), right.ravel(), rcond=None)[0]
    )
