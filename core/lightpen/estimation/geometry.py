"""How true the LED geometry is, as the images themselves tell.

A swing sees every LED from all sides, so LED errors stand out of the noise: each LED's
residuals turn with the pen. The errors are taken as normal with one common standard
deviation, which is found by maximum likelihood (empirical Bayes [1]_). Where they are
significant, the LEDs become unknowns with that prior: the tip no longer takes on their
errors, and its covariance holds what the images cannot tell, above all the pen's scale.
Where they are not, the LEDs stay as they are, and the covariance holds the likeliest
errors all the same.

The tip is given in the frame in which the file's LEDs fit the true ones best. Moves of
the pen as a whole are no errors in that frame, and the prior keeps them at zero.

References
----------
.. [1] B. Efron, "Large-scale inference" (2010), chapter 1.
"""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.pose import normal_equations
from lightpen.estimation.joint import (
    TURN_RIDGE,
    ContactModel,
    JointFit,
    Linearised,
    fit_joint,
    symmetric_inverse,
)
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.model.rigid import skew

SIGNIFICANT = 10.83  # chi-square, 1 degree of freedom, at 0.001
PASSES = 2  # the first works with a noise that the LED errors have raised
FRAME_LOCK = 1e-6  # mm, standard deviation left to moves of the pen as a whole
SCALES = np.geomspace(1e-5, 1.0, 400)  # mm, standard deviations tried


@dataclass(frozen=True, eq=False)
class GeometryFit:
    """The joint fit with the LED geometry put right as far as the images tell.

    Attributes
    ----------
    joint : JointFit
        The fit with the corrected LEDs.
    corrections : (L, 3) array
        Added to the LEDs of the file, pen frame, mm; zero where not significant.
    led_sigma : float
        Standard deviation of one LED coordinate of the file, mm; 0 where the images
        show no significant errors.
    led_covariance : (6, 6) array
        What the LED geometry adds to the covariance of (tip_pen, cone_cam), mm^2.
    """

    joint: JointFit
    corrections: FloatArray
    led_sigma: float
    led_covariance: FloatArray


def fit_geometry(
    camera: Camera, pen: Pen, pixels: FloatArray, joint: JointFit
) -> GeometryFit:
    """Estimate the errors of the LED geometry and repeat the joint fit without them.

    Parameters
    ----------
    pixels : (N, L, 2) array
        Ellipse centres of the LEDs, px; NaN where an LED was not seen.
    joint : JointFit
        The joint fit of these images with the pen as it stands.
    """
    corrections = np.zeros_like(pen.leds)
    led_sigma, led_covariance = 0.0, np.zeros((6, 6))
    modes = _rigid_modes(pen.leds)
    frame_lock: FloatArray = modes @ modes.T / FRAME_LOCK**2
    for _ in range(PASSES):
        corrected = replace(pen, leds=pen.leds + corrections)
        model = ContactModel(camera, corrected, pixels)
        state = model.at(joint.rotations, joint.tip_pen, joint.cone_cam)
        system = _LedSystem.build(state, joint)
        right = system.right + system.S @ corrections.ravel()
        led_sigma, significant = _prior_sigma(system.S, right)
        if not significant:
            led_covariance = system.uncorrected_covariance(led_sigma, modes)
            led_sigma = 0.0
            break
        prior: FloatArray = frame_lock + np.eye(len(right)) / led_sigma**2
        corrections = np.asarray(
            np.linalg.solve(system.S + prior, right), dtype=np.float64
        ).reshape(-1, 3)
        corrected = replace(pen, leds=pen.leds + corrections)
        joint = fit_joint(
            camera, corrected, pixels, joint.rotations, joint.tip_pen, joint.cone_cam
        )
        led_covariance = system.led_covariance(prior)
    return GeometryFit(joint, corrections, led_sigma, led_covariance)


def _rigid_modes(leds: FloatArray) -> FloatArray:
    """Return the moves of all LEDs as one body, orthonormal columns (3 L, 6)."""
    shifts = np.tile(np.eye(3), (len(leds), 1))
    turns = -skew(leds - leds.mean(axis=0)).reshape(-1, 3)
    return np.asarray(np.linalg.qr(np.concatenate([shifts, turns], axis=1))[0])


@dataclass(frozen=True, eq=False)
class _LedSystem:
    """Normal equations of (tip, cone) and the LEDs, rotations eliminated, 1/mm^2."""

    tip: FloatArray  # (6, 6)
    coupling: FloatArray  # (6, 3 L)
    leds: FloatArray  # (3 L, 3 L)
    S: FloatArray  # (3 L, 3 L), tip and cone eliminated too
    right: FloatArray  # (3 L,)

    @classmethod
    def build(cls, state: Linearised, joint: JointFit) -> "_LedSystem":
        n_images, n_leds = joint.used.shape
        weights = joint.used / joint.sigma**2
        # Columns: turn (3), tip (3), cone (3), and the LED's own shift (3).
        by_led = state.jacobian[..., 6:9] @ state.rotations[:, None]
        J = np.concatenate([state.jacobian, by_led], axis=3)
        each, each_right = normal_equations(
            J.reshape(-1, 1, 2, 12),
            state.residuals.reshape(-1, 1, 2),
            weights.reshape(-1, 1),
        )
        each = each.reshape(n_images, n_leds, 12, 12)
        each_right = each_right.reshape(n_images, n_leds, 12)
        H, g = each.sum(axis=1), each_right.sum(axis=1)
        inverse = np.linalg.inv(H[:, :3, :3] + TURN_RIDGE / joint.sigma**2 * np.eye(3))
        # Rows of every other unknown against the turn of each image.
        to_turn = np.concatenate(
            [H[:, 3:9, :3], each[:, :, 9:, :3].reshape(n_images, -1, 3)], axis=1
        )
        n_unknowns = 6 + 3 * n_leds
        N = np.zeros((n_unknowns, n_unknowns))
        N[:6, :6] = H[:, 3:9, 3:9].sum(axis=0)
        N[:6, 6:] = each[:, :, 3:9, 9:].sum(axis=0).transpose(1, 0, 2).reshape(6, -1)
        N[6:, :6] = N[:6, 6:].T
        own = each[:, :, 9:, 9:].sum(axis=0)
        for j in range(n_leds):
            at = slice(6 + 3 * j, 9 + 3 * j)
            N[at, at] = own[j]
        folded = to_turn @ inverse
        N -= np.tensordot(folded, to_turn, axes=([0, 2], [0, 2]))
        b = np.concatenate([g[:, 3:9].sum(axis=0), each_right[:, :, 9:].sum(0).ravel()])
        b -= np.einsum("nij,nj->i", folded, g[:, :3])
        coupling = N[:6, 6:]
        gain = np.linalg.solve(N[:6, :6], coupling).T
        return cls(
            tip=N[:6, :6],
            coupling=coupling,
            leds=N[6:, 6:],
            S=N[6:, 6:] - gain @ coupling,
            right=b[6:] - gain @ b[:6],
        )

    def uncorrected_covariance(self, led_sigma: float, modes: FloatArray) -> FloatArray:
        """Return what LED errors add to the covariance where none is corrected."""
        gain = np.linalg.solve(self.tip, self.coupling)
        seen = gain - gain @ modes @ modes.T
        return led_sigma**2 * seen @ seen.T

    def led_covariance(self, prior: FloatArray) -> FloatArray:
        """Return what LEDs under a prior add to the covariance of tip and cone."""
        folded = self.coupling @ np.linalg.solve(self.leds + prior, self.coupling.T)
        with_leds = symmetric_inverse(self.tip - 0.5 * (folded + folded.T))
        return with_leds - symmetric_inverse(self.tip)


def _prior_sigma(S: FloatArray, right: FloatArray) -> tuple[float, bool]:
    """Return the likeliest standard deviation of the LED coordinates; significance.

    In the eigenvectors of S the right sides are independent and normal, with variance
    ``value^2 sigma^2 + value``.
    """
    values, vectors = np.linalg.eigh(S)
    seen = values > 1e-9 * values[-1]  # seven are zero: pen motion and scale
    values, projected = values[seen], (vectors.T @ right)[seen]
    sigmas = np.concatenate([[0.0], SCALES])
    excess = values * sigmas[:, None] ** 2 + 1
    costs = np.sum(np.log(excess) + projected**2 / (values * excess), axis=1)
    best = int(np.argmin(costs))
    return float(sigmas[best]), bool(costs[0] - costs[best] > SIGNIFICANT)
