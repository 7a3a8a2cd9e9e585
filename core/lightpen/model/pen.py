"""The light pen: where its LEDs are, and the frame they are given in.

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

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.errors import FileError
from lightpen.sentences import Sentence, sentence

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
_HANDEDNESS = (
    sentence(
        "pen.sign-of-x",
        "LEDs 5 to 7 must have negative x and 8 to 10 positive x. Change the sign of "
        "all x, or exchange the columns if they are numbered the wrong way.",
    ),
    sentence(
        "pen.sign-of-y", "y must grow from LED 1 to LED 4. Change the sign of all y."
    ),
    sentence(
        "pen.sign-of-z", "LEDs 1 to 4 must have negative z. Change the sign of all z."
    ),
)


@dataclass(frozen=True, eq=False)
class Pen:
    """LED geometry of a light pen, in the pen frame.

    LED number j of the files is row ``j - 1`` of every array.

    Attributes
    ----------
    leds : (L, 3) array
        LED centres, mm.
    normals : (L, 3) array
        Unit normals of the LED discs, towards the viewer.
    diameter : float
        Diameter of the LED discs, mm.
    nominal_tip : (3,) array or None
        Where the design puts the centre of the probe tip, mm.
    name : str
        Name or serial number, empty if unknown.
    led_sigma : float or None
        Standard uncertainty of one LED coordinate, mm; None if not stated.
    scale_sigma : float or None
        Standard uncertainty common to all coordinates, relative; None if not stated.
    diameter_sigma : float or None
        Standard uncertainty of the diameter, mm; None if not stated.
    expansion : float or None
        Thermal, of all coordinates, 1/K; None if not stated.
    expansion_sigma : float or None
        Its standard uncertainty, 1/K; None if not stated.
    temperature_c : float or None
        At which the LEDs were measured; None if not stated.
    led_covariance : (3 L, 3 L) array or None
        Of all LED coordinates but for the scale that they share, mm^2; None if no more
        than ``led_sigma`` is known.
    """

    leds: FloatArray
    normals: FloatArray
    diameter: float = DISC_DIAMETER
    nominal_tip: FloatArray | None = None
    name: str = ""
    led_sigma: float | None = None
    scale_sigma: float | None = None
    diameter_sigma: float | None = None
    expansion: float | None = None
    expansion_sigma: float | None = None
    temperature_c: float | None = None
    led_covariance: FloatArray | None = None

    @property
    def n_leds(self) -> int:
        """Number of LEDs."""
        return len(self.leds)


def grown(pen: Pen, growth: float) -> Pen:
    """Return a pen whose LEDs lie further apart about their middle.

    Parameters
    ----------
    growth : float
        Relative.
    """
    middle = pen.leds.mean(axis=0)
    return replace(
        pen,
        leds=middle + (1 + growth) * (pen.leds - middle),
        diameter=(1 + growth) * pen.diameter,
    )


def check_leds(leds: FloatArray, diameter: float) -> None:
    """Refuse LEDs that cannot be those of a pen whose pose they fix.

    Parameters
    ----------
    leds : (L, 3) array
        LED centres in any frame, mm.
    diameter : float
        Diameter of the LED discs, mm.

    Raises
    ------
    FileError
        They are too few, in a line, too close, or not in millimetres.
    """
    if not MIN_LEDS <= len(leds) <= MAX_LEDS:
        raise FileError(
            sentence(
                "pen.number-of-leds",
                "A pen needs {least} to {most} LEDs; the file has {n_leds}. Check "
                "that it is the complete file of a pen.",
                least=MIN_LEDS,
                most=MAX_LEDS,
                n_leds=len(leds),
            )
        )
    farthest = np.abs(leds).max(axis=1)
    if farthest.max() > MAX_COORDINATE:
        raise FileError(
            sentence(
                "pen.far-led",
                "LED {led} is {distance:.6g} m from the origin, which no pen is. "
                "Check the numbers and their units.",
                led=int(np.argmax(farthest)) + 1,
                distance=float(farthest.max()) / 1000,
            )
        )
    extent = float(np.ptp(leds, axis=0).max())
    if extent > MAX_EXTENT:
        raise FileError(
            sentence(
                "pen.too-large",
                "The LEDs span {extent:.6g} m; a pen spans at most {most:g} m. "
                "Check that the coordinates are in millimetres, in the header too, "
                "or name their units.",
                extent=extent / 1000,
                most=MAX_EXTENT / 1000,
            )
        )
    if extent < diameter:
        raise FileError(
            sentence(
                "pen.too-small",
                "The LEDs span only {extent:.4g} mm, less than one disc of "
                "{diameter:g} mm. Are the coordinates in metres? Then name the "
                "units, such as in the header: x_m, y_m, z_m.",
                extent=extent,
                diameter=diameter,
            )
        )
    _check_separation(leds, diameter)
    _check_not_in_line(leds, extent)


def check_frame(pen: Pen) -> None:
    """Refuse a pen of the paper's layout that is not in the paper's frame.

    The layout is recognised from the geometry, whatever the order and the frame of the
    LEDs. Pens of other layouts pass.

    Raises
    ------
    FileError
        LEDs are exchanged, an axis is mirrored, or the coordinates are in another
        frame, such as a measuring machine's. The text names the LED and the amount.
    """
    slots = _layout(pen.leds)
    if slots is None:
        return
    if not _check_order(pen.leds, slots):
        raise _mirrored(pen.leds)
    deviations = np.linalg.norm(_in_frame(pen.leds) - pen.leds, axis=1)
    worst = int(np.argmax(deviations))
    if deviations[worst] > FRAME_TOLERANCE:
        raise FileError(
            sentence(
                "pen.not-in-frame",
                "The LEDs are not in the pen frame: LED {led} is {distance:.2f} mm "
                "from where the frame puts it (origin in front of LED 1, y along "
                "LEDs 1 to 4, LEDs 5 to 10 at z = 0). If these are a measuring "
                "machine's coordinates, put them into the pen frame.",
                led=worst + 1,
                distance=float(deviations[worst]),
            )
        )
    backwards = np.flatnonzero(pen.normals[:, 2] <= 0)
    if len(backwards):
        raise FileError(
            sentence(
                "pen.normal-backwards",
                "The normal of LED {led} points away from the viewer (nz = "
                "{nz:.3f}); nz must be positive in the pen frame. Change its sign.",
                led=int(backwards[0]) + 1,
                nz=float(pen.normals[backwards[0], 2]),
            )
        )


def pen_frame_from_raw(raw_leds: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return R, t that bring raw coordinates of the paper's pen into the pen frame.

    The front plane is the least-squares plane of LEDs 5 to 10; see the module for the
    rest of the definition.

    Parameters
    ----------
    raw_leds : (10, 3) array
        LED centres in any right-handed frame, mm.

    Returns
    -------
    R : (3, 3) array
    t : (3,) array
        ``leds_pen = raw_leds @ R.T + t``.

    Raises
    ------
    FileError
        The LEDs are not of the paper's layout, out of order, or mirrored.
    """
    if raw_leds.ndim != 2 or raw_leds.shape[1] != 3:
        raise ValueError(f"`raw_leds` must have shape (10, 3), got {raw_leds.shape}.")
    slots = _layout(raw_leds)
    if slots is None:
        raise FileError(
            sentence(
                "pen.no-frame",
                "The LEDs do not stand as the pen frame needs it: ten LEDs, 1 to 4 "
                "in a line behind the plane of 5 to 10, and these in two columns of "
                "three parallel to the line, all within {tolerance:g} mm. {misfit} "
                "Measure the LEDs again, or give a pen of another layout in a frame "
                "of its own.",
                tolerance=FRAME_TOLERANCE,
                misfit=_misfit(raw_leds),
            )
        )
    if not _check_order(raw_leds, slots):
        raise FileError(
            sentence(
                "pen.mirror-image",
                "The LEDs are a mirror image of the pen: seen from the front with "
                "LED 4 above LED 1, LEDs 5 to 7 must be on the left and 8 to 10 on "
                "the right. If the machine's axes are left-handed, change the sign "
                "of one coordinate; if the columns are exchanged, number them anew.",
            )
        )
    return _frame(raw_leds)


def in_pen_frame(raw: Pen) -> Pen:
    """Return a pen of the paper's layout in the pen frame; see `pen_frame_from_raw`.

    Parameters
    ----------
    raw : Pen
        LEDs, normals and nominal tip in any right-handed frame.
    """
    R, t = pen_frame_from_raw(raw.leds)
    return replace(
        raw,
        leds=raw.leds @ R.T + t,
        normals=raw.normals @ R.T,
        nominal_tip=None if raw.nominal_tip is None else R @ raw.nominal_tip + t,
    )


def _check_separation(leds: FloatArray, diameter: float) -> None:
    distances = np.linalg.norm(leds[:, None] - leds, axis=2)
    np.fill_diagonal(distances, np.inf)
    first, second = np.unravel_index(np.argmin(distances), distances.shape)
    nearest = distances[first, second]
    if nearest < MIN_SEPARATION * diameter:
        raise FileError(
            sentence(
                "pen.leds-too-close",
                "LEDs {first} and {second} are {distance:.2f} mm apart, too close "
                "for discs of {diameter:g} mm. Check their coordinates and the "
                "diameter.",
                first=int(first) + 1,
                second=int(second) + 1,
                distance=float(nearest),
                diameter=diameter,
            )
        )


def _check_not_in_line(leds: FloatArray, extent: float) -> None:
    off_line = _off_line(leds).max()
    if off_line < MIN_OFF_LINE * extent:
        raise FileError(
            sentence(
                "pen.leds-in-line",
                "The LEDs stand in a line within {off_line:.2f} mm over "
                "{extent:.0f} mm, so a turn about it could not be seen. At least "
                "one LED must stand {needed:.1f} mm off the line.",
                off_line=off_line,
                extent=extent,
                needed=MIN_OFF_LINE * extent,
            )
        )


def _off_line(points: FloatArray) -> FloatArray:
    """Return the distances of points (..., N, 3) from their best line."""
    centred = points - points.mean(axis=-2, keepdims=True)
    direction = np.linalg.svd(centred, full_matrices=False)[2][..., :1, :]
    along = np.sum(centred * direction, axis=-1, keepdims=True)
    distances: FloatArray = np.linalg.norm(centred - along * direction, axis=-1)
    return distances


def _layout(leds: FloatArray) -> IntArray | None:
    """Return which LED stands where in the paper's layout, or None if it is not that.

    The places are the back line, one column and the other, each from one end to the
    other; which end and which column comes first is not decided.
    """
    if len(leds) != 10:
        return None
    backs = np.array(list(combinations(range(10), 4)))
    in_line = _off_line(leds[backs]).max(axis=1) <= FRAME_TOLERANCE
    for back in backs[in_line]:
        slots = _layout_behind(leds, back)
        if slots is not None:
            return slots
    return None


def _layout_behind(leds: FloatArray, back: IntArray) -> IntArray | None:
    """Return `_layout` if its back line is that of the LEDs `back`."""
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
    """Refuse LEDs with exchanged numbers; tell whether the others are right-handed."""
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
    """Return the error about LEDs of which number ``order[j] + 1`` is in place j."""
    wrong = np.flatnonzero(order != np.arange(10))
    if len(wrong) == 2:
        return FileError(
            sentence(
                "pen.leds-exchanged",
                "LEDs {first} and {second} are exchanged: each stands where the "
                "other belongs. LEDs 1 to 4 must follow each other along the back "
                "line, and 5 to 7 and 8 to 10 along the columns in the same "
                "direction. Exchange their coordinates.",
                first=int(wrong[0]) + 1,
                second=int(wrong[1]) + 1,
            )
        )
    places = _listing(
        [
            sentence(
                "pen.led-in-place-of",
                "{led} where {other} belongs",
                led=int(order[j]) + 1,
                other=int(j) + 1,
            )
            for j in wrong
        ]
    )
    return FileError(
        sentence(
            "pen.out-of-order",
            "The LEDs are out of order: LED {places}. LEDs 1 to 4 must follow each "
            "other along the back line, and 5 to 7 and 8 to 10 along the columns in "
            "the same direction. Number them so.",
            places=places,
        )
    )


def _mirrored(leds: FloatArray) -> FileError:
    """Return the error about LEDs that are in order but left-handed."""
    for axis in range(3):
        mirrored = leds.copy()
        mirrored[:, axis] *= -1
        if np.abs(_in_frame(mirrored) - mirrored).max() <= FRAME_TOLERANCE:
            break
    else:
        return FileError(
            sentence(
                "pen.neither-framed-nor-handed",
                "The LEDs are neither in the pen frame nor right-handed: they are a "
                "mirror image of the pen. Change the sign of one coordinate, then "
                "put them into the pen frame.",
            )
        )
    worst = int(np.argmax(np.abs(leds[:, axis])))
    return FileError(
        sentence(
            "pen.mirrored-axis",
            "The LEDs are mirrored in {axis}, a left-handed frame: LED {led} has "
            "{axis} = {found:.2f} mm in place of {needed:.2f} mm. {rule}",
            axis="xyz"[axis],
            led=worst + 1,
            found=float(leds[worst, axis]),
            needed=-float(leds[worst, axis]),
            rule=_HANDEDNESS[axis],
        )
    )


def _misfit(leds: FloatArray) -> Sentence:
    """Return a sentence about what keeps LEDs from being the paper's layout."""
    if len(leds) != 10:
        return sentence(
            "pen.led-count", "The file has {n_leds} LEDs.", n_leds=len(leds)
        )
    off_line = _off_line(leds[_BACK])
    front = leds[4:] - leds[4:].mean(axis=0)
    off_plane = np.abs(front @ np.linalg.svd(front)[2][2])
    if off_line.max() > FRAME_TOLERANCE:
        return sentence(
            "pen.off-line",
            "LED {led} is {distance:.2f} mm off the line of LEDs 1 to 4.",
            led=int(np.argmax(off_line)) + 1,
            distance=float(off_line.max()),
        )
    if off_plane.max() > FRAME_TOLERANCE:
        return sentence(
            "pen.off-plane",
            "LED {led} is {distance:.2f} mm off the plane of LEDs 5 to 10.",
            led=int(np.argmax(off_plane)) + 5,
            distance=float(off_plane.max()),
        )
    return sentence(
        "pen.not-parallel",
        "The line, the plane and the columns are not parallel, or too close.",
    )


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


def _listing(items: Sequence[Sentence]) -> Sentence:
    *others, last = items
    return sentence("list.and", "{others} and {last}", others=tuple(others), last=last)
