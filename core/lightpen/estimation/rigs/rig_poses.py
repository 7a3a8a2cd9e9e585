"""The pose of the pen at each moment by all cameras of a rig that saw it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.detection.pose import Poses
from lightpen.errors import CalibrationError
from lightpen.estimation.contact.single_images import PosedImages
from lightpen.estimation.pivot.pivot import median_distance
from lightpen.model.rigid import (
    Rig,
    nearest_rotation,
    rotation_from_vector,
    vector_from_rotation,
)

# Check that the cameras of a rig took their images at the same moments.
#
# Two fixed cameras see the same rotation of the pen. A camera that takes its images
# later sees a moving pen rotated further by lag times speed; images that are paired
# with wrong moments show arbitrary rotations.


MIN_PAIRS = 6  # moments that two cameras see
NEAR = 4.0  # times the median turn: pairs by which the cameras are judged
ROUNDS = 3
APART = 8.0  # times the median turn: images of other moments
MANY = 0.25  # of the moments; more show a wrong pairing
UNSTEADY = 0.02  # rad; scatter of poses that no camera file causes
SLOW = 0.3  # rad from one image to the next, up to which a motion counts as even
MIN_SLOW = 20  # images of such motion that determine a lag
SIGNIFICANT = 5.0  # standard deviations
NOTICEABLE = 2e-4  # rad: 0.04 mm at the far end of a pen


@dataclass(frozen=True, eq=False)
class PenRotations:
    """Rotations of the pen at N moments, as one camera or several saw them."""

    rotations: FloatArray  # (N, 3, 3)
    variances: FloatArray  # (N,), of the three axes of each together, rad^2
    known: BoolArray  # (N,), whether there is one

    @classmethod
    def of(cls, images: PosedImages) -> "PenRotations":
        """Return the rotations by the images of one camera."""
        n, chosen = len(images.reasons), images.chosen
        poses = images.poses.of(images.kept)
        rotations, variances = np.tile(np.eye(3), (n, 1, 1)), np.zeros(n)
        known = np.zeros(n, dtype=bool)
        rotations[chosen] = poses.rotations
        variances[chosen] = np.trace(poses.covariances[:, :3, :3], axis1=1, axis2=2)
        known[chosen] = True
        return cls(rotations, variances, known)

    def completed(self, other: "PenRotations", rotation: FloatArray) -> "PenRotations":
        """Return these; a camera rotated by ``rotation`` fills the gaps."""
        new = other.known & ~self.known
        return PenRotations(
            np.where(new[:, None, None], rotation.T @ other.rotations, self.rotations),
            np.where(new, other.variances, self.variances),
            self.known | new,
        )


@dataclass(frozen=True, eq=False)
class RelativeRotation:
    """Relative rotation of two cameras at P common moments."""

    rotation: FloatArray  # (3, 3), from the first camera to the second
    pairs: IntArray  # (P,), the common moments
    # (P, 3), rotation vector of each moment's deviation, frame of the first, rad.
    off: FloatArray
    usual: float  # length of these expected from the poses' uncertainty, rad

    @property
    def scatter(self) -> float:
        """Median disagreement, rad."""
        return float(np.median(np.linalg.norm(self.off, axis=1)))

    @property
    def apart(self) -> IntArray:
        """Moments at which the cameras did not see the same posture."""
        far = max(APART * max(self.scatter, self.usual), NOTICEABLE)
        return np.asarray(self.pairs[np.linalg.norm(self.off, axis=1) > far])


@dataclass(frozen=True)
class TimeLag:
    """Time lag of a camera."""

    # `value` and `sigma`: lag in image intervals, and its standard deviation.
    value: float
    sigma: float
    turn: float  # rotation of the pen in this time in the usual motion, rad

    @property
    def is_noticeable(self) -> bool:
        """Whether it is significant and relevant beside the noise of a pose."""
        return (
            abs(self.value) > SIGNIFICANT * self.sigma and abs(self.turn) > NOTICEABLE
        )


def relative_turn(one: PenRotations, other: PenRotations) -> RelativeRotation:
    """Return the relative rotation of the other camera, robust against outliers."""
    pairs = np.flatnonzero(one.known & other.known)
    each = other.rotations[pairs] @ np.swapaxes(one.rotations[pairs], 1, 2)
    rotation = nearest_rotation(np.median(each, axis=0))
    for _ in range(ROUNDS):
        far = np.linalg.norm(vector_from_rotation(rotation.T @ each), axis=1)
        rotation = nearest_rotation(each[far <= NEAR * np.median(far)].mean(axis=0))
    variances = one.variances[pairs] + other.variances[pairs]
    return RelativeRotation(
        rotation=rotation,
        pairs=pairs,
        off=vector_from_rotation(rotation.T @ each),
        usual=float(np.sqrt(np.median(variances) / 3)) * median_distance(),
    )


def require_same_moments(
    one: PenRotations, other: PenRotations, name: str
) -> RelativeRotation:
    """Return the relative rotation of the other camera, if the images are simultaneous.

    Raises `CalibrationError` if not, or if too few moments are seen by both.
    """
    n_pairs = int(np.sum(one.known & other.known))
    if n_pairs < MIN_PAIRS:
        raise CalibrationError(
            "rig.few-pairs",
            n_pairs=n_pairs,
            n_moments=len(one.known),
            camera=name,
            needed=MIN_PAIRS,
        )
    found = relative_turn(one, other)
    if found.scatter > UNSTEADY or len(found.apart) > MANY * n_pairs:
        raise CalibrationError(
            "rig.other-moments",
            camera=name,
            n_apart=int(np.sum(np.linalg.norm(found.off, axis=1) > UNSTEADY)),
            n_pairs=n_pairs,
        )
    return found


def measure_lag(one: PenRotations, found: RelativeRotation) -> TimeLag | None:
    """Estimate the time lag of the other camera.

    None where the pen turns too far between two images to tell.
    """
    inner = found.pairs[(found.pairs > 0) & (found.pairs < len(one.known) - 1)]
    inner = inner[one.known[inner - 1] & one.known[inner + 1]]
    before, after = one.rotations[inner - 1], one.rotations[inner + 1]
    speeds = vector_from_rotation(after @ np.swapaxes(before, 1, 2)) / 2
    off = found.off[np.isin(found.pairs, inner)]
    slow = np.linalg.norm(speeds, axis=1) < SLOW
    slow &= np.linalg.norm(off, axis=1) <= NEAR * max(found.scatter, NOTICEABLE)
    if slow.sum() < max(MIN_SLOW, 0.5 * len(found.pairs)):
        return None
    speeds, off = speeds[slow], off[slow]
    total = float(np.sum(speeds**2))
    value = float(np.sum(speeds * off)) / total
    left = float(np.sum((off - value * speeds) ** 2)) / (off.size - 1)
    return TimeLag(
        value=value,
        sigma=float(np.sqrt(left / total)),
        turn=value * float(np.sqrt(total / len(speeds))),
    )


class RigPoses(NamedTuple):
    """Poses rig_from_pen at N moments; NaN where no camera has one."""

    # `rotations` and `translations`: (N, 3, 3) and (N, 3), mm
    rotations: FloatArray
    translations: FloatArray


def join_poses(
    rig: Rig, n_moments: int, posed: Sequence[IntArray], poses: Sequence[Poses]
) -> RigPoses:
    """Combine the poses by single cameras.

    Each is weighted by its covariance, which is small across the view of its camera and
    large along it.

    Parameters
    ----------
    posed : sequence of (M,) array of int
        Moments at which each camera has a pose.
    poses : sequence of Poses
        cam_from_pen, of each camera.
    """
    rotations = np.full((n_moments, 3, 3), np.nan)
    translations = np.full((n_moments, 3), np.nan)
    information = np.zeros((n_moments, 6, 6))
    for c, (at, each) in enumerate(zip(posed, poses, strict=True)):
        R, t, covariances = poses_in_rig(
            rig, c, each.rotations, each.translations, each.covariances
        )
        new = np.isnan(translations[at, 0])
        rotations[at[new]], translations[at[new]] = R[new], t[new]
        known = np.linalg.inv(covariances)
        turns = vector_from_rotation(R @ np.swapaxes(rotations[at], 1, 2))
        off = np.concatenate([turns, t - translations[at]], axis=1)
        information[at] += known
        step = np.linalg.solve(information[at], known @ off[..., None])[..., 0]
        rotations[at] = rotation_from_vector(step[:, :3]) @ rotations[at]
        translations[at] += step[:, 3:]
    return RigPoses(rotations, translations)


def poses_in_rig(
    rig: Rig,
    c: int,
    rotations: FloatArray,
    translations: FloatArray,
    covariances: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return poses cam_from_pen, mm, of the c-th camera as rig_from_pen.

    ``covariances`` (N, 6, 6) are of (theta, dt), rad and mm.
    """
    back = rig.rotations[c].T
    turned = np.zeros((6, 6))
    turned[:3, :3] = turned[3:, 3:] = back
    return (
        back @ rotations,
        (translations - rig.translations[c]) @ back.T,
        turned @ covariances @ turned.T,
    )


# Extrinsics of a rig by the images alone, to start the fit from.
#
# At a moment that two cameras see, the two poses of the pen give their relative pose.
# The fit of a rig starts from there, as a wrong rig file or focal length would mislead
# it.


@dataclass(frozen=True, eq=False)
class InitialExtrinsics:
    """The extrinsics of a rig by the images."""

    rig: Rig  # with the file's cameras, without a covariance
    # Of each camera but the first; None: not determined.
    lags: tuple[TimeLag | None, ...]
    apart: BoolArray  # (N, C), images not simultaneous with those of earlier cameras

    def deviations(self, file: Rig) -> FloatArray:
        """Return the deviations from a file's extrinsics, as in `Rig.covariance`."""
        turns = self.rig.rotations[1:] @ np.swapaxes(file.rotations[1:], 1, 2)
        shifts = self.rig.translations[1:] - file.translations[1:]
        return np.concatenate([vector_from_rotation(turns), shifts], axis=1).ravel()


def find_initial_extrinsics(
    rig: Rig, parts: Sequence[PosedImages]
) -> InitialExtrinsics:
    """Find the extrinsics by the images of each camera at the same N instants.

    Raises `CalibrationError` if too few moments are seen by two cameras, or the images
    are not of the same moments.
    """
    turns = [PenRotations.of(part) for part in parts]
    seen, cone = turns[0], parts[0].pivot.pivot_cam
    rotations, translations = rig.rotations.copy(), rig.translations.copy()
    lags: list[TimeLag | None] = [None] * rig.n_cameras
    apart = np.zeros((len(seen.known), rig.n_cameras), dtype=bool)
    left = list(range(1, rig.n_cameras))
    while left:
        c = max(left, key=lambda each: np.sum(seen.known & turns[each].known))
        left.remove(c)
        found = require_same_moments(seen, turns[c], rig.names[c])
        lags[c] = measure_lag(seen, found)
        apart[found.apart, c] = True
        rotations[c] = found.rotation
        # From the cone, as all images of a camera determine it, not from single poses.
        translations[c] = parts[c].pivot.pivot_cam - found.rotation @ cone
        seen = seen.completed(turns[c], found.rotation)
    placed = replace(
        rig, rotations=rotations, translations=translations, covariance=None
    )
    return InitialExtrinsics(placed, tuple(lags[1:]), apart)


USUAL_ANGLE = np.radians(15.0)  # by which a camera may have been turned
USUAL_SHARE = 0.3  # of its distance from the reference, by which it may have moved
LEAST_DISTANCE = 100.0  # mm, lower bound of the distance for that share


def require_usual_rig(rig: Rig, placed: InitialExtrinsics) -> None:
    """Raise `CalibrationError` if a camera is quite elsewhere than in the rig's file.

    Smaller deviations are left to the adjustment.
    """
    for c, off in enumerate(placed.deviations(rig).reshape(-1, 6), 1):
        angle, distance = (float(np.linalg.norm(part)) for part in (off[:3], off[3:]))
        apart = float(np.linalg.norm(placed.rig.translations[c]))
        most = USUAL_SHARE * max(apart, LEAST_DISTANCE)
        if angle > USUAL_ANGLE or distance > most:
            raise CalibrationError(
                "rig.of-others",
                camera=rig.names[c],
                angle=float(np.degrees(angle)),
                distance=distance,
            )
