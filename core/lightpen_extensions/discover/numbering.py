"""Numbers of the LEDs and the frame of the pen: by definition, or by a sketch."""

from itertools import permutations

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.errors import CalibrationError
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.model.pen import Pen, moved, order_of_paper, pen_frame_from_raw
from lightpen.model.rigid import fit_rigid
from lightpen_extensions.discover.normals import towards_camera

ROW = 0.02  # of the pen's size: LEDs of one row differ less in height
SKETCHED = 0.1  # of the pen's size: LEDs are nearer to a sketch


def number_by_place(state: BundleState) -> IntArray:
    """Return the LEDs in the order of their numbers.

    From the tip upwards, those of a row from left to right as the camera sees them; a
    pen of the paper's layout has the paper's numbers.
    """
    leds = state.pen.leds - state.tip_pen
    towards = towards_camera(state)
    up = _normalised(leds.mean(axis=0) - (leds.mean(axis=0) @ towards) * towards)
    right = np.cross(up, towards)
    paper = order_of_paper(leds, up)
    if paper is not None:
        return paper
    heights, places = leds @ up, leds @ right
    row = ROW * float(np.ptp(leds, axis=0).max())
    order = np.argsort(heights)
    rows = np.cumsum(np.diff(heights[order], prepend=heights[order[0]]) > row)
    return np.asarray(order[np.lexsort((places[order], rows))])


def number_by_sketch(leds: FloatArray, sketch: FloatArray) -> IntArray:
    """Return the LEDs (L, 3) in the order of a sketch (L, 3), roughly, mm.

    They are in any right-handed frame and to any scale. Raises `CalibrationError` if
    their numbers differ, or they do not resemble the sketch.
    """
    n = len(sketch)
    if len(leds) != n:
        raise CalibrationError("discover.sketch-count", n_found=len(leds), n_sketched=n)
    size = _extent(sketch)
    scaled = leds * (size / _extent(leds))
    # Three LEDs that span the sketch fix how it lies for each three that are found.
    first, second = np.unravel_index(np.argmax(_distances(sketch)), (n, n))
    along = sketch[second] - sketch[first]
    off_line = np.cross(sketch - sketch[first], along / np.linalg.norm(along))
    third = int(np.argmax(np.linalg.norm(off_line, axis=1)))
    corners = [int(first), int(second), third]
    triples = np.array(list(permutations(range(n), 3)))
    sides = _sides(scaled[triples]) - _sides(sketch[corners])
    triples = triples[np.abs(sides).max(axis=1) < 2 * SKETCHED * size]
    best, order = np.inf, np.arange(n)
    for triple in triples:
        R, t = fit_rigid(scaled[triple], sketch[corners])
        match, misfit = _matched(scaled @ R.T + t, sketch)
        if misfit < best:
            best, order = misfit, match
    if best > SKETCHED * size:
        raise CalibrationError("discover.other-sketch")
    return order


def framed(
    pen: Pen, tip: FloatArray, sketch: FloatArray | None
) -> tuple[Pen, FloatArray, FloatArray]:
    """Return a numbered pen in its frame, and R, t that brought it there.

    The frame is the sketch's if there is one, and the paper's for a pen of its layout.
    Otherwise LED 1 is the origin, y runs to the last LED, and z, at right angles to it,
    is next to the normal of the discs. Tip (3,) and sketch (L, 3) are in mm.
    """
    leds = pen.leds
    if sketch is not None:
        R, t = fit_rigid(leds, sketch)
    elif order_of_paper(leds, leds.mean(axis=0) - tip) is not None:
        R, t = pen_frame_from_raw(leds)
    else:
        R, t = frame_by(pen, 0, len(leds) - 1)
    return moved(pen, R, t), R, t


def frame_by(pen: Pen, origin: int, along: int) -> tuple[FloatArray, FloatArray]:
    """Return R, t of a frame with one LED as origin and y to another, by indices.

    z, at right angles to y, is next to the normal of the discs.
    """
    y = _normalised(pen.leds[along] - pen.leds[origin])
    z = pen.normals.mean(axis=0)
    z = _normalised(z - (z @ y) * y)
    R = np.stack([np.cross(y, z), y, z])
    return R, -R @ pen.leds[origin]


def _normalised(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / np.linalg.norm(vector))


def _distances(points: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(points[:, None] - points, axis=2))


def _extent(points: FloatArray) -> float:
    return float(_distances(points).max())


def _sides(triples: FloatArray) -> FloatArray:
    """Return the sides of triangles (..., 3, 3), (..., 3)."""
    return np.asarray(np.linalg.norm(triples - np.roll(triples, 1, axis=-2), axis=-1))


def _matched(points: FloatArray, sketch: FloatArray) -> tuple[IntArray, float]:
    """Return the point of each of the sketch, and the rms distance after a fit, mm."""
    from scipy.optimize import linear_sum_assignment  # takes 0.2 s

    for _ in range(2):
        apart = np.linalg.norm(sketch[:, None] - points, axis=2)
        _, match = linear_sum_assignment(apart**2)
        R, t = fit_rigid(points[match], sketch)
        points = points @ R.T + t
    misses = np.linalg.norm(points[match] - sketch, axis=1)
    return np.asarray(match), float(np.sqrt(np.mean(misses**2)))
