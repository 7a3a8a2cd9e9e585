"""The pose of the pen at a moment, by the first camera that sees enough of it."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.labelling.constellation import certain_leds
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.pose import fit_poses
from lightpen.detection.reasons import Reason
from lightpen.estimation.rigs.rig_poses import poses_in_rig
from lightpen.model.pen import Pen
from lightpen.model.rig import Rig


class SimultaneousPoses(NamedTuple):
    """Poses rig_from_pen at N moments."""

    rotations: FloatArray  # (N, 3, 3)
    translations: FloatArray  # (N, 3), mm
    cofactors: FloatArray  # (N, 6, 6), covariances for a noise of 1 px, rad and mm
    sigmas: FloatArray  # (N,), standard deviation of one image coordinate, px


def seen_by_rig(rig: Rig, pen: Pen, detection: PenDetection) -> PenDetection:
    """Return a detection with the pose by another camera where the first has none.

    It is the detection of the first camera, with the simultaneous ones of the others.
    Unchanged if the first camera shows enough of the pen, or none does.
    """
    for c, seen in enumerate((detection, *detection.others)):
        if seen.has_pose and seen.n_leds >= certain_leds(pen) and not seen.is_blurred:
            return detection if c == 0 else _posed_by(rig, detection, c)
    return detection


def fit_moments(
    rig: Rig,
    pen: Pen,
    pixels: FloatArray,
    rotations: FloatArray,
    translations: FloatArray,
) -> SimultaneousPoses:
    """Fit the pose of each moment to the LEDs in one camera, as when captured.

    The fit to pixels (N, C, L, 2), NaN where an LED was not seen, starts at rotations
    (N, 3, 3) and translations (N, 3), mm, of rig_from_pen.
    """
    n_seen = np.isfinite(pixels[..., 0]).sum(axis=2)
    enough = n_seen >= certain_leds(pen)
    cameras = np.where(enough.any(axis=1), enough.argmax(axis=1), n_seen.argmax(axis=1))
    n_moments = len(pixels)
    found = SimultaneousPoses(
        rotations.copy(),
        translations.copy(),
        np.zeros((n_moments, 6, 6)),
        np.zeros(n_moments),
    )
    for c, camera in enumerate(rig.cameras):
        at = np.flatnonzero(cameras == c)
        if not len(at):
            continue
        R, t = rig.rotations[c], rig.translations[c]
        start = R @ rotations[at], translations[at] @ R.T + t
        poses = fit_poses(camera, pen, pixels[at, c], *start)
        cofactors = poses.covariances / poses.sigma**2
        by_rig = poses_in_rig(rig, c, poses.rotations, poses.translations, cofactors)
        found.rotations[at], found.translations[at], found.cofactors[at] = by_rig
        found.sigmas[at] = poses.sigma
    return found


def _posed_by(rig: Rig, detection: PenDetection, c: int) -> PenDetection:
    """Return the detection with the pose by the c-th camera."""
    seen = detection.others[c - 1]
    R, t, cofactors = poses_in_rig(
        rig, c, seen.rotation[None], seen.translation[None], seen.cofactors[None]
    )
    return replace(
        detection,
        reason=Reason.NONE,
        rotation=R[0],
        translation=t[0],
        cofactors=cofactors[0],
        sigma=seen.sigma,
        posed_by=c,
    )
