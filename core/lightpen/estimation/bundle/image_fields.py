"""Shifts with the place in the image or the lean: of the image, and of the seat."""

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.estimation.bundle.linearised import (
    N_CONE,
    BundleState,
    views_at,
    whole_moves,
)
from lightpen.model.camera import Camera
from lightpen.model.coverage import symmetric_root
from lightpen.model.fisheye import correlation
from lightpen.model.rigid import skew

# Modes of the seat offset as a function of the tilt, and of the drift of the cone.
#
# A tip that sits in a worn cone, or that is itself out of round, moves as the pen
# leans; camera and cone drift during a swing. Each mode is a weight for every image:
# w_m and v_n of equation (4) of method.md.


FULL_LEAN = 0.15  # sine of the tilt at which a mode reaches half its weight
MODE_COUNTS = (2, 2, 2, 1)  # of one, two, three waves round the cone, and of the tilt
UPRIGHT = 0.966  # cosine of 15 degrees, to which 15 images show where a cone opens
SMALLEST_SEAT = 1e-9  # size of a mode; less is rounding


class SeatModes(NamedTuple):
    """Weights of the modes in each of N images."""

    lean: FloatArray  # (N, 7), of the seat, see `tilt_modes`
    drift: FloatArray  # (N, D), of the cone, see `drift_modes`


def seat_modes_of(rotations: FloatArray, shifts: FloatArray | None = None) -> SeatModes:
    """Return the modes of images with rotations rig_from_pen (N, 3, 3).

    ``shifts`` as in `drift_modes`.
    """
    return SeatModes(tilt_modes(rotations), drift_modes(len(rotations), shifts))


def drift_modes(n_images: int, shifts: FloatArray | None = None) -> FloatArray:
    """Return the drift modes of a cone, (N, D), each with a range of 1.

    Linear in time, and along the shifts (N, k) of fixed lamps in view, px.
    """
    time = np.linspace(-0.5, 0.5, n_images)[:, None]
    if shifts is None or n_images == 0:
        return time
    ranges = np.ptp(shifts, axis=0)
    return np.column_stack([time, shifts[:, ranges > 0] / ranges[ranges > 0]])


def tilt_modes(rotations: FloatArray) -> FloatArray:
    """Return the seat modes as functions of the tilt of the pen, (N, 7).

    Cosine and sine of one to three waves round the cone, and the tilt, less their
    means, each of mean square 1 (or 0). Rotations (N, 3, 3) are rig_from_pen.
    """
    right, away, _ = axes_of_cone(rotations) @ rotations[:, :, 1].T
    radius = np.hypot(right, away)
    weight = radius / (radius + FULL_LEAN)
    angle = np.arctan2(away, right)
    waves = [f(n * angle) * weight for n in (1, 2, 3) for f in (np.cos, np.sin)]
    forms = np.stack([*waves, weight**2], axis=1)
    forms -= forms.mean(axis=0)
    sizes = np.sqrt(np.mean(forms**2, axis=0))
    is_there = sizes > SMALLEST_SEAT
    return np.where(is_there, forms / np.where(is_there, sizes, 1.0), 0.0)


def axes_of_cone(rotations: FloatArray) -> FloatArray:
    """Return the axes of the cone in the rig, one a row: two across, one along, (3, 3).

    Before a camera that looks at it from its side they are right, away, and up. Where
    the mean direction of the pen by rig_from_pen is more than 15 degrees off, the
    camera looks down or lies on its side, and the cone opens along the mean direction.
    """
    along = rotations[:, :, 1].mean(axis=0)
    along /= np.linalg.norm(along)
    if abs(along[1]) > UPRIGHT:
        along = np.array([0.0, np.copysign(1.0, along[1]), 0.0])
    most_across = np.eye(N_CONE)[np.argmin(np.abs(along).round(1))]
    right = most_across - (most_across @ along) * along
    right /= np.linalg.norm(right)
    return np.array([right, skew(along) @ right, along])


DEGREE = 6  # of the polynomials of a lens field
NODES = 10  # along a side, at which polynomials take the covariance of a field
LENGTHS = np.array([0.1, 0.18, 0.32, 0.56])  # of the image's width
N_SCALES = 40  # standard deviations tried
SMALLEST = 1e-2  # of the largest one; smaller ones count as none


class FieldName(StrEnum):
    """Kind of a field."""

    LENS = "lens"
    TILT = "camera tilt"
    BEND = "pen bend"


# Prior probabilities that there is no field; else all scales are as likely. Every lens
# and pen has some; a camera on a firm floor does not turn.
NONE = {FieldName.LENS: 0.4, FieldName.TILT: 0.7, FieldName.BEND: 0.4}
# Largest standard deviations: px, of a tilt by the sine of the lean; of a bend, mm.
LARGEST = {FieldName.LENS: 0.08, FieldName.TILT: 0.3, FieldName.BEND: 0.1}


class FieldComponent(NamedTuple):
    """A field on average over its possible sizes, by their likelihood."""

    sigma: float  # standard deviation of maximum likelihood, px
    gain: float  # twice the log likelihood ratio to no field
    # (k, k), prior covariance with which one fit equals the average over the sizes.
    covariance: FloatArray
    spread: FloatArray  # (k, k), covariance of the estimates by the sizes


@dataclass(frozen=True, eq=False)
class ImageField:
    """One field with k unknowns, px."""

    name: FieldName
    camera: int | None  # index of the camera whose images it shifts; None: of all
    # (N, C, L, 2, k), derivative of the LEDs' images
    columns: FloatArray
    # Each (k, k), possible covariances for a standard deviation of 1 px.
    shapes: tuple[FloatArray, ...]
    # Whether the covariance is ``shapes[0]``.
    is_exact: bool = False

    @property
    def number(self) -> int:
        """Number of unknowns."""
        return int(self.columns.shape[-1])

    @cached_property
    def roots(self) -> tuple[FloatArray, ...]:
        """A square root of each shape, (k, k)."""
        return tuple(map(symmetric_root, self.shapes))


def held(field: ImageField) -> FieldComponent:
    """Return the component of a field held at 0, or as its file states it."""
    nothing = np.zeros_like(field.shapes[0])
    if field.is_exact:
        return FieldComponent(1.0, np.inf, field.shapes[0], nothing)
    return FieldComponent(0.0, 0.0, nothing, nothing)


def size_of(field: ImageField, S: FloatArray, right: FloatArray) -> FieldComponent:
    """Average a field over its sizes by their restricted likelihood.

    ``S`` (k, k) and ``right`` (k,) are information about its unknowns, all others
    marginalised, and the right side. A size makes the estimate A_s right with the
    covariance ``A_s = (S + K_s^-1)^-1``, and their average A is that of one prior.
    """
    if field.is_exact:
        return held(field)
    scales = np.concatenate([[0.0], np.geomspace(SMALLEST, 1.0, N_SCALES)])
    none = NONE[field.name]
    prior = np.where(scales > 0, (1 - none) / N_SCALES, none)
    sigmas, parts = LARGEST[field.name] * scales, []
    for root in field.roots:
        seen, turned = np.linalg.eigh(root.T @ S @ root)
        ways = root @ turned
        excess = 1 + np.maximum(seen, 0.0) * sigmas[:, None] ** 2
        gains = sigmas[:, None] ** 2 / excess
        costs = np.log(excess) - gains * (ways.T @ right) ** 2
        parts.append((ways, gains, costs.sum(axis=1)))
    costs = np.array([part[-1] for part in parts])
    best = float(costs.min())
    weights = np.exp(-0.5 * (costs - best)) * prior
    weights /= weights.sum()
    size, average = len(S), np.zeros_like(S)
    moments = np.zeros_like(S)
    for weight, (ways, gains, _) in zip(weights, parts, strict=True):
        average += (ways * (weight @ gains)) @ ways.T
        estimates = gains * (ways.T @ right)
        moments += ways @ (estimates.T * weight) @ estimates @ ways.T
    mean = average @ right
    covariance = np.linalg.solve(np.eye(size) - average @ S, average)
    return FieldComponent(
        float(sigmas[int(np.argmin(costs.min(axis=0)))]),
        -best,
        0.5 * (covariance + covariance.T),
        moments - np.outer(mean, mean),
    )


def image_fields(
    pixels: FloatArray, used: BoolArray, state: BundleState
) -> tuple[ImageField, ...]:
    """Return the fields of lenses, of cameras that turn with the lean, and of the pen.

    By the LED centres ``pixels`` (N, C, L, 2), px, that are ``used`` (N, C, L), in
    images at a state.
    """
    cameras, rotations = state.rig.cameras, state.rotations
    lenses = [_lens(camera, c, pixels, used) for c, camera in enumerate(cameras)]
    lean = rotations[:, :, 1] @ axes_of_cone(rotations)[:2].T
    lean -= lean.mean(axis=0)
    tilts = np.zeros((*pixels.shape, 4 * len(cameras)))
    for c in range(len(cameras)):
        own = tilts[:, c, ..., 4 * c : 4 * c + 4]
        own[:, :, 0, :2] = own[:, :, 1, 2:] = lean[:, None]
    # On one floor: all cameras have one size.
    tilt = ImageField(FieldName.TILT, None, tilts, (np.eye(4 * len(cameras)),))
    return (*lenses, tilt, _bend(pixels, state))


def _bend(pixels: FloatArray, state: BundleState) -> ImageField:
    """Return the shifts of a pen that bends under its weight as it leans.

    By the deflection of the highest LED, pen horizontal, mm: it grows with the square
    of the height, and moves of the pen as a whole are none.
    """
    pen = state.pen
    views = views_at(state, pixels)
    by_led = np.stack([view.led for view in views], axis=1)
    axis = pen.leds.mean(axis=0) - state.tip_pen
    axis /= np.linalg.norm(axis)
    heights = pen.leds @ axis
    shares = ((heights - heights.min()) / max(np.ptp(heights), 1e-9)) ** 2
    across = np.linalg.svd(axis[None])[2][1:]  # two directions, (2, 3)
    moves = (shares[:, None] * across[:, None]).reshape(2, -1).T
    whole = whole_moves(pen.leds)
    moves -= whole @ np.linalg.lstsq(whole, moves, rcond=None)[0]
    fall = -(axes_of_cone(state.rotations)[2] @ state.rotations) @ across.T
    columns = np.einsum(
        "nclik,lkd,nd->ncli",
        by_led,
        moves.reshape(-1, 3, 2),
        fall - fall.mean(axis=0),
        optimize=True,
    )
    return ImageField(FieldName.BEND, None, columns[..., None], (np.eye(1),))


def _lens(camera: Camera, c: int, pixels: FloatArray, used: BoolArray) -> ImageField:
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
        return ImageField(FieldName.LENS, c, columns, (shape,), is_exact=True)
    lengths = LENGTHS * camera.width
    shapes = tuple(shape_of(correlation(places, places, each)) for each in lengths)
    return ImageField(FieldName.LENS, c, columns, shapes)


def _polynomials(points: FloatArray) -> FloatArray:
    """Return products of Legendre polynomials at points (..., 2) of [-1, 1]."""
    u, v = (np.polynomial.legendre.legvander(points[..., k], DEGREE) for k in (0, 1))
    pairs = [(i, j) for i in range(DEGREE + 1) for j in range(DEGREE + 1 - i)]
    one, other = np.array(pairs).T
    return np.asarray(u[..., one] * v[..., other])
