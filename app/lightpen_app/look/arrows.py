"""Residuals as enlarged arrows, and the means of many."""

import numpy as np

from lightpen.arrays import FloatArray

MANY = 400  # arrows; more are shown as their means
N_CELLS = 20  # across; each shows the mean of its arrows


def cell_means(
    points: FloatArray, vectors: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the means of points (N, 2) and vectors (N, 2) in cells of the image."""
    low = points.min(axis=0)
    side = float(np.max(points.max(axis=0) - low)) / N_CELLS or 1.0
    columns, rows = ((points - low) / side).astype(np.int64).T
    _, cells = np.unique(rows * (N_CELLS + 1) + columns, return_inverse=True)
    counts = np.bincount(cells)
    means = [
        np.bincount(cells, weights=values) / counts
        for values in (*points.T, *vectors.T)
    ]
    return np.column_stack(means[:2]), np.column_stack(means[2:])


def arrow_lines(
    points: FloatArray, vectors: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the ends of shafts and heads as pairs, for one curve of them all.

    Arrows lead from points (N, 2) by vectors (N, 2); x and y are (6 N,).
    """
    tips = points + vectors
    ahead = vectors * 0.3
    aside = np.column_stack([-ahead[:, 1], ahead[:, 0]]) * 0.5
    strokes = (points, tips, tips, tips - ahead + aside, tips, tips - ahead - aside)
    lines = np.stack(strokes, axis=1).reshape(-1, 2)
    return lines[:, 0], lines[:, 1]


def arrow_scale(residuals: FloatArray, image_width: float) -> float:
    """Return the magnification for residuals (N, 2), px, on an image.

    Arrows then are about a thirtieth of its width; the factor is 1, 2 or 5 times a
    power of ten.
    """
    rms = float(np.sqrt(np.mean(np.sum(residuals**2, axis=1)))) if len(residuals) else 0
    if not rms > 0:
        return 1.0
    wanted = image_width / 30 / rms
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(power * max(step for step in (1, 2, 5) if step * power <= wanted))
