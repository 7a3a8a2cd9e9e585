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
"""

from math import erf, pi, sqrt

import numpy as np

from lightpen.arrays import FloatArray, Image

ROUNDS = 8
FIRST_BLUR, LEAST_BLUR = 1.0, 0.3  # px, standard deviations
LONGEST, LARGEST_TURN = 1.0, 0.2  # px and rad, in one round
FARTHEST = 1.0  # px from the start
CONVERGED = 0.01  # px
RIDGE = 1e-9  # of a normal matrix scaled to ones
CONTRAST = 2.0  # times the rms of the residuals, of a corner
_AT = np.linspace(-6.0, 6.0, 2401)
_ERF = np.array([erf(at / sqrt(2)) for at in _AT])


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
    light = image[base[:, 1:] + y, base[:, :1] + x].astype(np.float64)
    at = start - base
    turns = np.arctan2(edges[..., 0], -edges[..., 1])  # of the normals
    blurs = np.full((len(start), 2), FIRST_BLUR)
    step = np.full((len(start), 2), np.inf)
    for _ in range(ROUNDS):
        normals = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
        away = np.stack([x - at[:, :1], y - at[:, 1:]], axis=1)  # (N, 2, P)
        across = normals @ away / blurs[..., None]
        along = normals[..., :1] * away[:, 1:] - normals[..., 1:] * away[:, :1]
        sides = np.interp(across, _AT, _ERF)
        slopes = sqrt(2 / pi) * np.exp(-0.5 * across**2) / blurs[..., None]
        ones = np.ones_like(light)
        planes = np.stack([ones, *np.moveaxis(away, 1, 0)], axis=-1)
        linear = np.concatenate([planes, planes * sides.prod(axis=1)[..., None]], -1)
        levels = _least_squares(linear, light)
        left = light - _applied(linear, levels)
        contrast = _applied(planes, levels[:, 3:])
        by_edge = contrast[:, None] * slopes * sides[:, ::-1]
        by_corner = -np.einsum("nkp,nkc->npc", by_edge, normals)
        by_turn = np.swapaxes(by_edge * along, 1, 2)
        by_blur = np.swapaxes(-by_edge * across, 1, 2)
        both = np.concatenate([by_corner, by_turn, by_blur, linear], axis=-1)
        moved = _least_squares(both, left)
        step = np.clip(moved[:, :2], -LONGEST, LONGEST)
        at = at + step
        turns = turns + np.clip(moved[:, 2:4], -LARGEST_TURN, LARGEST_TURN)
        widened = np.clip(moved[:, 4:6], -0.5 * blurs, 0.5 * blurs)
        blurs = np.clip(blurs + widened, LEAST_BLUR, 0.5 * half)
        if np.abs(step).max() < 0.1 * CONVERGED:
            break
    rms = np.sqrt(np.mean(np.square(left), axis=1))
    fits = (
        (np.abs(step).max(axis=1) < CONVERGED)
        & (np.linalg.norm(base + at - start, axis=1) < FARTHEST)
        & (np.abs(levels[:, 3]) > CONTRAST * rms)
    )
    return np.asarray(np.where(fits[:, None], base + at, start))


def _applied(functions: FloatArray, factors: FloatArray) -> FloatArray:
    return np.asarray((functions @ factors[..., None])[..., 0])


def _least_squares(functions: FloatArray, values: FloatArray) -> FloatArray:
    """Return the factors, (N, k), of functions, (N, P, k), that give values, (N, P)."""
    across = np.swapaxes(functions, 1, 2)
    normal = across @ functions
    scale = 1 / np.sqrt(np.maximum(np.einsum("nkk->nk", normal), 1e-300))
    scaled = normal * scale[:, :, None] * scale[:, None]
    right = scale * _applied(across, values)
    solved = np.linalg.solve(scaled + RIDGE * np.eye(scale.shape[1]), right[..., None])
    return np.asarray(scale * solved[..., 0])
