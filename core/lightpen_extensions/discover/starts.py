"""Initial values of the bundle adjustment from a weak-perspective shape.

A start is adjusted here with a robust loss and damped steps, as the factorisation is
off by several percent; `lightpen.estimation` does the final adjustment. Both use the
same linearised equations. The tip is the origin of the pen's frame and the normal of
the discs starts as its z axis.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.robust_residuals import CAUCHY_WIDTH, NOISE_FLOOR, robust_sigma
from lightpen.estimation.bundle.linearised import (
    N_CONE,
    BundleState,
    CameraView,
    eliminate,
    views_at,
)
from lightpen.estimation.uncertainty.disc_normals import (
    across_normals,
    turned_normals,
    with_normal,
)
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.model.rigid import nearest_rotation, rig_of, rotation_from_vector
from lightpen_extensions.boards.distortion import usual_distortion

# Shape and turns of a pen from its tracks under weak perspective.
#
# References
# ----------
# .. [1] C. Tomasi, T. Kanade, "Shape and motion from image streams under orthography: a
#    factorization method", Int. J. Computer Vision 9 (1992) 137-154.
# .. [2] C. J. Poelman, T. Kanade, "A paraperspective factorization method for shape and
#    motion recovery", IEEE PAMI 19 (1997) 206-218, section 2.4: scaled orthography.


FILLING_STEPS = 60
SIZE_WEIGHT = 10.0  # of the mean scale of 1 beside the other equations
LEAST_METRIC = 1e-6  # of the largest eigenvalue, that the least is taken to be


class WeakShape(NamedTuple):
    """Shape and motion, up to a mirror along the line of sight."""

    points: FloatArray  # (L, 3), about their centroid; the mean scale is 1 px a unit
    rotations: FloatArray  # (N, 3, 3), of cam_from_shape
    scales: FloatArray  # (N,), px a unit
    centroids: FloatArray  # (N, 2), image of the centroid, px

    @property
    def mirrored(self) -> "WeakShape":
        """The other shape with the same images: near and far exchanged."""
        flip = np.array([1.0, 1.0, -1.0])
        rotations = flip[:, None] * self.rotations * flip
        return self._replace(points=self.points * flip, rotations=rotations)


def factorise(pixels: FloatArray, least_metric: float = LEAST_METRIC) -> WeakShape:
    """Return shape and motion from tracks.

    Parameters
    ----------
    pixels : (N, L, 2) array
        px; NaN where a point is not seen, which is filled by the points beside it.
    least_metric : float
        Where a flat pen or strong perspective leaves the depth of the shape open, the
        least eigenvalue of its metric is taken to be this share of the largest.
    """
    filled = filled_tracks(pixels)
    n = len(filled)
    centroids = filled.mean(axis=1)
    tracks = np.concatenate(np.moveaxis(filled - centroids[:, None], 2, 0))
    left, values, right = np.linalg.svd(tracks, full_matrices=False)
    motion = left[:, :3] * np.sqrt(values[:3])
    shape = np.sqrt(values[:3])[:, None] * right[:3]
    upgrade = _metric_upgrade(motion[:n], motion[n:], least_metric)
    motion, points = motion @ upgrade, np.linalg.solve(upgrade, shape).T
    a, b = motion[:n], motion[n:]
    lengths = np.linalg.norm(a, axis=1) + np.linalg.norm(b, axis=1)
    scales = np.maximum(lengths / 2, 1e-6)
    axes = np.stack([a, b, np.cross(a, b) / scales[:, None]], axis=1)
    return WeakShape(points, nearest_rotation(axes), scales, centroids)


def filled_tracks(pixels: FloatArray) -> FloatArray:
    """Return tracks without gaps: interpolated, then drawn to an affine shape."""
    known = np.isfinite(pixels[..., 0])
    filled = pixels.copy()
    every = np.arange(len(pixels))
    for j in range(pixels.shape[1]):
        own = known[:, j]
        for k in range(2):
            filled[:, j, k] = np.interp(every, every[own], pixels[own, j, k])
    if known.all():
        return filled
    n = len(pixels)
    tracks = np.concatenate([filled[..., 0], filled[..., 1]])
    seen = np.concatenate([known, known])
    for _ in range(FILLING_STEPS):
        centroids = tracks.mean(axis=1, keepdims=True)
        left, values, right = np.linalg.svd(tracks - centroids, full_matrices=False)
        fit = (left[:, :3] * values[:3]) @ right[:3] + centroids
        tracks = np.where(seen, tracks, fit)
    return np.stack([tracks[:n], tracks[n:]], axis=2)


def _metric_upgrade(a: FloatArray, b: FloatArray, least: float) -> FloatArray:
    """Return the matrix (3, 3) by which the rows of motion become axes of a camera."""
    size = (_product(a, a) + _product(b, b)).mean(axis=0, keepdims=True)
    alike = np.concatenate([_product(a, a) - _product(b, b), _product(a, b)])
    rows = np.concatenate([alike, SIZE_WEIGHT * size])
    right = np.zeros(len(rows))
    right[-1] = 2 * SIZE_WEIGHT
    m = np.linalg.lstsq(rows, right, rcond=None)[0]
    values, vectors = np.linalg.eigh(m[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]])
    floor = max(least * float(np.abs(values).max()), 1e-300)
    return np.asarray(vectors * np.sqrt(np.maximum(values, floor)))


def _product(p: FloatArray, q: FloatArray) -> FloatArray:
    """Return the coefficients of p^T M q by the six elements of M, (N, 6)."""
    x, y, z = p.T
    u, v, w = q.T
    return np.stack(
        [x * u, x * v + y * u, x * w + z * u, y * v, y * w + z * v, z * w], axis=1
    )


TINY = 1e-12
FACING = 0.3  # rad: standard deviation of the normal about the mean line of sight


def towards_camera(state: BundleState) -> FloatArray:
    """Return the mean direction from the tip to the camera in the pen's frame, (3,).

    A pen is held with its discs to the camera, so their normal is near.
    """
    towards = -np.einsum("nji,j->ni", state.rotations, state.cone_rig).mean(axis=0)
    return np.asarray(towards / np.linalg.norm(towards))


def off_sight(state: BundleState) -> FloatArray:
    """Return the turn of the normal that would bring it to the camera, (2,), rad."""
    normals = state.pen.normals
    axis = np.cross(normals.mean(axis=0), towards_camera(state))
    sine = float(np.linalg.norm(axis))
    cosine = float(normals.mean(axis=0) @ towards_camera(state))
    turn = axis * np.arctan2(sine, cosine) / max(sine, TINY)
    return np.asarray(across_normals(normals) @ turn)


HELD = 1e-6  # relative, of a number that is not free
UNKNOWN = 3.0  # relative, of a focal length
# Standard deviations of any camera: of fy / fx, of the principal point from the middle
# in widths of the image, and of distortion coefficients.
ASPECT, CENTER, RADIAL = 1e-3, 0.03, 1.0
DISTORTION = {"k1": 0.5, "p1": 1e-3, "p2": 1e-3}
MAX_TURN = 0.3  # rad, of one step
SETTLED = 1e-7  # relative gain of a step
FIRST_DAMPING, MOST_DAMPING = 1e-3, 1e8
WORST = 1e12  # misfit of an invalid state


@dataclass(frozen=True)
class KnownLength:
    """A length between two LEDs by index, with its standard uncertainty, mm."""

    first: int
    second: int
    length: float
    sigma: float

    def between(self, leds: FloatArray) -> float:
        """Return the distance of the two among LEDs (L, 3)."""
        return float(np.linalg.norm(leds[self.second] - leds[self.first]))


def farthest_apart(points: FloatArray) -> tuple[int, int, float]:
    """Return the indices of the two of points (L, 3) farthest apart, and how far."""
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    one, other = np.unravel_index(np.argmax(apart), apart.shape)
    return int(one), int(other), float(apart.max())


class CameraPrior(NamedTuple):
    """Prior knowledge of the intrinsics of a camera."""

    intrinsics: FloatArray  # (k,), as `Camera.intrinsics`
    information: FloatArray  # (k, k)

    @classmethod
    def of(cls, camera: Camera, covariance: FloatArray) -> "CameraPrior":
        """Return a prior about a camera with a covariance (k, k)."""
        values = camera.intrinsics
        units = np.full(len(values), 1e-3)
        units[:2], units[2:4] = camera.fx, 1.0
        known = np.linalg.inv(covariance + np.diag((HELD * units) ** 2))
        return cls(values, np.asarray(known, dtype=np.float64))


def held_camera(camera: Camera) -> CameraPrior:
    """Return the prior of a camera that is held fixed."""
    return CameraPrior.of(camera, np.zeros((len(camera.intrinsics),) * 2))


def free_focal_length(camera: Camera) -> CameraPrior:
    """Return the prior of a camera with only the focal length unknown."""
    covariance = np.zeros((len(camera.intrinsics),) * 2)
    covariance[:2, :2] = (UNKNOWN * camera.fx) ** 2
    return CameraPrior.of(camera, covariance)


def any_covariance(camera: Camera) -> FloatArray:
    """Return the covariance (k, k) of the intrinsics of cameras about ideal ones."""
    distortion = [DISTORTION.get(name, RADIAL) for name in camera.distortion_names]
    covariance = np.diag([0.0, 0.0, *(CENTER * camera.width,) * 2, *distortion]) ** 2
    usual = np.diag(usual_distortion(camera))
    at = np.flatnonzero(usual)
    covariance[at, at] = 1 / usual[at]
    covariance[:2, :2] = (UNKNOWN * camera.fx) ** 2
    covariance[1, 1] += (ASPECT * camera.fx) ** 2
    return covariance


def any_camera(camera: Camera) -> CameraPrior:
    """Return the prior of any camera with images of this size."""
    ideal = ideal_camera(camera.width, camera.height, camera.fx)
    ideal = replace(
        ideal, distortion=np.zeros_like(camera.distortion), lens=camera.lens
    )
    return CameraPrior.of(ideal, any_covariance(camera))


def ideal_camera(width: int, height: int, focal: float) -> Camera:
    """Return a camera without distortion, with the focal length in px."""
    return Camera(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2)


@dataclass(frozen=True, eq=False)
class Start:
    """A state and how well it fits."""

    state: BundleState  # tip at the origin of the pen's frame
    sigma: float  # robust noise of one coordinate about it, px


def focal_length_of(shape: WeakShape) -> float:
    """Return the focal length that a shape implies, px.

    The distance of the centroid is that of the cone and a share by the turn of the
    pen about it, and the inverse of the scale is proportional to it: 1 / s = Z / f.
    The in-plane shifts determine the lever. A mirrored shape gives a negative one.
    """
    lever = _lever(shape)
    depths = shape.rotations[:, 2] @ lever
    A = np.column_stack([depths, np.ones(len(depths))])
    slope = np.linalg.lstsq(A, 1 / shape.scales, rcond=None)[0][0]
    return float(1 / slope) if abs(slope) > 1e-12 else np.inf


def _lever(shape: WeakShape) -> FloatArray:
    """Return the centroid from the tip, (3,), by its images: s R l + c, least squares.

    The share of the lever along the line of sight follows from the turns alone.
    """
    n = len(shape.scales)
    rows = np.zeros((2 * n, 5))
    rows[:, :3] = (shape.scales[:, None, None] * shape.rotations[:, :2]).reshape(-1, 3)
    rows[0::2, 3] = rows[1::2, 4] = 1.0
    return np.asarray(np.linalg.lstsq(rows, shape.centroids.ravel(), rcond=None)[0][:3])


def state_of(
    shape: WeakShape, camera: Camera, radius: float, unit: float
) -> BundleState:
    """Return the state of a shape before a camera.

    ``radius`` is the radius of the discs, mm; ``unit`` is the size of a unit of the
    shape, mm.
    """
    distances = camera.fx * unit / shape.scales
    middle = np.array([camera.cx, camera.cy])
    places = np.column_stack(
        [(shape.centroids - middle) / camera.fx * distances[:, None], distances]
    )
    R = shape.rotations
    n = len(R)
    rows = np.concatenate([R.reshape(-1, 3), np.tile(-np.eye(3), (n, 1))], axis=1)
    solved = np.linalg.lstsq(rows, -places.ravel(), rcond=None)[0]
    tip, cone = solved[:3], solved[3:]
    leds = unit * shape.points - tip
    _, axes = np.linalg.eigh(np.cov(leds.T))  # LEDs look where they spread least
    normal = -axes[:, 0] * np.sign((R @ axes[:, 0])[:, 2].mean() or 1.0)
    along = axes[:, 2]
    frame = np.stack([along, np.cross(normal, along), normal], axis=1)
    pen = Pen(leds @ frame, np.tile([0.0, 0.0, 1.0], (len(leds), 1)), 2 * radius)
    return BundleState(rig_of(camera), pen, np.zeros(3), cone, R @ frame)


def adjust_start(
    start: BundleState,
    pixels: FloatArray,
    prior: CameraPrior,
    n_steps: int,
    lengths: tuple[KnownLength, ...],
    least_sigma: float = 0.0,
) -> Start:
    """Adjust a state by damped Gauss-Newton steps on the Cauchy loss.

    Parameters
    ----------
    pixels : (N, L, 2) array
        px; NaN where an LED was not seen.
    least_sigma : float
        Least noise that residuals are measured by, px; more of it makes a poor start
        converge.
    lengths : tuple of KnownLength
        One at least holds the size of the pen.
    """
    observed = pixels[:, None]
    state, damping = start, FIRST_DAMPING
    view = _view(state, observed)
    sigma = max(robust_sigma(view.residuals, 3), least_sigma)
    cost = _cost(view, state, sigma, prior, lengths)
    for _ in range(n_steps):
        weighted = _weighted(view, sigma)
        used = np.isfinite(view.residuals[..., 0])[:, None]
        each = eliminate((weighted,), used, sigma)
        N, b = _with_priors(each.N, each.b, state, prior, lengths)
        now = cost
        while damping < MOST_DAMPING:
            step = _damped_step(N, b, damping)
            turns = each.turn + each.turn_by_step @ step
            tried = _moved(state, step, turns)
            if tried is not None:
                view_there = _view(tried, observed)
                cost = _cost(view_there, tried, sigma, prior, lengths)
                if cost < now:
                    break
            damping *= 8
        else:
            break
        state, view = tried, view_there
        damping = max(damping / 10, 1e-9)
        sigma = max(robust_sigma(view.residuals, 3), least_sigma)
        gained = now - cost
        cost = _cost(view, state, sigma, prior, lengths)
        if gained < SETTLED * now:
            break
    return Start(state, robust_sigma(view.residuals, 3))


def focal_sigma(
    start: Start,
    pixels: FloatArray,
    prior: CameraPrior,
    lengths: tuple[KnownLength, ...],
) -> float:
    """Return the standard uncertainty of the focal length of an adjusted start, px."""
    state = start.state
    view = _view(state, pixels[:, None])
    used = np.isfinite(view.residuals[..., 0])[:, None]
    each = eliminate((_weighted(view, start.sigma),), used, start.sigma)
    N, b = _with_priors(each.N, each.b, state, prior, lengths)
    unit = np.zeros_like(b)
    unit[N_CONE] = 1.0
    return float(np.sqrt(_damped_step(N, unit, 0.0)[N_CONE]))


def scaled_to(state: BundleState, factor: float) -> BundleState:
    """Return the state with pen and distances larger by a factor."""
    pen = replace(state.pen, leds=factor * state.pen.leds)
    return replace(
        state, pen=pen, tip_pen=factor * state.tip_pen, cone_rig=factor * state.cone_rig
    )


def _view(state: BundleState, observed: FloatArray) -> CameraView:
    with np.errstate(all="ignore"):  # a start may be absurd
        return with_normal(views_at(state, observed)[0], state)


def _cost(
    view: CameraView,
    state: BundleState,
    sigma: float,
    prior: CameraPrior,
    lengths: tuple[KnownLength, ...],
) -> float:
    """Return the Cauchy loss and the misfit of priors, in units of variance."""
    squares = np.sum(view.residuals**2, axis=2)
    squares = squares[np.isfinite(squares)]
    width = (CAUCHY_WIDTH * sigma) ** 2
    loss = CAUCHY_WIDTH**2 * float(np.log1p(squares / width).sum())
    off = state.rig.cameras[0].intrinsics - prior.intrinsics
    loss += float(off @ prior.information @ off)
    loss += float(np.sum(off_sight(state) ** 2)) / FACING**2
    leds = state.pen.leds
    loss += sum(((k.between(leds) - k.length) / k.sigma) ** 2 for k in lengths)
    return loss if np.isfinite(loss) else WORST


def _weighted(view: CameraView, sigma: float) -> CameraView:
    squares = np.sum(view.residuals**2, axis=2)
    root = np.sqrt(1 / (1 + squares / (CAUCHY_WIDTH * sigma) ** 2))
    root = np.nan_to_num(root)
    by = root[..., None]
    each = root[..., None, None]
    return CameraView(
        residuals=by * view.residuals,
        turn=each * view.turn,
        cone=each * view.cone,
        led=each * view.led,
        own=each * view.own,
        fields=each * view.fields,
        diameter=0.0 * np.nan_to_num(view.diameter),
    )


def _with_priors(
    N: FloatArray,
    b: FloatArray,
    state: BundleState,
    prior: CameraPrior,
    lengths: tuple[KnownLength, ...],
) -> tuple[FloatArray, FloatArray]:
    """Return the normal equations with priors of the camera, and lengths."""
    N, b = N.copy(), b.copy()
    at = slice(N_CONE, N_CONE + len(prior.intrinsics))
    off = state.rig.cameras[0].intrinsics - prior.intrinsics
    N[at, at] += prior.information
    at_normal = at.stop + np.arange(2)
    N[at_normal, at_normal] += FACING**-2
    b[at_normal] += off_sight(state) / FACING**2
    b[at] -= prior.information @ off
    at_leds = len(b) - 3 * state.pen.n_leds
    for known in lengths:
        row = gradient_of(state.pen.leds, known)
        miss = known.length - known.between(state.pen.leds)
        N[at_leds:, at_leds:] += np.outer(row, row) / known.sigma**2
        b[at_leds:] += row * miss / known.sigma**2
    at_diameter = at_leds - 1
    N[at_diameter, at_diameter] += 1.0  # its column is 0
    return N, b


def gradient_of(leds: FloatArray, known: KnownLength) -> FloatArray:
    """Return the derivative of a length by the LEDs, (3 L,)."""
    row = np.zeros_like(leds)
    along = leds[known.second] - leds[known.first]
    along = along / np.linalg.norm(along)
    row[known.second], row[known.first] = along, -along
    return row.ravel()


def _damped_step(N: FloatArray, b: FloatArray, damping: float) -> FloatArray:
    diagonal = np.diag(N)
    floor = 1e-12 * float(diagonal.max())
    scale = 1 / np.sqrt(np.maximum(diagonal, floor))
    scaled = N * np.outer(scale, scale) + (damping + 1e-10) * np.eye(len(b))
    return np.asarray(scale * np.linalg.solve(scaled, scale * b))


def _moved(
    state: BundleState, step: FloatArray, turns: FloatArray
) -> BundleState | None:
    """Return the state after a step; None if it is impossible."""
    camera = state.rig.cameras[0]
    intrinsics = camera.intrinsics
    intrinsics = intrinsics + step[N_CONE : N_CONE + len(intrinsics)]
    n_leds = state.pen.n_leds
    at_normal = N_CONE + len(intrinsics)
    turn = np.clip(step[at_normal : at_normal + 2], -MAX_TURN, MAX_TURN)
    cone = state.cone_rig + step[:N_CONE]
    if not np.isfinite(step).all() or intrinsics[:2].min() <= 0 or cone[2] <= 0:
        return None
    angles = np.linalg.norm(turns, axis=1, keepdims=True)
    turns = turns * np.minimum(1, MAX_TURN / np.maximum(angles, NOISE_FLOOR))
    leds = state.pen.leds + step[-3 * n_leds :].reshape(-1, 3)
    return replace(
        state,
        rig=rig_of(camera.with_intrinsics(intrinsics)),
        pen=replace(
            state.pen, leds=leds, normals=turned_normals(state.pen.normals, turn)
        ),
        cone_rig=cone,
        rotations=rotation_from_vector(turns) @ state.rotations,
    )
