"""A calibrated camera: pinhole with distortion by Brown-Conrady or Kannala-Brandt.

A projection is three maps, each with its Jacobian: the perspective division
``(u, v, w) -> (u, v) / w``, the distortion of normalised points, and the affine map
to pixels. The distortion is OpenCV's model with 5 or 8 coefficients
``k1 k2 p1 p2 k3 [k4 k5 k6]``:

    r2 = x^2 + y^2
    g  = (1 + k1 r2 + k2 r2^2 + k3 r2^3) / (1 + k4 r2 + k5 r2^2 + k6 r2^3)
    x' = x g + 2 p1 x y + p2 (r2 + 2 x^2)
    y' = y g + p1 (r2 + 2 y^2) + 2 p2 x y

or that of Kannala and Brandt with 4 coefficients, see `lightpen.model.fisheye`.

References
----------
.. [1] D. C. Brown, "Close-range camera calibration", Photogrammetric Engineering 37
   (1971) 855-866.
.. [2] OpenCV, "Camera calibration and 3D reconstruction", section "Detailed
   description".
"""

from dataclasses import dataclass, field, replace
from datetime import date
from enum import StrEnum
from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np

from lightpen.arrays import BoolArray, FloatArray, Image
from lightpen.errors import CalibrationError
from lightpen.messages import Message, message
from lightpen.model import fisheye
from lightpen.model.fisheye import LensField
from lightpen.model.self_calibration import FoundCamera, are_shared

FEW = 200  # coordinates, up to which OpenCV is faster than numpy
NOWHERE, IDENTITY = np.zeros(3), np.eye(3)
UNDISTORT_STEPS = 20
# Of a step of Newton's method, in normalised units: what is left is about its square,
# less than 1e-8 px at any sensible focal length.
UNDISTORT_TOLERANCE = 1e-7
UNDISTORTED = (cv2.TERM_CRITERIA_COUNT, UNDISTORT_STEPS, 0.0)
FOLD_SAMPLES = 17  # along a side; a lens folds from the corners inwards


class LensModel(StrEnum):
    """Models of the distortion of a lens."""

    BROWN = "brown"
    KANNALA_BRANDT = "kannala-brandt"


def lens_model_of(n_coefficients: int) -> LensModel:
    """Return the model with this number of distortion coefficients."""
    is_fisheye = n_coefficients == fisheye.N_COEFFICIENTS
    return LensModel.KANNALA_BRANDT if is_fisheye else LensModel.BROWN


class PointMap(NamedTuple):
    """Image of points under a map, with the Jacobian at each."""

    points: FloatArray  # (..., 2)
    jacobian: FloatArray  # (..., 2, k), by the k coordinates of the input


@dataclass(frozen=True, eq=False)
class Camera:
    """Intrinsics of a camera."""

    width: int  # image size, px
    height: int
    fx: float  # focal length, px
    fy: float
    cx: float  # principal point, px; (0, 0) is the centre of the top-left pixel
    cy: float
    # (5,) or (8,) ``k1 k2 p1 p2 k3 [k4 k5 k6]``, or (4,) of Kannala and Brandt
    distortion: FloatArray = field(default_factory=lambda: np.zeros(5))
    covariance: FloatArray | None = None  # (4 + n, 4 + n), of the `intrinsics`
    calibrated_on: date | None = None
    serial: str = ""  # empty where its file does not say
    temperature_c: float | None = None  # at its calibration, degrees Celsius
    # Residual field beyond the distortion model, from the camera calibration. Not part
    # of the projection: `without_lens_field` removes it from observed pixels.
    lens_field: LensField | None = None
    lens: LensModel = LensModel.BROWN
    found: FoundCamera | None = None  # before the images that it was found from
    # Width and height before the binning and the region that its file states, px.
    unbinned_size: tuple[int, int] | None = None

    @property
    def distortion_names(self) -> tuple[str, ...]:
        """Names of the distortion coefficients."""
        if self.lens is LensModel.KANNALA_BRANDT:
            return ("k1", "k2", "k3", "k4")
        names = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
        return names[: len(self.distortion)]

    @property
    def image_size(self) -> tuple[int, int]:
        """Width and height of the images that the intrinsics are for, px."""
        return self.width, self.height

    def fits(self, image: Image) -> bool:
        """Return whether an image (H, W) has the size that the intrinsics are for."""
        return image.shape == (self.height, self.width)

    @property
    def matrix(self) -> FloatArray:
        """Camera matrix, (3, 3), px."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1.0]])

    @property
    def intrinsics(self) -> FloatArray:
        """``fx fy cx cy`` followed by the distortion coefficients."""
        return np.concatenate([[self.fx, self.fy, self.cx, self.cy], self.distortion])

    def with_intrinsics(self, values: FloatArray) -> "Camera":
        """Return the camera with other `intrinsics` of the same number."""
        fx, fy, cx, cy = values[:4].tolist()
        return replace(self, fx=fx, fy=fy, cx=cx, cy=cy, distortion=values[4:])

    def is_found_from(self, pixels: FloatArray) -> bool:
        """Return whether it was found from images with LED centres (N, L, 2)."""
        return self.found is not None and are_shared(self.found.marks, pixels)

    def before_images(self) -> "Camera":
        """Return the prior camera: intrinsics and covariance before the images."""
        if self.found is None:
            return self
        camera = self.with_intrinsics(self.found.intrinsics)
        return replace(camera, covariance=self.found.covariance)

    def without_lens_field(self, pixels: FloatArray) -> FloatArray:
        """Return observed pixels less the mean of the lens field, both (..., 2)."""
        if self.lens_field is None:
            return pixels
        return pixels - self.lens_field.at(pixels)

    def project(self, points_cam: FloatArray) -> FloatArray:
        """Return the pixels (..., 2) of points (..., 3), mm, in front of the camera."""
        return self.pixels(points_cam[..., :2] / points_cam[..., 2:])

    def project_with_jacobian(self, points_cam: FloatArray) -> PointMap:
        """Return the pixels of points (..., 3) in front of it, and d px / d mm."""
        inverse_depth = 1 / points_cam[..., 2]
        normalised = points_cam[..., :2] * inverse_depth[..., None]
        pixels = self.pixels_with_jacobian(normalised)
        J = np.empty((*points_cam.shape[:-1], 2, 3))
        J[..., :2] = pixels.jacobian * inverse_depth[..., None, None]
        J[..., 2] = -(J[..., 0] * normalised[..., :1] + J[..., 1] * normalised[..., 1:])
        return PointMap(pixels.points, J)

    def pixels(self, normalised: FloatArray) -> FloatArray:
        """Return the pixels of undistorted normalised points, both (..., 2)."""
        if self._is_for_opencv(normalised):
            return self._by_opencv(normalised).points
        r2 = np.einsum("...i,...i->...", normalised, normalised)
        factor = self._gain(r2) + normalised @ self._slopes
        return self._distorted_pixels(normalised, r2, factor)

    def pixels_with_jacobian(self, normalised: FloatArray) -> PointMap:
        """Return the pixels of undistorted normalised points, and the derivative, px.

        With n the point, r its distance from the axis and p = (p2, p1), Brown's model
        is ``n (gain(r^2) + 2 p n) + r^2 p``.
        """
        if self._is_for_opencv(normalised):
            return self._by_opencv(normalised)
        slopes = self._slopes
        r2 = np.einsum("...i,...i->...", normalised, normalised)
        gain = self._gain(r2)
        factor = gain + normalised @ slopes
        slope = 2 * self._gain_slope(r2, gain)
        of_factor = normalised * slope[..., None] + slopes
        J = normalised[..., :, None] * of_factor[..., None, :]
        J += slopes[:, None] * normalised[..., None, :]
        J[..., 0, 0] += factor
        J[..., 1, 1] += factor
        J *= np.array([[self.fx], [self.fy]])
        return PointMap(self._distorted_pixels(normalised, r2, factor), J)

    def _is_for_opencv(self, normalised: FloatArray) -> bool:
        return self.lens is LensModel.BROWN and 0 < normalised.size <= FEW

    @cached_property
    def opencv(self) -> tuple[FloatArray, FloatArray]:
        """Camera matrix and distortion, as OpenCV takes them."""
        return self.matrix, np.asarray(self.distortion, dtype=np.float64)

    def _by_opencv(self, normalised: FloatArray) -> PointMap:
        """Return `pixels_with_jacobian` of a few points, a quarter of its time."""
        points = np.ones((normalised.size // 2, 3))
        points[:, :2] = normalised.reshape(-1, 2)
        pixels, J = cv2.projectPoints(points, NOWHERE, NOWHERE, *self.opencv)
        by_point = np.asarray(J, dtype=np.float64)[:, 3:5]  # by a shift of the camera
        return PointMap(
            np.asarray(pixels, dtype=np.float64).reshape(normalised.shape),
            by_point.reshape(*normalised.shape, 2),
        )

    @property
    def _slopes(self) -> FloatArray:
        """Change of the tangential factor by the normalised point, (2,)."""
        return 2 * self._tangential

    @property
    def _tangential(self) -> FloatArray:
        """Tangential coefficients ``p2 p1``, (2,)."""
        if self.lens is LensModel.KANNALA_BRANDT:
            return np.zeros(2)
        return self.distortion[3:1:-1]

    def _gain(self, r2: FloatArray) -> FloatArray:
        """Return distorted over undistorted distance from the axis."""
        if self.lens is LensModel.KANNALA_BRANDT:
            return fisheye.gain(self.distortion, r2)
        return _radial_gain(self.distortion, r2)

    def _gain_slope(self, r2: FloatArray, gain: FloatArray) -> FloatArray:
        """Return d gain / d r2."""
        if self.lens is LensModel.KANNALA_BRANDT:
            return fisheye.gain_slope(self.distortion, r2, gain)
        return _radial_slope(self.distortion, r2, gain)

    def _distorted_pixels(
        self, normalised: FloatArray, r2: FloatArray, factor: FloatArray
    ) -> FloatArray:
        distorted = normalised * factor[..., None]
        distorted += r2[..., None] * self._tangential
        distorted *= np.array([self.fx, self.fy])
        distorted += np.array([self.cx, self.cy])
        return distorted

    def intrinsics_jacobian(self, normalised: FloatArray) -> FloatArray:
        """Return the derivative (..., 2, 4 + n) of the pixels by the `intrinsics`.

        It is taken at undistorted normalised points (..., 2).
        """
        x, y = normalised[..., 0], normalised[..., 1]
        r2 = x * x + y * y
        gain = self._gain(r2)
        focal_points = normalised * np.array([self.fx, self.fy])
        J = np.zeros((*normalised.shape, 4 + len(self.distortion)))
        J[..., 0, 2] = J[..., 1, 3] = 1
        if self.lens is LensModel.KANNALA_BRANDT:
            J[..., 0, 0], J[..., 1, 1] = x * gain, y * gain
            J[..., 4:] = (
                focal_points[..., None] * fisheye.gain_jacobian(r2)[..., None, :]
            )
            return J
        k4, k5, k6 = self.distortion[5:8] if len(self.distortion) == 8 else (0, 0, 0)
        denominator = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
        p1, p2 = self.distortion[2:4]
        J[..., 0, 0] = x * gain + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        J[..., 1, 1] = y * gain + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        for power, column in ((1, 4), (2, 5), (3, 8)):
            J[..., column] = focal_points * (r2**power / denominator)[..., None]
        J[..., 0, 6], J[..., 1, 6] = 2 * self.fx * x * y, self.fy * (r2 + 2 * y * y)
        J[..., 0, 7], J[..., 1, 7] = self.fx * (r2 + 2 * x * x), 2 * self.fy * x * y
        if len(self.distortion) == 8:
            for power in (1, 2, 3):
                factor = -gain * r2**power / denominator
                J[..., 8 + power] = focal_points * factor[..., None]
        return J

    def unproject(self, pixels: FloatArray) -> FloatArray:
        """Return the undistorted normalised points ``(u / w, v / w)`` of pixels.

        NaN gives NaN. Raises `CalibrationError` where the coefficients fold the image.
        Directions of a fisheye that are more than 88 degrees off the axis are returned
        at 88 degrees, see `sees`.
        """
        return self.unproject_with_jacobian(pixels).points

    def unproject_with_jacobian(self, pixels: FloatArray) -> PointMap:
        """Return the undistorted normalised points of pixels, and the derivative, 1/px.

        Newton's method on `pixels_with_jacobian`; see `unproject`.
        """
        plane, found = self._unprojected(pixels)
        if not np.all(found | np.isnan(pixels[..., 0])):
            raise CalibrationError("camera.distortion-folds")
        return plane

    def _unprojected(self, pixels: FloatArray) -> tuple[PointMap, BoolArray]:
        """Return `unproject_with_jacobian`, and where it exists, (...)."""
        focal = np.array([self.fx, self.fy])
        normalised = (pixels - np.array([self.cx, self.cy])) / focal
        if self.lens is LensModel.KANNALA_BRANDT:
            return self._unprojected_fisheye(normalised)
        if self._is_for_opencv(pixels):
            near = cv2.undistortPointsIter(
                pixels.reshape(-1, 1, 2), *self.opencv, IDENTITY, IDENTITY, UNDISTORTED
            )
            normalised = np.asarray(near, dtype=np.float64).reshape(pixels.shape)
        missing = np.isnan(pixels)
        with np.errstate(all="ignore"):  # of what diverges, there is none
            for _ in range(UNDISTORT_STEPS):
                there = self.pixels_with_jacobian(normalised)
                inverse = _inverse_2x2(there.jacobian)
                step = np.einsum("...ij,...j->...i", inverse, pixels - there.points)
                normalised = normalised + step
                close = np.abs(step) < UNDISTORT_TOLERANCE
                if (close | missing).all():
                    break
            found = close.all(axis=-1) & ~_is_folded(there.jacobian)
        return PointMap(normalised, inverse), found

    def _unprojected_fisheye(self, distorted: FloatArray) -> tuple[PointMap, BoolArray]:
        """Return undistorted points and derivative of distorted points of a fisheye."""
        distances = np.linalg.norm(distorted, axis=-1)
        angles = fisheye.angles(self.distortion, distances)
        scale = np.where(
            distances > 1e-12,
            np.tan(angles) / np.where(distances > 1e-12, distances, 1),
            1,
        )
        normalised = distorted * scale[..., None]
        J = self.pixels_with_jacobian(normalised).jacobian
        return PointMap(normalised, _inverse_2x2(J)), ~np.isnan(angles)

    @cached_property
    def folded_share(self) -> float:
        """Share of the image where the distortion has no inverse."""
        grid = np.meshgrid(
            np.linspace(0, self.width - 1, FOLD_SAMPLES),
            np.linspace(0, self.height - 1, FOLD_SAMPLES),
        )
        return 1 - float(np.mean(self._unprojected(np.stack(grid, axis=-1))[1]))

    def sees(self, pixels: FloatArray) -> BoolArray:
        """Tell which pixels (..., 2) are images of directions before the camera.

        The corners of a fisheye's image may not be, nor what lies beyond a fold of the
        distortion.
        """
        if self.lens is LensModel.KANNALA_BRANDT:
            focal = np.array([self.fx, self.fy])
            distorted = (pixels - np.array([self.cx, self.cy])) / focal
            distances = np.linalg.norm(distorted, axis=-1)
            return fisheye.is_within(self.distortion, distances) & ~np.isnan(
                fisheye.angles(self.distortion, distances)
            )
        if self.folded_share == 0:
            return np.ones(pixels.shape[:-1], dtype=np.bool_)
        return np.asarray(self._unprojected(pixels)[1])

    def cropped(self, x: int, y: int, width: int, height: int) -> "Camera":
        """Return the camera of images that are cut from its own, px."""
        return self._resampled(1, 1, width, height, np.array([x, y], dtype=float))

    def binned(self, horizontal: int, vertical: int) -> "Camera":
        """Return the camera of images whose pixels are so many of its own in one."""
        width, height = self.width // horizontal, self.height // vertical
        return self._resampled(horizontal, vertical, width, height, np.zeros(2))

    def _resampled(
        self, horizontal: int, vertical: int, width: int, height: int, first: FloatArray
    ) -> "Camera":
        """Return the camera of images whose first pixel begins at a pixel of its own.

        What was measured of a lens field, and from which images it was found, are of
        the whole images, and are lost.
        """
        ratio = np.array([horizontal, vertical])
        centre = (np.array([self.cx, self.cy]) + 0.5 - first) / ratio - 0.5
        scales = np.ones(len(self.intrinsics))
        scales[:4] = 1 / np.tile(ratio, 2)
        field = self.lens_field
        if field is not None:
            size = float(np.sqrt(horizontal * vertical))
            field = LensField.of(
                width, height, field.amplitude / size, field.length / size
            )
        return replace(
            self,
            width=width,
            height=height,
            fx=self.fx / horizontal,
            fy=self.fy / vertical,
            cx=float(centre[0]),
            cy=float(centre[1]),
            covariance=None
            if self.covariance is None
            else scales[:, None] * self.covariance * scales,
            lens_field=field,
            found=None,
        )


def _radial_gain(distortion: FloatArray, r2: FloatArray) -> FloatArray:
    k1, k2, _, _, k3 = distortion[:5].tolist()
    gain = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    if len(distortion) == 8:
        k4, k5, k6 = distortion[5:8].tolist()
        gain = gain / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    return np.asarray(gain)


def _radial_slope(
    distortion: FloatArray, r2: FloatArray, gain: FloatArray
) -> FloatArray:
    """Return d gain / d r2."""
    k1, k2, _, _, k3 = distortion[:5].tolist()
    slope = k1 + r2 * (2 * k2 + r2 * 3 * k3)
    if len(distortion) == 8:
        k4, k5, k6 = distortion[5:8].tolist()
        denominator = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
        slope = (slope - gain * (k4 + r2 * (2 * k5 + r2 * 3 * k6))) / denominator
    return np.asarray(slope)


def _is_folded(jacobians: FloatArray) -> BoolArray:
    """Return where a distortion is not invertible, beyond its valid field."""
    a, b = jacobians[..., 0, 0], jacobians[..., 0, 1]
    c, d = jacobians[..., 1, 0], jacobians[..., 1, 1]
    return np.asarray((a <= 0) | (d <= 0) | (a * d - b * c <= 0))


def _inverse_2x2(matrices: FloatArray) -> FloatArray:
    a, b = matrices[..., 0, 0], matrices[..., 0, 1]
    c, d = matrices[..., 1, 0], matrices[..., 1, 1]
    inverse = np.empty_like(matrices)
    inverse[..., 0, 0], inverse[..., 0, 1] = d, -b
    inverse[..., 1, 0], inverse[..., 1, 1] = -c, a
    inverse /= (a * d - b * c)[..., None, None]
    return inverse


OLDEST = 365  # days
# A lens of 25 mm on an aluminium mount: 0.01 % of focal length in 5 K, by which a file
# of 24 views of a board is off as well.
LARGEST_WARMTH = 5.0  # K


def unmodelled_effects_of(
    camera: Camera, today: date, temperature_c: float | None = None, serial: str = ""
) -> tuple[Message, ...]:
    """Return why the intrinsics of a camera may no longer be valid.

    Temperature, degrees Celsius, and serial number are those at the station; what the
    file or the station does not state is not checked.
    """
    doubts = []
    if camera.folded_share:
        share = 100 * camera.folded_share
        doubts.append(message("camera-validity.fold", share=share))
    if camera.serial and serial and camera.serial.casefold() != serial.casefold():
        doubts.append(
            message("camera-validity.serial", stated=camera.serial, used=serial)
        )
    if camera.calibrated_on is not None:
        age = (today - camera.calibrated_on).days
        if age > OLDEST:
            doubts.append(
                message(
                    "camera-validity.age", age=age, day=camera.calibrated_on.isoformat()
                )
            )
    if camera.temperature_c is not None and temperature_c is not None:
        warmth = temperature_c - camera.temperature_c
        if abs(warmth) > LARGEST_WARMTH:
            doubts.append(
                message(
                    "camera-validity.temperature",
                    stated=camera.temperature_c,
                    used=temperature_c,
                )
            )
    return tuple(doubts)
