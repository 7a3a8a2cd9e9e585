"""Equation (9) of method.md linearised about a state, and its normal equations.

The image of an LED depends on the rotation of the pen, the cone, intrinsics and
extrinsics of the camera, the diameter of the discs and the LED itself. Tip and scale of
the pen need no columns of their own: they are combinations of those of the LEDs.
"""

from dataclasses import dataclass, field

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.robust_residuals import disc_residuals
from lightpen.estimation.contact.joint import TURN_RIDGE
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig

N_TURN = 3
N_CONE = 3


@dataclass(frozen=True, eq=False)
class BundleState:
    """Parameters of the images of a swing."""

    rig: Rig
    pen: Pen
    tip_pen: FloatArray  # (3,), mm
    cone_rig: FloatArray  # (3,), mm
    rotations: FloatArray  # (N, 3, 3), of rig_from_pen
    # (N,), images in which the tip rests in a second cone; None without one.
    at_second: BoolArray | None = None
    # (3,), from the first cone to the second, mm
    between_rig: FloatArray = field(default_factory=lambda: np.zeros(3))

    @property
    def cones_rig(self) -> FloatArray:
        """Cone in which the tip of each image rests, (N, 3), mm."""
        cones = np.tile(self.cone_rig, (len(self.rotations), 1))
        if self.at_second is not None:
            cones[self.at_second] += self.between_rig
        return cones

    def leds_in(self, c: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return LEDs from the tip, from a camera, and normals, in its frame, mm.

        Each is (N, L, 3).
        """
        R_c, t_c = self.rig.rotations[c], self.rig.translations[c]
        transposed = np.swapaxes(R_c @ self.rotations, 1, 2)
        levers = (self.pen.leds - self.tip_pen) @ transposed
        cones = self.cones_rig @ R_c.T + t_c
        return levers, levers + cones[:, None], self.pen.normals @ transposed


@dataclass(frozen=True, eq=False)
class CameraView:
    """The images of one camera around a state."""

    # (N, L, 2), observed minus modelled centres, px; NaN where an LED was not seen.
    residuals: FloatArray
    # `turn`, `cone` and `led`: (N, L, 2, 3), derivative of the modelled centres by the
    # rotation vector of the image (left, rad), the cone point and the LED itself (mm).
    turn: FloatArray
    cone: FloatArray
    led: FloatArray
    # (N, L, 2, k), derivative by the intrinsics and, unless the camera is the first of
    # the rig, by its rotation and translation in the rig.
    own: FloatArray
    # (N, L, 2, E), by the unknowns of `lightpen.estimation.bundle.image_fields`.
    fields: FloatArray
    diameter: FloatArray  # (N, L, 2), by the disc diameter

    def in_units_of(self, noise: FloatArray) -> "CameraView":
        """Return residuals and derivatives by the noise of each LED, (N, L)."""
        if np.all(noise == 1):
            return self
        by_two, by_three = noise[..., None], noise[..., None, None]
        return CameraView(
            residuals=self.residuals / by_two,
            turn=self.turn / by_three,
            cone=self.cone / by_three,
            led=self.led / by_three,
            own=self.own / by_three,
            fields=self.fields / by_three,
            diameter=self.diameter / by_two,
        )


def views_at(
    state: BundleState, pixels: FloatArray, fields: FloatArray | None = None
) -> tuple[CameraView, ...]:
    """Linearise the images ``pixels`` (N, C, L, 2), px, of each camera about a state.

    ``fields`` (N, C, L, 2, E) are columns of fields.
    """
    if fields is None:
        fields = np.zeros((*pixels.shape, 0))
    return tuple(
        _view(state, c, pixels[:, c], fields[:, c]) for c in range(state.rig.n_cameras)
    )


def _view(
    state: BundleState, c: int, pixels: FloatArray, fields: FloatArray
) -> CameraView:
    rig, pen = state.rig, state.pen
    camera, R_c, t_c = rig.cameras[c], rig.rotations[c], rig.translations[c]
    levers, points, normals = state.leds_in(c)
    residuals, J = disc_residuals(
        camera, levers, points, normals, pen.diameter / 2, pixels
    )
    by_point = J[..., 3:]
    normalised = points[..., :2] / points[..., 2:]
    own = camera.intrinsics_jacobian(normalised)
    if c > 0:
        by_turn = np.cross((points - t_c)[:, :, None], by_point)
        own = np.concatenate([own, by_turn, by_point], axis=3)
    # The centre of a disc's image deviates by the square of the diameter.
    offset = (pixels - residuals) - camera.pixels(normalised)
    return CameraView(
        residuals=residuals,
        turn=J[..., :3] @ R_c,
        cone=by_point @ R_c,
        led=by_point @ (R_c @ state.rotations)[:, None],
        own=own,
        fields=fields,
        diameter=2 / pen.diameter * offset,
    )


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Normal equations of the images of a swing, in units of the noise.

    Columns: cone (3), each camera's own, fields (E), diameter, LEDs (3 L).
    """

    N: FloatArray  # (K, K)
    b: FloatArray  # (K,)
    # (N, 3, K), contribution of each image to the rows of the cone.
    cone_rows: FloatArray
    cone_right: FloatArray  # (N, 3), contribution to their right side


@dataclass(frozen=True, eq=False)
class Eliminated(NormalEquations):
    """The same with the rotations eliminated, equation (3)."""

    # (N, q), step of the eliminated unknowns of each image with all others held:
    # rotation, and with jitter the seat.
    turn: FloatArray
    turn_by_step: FloatArray  # (N, q, K)
    # (N, q, q), inverse of the normal matrix of the eliminated unknowns.
    nuisance_covariance: FloatArray


def eliminate(
    views: tuple[CameraView, ...],
    used: BoolArray,
    sigma: float,
    jitter: FloatArray | None = None,
) -> Eliminated:
    """Eliminate the rotation of each image, and its seat if there is jitter: (3).

    Parameters
    ----------
    used : (N, C, L) array of bool
    sigma : float
        Noise of one image coordinate, px.
    jitter : (3, 3) array or None
        Covariance of the seat from image to image, mm^2.
    """
    n_images, _, n_leds = used.shape
    sizes = [view.own.shape[-1] for view in views]
    n_fields = views[0].fields.shape[-1]
    K = N_CONE + sum(sizes) + n_fields + 1 + 3 * n_leds
    at_fields, at_leds = K - 3 * n_leds - 1 - n_fields, K - 3 * n_leds
    N, b = np.zeros((K, K)), np.zeros(K)
    q = N_TURN if jitter is None else N_TURN + N_CONE
    inner = np.zeros((n_images, q, q))
    inner_right = np.zeros((n_images, q))
    to_inner = np.zeros((n_images, K, q))
    cone_rows = np.zeros((n_images, N_CONE, K))
    cone_right = np.zeros((n_images, N_CONE))
    own_start = N_CONE
    for c, view in enumerate(views):
        k = sizes[c]
        J = np.concatenate(
            [
                *(view.turn, view.cone, view.own, view.fields),
                *(view.diameter[..., None], view.led),
            ],
            axis=3,
        )
        mask = used[:, c, :, None]
        J = np.where(mask[..., None], J, 0.0) / sigma
        r = np.where(mask, view.residuals, 0.0) / sigma
        shared = np.r_[0:N_CONE, own_start : own_start + k, at_fields:at_leds]
        own_start += k
        n = N_TURN + N_CONE + k + n_fields + 1  # columns that all LEDs share
        rows = J[..., :n].reshape(n_images, 2 * n_leds, n)
        H = np.swapaxes(rows, 1, 2) @ rows
        g = (r.reshape(n_images, 1, -1) @ rows)[:, 0]
        by_led = J[..., n:]
        cross = np.swapaxes(by_led, 2, 3) @ J[..., : N_TURN + N_CONE]
        cross = cross.reshape(n_images, 3 * n_leds, -1)
        # All images of one LED beside each other.
        of_led = np.swapaxes(J, 0, 1).reshape(n_leds, 2 * n_images, -1)
        r_of_led = np.swapaxes(r, 0, 1).reshape(n_leds, 2 * n_images, 1)
        transposed = np.swapaxes(of_led[..., n:], 1, 2)
        N[np.ix_(shared, shared)] += H[:, 3:, 3:].sum(axis=0)
        coupling = (transposed @ of_led[..., 3:n]).reshape(3 * n_leds, -1)
        N[np.ix_(np.arange(at_leds, K), shared)] += coupling
        N[np.ix_(shared, np.arange(at_leds, K))] += coupling.T
        blocks = transposed @ of_led[..., n:]
        for j in range(n_leds):
            at = slice(at_leds + 3 * j, at_leds + 3 * j + 3)
            N[at, at] += blocks[j]
        b[shared] += g[:, 3:].sum(axis=0)
        b[at_leds:] += (transposed @ r_of_led).ravel()
        inner += H[:, :q, :q]
        inner_right += g[:, :q]
        to_inner[:, shared] += H[:, 3:, :q]
        to_inner[:, at_leds:] += cross[..., :q]
        cone_rows[:, :, shared] += H[:, 3:6, 3:]
        cone_rows[:, :, at_leds:] += np.swapaxes(cross[..., N_TURN:], 1, 2)
        cone_right += g[:, 3:6]
    inner[:, range(N_TURN), range(N_TURN)] += TURN_RIDGE / sigma**2
    if jitter is not None:
        inner[:, N_TURN:, N_TURN:] += np.linalg.inv(jitter)
    nuisance_covariance = np.asarray(np.linalg.inv(inner), dtype=np.float64)
    gain: FloatArray = nuisance_covariance @ np.swapaxes(to_inner, 1, 2)  # (N, q, K)
    turn = np.einsum("nij,nj->ni", nuisance_covariance, inner_right)
    N -= np.tensordot(to_inner, gain, axes=([0, 2], [0, 1]))
    b -= np.einsum("nki,ni->k", to_inner, turn)
    to_cone = to_inner[:, :N_CONE]
    return Eliminated(
        N=0.5 * (N + N.T),
        b=b,
        cone_rows=cone_rows - to_cone @ gain,
        cone_right=cone_right - np.einsum("nij,nj->ni", to_cone, turn),
        turn=turn,
        turn_by_step=-gain,
        nuisance_covariance=nuisance_covariance,
    )
