"""Effects of a station beyond files and seat: lens, mechanics of pen and camera.

Each effect is a set of unknowns with columns, the derivative of every LED's image by
them. It is linear, as what it moves is small, and random: normal with one standard
deviation and one of several shapes of covariance, both by restricted likelihood.

============== =========================================================================
lens           smooth field over the image of one camera, px: polynomials over the part
               of the image that the swing covers, with the covariance of a Gaussian
               process (`lightpen.model.lens_field`) of one of several lengths, or as
               the camera file states it
compliance     stylus gives way across the pen, seat or stand across the cone, each by
               the sine of the lean: the pen turns with the one and not with the other
loose stylus   jump of the tip across the pen with the side of the lean: to that side,
               or along one of two axes of the pen, with the sign of the lean to it
sag            the pen bends under its weight, as the square of the height of the LED
camera tilt    the image of one camera shifts with the lean, px
late camera    a further camera takes its images later, in image intervals
rolling        the rows of an image are read one after the other; interval from the
shutter        first row to the last
LEDs in turn   the LEDs light one after the other; interval from one to the next
============== =========================================================================

Mechanics (compliance to camera tilt) are seldom perfect, and a swing decides little of
their sizes. They are unknowns of every fit, with a prior of their usual size. Play and
sag follow gravity: their priors are half-normal, with that mean and variance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.estimation.bundle.linearised import CameraView
from lightpen.estimation.statistics.variance_components import P_NONE
from lightpen.model.camera import Camera
from lightpen.model.information import known_by, symmetric_root
from lightpen.model.lens_field import correlation
from lightpen.model.quantiles import chi_square_quantile

DEGREE = 6  # of the polynomials of a lens field
NODES = 10  # along a side, at which polynomials take the covariance of a field
LENGTHS = np.array([0.1, 0.18, 0.32, 0.56])  # of the image's width
LEAST_LEAN = 0.02  # sine; below it the side of the lean is not known
# How often chance alone supports an effect, at most. Four kinds are tried at every
# station: of 24 without effects, one in six (Akaike) made the tip twice as far off.
CHANCE = 0.01
UNEVEN = 0.5  # of the shorter step, by which successive steps of an even motion differ
MOVING = 1.0  # px, least median step: pens at rest tell no time
N_SCALES = 60  # standard deviations tried
SMALLEST = 1e-3  # of the largest one
ROUNDING = 1e-9  # of the largest eigenvalue


class EffectName(StrEnum):
    """Kind of an effect."""

    LENS = "lens"
    COMPLIANCE = "compliance"
    LOOSE = "loose stylus"
    SAG = "sag"
    TILT = "camera tilt"
    DELAY = "late camera"
    SHUTTER = "rolling shutter"
    STROBE = "leds in turn"


# Usual sizes of mechanics, rms, mm or px; that of compliance is an assumption.
USUAL = {EffectName.LOOSE: 0.005, EffectName.SAG: 0.012, EffectName.TILT: 0.01}
MECHANICS = EffectName.COMPLIANCE, *USUAL
DOWNWARD = EffectName.LOOSE, EffectName.SAG  # first unknown positive, by gravity
HALF_NORMAL_MEAN = float(np.sqrt(2 / np.pi))  # of a root mean square of 1
TIMING = EffectName.DELAY, EffectName.SHUTTER, EffectName.STROBE
# Largest standard deviations, mm, px or image intervals; a larger one is another fault.
LARGEST = {
    EffectName.LENS: 0.08,
    EffectName.COMPLIANCE: 0.03,
    EffectName.LOOSE: 0.01,
    EffectName.SAG: 0.03,
    EffectName.TILT: 0.1,
    EffectName.DELAY: 0.5,  # image intervals
    EffectName.SHUTTER: 1.0,
    EffectName.STROBE: 0.1,
}


@dataclass(frozen=True, eq=False)
class Effect:
    """One effect with k unknowns."""

    name: EffectName
    camera: int  # index of the camera whose images it shifts; 0 if all cameras see it
    # (N, C, L, 2, k), derivative of the LEDs' images, px by mm or px
    columns: FloatArray
    # Each (k, k), possible covariances for a standard deviation of 1.
    shapes: tuple[FloatArray, ...]
    # Stated, assumed or usual standard deviation, mm or px; 0 if none.
    stated: float = 0.0
    # Whether the covariance is ``shapes[0]`` times the stated variance.
    is_exact: bool = False

    @property
    def number(self) -> int:
        """Number of unknowns."""
        return int(self.columns.shape[-1])

    @property
    def is_mechanical(self) -> bool:
        """Whether it is an unknown of every fit, with a prior of its usual size."""
        return self.name in MECHANICS

    @cached_property
    def at_zero(self) -> "Effect":
        """The same effect held at 0."""
        return replace(self, stated=0.0, is_exact=True)

    @cached_property
    def prior(self) -> FloatArray:
        """Covariance of the unknowns by the stated standard deviation, (k, k)."""
        mean_square = self.stated**2 * np.mean(self.shapes, axis=0)
        return np.asarray(mean_square - np.diag(self.mean**2))

    @cached_property
    def mean(self) -> FloatArray:
        """Mean of the unknowns by the prior, (k,)."""
        mean = np.zeros(self.number)
        if self.name in DOWNWARD:
            mean_square = np.mean([shape[0, 0] for shape in self.shapes])
            mean[0] = HALF_NORMAL_MEAN * self.stated * np.sqrt(mean_square)
        return mean

    @cached_property
    def roots(self) -> tuple[FloatArray, ...]:
        """A square root of each shape, (k, k)."""
        return tuple(map(symmetric_root, self.shapes))

    @cached_property
    def prior_information(self) -> FloatArray:
        """Its inverse, (k, k)."""
        return known_by(self.prior)


class EffectComponent(NamedTuple):
    """Size of an effect by likelihood."""

    sigma: float  # standard deviation of maximum likelihood, mm or px
    gain: float  # twice the log likelihood ratio to no effect
    covariance: FloatArray  # (k, k), of the unknowns by ``sigma``
    # (k, k), the same averaged over the likelihood of sigma; of timing the mean square
    # given the images, of mechanics the prior.
    expected: FloatArray

    @property
    def is_supported(self) -> bool:
        """Whether the images support the effect, so that it is fitted."""
        return is_supported(self.gain)


def is_supported(gain: float) -> bool:
    """Return whether chance alone makes such a gain less than once in a hundred."""
    return gain > chi_square_quantile(1, CHANCE)


def held(effect: Effect) -> EffectComponent:
    """Return the component of an effect held at 0, or at its stated size."""
    gain = np.inf if effect.is_exact else 0.0
    return EffectComponent(effect.stated, gain, effect.prior, effect.prior)


def size_of(effect: Effect, S: FloatArray, right: FloatArray) -> EffectComponent:
    """Find the size of an effect by restricted likelihood.

    ``S`` (k, k) and ``right`` (k,) are information about its unknowns, all others
    marginalised, and the right side.
    """
    if effect.is_exact:
        return held(effect)
    sigmas = LARGEST[effect.name] * np.geomspace(SMALLEST, 1.0, N_SCALES)
    spectra = [_Spectrum.of(S, right, root) for root in effect.roots]
    all_costs = np.array([each.costs(sigmas) for each in spectra])
    s, i = np.unravel_index(int(np.argmin(all_costs)), all_costs.shape)
    gain = -float(all_costs[s, i])
    if effect.is_mechanical:
        expected = effect.prior
    else:
        weights = np.exp(-0.5 * (all_costs + gain)) * (1 - P_NONE) / all_costs.size
        weights /= weights.sum() + P_NONE * np.exp(-0.5 * gain)
        if effect.name in TIMING:  # well seen, so the values are known as well
            moments = zip(spectra, weights, strict=True)
            expected = np.sum([x.second_moment(sigmas, w) for x, w in moments], axis=0)
        else:  # given that other effects are 0, the size would be too small
            variances = weights @ sigmas**2
            expected = np.einsum("s,sij->ij", variances, np.array(effect.shapes))
    sigma = float(sigmas[i])
    return EffectComponent(sigma, gain, sigma**2 * effect.shapes[s], expected)


def prior_of(effects: Sequence[Effect]) -> FloatArray:
    """Return the prior covariance of the unknowns of several effects."""
    number = sum(effect.number for effect in effects)
    prior, first = np.zeros((number, number)), 0
    for effect in effects:
        at = slice(first, first + effect.number)
        prior[at, at], first = effect.prior, at.stop
    return prior


def gain_of(
    S: FloatArray, right: FloatArray, prior: FloatArray, means: FloatArray
) -> float:
    """Return twice the log likelihood ratio of k unknowns with a prior to none.

    ``S`` and ``right`` as in `size_of`; the prior has a covariance (k, k) and means
    (k,).
    """
    left = right - S @ means
    spectrum = _Spectrum.of(S, left, symmetric_root(prior))
    by_means = float(means @ (right + left))
    return by_means - float(spectrum.costs(np.ones(1))[0])


class _Spectrum(NamedTuple):
    """Unknowns ``root x`` as independent x of one variance s^2 and information."""

    root: FloatArray  # (k, k)
    # `seen` and `right`: (k,), information about each x, and its right side.
    seen: FloatArray
    right: FloatArray

    @classmethod
    def of(cls, S: FloatArray, right: FloatArray, root: FloatArray) -> "_Spectrum":
        """Return the spectrum of unknowns whose covariance has this square root."""
        seen, turned = np.linalg.eigh(root.T @ S @ root)
        root = root @ turned
        return cls(root, np.maximum(seen, 0.0), root.T @ right)

    def costs(self, sigmas: FloatArray) -> FloatArray:
        """Return twice the negative log likelihood ratio to no effect, of each size."""
        variances = sigmas[:, None] ** 2
        excess = 1 + self.seen * variances
        gains = variances * self.right**2 / excess
        return np.asarray(np.log(excess).sum(axis=1) - gains.sum(axis=1))

    def second_moment(self, sigmas: FloatArray, weights: FloatArray) -> FloatArray:
        """Return the mean square of the unknowns, averaged over sizes, (k, k)."""
        variances = sigmas[:, None] ** 2
        left = variances / (1 + self.seen * variances)
        means = left * self.right
        moment = np.diag(weights @ left) + (weights[:, None] * means).T @ means
        return np.asarray(self.root @ moment @ self.root.T)


class ConeMoves(NamedTuple):
    """Moves of the tip against the cone, mm, in the frame of the rig."""

    # (N, 2), tilt of the pen's axis from that of the cone, right and away.
    lean: FloatArray
    # (N, 3, 2), per mm of compliance of the stylus, and of seat or stand.
    compliance: FloatArray
    loose: FloatArray  # (N, 3, 3), per unknown of a loose stylus


def cone_moves(rotations: FloatArray, axes: FloatArray) -> ConeMoves:
    """Return the moves of the tip in images of rotations rig_from_pen (N, 3, 3).

    ``axes`` (3, 3) are the axes of the cone, see `axes_of_cone`.
    """
    along = rotations[:, :, 1]
    lean = along @ axes[:2].T
    sine = np.maximum(np.hypot(*lean.T), LEAST_LEAN)[:, None]
    # The axis of the cone less its part along the pen.
    of_stylus = axes[2] - (along @ axes[2])[:, None] * along
    smooth = np.tanh(lean / LEAST_LEAN)
    loose = [
        of_stylus / sine,
        smooth[:, :1] * rotations[:, :, 0],
        smooth[:, 1:] * rotations[:, :, 2],
    ]
    return ConeMoves(
        lean, np.stack([of_stylus, lean @ axes[:2]], axis=2), np.stack(loose, axis=2)
    )


def mechanics_of(
    views: tuple[CameraView, ...],
    rotations: FloatArray,
    axes: FloatArray,
    leds: FloatArray,
    compliance: float,
) -> tuple[Effect, ...]:
    """Return the effects of pen, stylus, stand and foot of the camera.

    Parameters
    ----------
    views : tuple of CameraView
        About a solution.
    rotations : (N, 3, 3) array
        Of rig_from_pen.
    axes : (3, 3) array
        Of the cone, see `axes_of_cone`.
    leds : (L, 3) array
        Of the pen, mm.
    compliance : float
        Standard deviation that is assumed, mm.
    """
    by_cone = np.stack([view.cone for view in views], axis=1)
    by_led = np.stack([view.led for view in views], axis=1)
    moves = cone_moves(rotations, axes)
    found = [
        Effect(
            EffectName.COMPLIANCE,
            0,
            np.einsum("nclik,nkm->nclim", by_cone, moves.compliance),
            (0.5 * np.eye(2),),
            compliance,
        ),
        Effect(
            EffectName.LOOSE,
            0,
            np.einsum("nclik,nkm->nclim", by_cone, moves.loose),
            tuple(np.diag(one) for one in np.eye(3)),
            USUAL[EffectName.LOOSE],
        ),
    ]
    heights = leds[:, 1] - leds[:, 1].min()
    if heights.max() > 0:
        weight = (heights / heights.max()) ** 2
        # In the pen's frame.
        down = np.einsum("nji,nj->ni", rotations, -moves.compliance[..., 0])
        down[:, 1] = 0.0
        columns = np.einsum("nclik,nk,l->ncli", by_led, down, weight)[..., None]
        found.append(
            Effect(EffectName.SAG, 0, columns, (np.eye(1),), USUAL[EffectName.SAG])
        )
    for c in range(len(views)):
        tilt = np.zeros((*by_cone.shape[:4], 4))
        tilt[:, c, :, 0, :2] = tilt[:, c, :, 1, 2:] = moves.lean[:, None]
        usual = USUAL[EffectName.TILT]
        found.append(Effect(EffectName.TILT, c, tilt, (np.eye(4),), usual))
    return tuple(found)


def lens_and_timing(
    pixels: FloatArray, used: BoolArray, cameras: tuple[Camera, ...]
) -> tuple[Effect, ...]:
    """Return the effects of lenses, and of the times at which LEDs are imaged.

    By the LED centres ``pixels`` (N, C, L, 2), px, that are ``used`` (N, C, L).
    """
    lenses = [_lens(camera, c, pixels, used) for c, camera in enumerate(cameras)]
    return (*lenses, *_timing(pixels, used, cameras))


def _timing(
    pixels: FloatArray, used: BoolArray, cameras: tuple[Camera, ...]
) -> list[Effect]:
    """Return the effects of delays between LEDs, cameras and rows, if the pen moves.

    Images between which the pen moves unevenly do not determine them.
    """
    speed = _speeds(np.where(used[..., None], pixels, np.nan))
    if speed is None:
        return []
    found = []

    def consider(name: EffectName, camera: int, delays: FloatArray) -> None:
        columns = np.asarray(delays[..., None, None] * speed[..., None])
        found.append(Effect(name, camera, columns, (np.eye(1),)))

    order = np.arange(pixels.shape[2]) - 0.5 * (pixels.shape[2] - 1)
    consider(EffectName.STROBE, 0, np.broadcast_to(order, pixels.shape[:-1]))
    for c, camera in enumerate(cameras):
        only = np.zeros(pixels.shape[:-1])
        if c > 0:
            only[:, c] = 1.0
            consider(EffectName.DELAY, c, only)
        rows = np.zeros_like(only)
        rows[:, c] = np.nan_to_num(pixels[:, c, :, 1] / camera.height - 0.5)
        consider(EffectName.SHUTTER, c, rows)
    return found


def _speeds(pixels: FloatArray) -> FloatArray | None:
    """Return the motion of each LED's image, (N, C, L, 2), px an image interval.

    None if it seldom is even from image to image, or the pen rests. An LED that the
    images before or after do not show moves as the others do on average.
    """
    steps = np.diff(pixels, axis=0)
    lengths = np.linalg.norm(steps, axis=-1)
    bends = np.linalg.norm(np.diff(steps, axis=0), axis=-1)
    seen = np.isfinite(bends)
    if not seen.any() or np.nanmedian(lengths) < MOVING:
        return None
    is_even = bends[seen] < UNEVEN * np.minimum(lengths[1:], lengths[:-1])[seen]
    if is_even.mean() < 0.5:
        return None
    both = np.stack(
        [np.concatenate([steps[:1], steps]), np.concatenate([steps, steps[-1:]])]
    )
    counts = np.isfinite(both).sum(axis=0)
    speed = np.nansum(both, axis=0) / np.maximum(counts, 1)
    known = counts > 0
    means = np.sum(speed * known, axis=2) / np.maximum(known.sum(axis=2), 1)
    return np.asarray(np.where(known, speed, means[:, :, None]))


def _lens(camera: Camera, c: int, pixels: FloatArray, used: BoolArray) -> Effect:
    seen = pixels[:, c][used[:, c]]
    low, high = (seen.min(axis=0), seen.max(axis=0)) if len(seen) else np.zeros((2, 2))
    middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), 1.0)
    clean = np.nan_to_num((pixels[:, c] - middle) / half)
    basis = _polynomials(np.clip(clean, -1.0, 1.0))
    m = basis.shape[-1]
    columns = np.zeros((*pixels.shape, 2 * m))
    columns[:, c, :, 0, :m] = columns[:, c, :, 1, m:] = basis
    line = np.linspace(-1.0, 1.0, NODES)
    nodes = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    by_values = np.linalg.pinv(_polynomials(nodes))
    places = nodes * half + middle

    def shape_of(covariance: FloatArray) -> FloatArray:
        return np.asarray(np.kron(np.eye(2), by_values @ covariance @ by_values.T))

    if camera.lens_field is not None:
        shape = shape_of(camera.lens_field.covariance_at(places))
        return Effect(EffectName.LENS, c, columns, (shape,), 1.0, is_exact=True)
    lengths = LENGTHS * camera.width
    shapes = tuple(shape_of(correlation(places, places, each)) for each in lengths)
    return Effect(EffectName.LENS, c, columns, shapes)


def _polynomials(points: FloatArray) -> FloatArray:
    """Return products of Legendre polynomials at points (..., 2) of [-1, 1]."""
    u, v = (np.polynomial.legendre.legvander(points[..., k], DEGREE) for k in (0, 1))
    pairs = [(i, j) for i in range(DEGREE + 1) for j in range(DEGREE + 1 - i)]
    one, other = np.array(pairs).T
    return np.asarray(u[..., one] * v[..., other])
