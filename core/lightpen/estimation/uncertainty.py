"""What the tip is worth: covariance, repeatability between blocks, halves, weakness.

The joint fit states the covariance that independent image noise leaves. Real residuals
hang together from image to image. Two figures tell by how much that raises the
covariance: the scatter between blocks of consecutive images (cluster-robust, [1]_), and
the lag-1 autocorrelation rho of the images' scores, which makes the variance of a mean
(1 + rho) / (1 - rho) times larger. The larger one counts, where it is significant. LED
geometry and the camera's own calibration add their parts, as the GUM [2]_ combines
independent components.

References
----------
.. [1] A. C. Cameron, D. L. Miller, "A practitioner's guide to cluster-robust
   inference", J. Human Resources 50 (2015) 317-372.
.. [2] JCGM 100:2008, "Guide to the expression of uncertainty in measurement", 5.1, 6.2.
"""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.geometry import GeometryFit
from lightpen.estimation.joint import ContactModel, JointFit, reduce
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen

COVERAGE_FACTOR = 2.0  # k of the expanded uncertainty
MAX_BLOCKS = 10
MIN_BLOCK_SIZE = 3
Z_99 = 2.326  # normal quantile: blocks count only beyond their own chance of 1 %


@dataclass(frozen=True, eq=False)
class Budget:
    """Covariance of (tip_pen, cone_cam) and what it is made of, (6, 6), mm^2.

    Attributes
    ----------
    noise : (6, 6) array
        From image noise, independent between images.
    blocks : (6, 6) array or None
        From the scatter between blocks of consecutive images; None with too few images.
    block_ratio : float
        Variance between blocks over that of independent noise, 1 on average.
    autocorrelation : float
        Lag-1 autocorrelation of what the images say of tip and cone.
    correlation_factor : float
        What ``noise`` is multiplied by: the larger of ``block_ratio`` and
        ``(1 + rho) / (1 - rho)``, each where significant, else 1.
    leds : (6, 6) array
        From the LED geometry.
    camera : (6, 6) array
        From the covariance of the camera's calibration; zero where not given.
    """

    noise: FloatArray
    blocks: FloatArray | None
    block_ratio: float
    autocorrelation: float
    correlation_factor: float
    leds: FloatArray
    camera: FloatArray

    @property
    def covariance(self) -> FloatArray:
        """Combined covariance of (tip_pen, cone_cam), (6, 6), mm^2."""
        return self.correlation_factor * self.noise + self.leds + self.camera

    @property
    def expanded_uncertainty(self) -> FloatArray:
        """U (k = 2) of tip_pen and cone_cam, (6,), mm."""
        return COVERAGE_FACTOR * np.sqrt(np.diag(self.covariance))

    @property
    def led_uncertainty(self) -> float:
        """U (k = 2) of the tip by the LED geometry alone, where it is largest, mm."""
        largest = np.linalg.eigvalsh(self.leds[:3, :3])[-1]
        return float(COVERAGE_FACTOR * np.sqrt(max(largest, 0.0)))

    @property
    def weakest_direction(self) -> FloatArray:
        """Unit vector of the pen frame along which the tip is known least."""
        _, vectors = np.linalg.eigh(self.covariance[:3, :3])
        weakest = vectors[:, -1]
        return np.asarray(weakest * np.sign(weakest[np.argmax(np.abs(weakest))]))

    @property
    def weakest_uncertainty(self) -> float:
        """U (k = 2) along the weakest direction, mm."""
        values = np.linalg.eigvalsh(self.covariance[:3, :3])
        return COVERAGE_FACTOR * float(np.sqrt(values[-1]))


@dataclass(frozen=True, eq=False)
class Halves:
    """Tip from the odd images against tip from the even ones.

    Attributes
    ----------
    difference : (3,) array
        Odd minus even, pen frame, mm.
    expanded_uncertainty : (3,) array
        U (k = 2) of the difference from image noise, mm.
    """

    difference: FloatArray
    expanded_uncertainty: FloatArray


def combine(
    camera: Camera, pen: Pen, pixels: FloatArray, geometry: GeometryFit
) -> Budget:
    """Combine the parts of the tip's uncertainty.

    Parameters
    ----------
    camera : Camera
        Its covariance enters where the camera file has one.
    pixels : (N, L, 2) array
        Ellipse centres of the LEDs in the order of capture, px.
    """
    joint = geometry.joint
    noise = joint.covariance
    blocks, ratio, blocks_count = _block_scatter(joint, noise)
    rho, rho_counts = _autocorrelation(joint, noise)
    return Budget(
        noise=noise,
        blocks=blocks,
        block_ratio=ratio,
        autocorrelation=rho,
        correlation_factor=max(
            1.0,
            ratio if blocks_count else 1.0,
            (1 + rho) / (1 - rho) if rho_counts else 1.0,
        ),
        leds=geometry.led_covariance,
        camera=_camera_part(camera, pen, pixels, geometry),
    )


def compare_halves(joint: JointFit) -> Halves:
    """Compare the tip of the odd images with that of the even ones."""
    steps, covariances = [], []
    for first in (0, 1):
        S = joint.information[first::2].sum(axis=0)
        steps.append(np.linalg.solve(S, joint.gradients[first::2].sum(axis=0)))
        covariances.append(np.linalg.inv(S))
    variances = np.diag(covariances[0] + covariances[1])[:3]
    return Halves(
        difference=(steps[0] - steps[1])[:3],
        expanded_uncertainty=COVERAGE_FACTOR * np.sqrt(variances),
    )


def _block_scatter(
    joint: JointFit, noise: FloatArray
) -> tuple[FloatArray | None, float, bool]:
    """Return the covariance from blocks, its ratio to the noise's, and significance."""
    n_images = len(joint.information)
    n_blocks = min(MAX_BLOCKS, n_images // MIN_BLOCK_SIZE)
    if n_blocks < 3:
        return None, 1.0, False
    scores = np.array(
        [part.sum(axis=0) for part in np.array_split(joint.gradients, n_blocks)]
    )
    scores -= scores.mean(axis=0)
    scatter = scores.T @ scores * n_blocks / (n_blocks - 1)
    blocks = noise @ scatter @ noise
    ratio = float(np.trace(noise @ scatter)) / 6
    n_free = 6 * (n_blocks - 1)
    return blocks, ratio, ratio > _chi_square_quantile_99(n_free) / n_free


def _autocorrelation(joint: JointFit, noise: FloatArray) -> tuple[float, bool]:
    """Return the lag-1 autocorrelation of what images say of the tip; significance.

    Six components share one coefficient; they count as half as many, as few of them
    carry most of the information.
    """
    whitened = joint.gradients @ np.linalg.cholesky(noise)
    total = float(np.sum(whitened**2))
    lagged = float(np.sum(whitened[1:] * whitened[:-1]))
    rho = lagged / total if total > 0 else 0.0
    return rho, rho > Z_99 / np.sqrt(3 * len(whitened))


def _chi_square_quantile_99(n_free: int) -> float:
    """Return the 99 % quantile of chi-square (Wilson and Hilferty, 1931)."""
    spread = 2 / (9 * n_free)
    return float(n_free * (1 - spread + Z_99 * np.sqrt(spread)) ** 3)


def _camera_part(
    camera: Camera, pen: Pen, pixels: FloatArray, geometry: GeometryFit
) -> FloatArray:
    """Carry the covariance of the intrinsics over to tip and cone."""
    if camera.covariance is None:
        return np.zeros((6, 6))
    joint = geometry.joint
    model = ContactModel(camera, pen, pixels)
    state = model.at(joint.rotations, joint.tip_pen, joint.cone_cam)
    points = (pen.leds - joint.tip_pen) @ np.swapaxes(joint.rotations, 1, 2)
    points = points + joint.cone_cam
    by_intrinsics = camera.intrinsics_jacobian(points[..., :2] / points[..., 2:])
    weights = joint.used.astype(float)
    sensitivity = np.empty((6, by_intrinsics.shape[-1]))
    for k in range(sensitivity.shape[1]):
        shifted = replace(state, residuals=by_intrinsics[..., k])
        sensitivity[:, k] = reduce(shifted, weights).step()
    return np.asarray(sensitivity @ camera.covariance @ sensitivity.T)
