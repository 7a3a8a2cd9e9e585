"""Pivot calibration: the tip of a pen from poses that swing about it.

While the tip rests at one place every pose i gives three equations

    R_i tip_pen + t_i = pivot_cam

linear in the six unknowns. `fit_pivot` solves all of them together, weighted by the
covariance of each pose where it is known, and finds the poses that do not belong.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import default_rng

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.pose import CameraReprojection
from lightpen.detection.robust_residuals import normal_equations
from lightpen.errors import CalibrationError
from lightpen.model.camera import Camera
from lightpen.model.coverage import chi_quantile, require_spread
from lightpen.model.pen import Pen
from lightpen.model.rigid import skew

MIN_POSES = 6  # the paper starts from six images
N_SAMPLES = 300  # of four poses; 40 % outliers leave no clean one with 1e-18
SAMPLE_SIZE = 4
FEW = 12  # poses; four of them predict the others too poorly
SHARE_OF_FEW = 0.75  # of so few poses: size of a sample
MINORITY = 0.4  # of the poses, that agree at least
OUTLIER = 1e-5  # probability that a correct pose is excluded
LOOSE_THRESHOLD = 8.0  # where covariances are not given: real trackers have heavy tails
MAX_PASSES = 20
MAX_EXCESS = 5.0  # scatter of the tip over what the covariances of the poses explain
MAX_SCATTER = 0.2  # mm rms; less is passed whatever the covariances say
TINY = 1e-12  # mm; exact poses have no scatter


@dataclass(frozen=True, eq=False)
class PivotFit:
    """Tip of a pen, and the point that it pivots about."""

    tip_pen: FloatArray  # (3,), tip in the pen frame, mm
    pivot_cam: FloatArray  # (3,), point the tip rested on, in the camera frame, mm
    # (6, 6), of (tip_pen, pivot_cam) by independent noise of the poses, mm^2.
    covariance: FloatArray
    # (N, 3), where each pose puts the tip, minus ``pivot_cam``, camera frame, mm
    residuals: FloatArray
    # (N,), length of the residuals in standard deviations, 1.73 on average.
    distances: FloatArray
    used: BoolArray  # (N,), poses that agree with the pivot; the others were left out

    @property
    def rms(self) -> float:
        """Root mean square of the components of the residuals of used poses, mm."""
        return float(np.sqrt(np.mean(self.residuals[self.used] ** 2)))


def fit_pivot(
    rotations: FloatArray,
    translations: FloatArray,
    covariances: FloatArray | None = None,
    *,
    robust: bool = True,
) -> PivotFit:
    """Fit tip and pivot to poses by linear least squares.

    Without covariances all equations weigh the same: the algebraic one-step method
    [1]_. A robust fit starts from the best of many small samples [2]_, then keeps the
    poses within the outlier threshold until their set no longer changes.

    Raises `CalibrationError` if there are too few poses, they turn too little to fix
    the tip, or the tip moved by far more than the covariances allow.

    Parameters
    ----------
    rotations, translations : (N, 3, 3) and (N, 3) array
        Poses cam_from_pen, mm.
    covariances : (N, 6, 6) array, optional
        Of each pose's (theta, dt) in rad and mm, see `lightpen.detection.pose`.
    robust : bool
        Leave out poses that do not agree with the pivot of the others.

    References
    ----------
    .. [1] Z. Yaniv, "Which pivot calibration?", Proc. SPIE 9415 (2015) 941527.
    .. [2] P. J. Rousseeuw, "Least median of squares regression", J. American
       Statistical Association 79 (1984) 871-880.
    """
    require_poses(rotations)
    equations = _Equations(rotations, translations, covariances)
    every = np.ones(len(rotations), dtype=bool)
    if not robust:
        return equations.fit(every, every)
    first = _best_sample(equations, MINORITY)
    used = equations.inliers(first, every, MINORITY)
    for _ in range(MAX_PASSES):
        require_poses(rotations[used])
        inliers = equations.inliers(equations.solve_weighted(used), used)
        if np.array_equal(inliers, used):
            break
        used = inliers
    fit = equations.fit(used, inliers)
    if covariances is not None:
        _require_steadiness(fit)
    return fit


@dataclass(frozen=True, eq=False)
class _Equations:
    rotations: FloatArray
    translations: FloatArray
    covariances: FloatArray | None

    def fit(self, used: BoolArray, inliers: BoolArray) -> PivotFit:
        """Solve over the used poses."""
        solution = self.solve_weighted(used)
        residuals = self.residuals(solution)
        distances = self.distances(solution)
        n_free = 3 * int(used.sum()) - 6
        variance = max(float(np.sum(distances[used] ** 2)) / n_free, TINY**2)
        if self.covariances is None:
            distances = distances / np.sqrt(variance)
        else:
            variance = max(variance, 1.0)
        H, _ = self.normal_equations(used[None], solution[:3])
        return PivotFit(
            tip_pen=solution[:3],
            pivot_cam=solution[3:],
            covariance=variance * np.linalg.inv(H[0]),
            residuals=residuals,
            distances=distances,
            used=inliers,
        )

    def solve_weighted(self, used: BoolArray) -> FloatArray:
        """Return the solution (6,) over the used poses."""
        solution = self.solve(used[None])[0]
        if self.covariances is not None:
            for _ in range(2):  # the weights hardly depend on the tip
                solution = self.solve(used[None], solution[:3])[0]
        return np.asarray(solution)

    def inliers(
        self, solution: FloatArray, used: BoolArray, share: float = 0.5
    ) -> BoolArray:
        """Return the mask of the inliers.

        The distance within which a share of the used poses lies sets the unit, so that
        a model that fits worse than the covariances say (geometry errors, a worn cone)
        does not cost good poses.
        """
        distances = self.distances(solution)
        unit = float(np.quantile(distances[used], share)) / chi_quantile(3, 1 - share)
        if self.covariances is None:
            return np.asarray(distances <= LOOSE_THRESHOLD * max(unit, TINY))
        return np.asarray(distances <= outlier_distance() * max(unit, 1.0))

    def solve(self, used: BoolArray, tip_pen: FloatArray | None = None) -> FloatArray:
        """Return the solutions (S, 6) over S sets of poses, ``used`` (S, N)."""
        H, g = self.normal_equations(used, tip_pen)
        # A sample of too similar poses is singular: any finite answer will do.
        H = H + 1e-12 * np.trace(H, axis1=1, axis2=2)[:, None, None] * np.eye(6)
        return np.asarray(np.linalg.solve(H, g[..., None])[..., 0])

    def normal_equations(
        self, used: BoolArray, tip_pen: FloatArray | None
    ) -> tuple[FloatArray, FloatArray]:
        A = contact_matrix(self.rotations)
        # Shifted by the mean translation, which keeps the numbers small.
        center = self.translations.mean(axis=0)
        b = center - self.translations
        WA = A
        if self.covariances is not None and tip_pen is not None:
            covariances = tip_covariances(self.rotations, self.covariances, tip_pen)
            WA = np.linalg.inv(covariances) @ A
        H_each = np.swapaxes(WA, 1, 2) @ A
        g_each = np.einsum("nki,nk->ni", WA, b)
        H = np.tensordot(used.astype(float), H_each, axes=1)
        g = used @ g_each
        shift = np.concatenate([np.zeros(3), center])
        return H, g + H @ shift

    def residuals(self, solution: FloatArray) -> FloatArray:
        """Return the tip by each pose minus the pivot, (N, 3), mm."""
        return contact_residuals(
            self.rotations, self.translations, solution[:3], solution[3:]
        )

    def distances(self, solution: FloatArray) -> FloatArray:
        """Return the lengths of the residuals, in standard deviations if known."""
        residuals = self.residuals(solution)
        if self.covariances is None:
            return np.asarray(np.linalg.norm(residuals, axis=1))
        covariances = tip_covariances(self.rotations, self.covariances, solution[:3])
        return in_deviations(residuals, covariances)


def contact_matrix(rotations: FloatArray) -> FloatArray:
    """Return [R_i, -I], (N, 3, 6): the equations of tip and pivot are A x = -t_i."""
    minus_identity = np.broadcast_to(-np.eye(3), rotations.shape)
    return np.concatenate([rotations, minus_identity], axis=2)


def contact_residuals(
    rotations: FloatArray,
    translations: FloatArray,
    tip_pen: FloatArray,
    pivot_cam: FloatArray,
) -> FloatArray:
    """Return R_i tip_pen + t_i - pivot_cam, (N, 3), mm, by which the equations miss."""
    return rotations @ tip_pen + translations - pivot_cam


def outlier_distance() -> float:
    """Return the distance in standard deviations from which on a pose is an outlier."""
    return chi_quantile(3, OUTLIER)


def median_distance() -> float:
    """Return the median distance of poses that belong, standard deviations."""
    return chi_quantile(3, 0.5)


def in_deviations(residuals: FloatArray, covariances: FloatArray) -> FloatArray:
    """Return the lengths (N,) of residuals in standard deviations, 1.73 on average.

    Residuals are (N, 3), mm, covariances (N, 3, 3) or (3, 3), mm^2.
    """
    whitened = np.linalg.solve(covariances, residuals[..., None])[..., 0]
    squares: FloatArray = np.einsum("ni,ni->n", residuals, whitened)
    return np.sqrt(squares)


def tip_covariances(
    rotations: FloatArray, covariances: FloatArray, tip_pen: FloatArray
) -> FloatArray:
    """Return the covariances (N, 3, 3) of where poses put the tip, camera frame, mm^2.

    Rotations (N, 3, 3) are cam_from_pen, ``covariances`` (N, 6, 6) those of each pose's
    (theta, dt), rad and mm.
    """
    J = np.concatenate(
        [-skew(rotations @ tip_pen), np.broadcast_to(np.eye(3), rotations.shape)],
        axis=2,
    )
    return np.asarray(J @ covariances @ np.swapaxes(J, 1, 2))


def agreeing_solution(
    rotations: FloatArray, translations: FloatArray, share: float
) -> FloatArray:
    """Return tip and pivot (6,), mm, on which a share of the poses agrees best.

    All poses cam_from_pen, mm, weigh the same: least trimmed squares by concentration
    [1]_.

    References
    ----------
    .. [1] P. J. Rousseeuw, K. Van Driessen, "Computing LTS regression for large data
       sets", Data Mining and Knowledge Discovery 12 (2006) 29-45.
    """
    equations = _Equations(rotations, translations, None)
    n_kept = int(np.ceil(share * len(rotations)))
    solution = _best_sample(equations, share)
    for _ in range(MAX_PASSES):
        nearest = np.argsort(equations.distances(solution))[:n_kept]
        kept = np.zeros(len(rotations), dtype=bool)
        kept[nearest] = True
        concentrated = equations.solve(kept[None])[0]
        if np.array_equal(concentrated, solution):
            break
        solution = concentrated
    return solution


def _best_sample(equations: _Equations, share: float) -> FloatArray:
    """Return the solution, (6,), mm, of the sample that fits a share of poses best."""
    n_poses = len(equations.rotations)
    rng = default_rng(0)  # the same poses give the same tip
    size = SAMPLE_SIZE if n_poses > FEW else int(np.ceil(SHARE_OF_FEW * n_poses))
    order = np.argpartition(rng.random((N_SAMPLES, n_poses)), size, axis=1)
    members = np.zeros((N_SAMPLES, n_poses), dtype=bool)
    np.put_along_axis(members, order[:, :size], True, axis=1)
    solutions = equations.solve(members)
    tips = solutions[:, :3] @ equations.rotations.reshape(-1, 3).T
    residuals = tips.reshape(N_SAMPLES, -1, 3) + equations.translations
    residuals -= solutions[:, None, 3:]
    squares = np.einsum("sni,sni->sn", residuals, residuals)
    reached = np.quantile(squares, share, axis=1)
    return np.asarray(solutions[np.argmin(reached)])


def require_poses(rotations: FloatArray) -> None:
    """Raise `CalibrationError` if rotations (N, 3, 3) are too few or too small."""
    n_poses = len(rotations)
    if n_poses < MIN_POSES:
        raise CalibrationError("pivot.too-few-poses", n_poses=n_poses, needed=MIN_POSES)
    require_spread(rotations)


def _require_steadiness(fit: PivotFit) -> None:
    scatter = float(np.sqrt(np.mean(np.sum(fit.residuals[fit.used] ** 2, axis=1))))
    excess = float(np.median(fit.distances[fit.used])) / median_distance()
    if excess > MAX_EXCESS and scatter > MAX_SCATTER:
        raise CalibrationError("pivot.tip-moved", scatter=scatter, excess=excess)


# The paper's second stage: tip and cone from poses by the general inverse method.
#
# Kept exactly as published, with its convergence record. The residual of image i is the
# distance
#
#     f_i = |R_i x0 + T_i - u0|                                              (3)
#
# and the iteration (9) to (12) of [1]_ minimises the sum of its squares. The optimum
# equals linear least squares on eq. (2), the algebraic one-step method.
#
# References
# ----------
# .. [1] S. Liu et al., "Portable light pen 3D vision coordinate measuring system probe
#    tip center calibration", Measurement Science Review 13 (2013) 194-199.


N_START = 6  # images of the linear start
STEP_TOLERANCE = 1e-9  # mm, of |alpha dX|
MAX_STEPS = 500
SMALLEST_STEP = 1e-12  # mm; a shorter distance has no direction


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
        directions = each / np.maximum(f, SMALLEST_STEP)[:, None]
        A = (directions[:, None] @ M)[:, 0]  # eq. (10)
        gradient = deviations @ rows  # A^T f, as f times a direction is the deviation
        dX = _solved(A.T @ A, gradient)
        # Along dX the objective is a parabola, so its minimum is known.
        alpha = float(dX @ gradient) / max(float(dX @ normal @ dX), SMALLEST_STEP**2)
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
