"""The paper's second stage: tip and cone from poses by the general inverse method.

Kept exactly as published, with its convergence record. The residual of image i is the
distance

    f_i = |R_i x0 + T_i - u0|                                              (3)

and the iteration (9) to (12) of [1]_ minimises the sum of its squares. The optimum
equals linear least squares on eq. (2), the algebraic one-step method.

References
----------
.. [1] S. Liu et al., "Portable light pen 3D vision coordinate measuring system probe
   tip center calibration", Measurement Science Review 13 (2013) 194-199.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.pose import CameraReprojection
from lightpen.detection.robust_residuals import normal_equations
from lightpen.errors import CalibrationError
from lightpen.estimation.pivot.pivot import contact_matrix
from lightpen.model.camera import Camera
from lightpen.model.coverage import require_spread
from lightpen.model.pen import Pen

N_START = 6  # images of the linear start
STEP_TOLERANCE = 1e-9  # mm, of |alpha dX|
MAX_STEPS = 500
TINY = 1e-12  # mm; a shorter distance has no direction


@dataclass(frozen=True, eq=False)
class TwoStageFit:
    """Tip and cone by the paper's method, with the record of its convergence."""

    tip_pen: FloatArray  # (3,), (x0, y0, z0), mm
    cone_cam: FloatArray  # (3,), (u0, v0, w0), mm
    # (N, 3), where each pose puts the tip, minus ``cone_cam``, mm
    residuals: FloatArray
    iterates: FloatArray  # (K + 1, 6), X(k), the linear start first, mm
    objectives: FloatArray  # (K + 1,), sum of the squared distances at X(k), mm^2
    step_lengths: FloatArray  # (K,), alpha_k
    increments: FloatArray  # (K,), ``|alpha_k dX(k)|``, mm

    @property
    def rms(self) -> float:
        """Root mean square distance of the tip from the cone point, mm."""
        return float(np.sqrt(self.objectives[-1] / len(self.residuals)))


def fit_two_stage(rotations: FloatArray, translations: FloatArray) -> TwoStageFit:
    """Find tip and cone from poses cam_from_pen, mm, as the paper does.

    Raises `CalibrationError` if there are fewer than six poses, or they turn too little
    to fix the tip.
    """
    n_poses = len(rotations)
    if n_poses < N_START:
        raise CalibrationError(
            "two-stage.too-few-poses", n_poses=n_poses, needed=N_START
        )
    require_spread(rotations)
    M = contact_matrix(rotations)
    X = _linear_start(M, translations)
    rows, constant = M.reshape(-1, 6), translations.ravel()
    normal = rows.T @ rows
    iterates, step_lengths, increments = [X], [], []
    deviations = rows @ X + constant
    objectives = [float(deviations @ deviations)]
    for _ in range(MAX_STEPS):
        each = deviations.reshape(-1, 3)
        f = np.sqrt(np.einsum("ni,ni->n", each, each))
        directions = each / np.maximum(f, TINY)[:, None]
        A = (directions[:, None] @ M)[:, 0]  # eq. (10)
        gradient = deviations @ rows  # A^T f, as f times a direction is the deviation
        dX = _solved(A.T @ A, gradient)
        # Along dX the objective is a parabola, so its minimum is known.
        alpha = float(dX @ gradient) / max(float(dX @ normal @ dX), TINY**2)
        step = alpha * dX
        X = X - step  # eq. (11)
        deviations = rows @ X + constant
        iterates.append(X)
        objectives.append(float(deviations @ deviations))
        step_lengths.append(alpha)
        increments.append(float(np.sqrt(step @ step)))
        if increments[-1] < STEP_TOLERANCE:
            break
    return TwoStageFit(
        tip_pen=X[:3],
        cone_cam=X[3:],
        residuals=deviations.reshape(-1, 3),
        iterates=np.array(iterates),
        objectives=np.array(objectives),
        step_lengths=np.array(step_lengths),
        increments=np.array(increments),
    )


def _solved(normal: FloatArray, right: FloatArray) -> FloatArray:
    """Solve normal equations, also where exact poses leave nothing to solve."""
    try:
        return np.asarray(np.linalg.solve(normal, right))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.lstsq(normal, right)[0])


def projection_bias(
    camera: Camera,
    pen: Pen,
    rotations: FloatArray,
    translations: FloatArray,
    seen: BoolArray,
) -> FloatArray:
    """Return the error of tip and cone by equation (5), (6,), mm.

    The equation takes the centre of an LED's image for the image of its centre. To
    first order, at the poses cam_from_pen, mm, of images with the LEDs ``seen`` (N, L).
    """
    nowhere = np.where(seen[..., None], 0.0, np.nan)
    discs, centres = (
        CameraReprojection(camera, pen.leds, pen.normals, radius, nowhere)
        for radius in (pen.diameter / 2, 0.0)
    )
    modelled, J = centres.residuals_with_jacobian(rotations, translations)
    offsets = modelled - discs.residuals_with_jacobian(rotations, translations)[0]
    H, g = normal_equations(J, offsets, seen.astype(float))
    step = np.linalg.solve(H, g[..., None])[..., 0]
    M = contact_matrix(rotations)
    tip = np.linalg.lstsq(M.reshape(-1, 6), -translations.ravel())[0][:3]
    moved = np.cross(step[:, :3], rotations @ tip) + step[:, 3:]
    return np.asarray(np.linalg.lstsq(M.reshape(-1, 6), -moved.ravel())[0])


def _linear_start(M: FloatArray, translations: FloatArray) -> FloatArray:
    """Solve eq. (2) for six images spread over the swing."""
    six = np.linspace(0, len(M) - 1, N_START).round().astype(int)
    solution: FloatArray = np.linalg.lstsq(
        M[six].reshape(-1, 6), -translations[six].ravel()
    )[0]
    return solution
