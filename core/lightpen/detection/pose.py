"""The pose of the pen in each image, from the centres of its LEDs.

Two estimators, both vectorised over images:

* `fit_paper_poses`: equations (5) to (8) of [1]_, a linear start for a1 .. a11 and
  Gauss-Newton on the pose, with projected LED centres and all LEDs alike.
* `fit_poses`: maximum likelihood on ellipse centres, with a robust loss for single
  LEDs and the covariance of each pose.

A pose is perturbed on the left, ``X = exp([theta]x) R x + t + dt``; covariances are in
the order (theta, dt), rad and mm.

References
----------
.. [1] S. Liu et al., "Portable light pen 3D vision coordinate measuring system probe
   tip center calibration", Measurement Science Review 13 (2013) 194-199.
"""

import math
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple, Protocol

import cv2
import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.detection.robust_residuals import (
    CAUCHY_WIDTH,
    cauchy_weights,
    disc_residuals,
    image_sigmas,
    normal_equations,
    robust_sigma,
    sigma_of_lengths,
)
from lightpen.model.camera import Camera, LensModel
from lightpen.model.ellipse import ellipse_centers_with_jacobian
from lightpen.model.pen import Pen
from lightpen.model.rigid import nearest_rotation, rotation_from_vector, with_turns

MIN_POSE_LEDS = 4  # three leave up to four poses
MAX_STEPS = 30
# Of an angle in rad and of a translation over its length:
LINEAR = 3e-5  # leaves its square: the weights of LEDs are all that changes
NEAR_STEPS = 2  # by projected centres, from a start near the solution
SETTLED = 5e-8  # leaves a sixteenth
MAX_STEP = 0.2  # keeps an image of wrong LEDs from flying away
WORSE = 1.5  # times the common noise; a blurred or dim image has more of it
TINY = 1e-12
RIDGE, DAMPING = TINY * np.eye(6), 1 + 1e-9 * np.eye(6)


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses ``cam_from_pen`` of N images."""

    rotations: FloatArray  # (N, 3, 3)
    translations: FloatArray  # (N, 3), mm
    # (N, 6, 6), of (theta, dt) in rad and mm, for the noise ``sigma``, or for the
    # image's own where that is clearly larger.
    covariances: FloatArray
    # (N, L, 2), observed minus modelled centres, px; NaN where an LED was not seen.
    residuals: FloatArray
    # (N, L), weight of each LED under the robust loss, 0 to 1; 0 where not seen.
    weights: FloatArray
    # Standard deviation of one image coordinate, px, estimated over all images; of the
    # most exact LEDs, where they differ.
    sigma: float

    @property
    def rms(self) -> FloatArray:
        """Root mean square length of the residuals of each image, px, (N,)."""
        squares = np.nansum(self.residuals**2, axis=(1, 2))
        n_seen = np.isfinite(self.residuals[..., 0]).sum(axis=1)
        return np.asarray(np.sqrt(squares / np.maximum(n_seen, 1)))

    def of(self, chosen: IntArray) -> "Poses":
        """Return the poses of some images."""
        names = (each.name for each in fields(self) if each.name != "sigma")
        arrays: dict[str, Any] = {name: getattr(self, name)[chosen] for name in names}
        return replace(self, **arrays)


class ImagePose(NamedTuple):
    """Pose ``cam_from_pen`` of one image."""

    rotation: FloatArray  # (3, 3)
    translation: FloatArray  # (3,), mm
    cofactors: FloatArray  # (6, 6), covariance over ``sigma`` squared, as of `Poses`
    sigma: float  # standard deviation of one image coordinate, px, as of `Poses`
    weights: FloatArray  # (L,), weight of each LED, as of `Poses`


class Reprojection(Protocol):
    """Reprojection errors of the pen at given poses."""

    @property
    def pixels(self) -> FloatArray:
        """Observed centres, (N, M, 2), px; NaN where an LED was not seen."""

    def residuals_with_jacobian(
        self, R: FloatArray, t: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return residuals (N, M, 2), and d pixel / d (theta, dt), (N, M, 2, 6)."""


def fit_poses(
    camera: Camera,
    pen: Pen,
    pixels: FloatArray,
    rotations: FloatArray,
    translations: FloatArray,
    *,
    is_near: bool = False,
) -> Poses:
    """Fit poses by maximum likelihood on ellipse centres.

    Minimises the Cauchy loss of the reprojection errors in units of the noise that all
    images share, by Gauss-Newton from a start near the solution.

    Parameters
    ----------
    pixels : (N, L, 2) array
        Ellipse centres of the LEDs, px; NaN where an LED was not seen. Every image
        needs four LEDs.
    rotations, translations : (N, 3, 3) and (N, 3) array
        Start, cam_from_pen, mm.
    is_near : bool
        Whether that is by least squares on most of these LEDs already.
    """
    problem = CameraReprojection(
        camera, pen.leds, pen.normals, pen.diameter / 2, pixels
    )
    return fit_reprojection(problem, rotations, translations, is_near=is_near)


def fit_pose(
    camera: Camera,
    pen: Pen,
    pixels: FloatArray,
    rotation: FloatArray,
    translation: FloatArray,
    sigmas: FloatArray,
) -> ImagePose:
    """Fit the pose of one image, (L, 2), from one near it, as `fit_poses`.

    ``sigmas`` (L,) are how exact the centres are compared with each other, px.
    """
    seen = np.isfinite(pixels[:, 0])
    leds, normals, there = pen.leds[seen], pen.normals[seen], pixels[seen]
    shares = sigmas[seen].min() / sigmas[seen]
    R, t = rotation, translation
    if camera.lens is LensModel.BROWN:  # by projected centres first, which is fast
        R, t = _by_projected_centers(camera, leds, there, R, t)
    for _ in range(MAX_STEPS):
        lever = leds @ R.T
        imaged = ellipse_centers_with_jacobian(
            camera, lever + t, normals @ R.T, pen.diameter / 2
        )
        J = with_turns(imaged.jacobian, lever) * shares[:, None, None]
        rows, errors = J.reshape(-1, 6), (there - imaged.points) * shares[:, None]
        left, step = errors.ravel(), np.zeros(6)
        distance = math.hypot(*t.tolist())
        for _ in range(MAX_STEPS):
            H, right, _, _ = _normal(rows, left)
            solved = cv2.solve(H, right, flags=cv2.DECOMP_CHOLESKY)[1]
            change = np.asarray(solved, dtype=np.float64)[:, 0]
            step = step + change
            left = errors.ravel() - rows @ step
            if not SETTLED < _size(change, distance) < LINEAR:
                break
        size = _size(step, distance)
        step = step * (MAX_STEP / max(size, MAX_STEP))
        R, t = cv2.Rodrigues(step[:3])[0] @ R, t + step[3:]
        if size < LINEAR:
            break
    H, _, weights, sigma = _normal(rows, left)
    own = (left * left) @ np.repeat(weights, 2) / max(2 * weights.sum() - 6, 1)
    worse = own / sigma**2 if own > (WORSE * sigma) ** 2 else 1.0
    inverse = cv2.invert(H, flags=cv2.DECOMP_CHOLESKY)[1]
    cofactors = worse * np.asarray(inverse, dtype=np.float64)
    every = np.zeros(len(pixels))
    every[seen] = weights
    return ImagePose(R, t, cofactors, sigma, every)


def _size(step: FloatArray, distance: float) -> float:
    """Return the size of a step (6,), rad."""
    a, b, c, x, y, z = step.tolist()
    return max(math.hypot(a, b, c), math.hypot(x, y, z) / distance)


def _by_projected_centers(
    camera: Camera, leds: FloatArray, there: FloatArray, R: FloatArray, t: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the pose near another one that projects LEDs to pixels, both (L, 2)."""
    vector, place = cv2.Rodrigues(R)[0], t[:, None]
    for _ in range(NEAR_STEPS):
        points, J = cv2.projectPoints(leds, vector, place, *camera.opencv)
        left = there - points[:, 0]
        step = cv2.solve(J[:, :6].copy(), left.reshape(-1, 1), flags=cv2.DECOMP_QR)[1]
        vector, place = vector + step[:3], place + step[3:]
    return np.asarray(cv2.Rodrigues(vector)[0]), np.asarray(place[:, 0])


def _normal(
    rows: FloatArray, errors: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Return normal equations of an image, its Cauchy weights (L,), and its noise."""
    lengths = np.hypot(errors[::2], errors[1::2])
    sigma = sigma_of_lengths(np.sort(lengths), 6)
    weights = 1 / (1 + (lengths / (CAUCHY_WIDTH * sigma)) ** 2)
    weighted = rows.T * np.repeat(weights, 2)
    return weighted @ rows * DAMPING + RIDGE, weighted @ errors, weights, sigma


def fit_reprojection(
    problem: Reprojection,
    rotations: FloatArray,
    translations: FloatArray,
    *,
    is_near: bool = False,
) -> Poses:
    """Fit poses to the reprojection errors of any cameras, as `fit_poses`."""
    _require_seen(problem.pixels)
    R, t = rotations, translations
    if not is_near:
        R, t, _, _ = _descend(problem, R, t, robust=False, max_steps=3)
    return _poses_at(*_descend(problem, R, t, robust=True), robust=True)


def fit_paper_poses(
    camera: Camera,
    pen: Pen,
    pixels: FloatArray,
    rotations: FloatArray,
    translations: FloatArray,
) -> Poses:
    """Fit poses as the paper does: equations (5) to (8), then Gauss-Newton.

    Works on undistorted image points and projected LED centres; no LED is weighted
    down. Where the linear equations cannot be solved (fewer than six LEDs seen, or all
    in one plane), the given poses start the iteration instead.

    Parameters
    ----------
    pixels : (N, L, 2) array
        Image points of the LEDs, px; NaN where an LED was not seen.
    rotations, translations : (N, 3, 3) and (N, 3) array
        Start for images without a linear solution, cam_from_pen, mm.
    """
    _require_seen(pixels)
    normalised = np.full_like(pixels, np.nan)
    seen = np.isfinite(pixels[..., 0])
    normalised[seen] = camera.unproject(pixels[seen])
    R, t, solved = _linear_poses(pen.leds, normalised)
    R = np.where(solved[:, None, None], R, rotations)
    t = np.where(solved[:, None], t, translations)
    ideal = replace(camera, distortion=np.zeros(5), lens=LensModel.BROWN)
    undistorted = ideal.pixels(normalised)
    problem = CameraReprojection(ideal, pen.leds, pen.normals, 0.0, undistorted)
    return _poses_at(*_descend(problem, R, t, robust=False), robust=False)


def start_poses(
    camera: Camera, pen: Pen, pixels: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return rough poses of labelled LEDs, to start an iteration from [1]_.

    They are cam_from_pen, (N, 3, 3) and (N, 3), mm; NaN where no pose puts the LEDs
    before the camera. ``pixels`` (N, L, 2) are image points, px, NaN where an LED was
    not seen; every image needs four.

    References
    ----------
    .. [1] G. Terzakis, M. Lourakis, "A consistently fast and globally optimal solution
       to the perspective-n-point problem", ECCV 2020 (OpenCV's SQPNP).
    """
    _require_seen(pixels)
    rotations = np.full((len(pixels), 3, 3), np.nan)
    translations = np.full((len(pixels), 3), np.nan)
    for i, points in enumerate(camera.unproject(pixels)):
        seen = np.isfinite(points[:, 0])
        try:
            solved, vector, translation = cv2.solvePnP(
                pen.leds[seen], points[seen], np.eye(3), None, flags=cv2.SOLVEPNP_SQPNP
            )
        except cv2.error:  # points that coincide
            continue
        if solved and translation[2, 0] > 0:
            rotations[i] = rotation_from_vector(
                np.asarray(vector, dtype=np.float64)[:, 0]
            )
            translations[i] = translation[:, 0]
    return rotations, translations


@dataclass(frozen=True, eq=False)
class CameraReprojection:
    """Reprojection errors of discs in one camera; radius 0: of projected centres."""

    camera: Camera
    leds: FloatArray
    normals: FloatArray
    radius: float
    pixels: FloatArray

    def residuals_with_jacobian(
        self, R: FloatArray, t: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return residuals (N, L, 2), and d pixel / d (theta, dt), (N, L, 2, 6)."""
        lever = self.leds @ np.swapaxes(R, -1, -2)
        return disc_residuals(
            self.camera,
            lever,
            lever + t[:, None],
            self.normals @ np.swapaxes(R, -1, -2),
            self.radius,
            self.pixels,
        )


def _require_seen(pixels: FloatArray) -> None:
    n_seen = np.isfinite(pixels[..., 0]).sum(axis=1)
    if np.any(n_seen < MIN_POSE_LEDS):
        raise ValueError(
            f"Every image needs {MIN_POSE_LEDS} LEDs, one has {n_seen.min()}."
        )


def _descend(
    problem: Reprojection,
    R: FloatArray,
    t: FloatArray,
    *,
    robust: bool,
    max_steps: int = MAX_STEPS,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return poses after Gauss-Newton steps, with residuals and derivatives there."""
    for _ in range(max_steps):
        residuals, J = problem.residuals_with_jacobian(R, t)
        distances = np.sqrt(np.einsum("ni,ni->n", t, t))
        step = _step(residuals, J, distances, robust=robust)
        R = rotation_from_vector(step[:, :3]) @ R
        t = t + step[:, 3:]
        if _sizes(step, distances).max() < LINEAR:
            break
    return R, t, residuals - _moves(J, step), J


def _step(
    residuals: FloatArray, J: FloatArray, distances: FloatArray, *, robust: bool
) -> FloatArray:
    """Return the steps (N, 6) that fit linear models; weights follow the residuals."""
    weights = np.isfinite(residuals[..., 0]).astype(float)
    step: FloatArray = np.zeros((len(J), 6))
    left = residuals
    for _ in range(MAX_STEPS):
        if robust:
            weights = cauchy_weights(left, image_sigmas(left))
        H, g = normal_equations(J, left, weights)
        H = H * DAMPING + RIDGE
        change = np.asarray(np.linalg.solve(H, g[..., None])[..., 0], dtype=np.float64)
        step = step + change
        size = _sizes(change, distances)
        if not robust or not SETTLED < size.max() < LINEAR:
            break
        left = residuals - _moves(J, step)
    return step * (MAX_STEP / np.maximum(size, MAX_STEP))[:, None]


def _sizes(step: FloatArray, distances: FloatArray) -> FloatArray:
    """Return the sizes of steps (N, 6), rad."""
    turns, moves = np.sqrt(np.einsum("nij,nij->in", *2 * (step.reshape(-1, 2, 3),)))
    return np.asarray(np.maximum(turns, moves / distances))


def _moves(J: FloatArray, step: FloatArray) -> FloatArray:
    """Return the moves of modelled centres by steps (N, 6), (N, L, 2), px."""
    return np.asarray((J @ step[:, None, :, None])[..., 0])


def _poses_at(
    R: FloatArray, t: FloatArray, residuals: FloatArray, J: FloatArray, *, robust: bool
) -> Poses:
    """Return fitted poses with covariances, by residuals (N, L, 2) and derivatives."""
    sigma = robust_sigma(residuals, 6)
    weights = cauchy_weights(residuals, sigma if robust else np.inf)
    H, _ = normal_equations(J, residuals, weights)
    squares = np.where(weights > 0, np.einsum("nli,nli->nl", *2 * (residuals,)), 0.0)
    surplus = np.maximum(2 * weights.sum(axis=1) - 6, 1)
    own = np.einsum("nl,nl->n", weights, squares) / surplus
    # An image that is clearly worse than the others has its own noise.
    variances = np.where(own > (WORSE * sigma) ** 2, own, sigma**2)
    covariances: FloatArray = variances[:, None, None] * _inverse(H)
    return Poses(R, t, covariances, residuals, weights, sigma)


def _inverse(H: FloatArray) -> FloatArray:
    """Return the inverses of normal matrices (N, 6, 6), scaled to a unit diagonal.

    A small ridge keeps an image with wrong labels, which may not determine a pose, from
    stopping the others.
    """
    scale = np.sqrt(np.maximum(np.einsum("nii->ni", H), TINY))
    scales = scale[:, :, None] * scale[:, None, :]
    return np.asarray(np.linalg.inv(H / scales + RIDGE) / scales)


def _linear_poses(
    leds: FloatArray, normalised: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Solve equation (6) of the paper for a1 .. a11, and (8) for R and T.

    Coordinates are centred and scaled for the solution: with s the scale and c the
    centroid of the LEDs, A x = A' (x - c) / s.
    """
    n_images, n_leds = normalised.shape[:2]
    seen = np.isfinite(normalised[..., 0])
    center = leds.mean(axis=0)
    scale = float(np.sqrt(np.mean((leds - center) ** 2)))
    x = np.column_stack([(leds - center) / scale, np.ones(n_leds)])
    blocks = np.zeros((n_images, n_leds, 2, 11))
    blocks[:, :, 0, 0:4] = blocks[:, :, 1, 4:8] = x
    blocks[..., 8:] = -normalised[..., None] * x[:, None, :3]
    rows = np.where(seen[..., None, None], blocks, 0).reshape(n_images, -1, 11)
    right = np.nan_to_num(normalised).reshape(n_images, -1, 1)
    U, values, Vt = np.linalg.svd(rows, full_matrices=False)
    solved = (seen.sum(axis=1) >= 6) & (values[:, -1] > 1e-4 * values[:, 0])
    inverse = np.where(solved[:, None], 1 / np.maximum(values, 1e-300), 0)
    a = np.swapaxes(Vt, 1, 2) @ (inverse[..., None] * (np.swapaxes(U, 1, 2) @ right))
    a = np.concatenate([a[..., 0], np.ones((n_images, 1))], axis=1)
    A = a.reshape(n_images, 3, 4)
    length = np.linalg.norm(A[:, 2, :3], axis=1)
    t_z = scale / np.where(solved, length, 1)  # eq. (8): (r7, r8, r9) has unit length
    R = nearest_rotation(
        np.where(solved[:, None, None], A[:, :, :3], np.eye(3)) * t_z[:, None, None]
    )
    t: FloatArray = A[:, :, 3] * t_z[:, None] - np.einsum("nij,j->ni", R, center)
    return R, t, solved
