"""The joint estimator: tip and cone from the LED images of all postures at once.

Unknowns are the tip x0 in the pen frame, the cone point u0 in the camera frame and one
rotation an image. LED j of image i lies at

    X_ij = R_i (x_j - x0) + u0

in the frame of the camera, or of the rig where several cameras look at once. So the
contact of tip and cone is built in and an image costs three unknowns, not six. The
reprojection errors of the ellipse centres are minimised by Gauss-Newton. The rotations
are eliminated image by image (Schur complement [1]_), which leaves a system of six
equations and the information of each image on tip and cone.

LEDs are weighed by a Cauchy loss until the iteration settles; it ends as least squares
on the LEDs below the outlier threshold, which loses nothing on normal noise.

References
----------
.. [1] B. Triggs et al., "Bundle adjustment - a modern synthesis", LNCS 1883 (2000)
   298-372, section 6.
"""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.rig_observations import derivatives_in_rig
from lightpen.detection.robust_residuals import (
    NOISE_FLOOR,
    cauchy_weights,
    disc_residuals,
    normal_equations,
    robust_sigma,
)
from lightpen.errors import CalibrationError
from lightpen.model.camera import Camera
from lightpen.model.coverage import inverse
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig, rig_of, rotation_from_vector

LEAST_SIGMA = 0.005  # px, for outliers; centres of dim discs are hardly better
OUTLIER = 5.0  # standard deviations; a normal vector in 2-D exceeds it in 4e-6
MIN_TURN_LEDS = 3  # in an image; fewer leave its rotation free
SETTLED = 1e-4  # mm, change of tip and cone after which the loss is dropped
CONVERGED = 1e-7  # mm
NEARLY = 1e-3  # mm, of a running fit; the step leaves less than a thousandth of it
MAX_STEPS = 50
MAX_SELECTIONS = 5
TURN_RIDGE = 1e-6  # px^2/rad^2 beside some 1e6; an image may lose all its LEDs
ONE_LED_RIDGE = 1e-10  # of the trace; an image with one LED rotates about it


@dataclass(frozen=True, eq=False)
class JointFit:
    """Tip and cone from all images together."""

    tip_pen: FloatArray  # (3,), tip in the pen frame, mm
    # (3,), cone point in the frame of the camera, or of the rig, mm
    cone_cam: FloatArray
    rotations: FloatArray  # (N, 3, 3), of cam_from_pen, or rig_from_pen
    # (N, L, 2). Observed minus modelled ellipse centres, px; NaN where an LED was not
    # seen. Of C cameras (N, C L, 2): the LEDs of one camera after those of the other.
    residuals: FloatArray
    # (N, L), LEDs below the outlier threshold; none of an image with fewer than three.
    used: BoolArray
    sigma: float  # standard deviation of one image coordinate, px
    # (N, 6, 6), of each image on (tip, cone), rotation eliminated, 1/mm^2.
    information: FloatArray
    # (N, 6), ``information`` times the step that the image alone would take, 1/mm
    gradients: FloatArray

    @property
    def covariance(self) -> FloatArray:
        """Covariance of (tip_pen, cone_cam) from image noise alone, (6, 6), mm^2."""
        return inverse(self.information.sum(axis=0))

    @property
    def rms(self) -> float:
        """Root mean square length of the residuals of used LEDs, px."""
        squares = np.sum(self.residuals**2, axis=2)
        return float(np.sqrt(np.mean(squares[self.used])))

    @property
    def image_rms(self) -> FloatArray:
        """The same of each image, px, (N,); NaN where no LED is used."""
        squares = np.sum(self.residuals**2, axis=2, where=self.used[..., None])
        n_used = self.used.sum(axis=1)
        means = squares.sum(axis=1) / np.maximum(n_used, 1)
        return np.where(n_used > 0, np.sqrt(means), np.nan)

    def of_camera(self, c: int, n_leds: int) -> "JointFit":
        """Return the fit with the residuals of the c-th camera alone."""
        own = slice(c * n_leds, (c + 1) * n_leds)
        return replace(self, residuals=self.residuals[:, own], used=self.used[:, own])

    @property
    def translations(self) -> FloatArray:
        """Translations of cam_from_pen that put the tip into the cone, (N, 3), mm."""
        return self.cone_cam - self.rotations @ self.tip_pen


def fit_contact(
    model: "ContactModel",
    rotations: FloatArray,
    tip_pen: FloatArray,
    cone_rig: FloatArray,
    *,
    is_near: bool = False,
) -> JointFit:
    """Fit tip and cone to the LED centres in the images of all cameras of a rig.

    Raises `CalibrationError` if the iteration does not settle.

    Parameters
    ----------
    rotations, tip_pen, cone_rig : (N, 3, 3), (3,) and (3,) array
        Start, rig_from_pen; mm.
    is_near : bool
        Whether it starts from a fit to most of these images, so that LEDs that are far
        off are known at once.
    """
    state = model.at(rotations, tip_pen, cone_rig)
    if not is_near:
        state, _ = _descend(model, state, None, SETTLED)
    for _ in range(MAX_SELECTIONS):
        used = inliers(state.residuals)
        tolerance = NEARLY if is_near else CONVERGED
        state, reduced = _descend(model, state, used, tolerance)
        if np.array_equal(inliers(state.residuals), used):
            break
    if is_near:  # the rest after so small a step does not matter
        return _fit_from(state, used, reduced)
    return joint_at(model, state.rotations, state.tip_pen, state.cone_cam, used)


def joint_at(
    model: "ContactModel",
    rotations: FloatArray,
    tip_pen: FloatArray,
    cone_rig: FloatArray,
    used: BoolArray,
) -> JointFit:
    """Return the joint fit at a given solution, with the ``used`` LEDs (N, C L)."""
    state = model.at(rotations, tip_pen, cone_rig)
    return _fit_from(state, used, reduce(state, used.astype(float)))


@dataclass(frozen=True, eq=False)
class Linearised:
    """The model around one state."""

    # `rotations`, `tip_pen` and `cone_cam`: (N, 3, 3) and (3,) and (3,), the state.
    rotations: FloatArray
    tip_pen: FloatArray
    cone_cam: FloatArray
    residuals: FloatArray  # (N, C L, 2), observed minus modelled, px
    # (N, C L, 2, 6). d pixel by the image's rotation vector (left) and the cone; rad,
    # mm. The tip moves the images as the cone does, turned: `by_tip_and_cone`.
    jacobian: FloatArray

    @property
    def by_tip_and_cone(self) -> FloatArray:
        """Derivative of the tip in each image by (tip, cone), (N, 3, 6)."""
        moves = np.empty((len(self.rotations), 3, 6))
        moves[..., :3] = -self.rotations
        moves[..., 3:] = np.eye(3)
        return moves


@dataclass(frozen=True, eq=False)
class ContactModel:
    """Images of a pen whose tip rests in the cone."""

    rig: Rig
    pen: Pen
    # (N, C, L, 2), observed ellipse centres, px; NaN where an LED was not seen.
    pixels: FloatArray

    @classmethod
    def of(cls, camera: Camera, pen: Pen, pixels: FloatArray) -> "ContactModel":
        """Return the model of one camera with centres ``pixels`` (N, L, 2), px."""
        return cls(rig_of(camera), pen, pixels[:, None])

    def at(
        self, R: FloatArray, tip_pen: FloatArray, cone_rig: FloatArray
    ) -> Linearised:
        """Return the model around rotations (N, 3, 3), tip (3,) and cone (3,)."""
        cameras = range(self.rig.n_cameras)
        views = [self._view(c, R, tip_pen, cone_rig) for c in cameras]
        residuals, J = (
            np.concatenate(each, axis=1) for each in zip(*views, strict=True)
        )
        return Linearised(R, tip_pen, cone_rig, residuals, J)

    def _view(
        self, c: int, R: FloatArray, tip_pen: FloatArray, cone_rig: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return residuals, and the Jacobian by rotation and cone of the rig."""
        rig, cone = self.rig, cone_rig
        if c > 0:
            R = rig.rotations[c] @ R
            cone = rig.rotations[c] @ cone_rig + rig.translations[c]
        lever = (self.pen.leds - tip_pen) @ np.swapaxes(R, 1, 2)
        residuals, J = disc_residuals(
            rig.cameras[c],
            lever,
            lever + cone,
            self.pen.normals @ np.swapaxes(R, 1, 2),
            self.pen.diameter / 2,
            self.pixels[:, c],
        )
        if c > 0:
            J = derivatives_in_rig(J, rig.rotations[c])
        return residuals, J


@dataclass(frozen=True, eq=False)
class _Reduced:
    """Normal equations with the rotations eliminated: S and b of each image."""

    S: FloatArray
    b: FloatArray
    turn: FloatArray  # (N, 3), rotation step with tip and cone held
    turn_by_step: FloatArray  # (N, 3, 6)

    def step(self) -> FloatArray:
        try:
            step = np.linalg.solve(self.S.sum(axis=0), self.b.sum(axis=0))
        except np.linalg.LinAlgError as error:  # the solution is at infinity
            raise CalibrationError("joint.not-settled", n_steps=MAX_STEPS) from error
        return np.asarray(step)


def reduce(state: Linearised, weights: FloatArray) -> _Reduced:
    """Eliminate the rotations of a linearised model, LED weights (N, L)."""
    H, g = normal_equations(state.jacobian, state.residuals, weights)
    trace = np.trace(H[:, :3, :3], axis1=1, axis2=2)
    ridge = TURN_RIDGE + ONE_LED_RIDGE * trace
    H_turn = H[:, :3, :3] + ridge[:, None, None] * np.eye(3)
    solved = np.linalg.solve(
        H_turn, np.concatenate([H[:, :3, 3:], g[:, :3, None]], axis=2)
    )
    coupling, turn = solved[..., :3], solved[..., 3:]
    back = H[:, 3:, :3]
    moves = state.by_tip_and_cone
    transposed = np.swapaxes(moves, 1, 2)
    return _Reduced(
        S=transposed @ (H[:, 3:, 3:] - back @ coupling) @ moves,
        b=(transposed @ (g[:, 3:, None] - back @ turn))[..., 0],
        turn=turn[..., 0],
        turn_by_step=-coupling @ moves,
    )


def _descend(
    model: ContactModel, state: Linearised, used: BoolArray | None, tolerance: float
) -> tuple[Linearised, _Reduced]:
    """Iterate until tip and cone move by less than ``tolerance``, mm.

    Weighed by the Cauchy loss without ``used``. The last step is so small that model
    and equations are taken along it as they are.
    """
    for _ in range(MAX_STEPS):
        weights = (
            cauchy_weights(state.residuals, robust_sigma(state.residuals, 3))
            if used is None
            else used.astype(float)
        )
        reduced = reduce(state, weights)
        step = reduced.step()
        turns = reduced.turn + reduced.turn_by_step @ step
        rotations = rotation_from_vector(turns) @ state.rotations
        tip_pen, cone_cam = state.tip_pen + step[:3], state.cone_cam + step[3:]
        if np.abs(step).max() < tolerance:
            J, moves = state.jacobian, state.by_tip_and_cone @ step
            change = J @ np.concatenate([turns, moves], axis=1)[:, None, :, None]
            residuals = state.residuals - change[..., 0]
            return Linearised(rotations, tip_pen, cone_cam, residuals, J), reduced
        state = model.at(rotations, tip_pen, cone_cam)
    raise CalibrationError("joint.not-settled", n_steps=MAX_STEPS)


def inliers(residuals: FloatArray) -> BoolArray:
    """Return the mask of inlier LEDs, (N, L), by residuals (N, L, 2), px.

    None of an image that has too few of them.
    """
    lengths = np.hypot(residuals[..., 0], residuals[..., 1])
    threshold = OUTLIER * max(robust_sigma(residuals, 3), LEAST_SIGMA)
    within = np.nan_to_num(lengths, nan=np.inf) < threshold
    enough = within.sum(axis=1, keepdims=True) >= MIN_TURN_LEDS
    return np.asarray(within & enough)


def _fit_from(state: Linearised, used: BoolArray, reduced: _Reduced) -> JointFit:
    squares = np.einsum("nli,nli->nl", state.residuals, state.residuals)
    n_free = 2 * int(used.sum()) - 3 * int(used.any(axis=1).sum()) - 6
    sigma = max(float(np.sqrt(squares[used].sum() / max(n_free, 1))), NOISE_FLOOR)
    return JointFit(
        tip_pen=state.tip_pen,
        cone_cam=state.cone_cam,
        rotations=state.rotations,
        residuals=state.residuals,
        used=used,
        sigma=sigma,
        information=reduced.S / sigma**2,
        gradients=reduced.b / sigma**2,
    )
