"""The paper's second stage: tip and cone from poses by the general inverse method.

Kept exactly as published, with its convergence record, as the reference that every
result is shown against. The residual of image i is the distance

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

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.pivot.pivot import contact_matrix, tip_covariances
from lightpen.model.coverage import require_spread

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


def propagated_covariance(
    rotations: FloatArray, covariances: FloatArray, tip_pen: FloatArray
) -> FloatArray:
    """Return the covariance of (tip_pen, cone_cam), given that of poses, (6, 6), mm^2.

    Arguments as of `lightpen.estimation.pivot.pivot.tip_covariances`.
    """
    M = contact_matrix(rotations)
    inverse = np.linalg.inv(np.einsum("nki,nkj->ij", M, M))
    each = np.swapaxes(M, 1, 2) @ tip_covariances(rotations, covariances, tip_pen) @ M
    return np.asarray(inverse @ each.sum(axis=0) @ inverse)


def _linear_start(M: FloatArray, translations: FloatArray) -> FloatArray:
    """Solve eq. (2) for six images spread over the swing."""
    six = np.linspace(0, len(M) - 1, N_START).round().astype(int)
    solution: FloatArray = np.linalg.lstsq(
        M[six].reshape(-1, 6), -translations[six].ravel()
    )[0]
    return solution
