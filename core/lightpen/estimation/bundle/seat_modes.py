"""Modes of the seat offset as a function of the tilt, and of the drift of the cone.

A tip that sits in a worn cone, or that is itself out of round, moves as the pen leans;
camera and cone drift during a swing. Each mode is a weight for every image: w_m and v_n
of equation (4) of method.md.
"""

from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.linearised import N_CONE
from lightpen.model.rigid import skew

FULL_LEAN = 0.15  # sine of the tilt at which a mode reaches half its weight
MODE_COUNTS = (2, 2, 2, 1)  # of one, two, three waves round the cone, and of the tilt
UPRIGHT = 0.966  # cosine of 15 degrees, to which 15 images show where a cone opens
SMALLEST = 1e-9  # size of a mode; less is rounding


class SeatModes(NamedTuple):
    """Weights of the modes in each of N images."""

    lean: FloatArray  # (N, 7), of the seat, see `tilt_modes`
    oval: FloatArray  # (21, 2), moves in these modes by an oval seat, see `oval_seat`
    drift: FloatArray  # (N, D), of the cone, see `drift_modes`


def seat_modes_of(rotations: FloatArray, shifts: FloatArray | None = None) -> SeatModes:
    """Return the modes of images with rotations rig_from_pen (N, 3, 3).

    ``shifts`` as in `drift_modes`.
    """
    lean, oval = tilt_modes(rotations), oval_seat(rotations)
    return SeatModes(lean, oval, drift_modes(len(rotations), shifts))


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
    forms, sizes = _lean(rotations)
    return np.asarray(forms / np.where(sizes > 0, sizes, 1.0))


def oval_seat(rotations: FloatArray) -> FloatArray:
    """Return the moves in the modes of `tilt_modes` by an oval seat, (21, 2).

    A ball or cone with two lobes, 1 mm off the circle, moves the tip away from the axis
    by equation (7) with a = 1 mm: one wave and three waves round the cone. The two
    columns are the cosine and sine of twice the phase p. Rotations (N, 3, 3) are
    rig_from_pen.
    """
    _, sizes = _lean(rotations)
    cos1, sin1, _, _, cos3, sin3, _ = np.eye(len(sizes)) * sizes
    right, away, _ = axes_of_cone(rotations)
    cosine = np.outer(cos1 + cos3, right) + np.outer(sin3 - sin1, away)
    sine = np.outer(sin1 + sin3, right) + np.outer(cos1 - cos3, away)
    return np.stack([0.5 * cosine.ravel(), 0.5 * sine.ravel()], axis=1)


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


def _lean(rotations: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the seat modes less their means, (N, 7), and their sizes, (7,)."""
    right, away, _ = axes_of_cone(rotations) @ rotations[:, :, 1].T
    radius = np.hypot(right, away)
    weight = radius / (radius + FULL_LEAN)
    angle = np.arctan2(away, right)
    waves = [f(n * angle) * weight for n in (1, 2, 3) for f in (np.cos, np.sin)]
    forms = np.stack([*waves, weight**2], axis=1)
    forms -= forms.mean(axis=0)
    sizes = np.sqrt(np.mean(forms**2, axis=0))
    is_there = sizes > SMALLEST
    return np.where(is_there, forms, 0.0), np.where(is_there, sizes, 0.0)
