"""The effective tip: the point of the pen that stays most nearly at one place.

A swing determines the point x of the LED frame, in the scale of the LED file, and the
place c, by least squares over its poses: ``min over x, c of sum |R_i x + t_i - c|^2``.
It contains what bends or gives way with the lean as it did in the swing.
"""

import numpy as np

from lightpen.arrays import FloatArray


def effective_tip(rotations: FloatArray, translations: FloatArray) -> FloatArray:
    """Return effective tip and its place, (6,) or (6, k), mm.

    By poses of the LED frame: rotations (N, 3, 3), translations (N, 3) or (N, 3, k) of
    k swings, mm.
    """
    n = len(rotations)
    design = np.column_stack([rotations.reshape(-1, 3), np.tile(-np.eye(3), (n, 1))])
    right = -translations.reshape(3 * n, *translations.shape[2:])
    return np.asarray(np.linalg.lstsq(design, right, rcond=None)[0])
