"""Centres of small discs by least squares: a blurred disc on a sloping background.

The light of an even disc of radius R under a Gaussian blur of standard deviation sigma
is, at the distance r from its centre, the probability that a normal variable lies
within R of a point so far off: the noncentral chi-square distribution with two degrees
of freedom [1]_. In units of the radius it is a table ``F(u; k)`` of u = r / R and the
sharpness k = R / sigma. An ellipse is its affine image:

    I(x) = a F(|M (x - c)|; k) + b + g x,

with the centre c, the symmetric matrix M, and the slope g of a background of bloom and
reflections. Clipped pixels must only be bright enough. Pixels brighter than the model,
as by reflections, lose their weight as by a Cauchy distribution. The noise of a pixel
grows with the light as much as the pixels of all discs show.

A free slope costs precision, a missing one the centre. So its usual size is estimated
from the slopes of all discs, as variance beyond that by noise, and is the standard
deviation of its prior; without evidence there is none.

References
----------
.. [1] J. I. Marcum, "A statistical theory of target detection by pulsed radar", IRE
   Transactions on Information Theory 6 (1960) 59-267.
"""

from functools import lru_cache, partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from lightpen.arrays import BoolArray, FloatArray
from lightpen.model.coverage import normal_quantile

REACH = 1.9  # radii, and
MORE_REACH = 0.5  # px, from the centre to the last pixel used, or less:
FAR_REACH, MORE_FAR = 1.4, 3.0
MIDDLE = 1.5  # px, where the light shows the height
START_BLUR = 1.5  # px
SHARPNESSES = (0.75, 30.0)
SHARPNESS_PRIOR = 1.0  # standard deviation of its logarithm
STEP_OF_DISTANCE, FARTHEST = 0.02, 4.0  # of the table, radii
STEP_OF_SHARPNESS = 0.04  # of the table, logarithm
LEAST_DISTANCE = 1e-6  # radii

ROUNDS = (6, 6, 12)  # after which slopes and the growth of noise are estimated
LARGEST = 1e6  # of any parameter
CONVERGED = 2e-3  # px
DAMPING, HOPELESS = 1e-3, 1e6
RIDGE, TINY = 1e-9, 1e-30
ROBUST = 3.0  # standard deviations of a pixel at which its weight is half
LEAST_NOISE = 0.7  # digital numbers
LEAST_LIT = 0.1  # of the height: pixels that show whether the model fits
DARK, LIT = 0.25, 0.5  # of the height: pixels that show the noise, and its growth
MOST_GROWTH = 0.1  # digital numbers, as 8 bits of 2500 electrons have
FEWEST_PIXELS = 12
MISSHAPEN = 0.1  # more stretched than usual, of an LED that is not whole, and
MANY_SPREADS = 2.0  # times the usual stretch: of normal ones one in 500 has thrice it
USUAL_NOISE = 3.0  # digital numbers, where fewer show it
EVIDENT_SLOPE = 1.5  # times the squares of slopes that noise alone makes
NO_SLOPE = 1e-2  # digital numbers per px

# Parameters: the centre, the height, the background, its slope, M and ln k.
CENTER, HEIGHT, BASE, SLOPES, SHARPNESS = slice(0, 2), 2, 3, slice(4, 6), 9
M11, M12, M22 = 6, 7, 8
N_PARAMETERS = 10
N_SHAPE = 7  # that lit pixels determine


_Reals: TypeAlias = npt.NDArray[np.floating[Any]]  # of either precision


class DiscFits(NamedTuple):
    """Blurred discs fitted to windows."""

    centers: FloatArray  # (N, 2), px from the middle of the window
    # (N,), standard deviation of one coordinate, px, larger for discs whose shape
    # differs from the others.
    sigmas: FloatArray
    # (N,), whether each shape differs from the median more than shapes usually do.
    are_outliers: BoolArray
    noises: FloatArray  # (N,), standard deviation of a dark pixel, digital numbers
    # (N,), mean square of the residuals over that by noise: 1 for even, blurred discs.
    misfits: FloatArray


class _Windows(NamedTuple):
    """Pixels (N, P) of N discs."""

    x: _Reals  # px from the middle
    y: _Reals
    light: _Reals
    used: BoolArray
    clipped: BoolArray
    full: _Reals  # (N, 1), least light of a clipped pixel
    ln_sharpness: _Reals  # (N,), expected

    def of(self, chosen: BoolArray) -> "_Windows":
        """Return the windows of some discs."""
        return _Windows(*(getattr(self, name)[chosen] for name in self._fields))


class _Model(NamedTuple):
    light: _Reals  # (N, P), of the disc alone
    residuals: _Reals  # (N, P), nothing where both are clipped
    jacobian: _Reals  # (N, 10, P)


def fit_discs(
    light: FloatArray, starts: FloatArray, radii: FloatArray, full: FloatArray
) -> DiscFits:
    """Fit blurred discs, all at once.

    Parameters
    ----------
    light : (N, S, S) array
        Windows about the discs, above the background, digital numbers.
    starts : (N, 2) array
        Rough centres, px from the middle of the window.
    radii : (N,) array
        Rough half-level radii, px.
    full : (N,) array
        Light at which each window is clipped, digital numbers.
    """
    half = light.shape[1] // 2
    places = np.arange(-half, half + 1, dtype=np.float32)
    x, y = (each.ravel() for each in np.meshgrid(places, places))
    reach = np.minimum(REACH * radii + MORE_REACH, FAR_REACH * radii + MORE_FAR)
    gaps = np.hypot(x - starts[:, :1], y - starts[:, 1:])
    used = gaps < reach[:, None]
    chosen = np.argsort(~used, axis=1, kind="stable")[:, : used.sum(axis=1).max()]
    gaps = np.take_along_axis(gaps, chosen, axis=1)
    used = np.take_along_axis(used, chosen, axis=1)
    pixels = light.reshape(len(light), -1).astype(np.float32)
    pixels = np.take_along_axis(pixels, chosen, axis=1)
    x, y, bound = x[chosen], y[chosen], full[:, None].astype(np.float32)
    ln_k = np.log(np.clip(radii / START_BLUR, *SHARPNESSES))
    windows = _Windows(x, y, pixels, used, pixels >= bound, bound, ln_k)
    values = np.zeros((len(light), N_PARAMETERS))
    values[:, CENTER] = starts
    near = gaps <= np.maximum(MIDDLE, gaps.min(axis=1, keepdims=True))
    values[:, HEIGHT] = (pixels * near).sum(axis=1) / near.sum(axis=1)
    values[:, M11] = values[:, M22] = 1 / radii
    values[:, SHARPNESS] = ln_k
    values, squares, pulls, noises, misfits = _fitted(windows, values)
    field = np.zeros((len(light), 2, light[0].size))
    np.put_along_axis(field, chosen[:, None], pulls, axis=2)
    squares = squares * _correlated(field.reshape(-1, *light.shape[1:]))
    off = _misshapen(values)
    usual = np.median(off)
    misshapen = np.maximum(off - usual, 0.0)
    sigmas = np.sqrt(squares + (misshapen * radii) ** 2)
    # Halos and lenses of their own give all LEDs shapes of their own; an edge or a
    # second light shows beyond their spread.
    are_outliers = misshapen >= np.maximum(MISSHAPEN, MANY_SPREADS * usual)
    return DiscFits(
        values[:, CENTER], sigmas, np.asarray(are_outliers), noises, misfits
    )


def _fitted(
    windows: _Windows, values: FloatArray
) -> tuple[FloatArray, FloatArray, _Reals, FloatArray, FloatArray]:
    """Return values, variances of centres, pulls (N, 2, P), noises and misfits."""
    slope_weight = 0.0
    variances = _variances(windows, _model(windows, values))
    for n_rounds in ROUNDS:
        values = _iterated(windows, values, variances, slope_weight, n_rounds)
        model = _model(windows, values)
        variances = _variances(windows, model)
        weights = _weights(windows, model.residuals, variances)
        normal = _normal(model.jacobian, weights, 0.0)
        slope_weight = _slope_weight(normal, values[:, SLOPES])
    normal = _normal(model.jacobian, weights, slope_weight)
    squares = _diagonal(np.linalg.inv(normal))[:, CENTER].mean(axis=1)
    pulls = model.jacobian[:, CENTER] * (weights * model.residuals)[:, None]
    noises = np.sqrt(variances.min(axis=1))
    return values, squares, pulls, noises, _misfits(windows, model, variances)


def _misfits(windows: _Windows, model: _Model, variances: _Reals) -> FloatArray:
    """Return the mean squares of residuals over those by noise, (N,)."""
    tops = np.minimum(model.light.max(axis=1, keepdims=True), windows.full)
    lit = windows.used & ~windows.clipped & (model.light > LEAST_LIT * tops)
    squares = np.where(lit, model.residuals**2 / variances, 0.0).sum(axis=1)
    return np.asarray(squares / np.maximum(lit.sum(axis=1) - N_SHAPE, 1))


def _iterated(
    windows: _Windows,
    starts: FloatArray,
    variances: _Reals,
    slope_weight: float,
    n_rounds: int,
) -> FloatArray:
    """Return values after rounds by Levenberg and Marquardt, each disc by itself."""
    found = starts.copy()
    left = np.arange(len(starts))
    values, damping = starts, np.full(len(starts), DAMPING)
    model = _model(windows, values)
    for _ in range(n_rounds):
        weights = _weights(windows, model.residuals, variances)
        normal = _normal(model.jacobian, weights, slope_weight)
        right = model.jacobian @ (weights * model.residuals)[..., None]
        right = right[..., 0].astype(np.float64)
        off = values[:, SHARPNESS] - windows.ln_sharpness
        right[:, SHARPNESS] -= off / SHARPNESS_PRIOR**2
        right[:, SLOPES] -= slope_weight * values[:, SLOPES]
        _diagonal(normal)[...] *= 1 + damping[:, None]
        moved = values + np.linalg.solve(normal, right[..., None])[..., 0]
        moved[:, SHARPNESS] = np.clip(moved[:, SHARPNESS], *np.log(SHARPNESSES))
        moved = np.clip(moved, -LARGEST, LARGEST)
        cost = partial(_cost, weights, windows.ln_sharpness, slope_weight)
        after = _model(windows, moved)
        better = cost(moved, after) < cost(values, model)
        steps = np.abs(moved - values)[:, CENTER].max(axis=1)
        values = np.where(better[:, None], moved, values)
        for old, new in zip(model, after, strict=True):
            old[better] = new[better]
        found[left] = values
        damping *= np.where(better, 0.2, 8.0)
        going = (steps > CONVERGED) & (damping < HOPELESS)
        if not going.all():
            left, values = left[going], values[going]
            damping, variances = damping[going], variances[going]
            if not len(left):
                break
            windows = windows.of(going)
            model = _Model(*(each[going] for each in model))
    return found


def _cost(
    weights: _Reals,
    ln_sharpness: _Reals,
    slope_weight: float,
    values: _Reals,
    model: _Model,
) -> _Reals:
    """Return the weighted squared residuals of pixels and priors, (N,)."""
    squares = np.einsum("np,np->n", weights, model.residuals**2)
    off = (values[:, SHARPNESS] - ln_sharpness) / SHARPNESS_PRIOR
    slopes = slope_weight * (values[:, SLOPES] ** 2).sum(axis=1)
    return np.asarray(squares + off**2 + slopes)


def _correlated(pulls: FloatArray) -> float:
    """Return the factor on variances by noise correlated between pixels (JPEG).

    ``pulls`` (N, S, S) are the weighted residuals of the pixels times their derivatives
    by a coordinate of the centre.
    """
    pairs = np.vdot(pulls[:, 1:], pulls[:, :-1])
    pairs += np.vdot(pulls[:, :, 1:], pulls[:, :, :-1])
    return 1 + 2 * max(float(pairs) / max(float(np.vdot(pulls, pulls)), TINY), 0.0)


def _misshapen(values: FloatArray) -> FloatArray:
    """Return the distance of each shape from the median, (N,).

    Light beside a disc distorts its shape and shifts its centre by about as much.
    """
    m11, m12, m22 = values[:, [M11, M12, M22]].T
    sizes = np.maximum(np.abs(m11 + m22), TINY)
    stretches = np.stack([m11 - m22, 2 * m12]) / sizes
    off = stretches - np.median(stretches, axis=1, keepdims=True)
    return np.asarray(np.hypot(*off))


def _diagonal(matrices: _Reals) -> _Reals:
    """Return a view of diagonals, (N, K)."""
    return np.asarray(np.einsum("nii->ni", matrices))


def _normal(jacobian: _Reals, weights: _Reals, slope_weight: float) -> _Reals:
    """Return normal matrices with the priors."""
    normal = (jacobian * weights[:, None]) @ np.swapaxes(jacobian, 1, 2)
    normal = normal.astype(np.float64)
    diagonal = _diagonal(normal)
    diagonal[:, SHARPNESS] += 1 / SHARPNESS_PRIOR**2
    diagonal[:, SLOPES] += slope_weight
    diagonal += RIDGE
    return normal


def _slope_weight(normal: _Reals, slopes: _Reals) -> float:
    """Return one over the variance of slopes beyond noise."""
    by_noise = float(np.median(_diagonal(np.linalg.inv(normal))[:, SLOPES]))
    found = float(np.median(slopes**2)) / _median_square()
    if found < EVIDENT_SLOPE * by_noise:
        return 1 / NO_SLOPE**2
    return 1 / (found - by_noise)


def _model(windows: _Windows, values: _Reals) -> _Model:
    values = values.astype(np.float32)
    dx, dy = windows.x - values[:, :1], windows.y - values[:, 1:2]
    m11, m12, m22 = (values[:, [i]] for i in (M11, M12, M22))
    a, b = m11 * dx + m12 * dy, m12 * dx + m22 * dy
    u = np.sqrt(a * a + b * b) + LEAST_DISTANCE
    disc, by_distance, by_sharpness = _interpolated(u, values[:, SHARPNESS])
    height, slopes = values[:, [HEIGHT]], values[:, SLOPES]
    sloping = slopes[:, :1] * windows.x + slopes[:, 1:] * windows.y
    light = height * disc + values[:, [BASE]] + sloping
    q = height * by_distance / u
    jacobian = np.empty((len(light), N_PARAMETERS, light.shape[1]), np.float32)
    qa, qb = q * a, q * b
    jacobian[:, 0], jacobian[:, 1] = -m11 * qa - m12 * qb, -m12 * qa - m22 * qb
    jacobian[:, HEIGHT], jacobian[:, BASE] = disc, 1.0
    jacobian[:, 4], jacobian[:, 5] = windows.x, windows.y
    jacobian[:, M11], jacobian[:, M22] = qa * dx, qb * dy
    jacobian[:, M12] = qa * dy + qb * dx
    jacobian[:, SHARPNESS] = height * by_sharpness
    jacobian *= ~(windows.clipped & (light > windows.full))[:, None]
    missing = np.maximum(windows.full - light, 0)
    residuals = np.where(windows.clipped, missing, windows.light - light)
    return _Model(height * disc, residuals, jacobian)


def _variances(windows: _Windows, model: _Model) -> _Reals:
    """Return the variances of pixels by their usual residuals."""
    light = np.maximum(model.light, 0)
    tops = np.minimum(light.max(axis=1, keepdims=True), windows.full)
    shown = windows.used & ~windows.clipped
    dark, lit = shown & (light < DARK * tops), shown & (light > LIT * tops)
    squares = model.residuals**2 / _median_square()
    few = dark.sum(axis=1) < FEWEST_PIXELS
    of_dark = np.where(dark, squares, np.nan)
    of_dark[few] = USUAL_NOISE**2
    noises = np.nanmedian(of_dark, axis=1, keepdims=True)
    noises = np.maximum(noises, LEAST_NOISE**2)
    if not lit.any():
        return np.asarray(noises + 0 * light)
    growth = float(np.median(((squares - noises) / np.maximum(light, 1))[lit]))
    return np.asarray(noises + min(max(growth, 0.0), MOST_GROWTH) * light)


def _weights(windows: _Windows, residuals: _Reals, variances: _Reals) -> _Reals:
    off = np.maximum(residuals, 0) ** 2 / (ROBUST**2 * variances)
    return np.asarray(windows.used / ((1 + off) * variances))


@lru_cache(maxsize=1)
def _median_square() -> float:
    """Return the median of the square of a standard normal variable."""
    return float(normal_quantile(0.25)) ** 2


def _interpolated(u: _Reals, ln_sharpness: _Reals) -> tuple[_Reals, _Reals, _Reals]:
    """Return F and its derivatives by u and by ln k, bilinear in the table."""
    table = _table()
    row = (ln_sharpness - np.log(SHARPNESSES[0])) / STEP_OF_SHARPNESS
    column = np.minimum(u * (1 / STEP_OF_DISTANCE), table.shape[2] - 1.01)
    i, j = row.astype(int), column.astype(int)
    s, t = (row % 1)[:, None], column % 1
    at = np.arange(len(u))[:, None] * table.shape[2] + j
    disc, by_distance, by_sharpness = (
        (1 - t) * flat.take(at) + t * flat.take(at + 1)
        for flat in (each[i] * (1 - s) + each[i + 1] * s for each in table)
    )
    return disc, by_distance, by_sharpness


@lru_cache(maxsize=1)
def _table() -> _Reals:
    """Return F, dF/du and dF/dln k, each by ln k and u, with F = 1 at u = 0."""
    from scipy.special import chndtr  # takes 0.1 s

    u = np.arange(0, FARTHEST, STEP_OF_DISTANCE)
    low, high = np.log(SHARPNESSES)
    ln_k = np.arange(low, high + 2 * STEP_OF_SHARPNESS, STEP_OF_SHARPNESS)
    k = np.exp(ln_k)[:, None]
    disc = np.nan_to_num(chndtr(k**2, 2, (k * u) ** 2)) / -np.expm1(-(k**2) / 2)
    by_k, by_u = np.gradient(disc, STEP_OF_SHARPNESS, STEP_OF_DISTANCE)
    return np.stack([disc, by_u, by_k]).astype(np.float32)
