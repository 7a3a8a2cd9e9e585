"""A touch: one point measured with the pen held still.

Each image puts the tip at ``X = R tip_pen + t``. The mean over the images of a touch is
its point. Two things make it uncertain: noise of images, seat and bending, which is
its own, and what is not known of tip, LEDs and camera, which all touches share. The
latter is kept as the derivative of the point by these parameters, so that it drops out
of a difference of two points as far as it moves both alike.

Several cameras make one pose of the pen by all their images together, in the frame of
the first. With the derivative ``J`` of the LED centres by the pose and ``K`` by the
parameters ``p`` a pose follows an error of them by ``-(J^T W J)^-1 J^T W K dp``.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.pose import Poses
from lightpen.detection.reasons import Reason
from lightpen.detection.rig_observations import derivatives_in_rig, fit_rig_poses
from lightpen.detection.robust_residuals import disc_residuals, normal_equations
from lightpen.estimation.pivot.pivot import (
    in_deviations,
    median_distance,
    outlier_distance,
    tip_covariances,
)
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.rigid import UPRIGHT_AXIS, nearest_rotation, skew

KNOWN_FREEDOM = 30  # degrees of freedom of the noise of the calibration
SEATING = 0.002  # mm, standard uncertainty of where a tip comes to rest in a good cone
POSE_UNKNOWNS = 6
NO_DRIFT = np.zeros(3)  # mm


@dataclass(frozen=True, eq=False)
class ProbingFrame:
    """The pen in one image, or in simultaneous images."""

    name: str  # file or frame
    pixels: FloatArray  # (C, L, 2), centres of the LEDs, px; NaN if not seen
    rotation: FloatArray  # (3, 3), rough cam_from_pen of the first camera
    translation: FloatArray  # (3,), of the same, mm


@dataclass(frozen=True)
class RejectedFrame:
    """An image that takes no part, and why."""

    name: str
    reason: Reason


@dataclass(frozen=True, eq=False)
class StillFrames:
    """Images through which the pen was held still on one point."""

    frames: tuple[ProbingFrame, ...]
    rejected: tuple[RejectedFrame, ...] = ()
    approach_cam: FloatArray | None = None  # (3,), unit vector


@dataclass(frozen=True, eq=False)
class ProbedPoint:
    """A measured point."""

    point_cam: FloatArray  # (3,), tip centre, or the surface touched, mm
    # (3, 3), part of the covariance independent of other points, mm^2.
    noise: FloatArray
    sensitivity: FloatArray  # (3, q), derivative by the parameters of the instrument
    rotation: FloatArray  # (3, 3), of cam_from_pen
    names: tuple[str, ...]
    rms: float  # root mean square residual of an LED, px
    rejected: tuple[RejectedFrame, ...] = ()
    approach_cam: FloatArray | None = None
    bending: FloatArray | None = None  # (3, 3), its part of the noise, mm^2

    @property
    def seated(self) -> "ProbedPoint":
        """The same in a cone, in which the stylus bends as it did in its swing."""
        if self.bending is None:
            return self
        return replace(self, noise=self.noise - self.bending, bending=None)

    @property
    def label(self) -> str:
        """The name of its first image, and of the last if there are more."""
        first, last = self.names[0], self.names[-1]
        return first if first == last else f"{first} to {last}"

    def covariance(self, instrument: Instrument) -> FloatArray:
        """Return the covariance of the point, (3, 3), mm^2."""
        shared = self.sensitivity @ instrument.covariance @ self.sensitivity.T
        return np.asarray(self.noise + shared)


def measure_touches(
    instrument: Instrument, held: Sequence[StillFrames]
) -> tuple[ProbedPoint, ...]:
    """Measure points.

    The noise of the images is found from all of them together. Images of a touch that
    put the tip elsewhere than the others are left out and named.
    """
    if not held:
        return ()
    frames = [frame for still in held for frame in still.frames]
    poses = fit_rig_poses(
        instrument.rig,
        instrument.pen,
        np.array([frame.pixels for frame in frames]),
        np.array([frame.rotation for frame in frames]),
        np.array([frame.translation for frame in frames]),
    )
    sigma = _pooled_sigma(instrument, poses)
    points = poses.rotations @ instrument.tip_pen + poses.translations
    noises = tip_covariances(poses.rotations, poses.covariances, instrument.tip_pen)
    noises *= (sigma / poses.sigma) ** 2
    along = poses.rotations @ UPRIGHT_AXIS
    across = np.eye(3) - along[:, :, None] * along[:, None, :]
    sensitivities = point_sensitivities(instrument, poses)
    touches, start = [], 0
    for still in held:
        own = slice(start, start + len(still.frames))
        start = own.stop
        agreeing = _agreeing(points[own], noises[own])
        bending = instrument.bending**2 * across[own][agreeing].mean(axis=0)
        touches.append(
            ProbedPoint(
                point_cam=points[own][agreeing].mean(axis=0),
                noise=_mean_noise(points[own][agreeing], noises[own][agreeing])
                + SEATING**2 * np.eye(3)
                + bending,
                sensitivity=sensitivities[own][agreeing].mean(axis=0),
                rotation=nearest_rotation(poses.rotations[own][agreeing].mean(axis=0)),
                names=tuple(still.frames[i].name for i in agreeing),
                rms=float(np.sqrt(np.mean(poses.rms[own][agreeing] ** 2))),
                rejected=still.rejected
                + tuple(
                    RejectedFrame(frame.name, Reason.SLIPPED)
                    for i, frame in enumerate(still.frames)
                    if i not in agreeing
                ),
                approach_cam=still.approach_cam,
                bending=bending,
            )
        )
    return tuple(touches)


def with_tip(
    touch: ProbedPoint, instrument: Instrument, tip_pen: FloatArray
) -> ProbedPoint:
    """Return a touch recomputed with another tip (3,), pen frame, mm."""
    moved = touch.rotation @ (tip_pen - instrument.tip_pen)
    return replace(touch, point_cam=touch.point_cam + moved)


def joint_covariance(
    points: Sequence[ProbedPoint], instrument: Instrument
) -> FloatArray:
    """Return the covariance of several points with what they share, (3 n, 3 n)."""
    rows = np.concatenate([point.sensitivity for point in points])
    covariance = rows @ instrument.covariance @ rows.T
    for i, point in enumerate(points):
        covariance[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] += point.noise
    return np.asarray(covariance)


def point_entries(
    points: Sequence[ProbedPoint], instrument: Instrument
) -> list[dict[str, Any]]:
    """Return the entries of points in a record."""
    return [
        {
            "images": list(point.names),
            "point_cam_mm": point.point_cam,
            "covariance": point.covariance(instrument),
            "noise_covariance": point.noise,
            "rms_px": point.rms,
            "rejected": rejected_entries(point.rejected),
        }
        for point in points
    ]


def rejected_entries(rejected: Sequence[RejectedFrame]) -> list[dict[str, str]]:
    """Return the entries of rejected images in a record."""
    return [{"file": each.name, "reason": str(each.reason)} for each in rejected]


def point_sensitivities(instrument: Instrument, poses: Poses) -> FloatArray:
    """Return the derivatives (N, 3, q) of the tip in the camera by the parameters."""
    R = poses.rotations
    views = [_view(instrument, c, poses) for c in range(instrument.rig.n_cameras)]
    J = np.concatenate([view.by_pose for view in views], axis=1)
    K = np.concatenate([view.by_parameters for view in views], axis=1)
    n_images, n_centers = J.shape[:2]
    weights = poses.weights
    H, _ = normal_equations(J, np.zeros((n_images, n_centers, 2)), weights)
    weighted = J.reshape(n_images, -1, 6) * np.repeat(weights, 2, axis=1)[..., None]
    follows = np.linalg.solve(
        H, np.swapaxes(weighted, 1, 2) @ K.reshape(n_images, 2 * n_centers, -1)
    )
    by_pose = np.concatenate(
        [-skew(R @ instrument.tip_pen), np.broadcast_to(np.eye(3), R.shape)], axis=2
    )
    sensitivities = -by_pose @ follows
    sensitivities[..., instrument.parameters.tip] += R
    return np.asarray(sensitivities)


class _Derivatives(NamedTuple):
    """Derivatives (N, L, 2, k) of the centres in a camera by pose and parameters."""

    by_pose: FloatArray
    by_parameters: FloatArray


def _view(instrument: Instrument, c: int, poses: Poses) -> _Derivatives:
    """Return the derivatives of the images of the c-th camera."""
    rig, pen, at = instrument.rig, instrument.pen, instrument.parameters
    camera, turn = rig.cameras[c], rig.rotations[c]
    R = turn @ poses.rotations
    lever = pen.leds @ np.swapaxes(R, 1, 2)
    from_rig = lever + (poses.translations @ turn.T)[:, None]
    centers = from_rig + rig.translations[c]
    normals = pen.normals @ np.swapaxes(R, 1, 2)
    n_images, n_leds = lever.shape[:2]
    nowhere = np.zeros((n_images, n_leds, 2))
    modelled, J = disc_residuals(
        camera, lever, centers, normals, pen.diameter / 2, nowhere
    )
    normalised = centers[..., :2] / centers[..., 2:]
    K = np.zeros((n_images, n_leds, 2, at.number))
    K[..., at.cameras[c]] = camera.intrinsics_jacobian(normalised)
    if c > 0:
        start = at.extrinsics.start + 6 * (c - 1)
        by_turn = np.cross(from_rig[:, :, None], J[..., 3:])
        K[..., start : start + 3], K[..., start + 3 : start + 6] = by_turn, J[..., 3:]
    # The centre of a disc's image deviates by the square of the diameter.
    offset = -modelled - camera.pixels(normalised)
    K[..., at.diameter] = (2 / pen.diameter * offset)[..., None]
    by_led = J[..., 3:] @ R[:, None]
    for j in range(n_leds):
        own = slice(at.leds.start + 3 * j, at.leds.start + 3 * j + 3)
        K[:, j, :, own] = by_led[:, j]
    return _Derivatives(derivatives_in_rig(J, turn), K)


def _pooled_sigma(instrument: Instrument, poses: Poses) -> float:
    """Return the noise by the images, and by the calibration where they are few."""
    n_free = 2 * int((poses.weights > 0).sum()) - POSE_UNKNOWNS * len(poses.rotations)
    squares = max(n_free, 0) * poses.sigma**2 + KNOWN_FREEDOM * instrument.sigma**2
    return float(np.sqrt(squares / (max(n_free, 0) + KNOWN_FREEDOM)))


def _agreeing(points: FloatArray, noises: FloatArray) -> list[int]:
    """Return the mask of the inliers of the points (n, 3) of a touch."""
    distances = in_deviations(points - np.median(points, axis=0), noises)
    unit = max(float(np.median(distances)) / median_distance(), 1.0)
    return np.flatnonzero(distances <= outlier_distance() * unit).tolist()


def _mean_noise(points: FloatArray, noises: FloatArray) -> FloatArray:
    """Return the covariance of the mean of points (n, 3), by noise or by scatter."""
    n = len(points)
    mean = noises.sum(axis=0) / n**2
    if n == 1:
        return np.asarray(mean)
    distances = in_deviations(points - points.mean(axis=0), noises)
    n_free = 3 * (n - 1)
    excess = float(np.sum(distances**2)) / n_free
    by_chance = 1 + 2.33 * np.sqrt(2 / n_free)  # 99 %
    return np.asarray(mean * (excess if excess > by_chance else 1.0))
