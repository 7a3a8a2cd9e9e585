"""The light pen: LED positions and the pen frame.

The paper [1]_ defines the pen frame of its ten-LED pen from the LEDs themselves. LEDs
1 to 4 stand in a line on the back plane; LEDs 5 to 10 lie on the front plane, in two
columns parallel to that line. The origin is the projection of LED 1 on the front plane,
y is the projected line from LED 1 to LED 4, x lies in the front plane at right angles
to it, and z completes the right-handed frame. LEDs 1 to 4 have negative z, so that z
points from the pen to its viewer; LEDs 5 to 7 have negative x and 8 to 10 positive x,
and along each line y grows with the number.

A pen of any other layout has whatever frame its file uses.

References
----------
.. [1] S. Liu, H. Zhang, Y. Dong, S. Tang, Z. Jiang, "Portable light pen 3D vision
   coordinate measuring system - probe tip center calibration", Measurement Science
   Review 13 (2013) 194-199, section 2 (a).
"""

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.errors import FileError
from lightpen.model.self_calibration import EXACT_SCALE, FoundPen, are_shared

DISC_DIAMETER = 10.0  # mm, of each LED of the paper's pen
FRAME_TOLERANCE = 1.0  # mm; LEDs deviate by up to 0.4 mm from line and plane
MIN_BACK_DEPTH = 5.0  # mm between the planes of the paper's layout
MIN_COLUMN_OFFSET = 5.0  # mm from the back line to either column
MIN_LEDS = 4
MAX_LEDS = 100
MAX_EXTENT = 5000.0  # mm
MAX_COORDINATE = 1e6  # mm, from the origin of a measuring machine
MIN_SEPARATION = 0.6  # of a disc's diameter, between two LEDs
MIN_OFF_LINE = 0.02  # of the pen's extent, of the LED farthest from the best line

_BACK, _LEFT, _RIGHT = slice(0, 4), slice(4, 7), slice(7, 10)


@dataclass(frozen=True, eq=False)
class Pen:
    """LED geometry of a light pen, in the pen frame.

    LED number j of the files is row ``j - 1`` of every array. A sigma is a standard
    uncertainty; None is what is not stated.
    """

    leds: FloatArray  # (L, 3), LED centres, mm
    normals: FloatArray  # (L, 3), unit normals of the LED discs, towards the viewer
    diameter: float = DISC_DIAMETER  # of the LED discs, mm
    nominal_tip: FloatArray | None = None  # (3,), centre of the tip by design, mm
    name: str = ""  # or serial number
    led_sigma: float | None = None  # of one coordinate, mm
    scale_sigma: float | None = None  # common to all coordinates, relative
    diameter_sigma: float | None = None  # mm
    expansion: float | None = None  # thermal, of all coordinates, 1/K
    expansion_sigma: float | None = None  # 1/K
    temperature_c: float | None = None  # of the LED measurement, degrees Celsius
    # (3 L, 3 L), of all LED coordinates but for the scale that they share, mm^2
    led_covariance: FloatArray | None = None
    # (3, 3), of a rotation vector common to all normals, rad^2; None: they are exact
    normal_covariance: FloatArray | None = None
    found: FoundPen | None = None  # before the images that the LEDs were found from

    @property
    def n_leds(self) -> int:
        """Number of LEDs."""
        return len(self.leds)

    def is_found_from(self, pixels: FloatArray) -> bool:
        """Return whether the LEDs were found from images with centres (N, L, 2)."""
        return self.found is not None and are_shared(self.found.marks, pixels)

    def before_images(self) -> "Pen":
        """Return the pen with what was known before the images it was found from."""
        if self.found is None:
            return self
        return replace(
            self,
            diameter=self.found.diameter,
            diameter_sigma=None,
            scale_sigma=EXACT_SCALE,
            led_covariance=self.found.led_covariance,
            expansion=0.0,  # the lengths are those during the swing
            expansion_sigma=None,
            temperature_c=None,
        )


def grown(pen: Pen, growth: float, about: FloatArray) -> Pen:
    """Return a pen scaled by a relative growth about a point (3,), mm: its tip."""
    return replace(
        pen,
        leds=pen.leds + growth * (pen.leds - about),
        diameter=(1 + growth) * pen.diameter,
    )


def check_leds(leds: FloatArray, diameter: float) -> None:
    """Refuse LEDs (L, 3), mm, in any frame, that do not determine a pose.

    Raises `FileError` if they are too few, in a line, too close by the diameter of
    their discs, mm, or not in millimetres.
    """
    if not MIN_LEDS <= len(leds) <= MAX_LEDS:
        raise FileError(
            "pen.number-of-leds", least=MIN_LEDS, most=MAX_LEDS, n_leds=len(leds)
        )
    farthest = np.abs(leds).max(axis=1)
    if farthest.max() > MAX_COORDINATE:
        raise FileError(
            "pen.far-led",
            led=int(np.argmax(farthest)) + 1,
            distance=float(farthest.max()) / 1000,
        )
    extent = float(np.ptp(leds, axis=0).max())
    if extent > MAX_EXTENT:
        raise FileError("pen.too-large", extent=extent / 1000, most=MAX_EXTENT / 1000)
    if extent < diameter:
        raise FileError("pen.too-small", extent=extent, diameter=diameter)
    _check_separation(leds, diameter)
    _check_not_in_line(leds, extent)


def check_frame(pen: Pen) -> None:
    """Refuse a pen of the paper's layout that is not in the paper's frame.

    The layout is recognised from the geometry, whatever the order and the frame of the
    LEDs. Pens of other layouts pass. Raises `FileError`, which names the LED and the
    amount, if LEDs are exchanged or mirrored, or the coordinates are in
    another frame, such as a measuring machine's.
    """
    slots = _layout(pen.leds)
    if slots is None:
        return
    if not _check_order(pen.leds, slots):
        raise FileError("pen.mirror-image")
    deviations = np.linalg.norm(_in_frame(pen.leds) - pen.leds, axis=1)
    worst = int(np.argmax(deviations))
    if deviations[worst] > FRAME_TOLERANCE:
        raise FileError(
            "pen.not-in-frame", led=worst + 1, distance=float(deviations[worst])
        )
    backwards = np.flatnonzero(pen.normals[:, 2] <= 0)
    if len(backwards):
        raise FileError(
            "pen.normal-backwards",
            led=int(backwards[0]) + 1,
            nz=float(pen.normals[backwards[0], 2]),
        )


def pen_frame_from_raw(raw_leds: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return R, t that bring raw coordinates of the paper's pen into the pen frame.

    ``leds_pen = raw_leds @ R.T + t``, with ``raw_leds`` (10, 3) in any right-handed
    frame, mm. The front plane is the least-squares plane of LEDs 5 to 10; see the
    module for the rest of the definition. Raises `FileError` if the LEDs are not of the
    paper's layout, out of order, or mirrored.
    """
    if raw_leds.ndim != 2 or raw_leds.shape[1] != 3:
        raise ValueError(f"`raw_leds` must have shape (10, 3), got {raw_leds.shape}.")
    slots = _layout(raw_leds)
    if slots is None:
        raise FileError("pen.no-frame", tolerance=FRAME_TOLERANCE)
    if not _check_order(raw_leds, slots):
        raise FileError("pen.mirror-image")
    return _frame(raw_leds)


def order_of_paper(leds: FloatArray, up: FloatArray) -> IntArray | None:
    """Return the LEDs (L, 3), mm, of the paper's layout in the order of their numbers.

    They are in any right-handed frame and order; numbers grow along ``up`` (3,), the
    direction from the tip to the LEDs. None for another layout.
    """
    slots = _layout(leds)
    if slots is None:
        return None
    back, left, right = slots[_BACK], slots[_LEFT], slots[_RIGHT]
    step = 1 if (leds[back[3]] - leds[back[0]]) @ up > 0 else -1
    for first, second in ((left, right), (right, left)):
        order = np.concatenate([back[::step], first[::step], second[::step]])
        if _is_right_handed(leds[order]):
            return order
    return None


def in_pen_frame(raw: Pen) -> Pen:
    """Return a pen of the paper's layout, in any right-handed frame, in its own."""
    return moved(raw, *pen_frame_from_raw(raw.leds))


def moved(pen: Pen, R: FloatArray, t: FloatArray) -> Pen:
    """Return a pen in another frame."""
    tip, found = pen.nominal_tip, pen.found
    of_leds, of_normals = pen.led_covariance, pen.normal_covariance
    if found is not None:
        found = replace(found, led_covariance=_turned(found.led_covariance, R))
    return replace(
        pen,
        leds=pen.leds @ R.T + t,
        normals=pen.normals @ R.T,
        nominal_tip=None if tip is None else R @ tip + t,
        led_covariance=None if of_leds is None else _turned(of_leds, R),
        normal_covariance=None if of_normals is None else _turned(of_normals, R),
        found=found,
    )


def _turned(covariance: FloatArray, R: FloatArray) -> FloatArray:
    """Return a covariance of vectors, (3 P, 3 P), in a frame turned by R."""
    turn = np.kron(np.eye(len(covariance) // 3), R)
    return np.asarray(turn @ covariance @ turn.T)


def _check_separation(leds: FloatArray, diameter: float) -> None:
    distances = np.linalg.norm(leds[:, None] - leds, axis=2)
    np.fill_diagonal(distances, np.inf)
    first, second = np.unravel_index(np.argmin(distances), distances.shape)
    nearest = distances[first, second]
    if nearest < MIN_SEPARATION * diameter:
        raise FileError(
            "pen.leds-too-close",
            first=int(first) + 1,
            second=int(second) + 1,
            distance=float(nearest),
            diameter=diameter,
        )


def _check_not_in_line(leds: FloatArray, extent: float) -> None:
    farthest = off_line(leds).max()
    if farthest < MIN_OFF_LINE * extent:
        raise FileError(
            "pen.leds-in-line",
            off_line=farthest,
            extent=extent,
            needed=MIN_OFF_LINE * extent,
        )


def off_line(points: FloatArray) -> FloatArray:
    """Return the distances of points (..., N, 3) from their best line."""
    centred = points - points.mean(axis=-2, keepdims=True)
    direction = np.linalg.svd(centred, full_matrices=False)[2][..., :1, :]
    along = np.sum(centred * direction, axis=-1, keepdims=True)
    distances: FloatArray = np.linalg.norm(centred - along * direction, axis=-1)
    return distances


def _layout(leds: FloatArray) -> IntArray | None:
    """Return the order of the LEDs in the paper's layout; None for other layouts.

    The places are the back line, one column and the other, each from one end to the
    other; which end and which column comes first is not decided.
    """
    if len(leds) != 10:
        return None
    backs = np.array(list(combinations(range(10), 4)))
    in_line = off_line(leds[backs]).max(axis=1) <= FRAME_TOLERANCE
    for back in backs[in_line]:
        slots = _layout_behind(leds, back)
        if slots is not None:
            return slots
    return None


def _layout_behind(leds: FloatArray, back: IntArray) -> IntArray | None:
    """Return `_layout` if the LEDs ``back`` are its back line."""
    front = np.setdiff1d(np.arange(10), back)
    origin = leds[front].mean(axis=0)
    normal = np.linalg.svd(leds[front] - origin)[2][2]
    heights = (leds - origin) @ normal
    depth = heights[back].mean()
    flat = np.abs(heights[front]).max() <= FRAME_TOLERANCE
    parallel = np.abs(heights[back] - depth).max() <= FRAME_TOLERANCE
    if not flat or not parallel or abs(depth) < MIN_BACK_DEPTH:
        return None
    back_origin = leds[back].mean(axis=0)
    along = np.linalg.svd(leds[back] - back_origin)[2][0]
    across = np.cross(normal, along)
    offsets = (leds - back_origin) @ across
    left, right = front[offsets[front] < 0], front[offsets[front] >= 0]
    for column in (left, right):
        middle = offsets[column].mean() if len(column) == 3 else 0.0
        straight = np.abs(offsets[column] - middle).max() <= FRAME_TOLERANCE
        if len(column) != 3 or not straight or abs(middle) < MIN_COLUMN_OFFSET:
            return None
    places = (leds - back_origin) @ along
    return np.concatenate([g[np.argsort(places[g])] for g in (back, left, right)])


def _check_order(leds: FloatArray, slots: IntArray) -> bool:
    """Refuse LEDs with swapped numbers; return whether they are right-handed."""
    back, left, right = slots[_BACK], slots[_LEFT], slots[_RIGHT]
    orders = [
        np.concatenate([back[::step], first[::step], second[::step]])
        for step in (1, -1)
        for first, second in ((left, right), (right, left))
    ]
    n_wrong = [int(np.sum(order != np.arange(10))) for order in orders]
    handed = [_is_right_handed(leds[order]) for order in orders]
    best = min(range(4), key=lambda i: (n_wrong[i], not handed[i]))
    if n_wrong[best]:
        raise _out_of_order(orders[best])
    return handed[best]


def _is_right_handed(leds: FloatArray) -> bool:
    along = leds[3] - leds[0]
    outwards = leds[4:].mean(axis=0) - leds[:4].mean(axis=0)
    across = leds[_RIGHT].mean(axis=0) - leds[_LEFT].mean(axis=0)
    return bool(np.linalg.det([across, along, outwards]) > 0)


def _out_of_order(order: IntArray) -> FileError:
    """Return the error on swapped numbers: LED ``order[j] + 1`` is in place j."""
    wrong = np.flatnonzero(order != np.arange(10))
    if len(wrong) == 2:
        return FileError(
            "pen.leds-exchanged", first=int(wrong[0]) + 1, second=int(wrong[1]) + 1
        )
    return FileError("pen.out-of-order", leds=", ".join(map(str, wrong + 1)))


def _in_frame(leds: FloatArray) -> FloatArray:
    R, t = _frame(leds)
    return leds @ R.T + t


def _frame(leds: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return R, t of the paper's definition, without any check."""
    centre = leds[4:].mean(axis=0)
    z = np.linalg.svd(leds[4:] - centre)[2][2]
    z = z if (leds[:4].mean(axis=0) - centre) @ z < 0 else -z
    origin = leds[0] - ((leds[0] - centre) @ z) * z
    y = leds[3] - leds[0]
    y = y - (y @ z) * z
    y = y / np.linalg.norm(y)
    R = np.stack([np.cross(y, z), y, z])
    return R, -R @ origin


# The effective tip: the point of the pen that stays most nearly at one place.
#
# A swing determines the point x of the LED frame, in the scale of the LED file, and the
# place c, by least squares over its poses: ``min over x, c of sum |R_i x + t_i -
# c|^2``. It contains what bends or gives way with the lean as it did in the swing.


def effective_tip(rotations: FloatArray, translations: FloatArray) -> FloatArray:
    """Return effective tip and its place, (6,) or (6, k), mm.

    By poses of the LED frame: rotations (N, 3, 3), translations (N, 3) or (N, 3, k) of
    k swings, mm.
    """
    n = len(rotations)
    design = np.column_stack([rotations.reshape(-1, 3), np.tile(-np.eye(3), (n, 1))])
    right = -translations.reshape(3 * n, *translations.shape[2:])
    return np.asarray(np.linalg.lstsq(design, right, rcond=None)[0])
