"""Shifts of the images of one camera beside its model: by the lens, and with the lean.

The images of a lens deviate from its distortion model by a smooth field, and those of a
camera that turns as the operator leans by an even shift that follows the lean of the
pen. Each is a set of unknowns with columns, the derivative of every LED's image by
them. They are random: normal, with one standard deviation and one of several shapes of
covariance, both by restricted likelihood; no size is assumed.

The field of a lens is a polynomial over the part of the image that the swing covers,
with the covariance of a Gaussian process (`lightpen.model.lens_field`) of one of
several lengths, or as the camera file states it.
"""

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.estimation.bundle.seat_modes import axes_of_cone
from lightpen.model.camera import Camera
from lightpen.model.information import symmetric_root
from lightpen.model.lens_field import correlation
from lightpen.model.quantiles import chi_square_quantile

DEGREE = 6  # of the polynomials of a lens field
NODES = 10  # along a side, at which polynomials take the covariance of a field
LENGTHS = np.array([0.1, 0.18, 0.32, 0.56])  # of the image's width
NONE = 0.4  # prior probability that there is no field
N_SCALES = 60  # standard deviations tried
SMALLEST = 1e-3  # of the largest one


class FieldName(StrEnum):
    """Kind of a field."""

    LENS = "lens"
    TILT = "camera tilt"


# How often chance alone supports a field, at most. One lens field too many hardly costs
# accuracy; a tilt too many may cost several standard uncertainties of the tip.
CHANCE = {FieldName.LENS: 0.1, FieldName.TILT: 0.01}
# Largest standard deviations, px, of a tilt by the sine of the lean.
LARGEST = {FieldName.LENS: 0.08, FieldName.TILT: 0.3}


class FieldComponent(NamedTuple):
    """Size of a field by likelihood."""

    sigma: float  # standard deviation of maximum likelihood, px
    gain: float  # twice the log likelihood ratio to no field
    covariance: FloatArray  # (k, k), of the unknowns, averaged over the likelihood


@dataclass(frozen=True, eq=False)
class ImageField:
    """One field with k unknowns, px."""

    name: FieldName
    camera: int  # index of the camera whose images it shifts
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

    def is_supported(self, found: FieldComponent) -> bool:
        """Return whether chance alone hardly makes such a gain."""
        return found.gain > chi_square_quantile(1, CHANCE[self.name])


def held(field: ImageField) -> FieldComponent:
    """Return the component of a field held at 0, or as its file states it."""
    if field.is_exact:
        return FieldComponent(1.0, np.inf, field.shapes[0])
    return FieldComponent(0.0, 0.0, np.zeros_like(field.shapes[0]))


def size_of(field: ImageField, S: FloatArray, right: FloatArray) -> FieldComponent:
    """Find the size of a field by restricted likelihood.

    ``S`` (k, k) and ``right`` (k,) are information about its unknowns, all others
    marginalised, and the right side.
    """
    if field.is_exact:
        return held(field)
    sigmas = LARGEST[field.name] * np.geomspace(SMALLEST, 1.0, N_SCALES)
    costs = np.array([_costs(S, right, root, sigmas) for root in field.roots])
    gain = -float(costs.min())
    sigma = float(sigmas[int(np.argmin(costs.min(axis=0)))])
    weights = np.exp(-0.5 * (costs + gain)) * (1 - NONE) / costs.size
    weights /= weights.sum() + NONE * np.exp(-0.5 * gain)
    covariance = np.einsum("s,sij->ij", weights @ sigmas**2, np.array(field.shapes))
    return FieldComponent(sigma, gain, covariance)


def _costs(
    S: FloatArray, right: FloatArray, root: FloatArray, sigmas: FloatArray
) -> FloatArray:
    """Return twice the negative log likelihood ratio to no field, of each size."""
    seen, turned = np.linalg.eigh(root.T @ S @ root)
    seen, right = np.maximum(seen, 0.0), (root @ turned).T @ right
    variances = sigmas[:, None] ** 2
    excess = 1 + seen * variances
    gains = variances * right**2 / excess
    return np.asarray(np.log(excess).sum(axis=1) - gains.sum(axis=1))


def image_fields(
    pixels: FloatArray,
    used: BoolArray,
    cameras: tuple[Camera, ...],
    rotations: FloatArray,
) -> tuple[ImageField, ...]:
    """Return the fields of lenses and of cameras that turn with the lean.

    By the LED centres ``pixels`` (N, C, L, 2), px, that are ``used`` (N, C, L), in
    images of ``rotations`` rig_from_pen (N, 3, 3).
    """
    lenses = [_lens(camera, c, pixels, used) for c, camera in enumerate(cameras)]
    lean = rotations[:, :, 1] @ axes_of_cone(rotations)[:2].T
    lean -= lean.mean(axis=0)
    tilts = []
    for c in range(len(cameras)):
        columns = np.zeros((*pixels.shape, 4))
        columns[:, c, :, 0, :2] = columns[:, c, :, 1, 2:] = lean[:, None]
        tilts.append(ImageField(FieldName.TILT, c, columns, (np.eye(4),)))
    return (*lenses, *tilts)


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
