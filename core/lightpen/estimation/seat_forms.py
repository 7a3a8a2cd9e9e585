"""Forms in which a cone may shift from image to image: its seat, and a drift.

A tip that sits in a worn cone, or that is itself out of round, moves as the pen leans;
camera and cone drift in the course of a swing. Each form is a weight for every image.
"""

from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.linearised import N_CONE
from lightpen.model.rigid import skew

FULL_LEAN = 0.15  # sine of the tilt from which on a seat shows most of its form
FORMS = (2, 2, 2, 1)  # of one, two, three waves round the cone, and of the tilt
UPRIGHT = 0.966  # cosine of 15 degrees, to which 15 images tell where a cone opens
SMALLEST = 1e-9  # size of a form; less is rounding


class Forms(NamedTuple):
    """Weights by which images may shift their cone.

    Attributes
    ----------
    lean : (N, 7) array
        As the pen leans, see `lean_forms`.
    oval : (21, 2) array
        Moves in each of these forms that an oval seat makes, see `oval_seat`.
    drift : (N, D) array
        In the course of the swing, see `drift_forms`.
    """

    lean: FloatArray
    oval: FloatArray
    drift: FloatArray


def forms_of(rotations: FloatArray, shifts: FloatArray | None = None) -> Forms:
    """Return the forms of images with these rotations (N, 3, 3) of rig_from_pen.

    Parameters
    ----------
    shifts : (N, k) array, optional
        Ways of fixed lamps, see `drift_forms`.
    """
    lean, oval = lean_forms(rotations), oval_seat(rotations)
    return Forms(lean, oval, drift_forms(len(rotations), shifts))


def drift_forms(n_images: int, shifts: FloatArray | None = None) -> FloatArray:
    """Return the forms in which a cone may drift, (N, D), each over a range of 1.

    Evenly in time, and along the ways that lamps in view go.

    Parameters
    ----------
    shifts : (N, k) array, optional
        These ways, px.
    """
    time = np.linspace(-0.5, 0.5, n_images)[:, None]
    if shifts is None or n_images == 0:
        return time
    ranges = np.ptp(shifts, axis=0)
    return np.column_stack([time, shifts[:, ranges > 0] / ranges[ranges > 0]])


def lean_forms(rotations: FloatArray) -> FloatArray:
    """Return the forms in which a seat may follow the lean of a pen, (N, 7).

    Waves of one to three periods round the cone and one that goes with the tilt, less
    their means, each of mean square 1 (or 0).

    Parameters
    ----------
    rotations : (N, 3, 3) array
        Of rig_from_pen.
    """
    forms, sizes = _lean(rotations)
    return np.asarray(forms / np.where(sizes > 0, sizes, 1.0))


def oval_seat(rotations: FloatArray) -> FloatArray:
    """Return the moves in the forms of the lean that an oval seat makes, (21, 2).

    A ball or cone with two lobes, 1 mm off the circle, moves the tip by
    ``cos(2 (angle - phase))`` mm away from the axis as the pen leans to an angle: by
    one wave and three waves round the cone, of which three waves are well seen. The
    two columns are the cosine and sine of twice the phase.

    Parameters
    ----------
    rotations : (N, 3, 3) array
        Of rig_from_pen.
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
    the pen points elsewhere on average by more than images are drawn unevenly, it is
    the camera that looks down or lies on its side: the cone opens to where it points.

    Parameters
    ----------
    rotations : (N, 3, 3) array
        Of rig_from_pen.
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
    """Return the forms of the lean less their means, (N, 7), and their sizes, (7,)."""
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
