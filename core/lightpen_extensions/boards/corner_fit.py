"""Corners of a chessboard, fitted to the brightness around them.

Two straight edges cross in a corner. With the signed distances d1 and d2 from them, of
which each edge is blurred by its own sigma, the brightness is

    I(x, y) = m(x, y) + a(x, y) erf(d1 / (sqrt 2 sigma1)) erf(d2 / (sqrt 2 sigma2)),

where m and a are linear, as light is uneven. Least squares by Gauss-Newton steps give
the crossing, both directions, both blurs, m and a. This uses the whole edges: on
rendered boards the noise of a corner is a quarter of that by the directions of
gradients [1]_. Where bright squares look larger than dark ones the four squares still
meet evenly, so the corner stays.

References
----------
.. [1] W. Forstner, E. Gulch, "A fast operator for detection and precise location of
   distinct points, corners and centres of circular features", ISPRS 1987.
.. [2] M. Abramowitz, I. A. Stegun, "Handbook of mathematical functions", 1964, 7.1.26.
"""

from math import pi, sqrt
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpen.arrays import FloatArray, Image

ROUNDS, ROUGH, THINNED = 8, 2, 3  # the first of them by every third of many pixels
MANY = 150  # pixels
FIRST_BLUR, LEAST_BLUR = 1.0, 0.3  # px, standard deviations
LONGEST, LARGEST_TURN = 1.0, 0.2  # px and rad, in one round
FARTHEST = 1.0  # px from the start
CONVERGED, SETTLED = 0.01, 0.003  # px, of a corner that counts, and that is left
RIDGE = 1e-7  # of a normal matrix scaled to ones
CONTRAST = 2.0  # times the rms of the residuals, of a corner
N_LEVELS = 6  # of m and a
ERF = (1.061405429, -1.453152027, 1.421413741, -0.284496736, 0.254829592)  # [2]
ERF_SCALE = 0.3275911

_Floats = npt.NDArray[np.floating[Any]]  # single precision is enough


def fit_corners(
    image: Image, start: FloatArray, edges: FloatArray, half: int
) -> FloatArray:
    """Return corners, (N, 2), px; the start where no corner fits.

    Parameters
    ----------
    start : (N, 2) array
        px, at least ``half + 1`` from the image's border.
    edges : (N, 2, 2) array
        Directions of the two edges, one per row.
    half : int
        Reach, px.
    """
    base = np.round(start).astype(int)
    aside = np.arange(-half, half + 1)
    x, y = (each.ravel() for each in np.meshgrid(aside, aside))
    near = x**2 + y**2 <= (half + 0.5) ** 2
    x, y = x[near], y[near]
    light = image[base[:, 1:] + y, base[:, :1] + x].astype(np.float32)
    u, v = x.astype(np.float32), y.astype(np.float32)
    at = start - base
    turns = np.arctan2(edges[..., 0], -edges[..., 1])  # of the normals
    blurs = np.full((len(start), 2), FIRST_BLUR)
    found, fits = start.copy(), np.zeros(len(start), dtype=np.bool_)
    left = np.arange(len(start))  # numbers of the corners that still move
    for n_done in range(1, ROUNDS + 1):
        some = slice(None, None, THINNED if n_done <= ROUGH and len(x) > MANY else None)
        columns = _columns(u[some], v[some], at[left], turns[left], blurs[left])
        if n_done == 1:
            levels = _least_squares(columns[:, -N_LEVELS:], light[:, some])
        shades = levels[:, None].astype(np.float32)
        residuals = light[:, some] - (shades @ columns[:, -N_LEVELS:])[:, 0]
        columns[:, :6] *= shades[..., 3:] @ columns[:, 6:9]
        moved = _least_squares(columns, residuals)
        levels = levels + moved[:, 6:]
        step = np.clip(moved[:, :2], -LONGEST, LONGEST)
        at[left] += step
        turns[left] += np.clip(moved[:, 2:4], -LARGEST_TURN, LARGEST_TURN)
        own = blurs[left]
        widened = own + np.clip(moved[:, 4:6], -0.5 * own, 0.5 * own)
        blurs[left] = np.clip(widened, LEAST_BLUR, 0.5 * half)
        size = np.abs(step).max(axis=1)
        ends = (n_done > ROUGH) & (size < SETTLED) | (n_done == ROUNDS)
        rms = np.sqrt(np.mean(np.square(residuals), axis=1))
        is_near = np.linalg.norm(base[left] + at[left] - start[left], axis=1) < FARTHEST
        is_corner = np.abs(levels[:, 3]) > CONTRAST * rms
        fits[left] = ends & (size < CONVERGED) & is_near & is_corner
        left, light, levels = left[~ends], light[~ends], levels[~ends]
        if not left.size:
            break
    found[fits] = base[fits] + at[fits]
    return found


def _columns(
    x: _Floats, y: _Floats, at: _Floats, turns: _Floats, blurs: _Floats
) -> _Floats:
    """Return derivatives for a contrast of 1, (N, 12, P), those of m and a last."""
    columns = np.empty((len(at), 6 + N_LEVELS, len(x)), dtype=np.float32)
    at, turns, blurs = (each.astype(np.float32) for each in (at, turns, blurs))
    u, v = x - at[:, :1], y - at[:, 1:]
    away, sides, slopes = [], [], []
    for k in (0, 1):
        cosine, sine = np.cos(turns[:, k : k + 1]), np.sin(turns[:, k : k + 1])
        blur = blurs[:, k : k + 1]
        across = (cosine * u + sine * v) / blur
        bell = np.exp(-0.5 * across * across)
        away.append((cosine, sine, across, cosine * v - sine * u))
        sides.append(_erf(across, bell))
        slopes.append(sqrt(2 / pi) * bell / blur)
    for k in (0, 1):
        cosine, sine, across, along = away[k]
        by_edge = slopes[k] * sides[1 - k]
        columns[:, k] = by_edge
        columns[:, 2 + k] = by_edge * along
        columns[:, 4 + k] = -by_edge * across
    first, second = columns[:, 0].copy(), columns[:, 1].copy()
    columns[:, 0] = -(away[0][0] * first + away[1][0] * second)
    columns[:, 1] = -(away[0][1] * first + away[1][1] * second)
    columns[:, 6], columns[:, 7], columns[:, 8] = 1.0, u, v
    columns[:, 9] = sides[0] * sides[1]
    columns[:, 10:] = columns[:, 7:9] * columns[:, 9:10]
    return columns


def _erf(across: _Floats, bell: _Floats) -> _Floats:
    """Return erf(across / sqrt 2), given exp(-across^2 / 2), to 2e-7 [2]_."""
    t = 1 / (1 + ERF_SCALE * sqrt(0.5) * np.abs(across))
    sums = np.zeros_like(t)
    for factor in ERF:
        sums = (sums + factor) * t
    return np.asarray(np.copysign(1 - sums * bell, across))


def _least_squares(functions: _Floats, values: _Floats) -> FloatArray:
    """Return the factors, (N, k), of functions, (N, k, P), that give values, (N, P)."""
    normal = (functions @ np.swapaxes(functions, 1, 2)).astype(np.float64)
    scale = 1 / np.sqrt(np.maximum(np.einsum("nkk->nk", normal), 1e-300))
    scaled = normal * scale[:, :, None] * scale[:, None]
    right = scale[..., None] * (functions @ values[..., None])
    solved = np.linalg.solve(scaled + RIDGE * np.eye(scale.shape[1]), right)
    return np.asarray(scale * solved[..., 0])
