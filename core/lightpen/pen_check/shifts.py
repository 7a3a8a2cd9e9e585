"""LEDs that are displaced from their coordinates in the pen file.

In image i the residual of LED j is, to first order in the change x_i of the pose and
the shift d_j of the LED,

    r_ij = J_ij x_i + B_ij d_j + noise.

With the poses eliminated the shifts obey S d = b. If only the LEDs of a set F are
shifted, the others hold the pen: ``d_F = S_FF^-1 b_F``, and the sum of squares falls by
``b_F d_F``. So each LED is tried in turn with poses that do without it, and the one
that explains most is taken into F, as long as it stands out from the others.
"""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.pose import fit_poses
from lightpen.detection.robust_residuals import (
    disc_residuals,
    normal_equations,
    robust_sigma,
)
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen

MAX_SHIFTED = 3
MIN_SHIFT = 0.1  # mm; less is taken up when the tip is solved
STANDS_OUT = 25.0  # times the misfit that the other LEDs explain: 5 standard deviations
SIGNIFICANT = 40.0  # chi-square, 3 degrees of freedom: below 1e-8 by chance
RIVAL = 25.0  # chi-square by which another LED must explain less to be ruled out
LIKELY_SHIFT = 3.0  # mm, standard deviation; holds what the views cannot show
SMALLEST_SIGMA = 0.02  # px; the centres of an image are hardly better
RIDGE = 1e-9


@dataclass(frozen=True)
class Shift:
    """An LED that sits off its place in the file."""

    led: int  # its number, from 1
    by: tuple[float, float, float]  # position minus file position, pen frame, mm
    sigma: float  # standard deviation of `by` in its weakest direction, mm
    rival: int = 0  # another LED whose shift would explain the images as well, or 0

    @property
    def length(self) -> float:
        """Distance from its place in the file, mm."""
        return float(np.linalg.norm(self.by))


def find_shifts(
    camera: Camera,
    pen: Pen,
    pixels: FloatArray,
    rotations: FloatArray,
    translations: FloatArray,
) -> tuple[Shift, ...]:
    """Find the LEDs that sit off their places, the farthest first.

    Parameters
    ----------
    pixels : (N, L, 2) array
        Ellipse centres, px; NaN where an LED was not seen. Every image needs four.
    rotations, translations : (N, 3, 3) and (N, 3) array
        Rough cam_from_pen, mm.
    """
    system = _System.build(camera, pen, pixels, rotations, translations)
    rivals: dict[int, int] = {}
    for _ in range(MAX_SHIFTED):
        found = _next_shifted(system, sorted(rivals))
        if found is None:
            break
        rivals[found.led] = found.rival
    if not rivals:
        return ()
    shifted = np.array(sorted(rivals))
    shifts = system.shifts(shifted)
    # Large shifts leave the first order: once more from where the LEDs are now.
    leds = pen.leds.copy()
    leds[shifted] += shifts
    moved = replace(pen, leds=leds)
    again = _System.build(camera, moved, pixels, rotations, translations)
    shifts = shifts + again.shifts(shifted)
    sigmas = again.sigmas(shifted)
    found_shifts = [
        Shift(int(led) + 1, triple(by), float(sigma), rivals[int(led)] + 1)
        for led, by, sigma in zip(shifted, shifts, sigmas, strict=True)
    ]
    return tuple(sorted(found_shifts, key=lambda shift: -shift.length))


def triple(point: FloatArray) -> tuple[float, float, float]:
    """Return a point (3,) as a plain value."""
    x, y, z = point.tolist()
    return x, y, z


@dataclass(frozen=True)
class _Found:
    """An LED that stands out, and the equivalent one or -1."""

    led: int
    rival: int


def _next_shifted(system: "_System", shifted: list[int]) -> _Found | None:
    others = [j for j in system.seen if j not in shifted]
    if len(others) < 3:
        return None
    before = system.gain(np.array(shifted, dtype=np.int64))
    gains = np.array([system.gain(np.array([*shifted, j])) - before for j in others])
    order = np.argsort(-gains)
    best = others[order[0]]
    # How much the rest explains once the best is free.
    released = np.array([*shifted, best])
    base = system.gain(released)
    rest = [system.gain(np.append(released, j)) - base for j in others if j != best]
    length = np.linalg.norm(system.shifts(released)[-1])
    limit = max(SIGNIFICANT, STANDS_OUT * float(np.median(rest)))
    if gains[order[0]] < limit or length < MIN_SHIFT:
        return None
    is_rivalled = gains[order[0]] - gains[order[1]] < RIVAL
    return _Found(best, others[order[1]] if is_rivalled else -1)


@dataclass(frozen=True, eq=False)
class _System:
    """Normal equations of the LEDs with the poses eliminated, in units of the noise."""

    S: FloatArray  # (3 L, 3 L), 1/mm^2
    b: FloatArray  # (3 L,), 1/mm
    seen: list[int]

    @classmethod
    def build(
        cls,
        camera: Camera,
        pen: Pen,
        pixels: FloatArray,
        rotations: FloatArray,
        translations: FloatArray,
    ) -> "_System":
        poses = fit_poses(camera, pen, pixels, rotations, translations)
        R, t = poses.rotations, poses.translations
        lever = pen.leds @ np.swapaxes(R, 1, 2)
        residuals, J = disc_residuals(
            camera,
            lever,
            lever + t[:, None],
            pen.normals @ np.swapaxes(R, 1, 2),
            pen.diameter / 2,
            pixels,
        )
        n_images, n_leds = pixels.shape[:2]
        weights = np.isfinite(pixels[..., 0]).astype(np.float64)
        by_led = J[..., 3:] @ R[:, None]
        H, g = normal_equations(J, residuals, weights)
        H += RIDGE * np.einsum("nii->n", H)[:, None, None] * np.eye(6)
        every = np.concatenate([J, by_led], axis=3).reshape(-1, 1, 2, 9)
        each, each_b = normal_equations(
            every, residuals.reshape(-1, 1, 2), weights.reshape(-1, 1)
        )
        each = each.reshape(n_images, n_leds, 9, 9)
        cross = each[:, :, 6:, :6].reshape(n_images, 3 * n_leds, 6)
        folded = cross @ np.linalg.inv(H)
        S = -np.tensordot(folded, cross, axes=([0, 2], [0, 2]))
        own = each[:, :, 6:, 6:].sum(axis=0)
        for j in range(n_leds):
            at = slice(3 * j, 3 * j + 3)
            S[at, at] += own[j]
        b = each_b.reshape(n_images, n_leds, 9)[:, :, 6:].sum(axis=0).ravel()
        b = b - np.einsum("nij,nj->i", folded, g)
        variance = max(robust_sigma(residuals, 6), SMALLEST_SIGMA) ** 2
        seen = np.flatnonzero(weights.sum(axis=0)).tolist()
        return cls(S / variance, b / variance, seen)

    def shifts(self, leds: IntArray) -> FloatArray:
        """Return the shifts (K, 3) of K LEDs, mm, if the others are in place."""
        held = self._held(leds)
        return np.asarray(np.linalg.solve(held, self.b[_places(leds)])).reshape(-1, 3)

    def sigmas(self, leds: IntArray) -> FloatArray:
        """Return the standard deviations (K,) of shifts in their weakest direction."""
        covariance = np.linalg.inv(self._held(leds))
        own = [
            covariance[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] for k in range(len(leds))
        ]
        return np.asarray(np.sqrt(np.linalg.eigvalsh(np.stack(own))[:, -1]))

    def gain(self, leds: IntArray) -> float:
        """Return the chi-square that the shifts of these LEDs explain."""
        return float(self.b[_places(leds)] @ self.shifts(leds).ravel())

    def _held(self, leds: IntArray) -> FloatArray:
        at = _places(leds)
        return np.asarray(self.S[np.ix_(at, at)] + np.eye(len(at)) / LIKELY_SHIFT**2)


def _places(leds: IntArray) -> IntArray:
    return np.asarray((3 * leds[:, None] + np.arange(3)).ravel())
