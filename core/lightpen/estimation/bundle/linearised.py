"""Equation (9) of method.md linearised about a state, and its normal equations.

The image of an LED depends on the rotation of the pen, the cone, intrinsics and
extrinsics of the camera, the diameter of the discs and the LED itself. Tip and scale of
the pen need no columns of their own: they are combinations of those of the LEDs.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.robust_residuals import disc_residuals
from lightpen.estimation.contact.joint import TURN_RIDGE
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig, skew

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

    def leds_in(self, c: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return LEDs from the tip, from a camera, and normals, in its frame, mm.

        Each is (N, L, 3).
        """
        R_c, t_c = self.rig.rotations[c], self.rig.translations[c]
        transposed = np.swapaxes(R_c @ self.rotations, 1, 2)
        levers = (self.pen.leds - self.tip_pen) @ transposed
        cone = R_c @ self.cone_rig + t_c
        return levers, levers + cone, self.pen.normals @ transposed


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
    ends = np.cumsum([0, *(view.own.shape[-1] for view in views)])
    n = N_TURN + N_CONE + int(ends[-1]) + views[0].fields.shape[-1] + 1
    K = n - N_TURN + 3 * n_leds
    own_of_all = np.zeros((n_images, n_leds, 2, ends[-1]))
    N, b = np.zeros((K, K)), np.zeros(K)
    q = N_TURN if jitter is None else N_TURN + N_CONE
    # Of each image, rows of its turn and its cone; columns: turn, then those of all.
    rows = np.zeros((n_images, N_TURN + N_CONE, N_TURN + K))
    right = np.zeros((n_images, N_TURN + N_CONE))
    at_led = (n - N_TURN + np.arange(3 * n_leds)).reshape(n_leds, 3)
    for c, view in enumerate(views):
        own = own_of_all.copy()
        own[..., ends[c] : ends[c + 1]] = view.own
        J = np.concatenate(
            [
                *(view.turn, view.cone, own, view.fields),
                *(view.diameter[..., None], view.led),
            ],
            axis=3,
        )
        J[~used[:, c]] = 0.0
        r = np.where(used[:, c, :, None], view.residuals, 0.0)
        by_image = J.reshape(n_images, 2 * n_leds, -1)
        first = np.swapaxes(by_image[..., : N_TURN + N_CONE], 1, 2)
        rows[..., :n] += first @ by_image[..., :n]
        right += (first @ r.reshape(n_images, -1, 1))[..., 0]
        cross = np.swapaxes(J[..., : N_TURN + N_CONE], 2, 3) @ J[..., n:]
        rows[..., n:] += np.swapaxes(cross, 1, 2).reshape(n_images, 6, -1)
        shared = J[..., N_TURN:n].reshape(-1, n - N_TURN)  # columns of all LEDs
        N[: n - N_TURN, : n - N_TURN] += shared.T @ shared
        b[: n - N_TURN] += r.ravel() @ shared
        # All images of one LED beside each other.
        of_led = np.swapaxes(J, 0, 1).reshape(n_leds, 2 * n_images, -1)
        transposed = np.swapaxes(of_led[..., n:], 1, 2)
        N[n - N_TURN :, : n - N_TURN] += (transposed @ of_led[..., N_TURN:n]).reshape(
            3 * n_leds, -1
        )
        N[at_led[:, :, None], at_led[:, None]] += transposed @ of_led[..., n:]
        r_of_led = np.swapaxes(r, 0, 1).reshape(n_leds, 2 * n_images, 1)
        b[n - N_TURN :] += (transposed @ r_of_led).ravel()
    N[: n - N_TURN, n - N_TURN :] = N[n - N_TURN :, : n - N_TURN].T
    for each in (N, b, rows, right):
        each /= sigma**2
    inner, to_inner = rows[:, :q, :q].copy(), rows[:, :q, N_TURN:]
    inner[:, range(N_TURN), range(N_TURN)] += TURN_RIDGE / sigma**2
    if jitter is not None:
        inner[:, N_TURN:, N_TURN:] += np.linalg.inv(jitter)
    nuisance_covariance = np.asarray(np.linalg.inv(inner), dtype=np.float64)
    gain: FloatArray = nuisance_covariance @ to_inner
    turn = (nuisance_covariance @ right[:, :q, None])[..., 0]
    flat = to_inner.reshape(-1, K)
    N -= flat.T @ gain.reshape(-1, K)
    b -= turn.ravel() @ flat
    to_cone = np.swapaxes(to_inner[..., :N_CONE], 1, 2)
    return Eliminated(
        N=0.5 * (N + N.T),
        b=b,
        cone_rows=rows[:, N_TURN:, N_TURN:] - to_cone @ gain,
        cone_right=right[:, N_TURN:] - (to_cone @ turn[..., None])[..., 0],
        turn=turn,
        turn_by_step=-gain,
        nuisance_covariance=nuisance_covariance,
    )


def own_step(each: Eliminated, step: FloatArray, shifts: FloatArray) -> FloatArray:
    """Return the step of each image's own unknowns, (N, q)."""
    by_cone = each.turn_by_step[..., :N_CONE]
    return np.asarray(
        each.turn + each.turn_by_step @ step + np.einsum("nqk,nk->nq", by_cone, shifts)
    )


def left_over(
    views: tuple[CameraView, ...],
    step: FloatArray,
    shifts: FloatArray,
    unknown: FloatArray,
) -> FloatArray:
    """Return the residuals after a step, (N, C, L, 2), px, seat and jitter removed."""
    n_leds = views[0].residuals.shape[1]
    by_led = step[-3 * n_leds :].reshape(n_leds, 3)
    by_diameter = step[-3 * n_leds - 1]
    cone = step[:N_CONE] + shifts
    if unknown.shape[1] > N_TURN:
        cone = cone + unknown[:, N_TURN:]
    n_fields = views[0].fields.shape[-1]
    by_fields = step[-3 * n_leds - 1 - n_fields : -3 * n_leds - 1]
    row, left = N_CONE, []
    for view in views:
        own = step[row : row + view.own.shape[-1]]
        row += len(own)
        left.append(
            view.residuals
            - np.einsum("nlik,nk->nli", view.turn, unknown[:, :N_TURN])
            - np.einsum("nlik,nk->nli", view.cone, cone)
            - view.own @ own
            - view.fields @ by_fields
            - view.diameter * by_diameter
            - np.einsum("nlik,lk->nli", view.led, by_led)
        )
    return np.stack(left, axis=1)


def n_eliminated(each: Eliminated, jitter: FloatArray | None, used: BoolArray) -> float:
    """Return the effective number of eliminated unknowns."""
    n_images = int(used.any(axis=(1, 2)).sum())
    if jitter is None:
        return float(N_TURN * n_images)
    known = np.linalg.inv(jitter)
    left = each.nuisance_covariance[:, N_TURN:, N_TURN:]
    freedom = N_CONE - np.einsum("nij,ji->n", left, known)
    return float(N_TURN * n_images + freedom.sum())


def whole_moves(leds: FloatArray) -> FloatArray:
    """Return the LED moves caused by rigid moves, (3 L, 6).

    Its shifts, mm, and its turns about the middle of the LEDs, rad.
    """
    shifts = np.tile(np.eye(3), (len(leds), 1))
    turns = -skew(leds - leds.mean(axis=0)).reshape(-1, 3)
    return np.concatenate([shifts, turns], axis=1)
