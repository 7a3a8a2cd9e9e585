"""Two cameras from views in which both detect one board.

Everything is fitted together: both cameras, the place of the second, the board and its
poses. A board that looks the same turned round is numbered as the places of the cameras
have it, which is the same in all views.
"""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.errors import CalibrationError
from lightpen.intrinsics.adjustment import (
    adjust_board,
    fit_board_poses,
    stated_information,
)
from lightpen.intrinsics.alternatives import USELESS
from lightpen.intrinsics.board_findings import (
    board_contradictions,
    messages_on_board,
    released_tolerances,
)
from lightpen.intrinsics.board_fit import N_SHAPE, BoardFit, BoardState
from lightpen.intrinsics.calibration import (
    CameraCalibration,
    calibrate_camera,
    without_outliers,
)
from lightpen.intrinsics.camera_change import changed_camera
from lightpen.intrinsics.duplicates import message_on_duplicates, without_duplicates
from lightpen.intrinsics.start import BoardPoses, start_board_poses
from lightpen.intrinsics.variance_components import MixedFit, fit_effects
from lightpen.intrinsics.views import BoardTolerances, Views
from lightpen.messages import Message, message
from lightpen.model.camera import Camera
from lightpen.model.rig import Rig, of_camera
from lightpen.model.rigid import vector_from_rotation

MIN_PAIRS = 3
MAX_VOTED = 60  # views that are compared with all
ALIKE_TURN = np.radians(5.0)  # of the place of the second camera from view to view
ALIKE_SHIFT = 0.15  # of its distance
PEN_SPEED = 100.0  # mm/s
APART = 3.0  # times the noise of each camera alone
SIGMAS = 4.0
OF_BOTH = (
    "intrinsics.board-stretched",
    "intrinsics.board-bent",
    "intrinsics.duplicates",
)  # found again by both cameras together
LEAST_LAG = 0.02  # of the time between two views


@dataclass(frozen=True)
class PairLag:
    """Time lag of the second camera, if the views are a sequence."""

    # `views` and `sigma`: lag in view intervals, and its standard deviation.
    views: float
    sigma: float
    interval_ms: float | None  # interval between two views, if known
    px_per_ms: float  # displacement of a pen moved at 100 mm/s

    @property
    def is_significant(self) -> bool:
        """Whether it is significant, and large enough to matter."""
        return abs(self.views) > max(SIGMAS * self.sigma, LEAST_LAG)

    @property
    def lag_ms(self) -> float | None:
        """The same in ms, where the time between two views is known."""
        return None if self.interval_ms is None else self.views * self.interval_ms

    def remark(self, name: str) -> Message:
        """Return the message on the camera of that name."""
        if self.lag_ms is None:
            return message(
                "pair.late",
                camera=name,
                lag=abs(self.views),
                u=2 * self.sigma,
                px=self.px_per_ms,
            )
        return message(
            "pair.late-by",
            camera=name,
            lag=abs(self.lag_ms),
            u=2 * self.sigma * (self.interval_ms or 0.0),
            px=abs(self.lag_ms) * self.px_per_ms,
        )


@dataclass(frozen=True, eq=False)
class PairCalibration:
    """Extrinsics and intrinsics of two cameras."""

    rig: Rig  # with the covariance of the extrinsics, the board's scale included
    views: Views
    effects: MixedFit
    # Each camera by its own views; empty if files state the intrinsics.
    alone: tuple[CameraCalibration, ...]
    n_pairs: int  # views in which both cameras see the board
    left_out: tuple[str, ...]  # excluded views
    lag: PairLag | None  # None if the board did not move enough between views
    remarks: tuple[Message, ...]

    @property
    def adjustment(self) -> BoardFit:
        """The final fit."""
        return self.effects.adjustment

    @property
    def baseline(self) -> float:
        """Distance of the cameras, mm."""
        R, t = self.rig.rotations[1], self.rig.translations[1]
        return float(np.linalg.norm(R.T @ t))

    @property
    def baseline_sigma(self) -> float:
        """Standard uncertainty of it, mm."""
        assert self.rig.covariance is not None
        t = self.rig.translations[1]
        along = t / np.linalg.norm(t)
        return float(np.sqrt(along @ self.rig.covariance[3:, 3:] @ along))


def calibrate_pair(
    views: Views,
    tolerances: BoardTolerances,
    names: tuple[str, str],
    cameras: tuple[Camera, ...] = (),
    interval_ms: float | None = None,
) -> PairCalibration:
    """Calibrate the extrinsics of the second of two cameras.

    Raises `CalibrationError` if too few views are of both, or they contradict each
    other.

    Parameters
    ----------
    cameras : tuple of Camera, optional
        Cameras as in their files; by default they are estimated from the views as well.
    interval_ms : float, optional
        Time between two views, if they are a sequence.
    """
    alone: tuple[CameraCalibration, ...] = ()
    if not cameras:
        alone = tuple(
            calibrate_camera(views.of_camera(c), tolerances) for c in range(2)
        )
        cameras = tuple(each.camera for each in alone)
        views = _as_alone(views, alone)
        # With the priors that keep their images from folding.
        stated: tuple[FloatArray | None, ...] = tuple(
            each.adjustment.prior_of(0) for each in alone
        )
    else:
        stated = tuple(
            None if camera.covariance is None else stated_information(camera.covariance)
            for camera in cameras
        )
    names_of_all = views.names
    views, duplicates = without_duplicates(views.chosen(np.any(views.found, axis=1)))
    both = np.all(views.found, axis=1)
    if both.sum() < MIN_PAIRS:
        raise CalibrationError("pair.few", n_pairs=int(both.sum()), least=MIN_PAIRS)
    try:
        views, place = _ordered(views, cameras, both)
    except CalibrationError:
        for c, (camera, name) in enumerate(zip(cameras, names, strict=True)):
            _require_fit(views.of_camera(c), camera, name)
        raise
    poses = _poses(views, cameras, place)
    state = BoardState(
        cameras,
        np.stack([np.eye(3), place.rotations[0]]),
        np.stack([np.zeros(3), place.translations[0]]),
        poses,
        np.zeros(N_SHAPE),
    )
    fitted = adjust_board(views, state, tolerances, stated)
    lag = _lag(views, fitted, np.all(views.found, axis=1), interval_ms)
    usual = max((each.adjustment.rms for each in alone), default=fitted.rms)
    moved = _message_on_moved(views, fitted, usual)
    kept = without_outliers(views, fitted)
    if int(kept.seen.sum()) < int(views.seen.sum()):
        which = np.isin(views.names, kept.names)
        poses = BoardPoses(*(each[which] for each in fitted.state.poses))
        views, state = kept, replace(state, poses=poses)
        fitted = adjust_board(views, state, tolerances, stated)
    denied = board_contradictions(fitted, tolerances)
    if denied.any():
        released = released_tolerances(tolerances)
        fitted = adjust_board(views, state, released, stated)
    effects = fit_effects(views, fitted)
    fitted = effects.adjustment
    rig = _rig(effects, names, tolerances, alone)
    remarks = [
        of_camera(name, remark)
        for name, each in zip(names, alone, strict=False)
        for remark in each.remarks
        if remark.code not in OF_BOTH
    ]
    if duplicates:
        remarks.append(message_on_duplicates(views.n_views, duplicates))
    if lag is not None and lag.is_significant:
        remarks.append(lag.remark(names[1]))
    elif moved is not None:
        remarks.append(moved)
    return PairCalibration(
        rig=rig,
        views=views,
        alone=alone,
        n_pairs=int(np.all(views.found, axis=1).sum()),
        left_out=tuple(
            name for name in names_of_all if name not in (*views.names, *duplicates)
        ),
        effects=effects,
        lag=lag,
        remarks=(*messages_on_board(fitted, tolerances, denied), *remarks),
    )


def _require_fit(views: Views, camera: Camera, name: str) -> None:
    """Raise `CalibrationError` if views do not fit their camera's file at any poses."""
    poses, shape = start_board_poses(camera, views), np.zeros(N_SHAPE)
    state = BoardState((camera,), np.eye(3)[None], np.zeros((1, 3)), poses, shape)
    rms = float(np.sqrt(np.nanmean(np.square(fit_board_poses(views, state)))))
    if rms > USELESS * max(camera.image_size):
        raise CalibrationError("pair.other-lens", camera=name, rms=rms)


def _as_alone(views: Views, alone: tuple[CameraCalibration, ...]) -> Views:
    """Return the views without the points that the fit of each camera excluded."""
    pixels = views.pixels.copy()
    for c, each in enumerate(alone):
        rows = {name: v for v, name in enumerate(views.names)}
        pixels[[rows[name] for name in each.left_out], c] = np.nan
        kept = [rows[name] for name in each.views.names]
        pixels[kept, c] = each.views.pixels[:, 0]
    return replace(views, pixels=pixels)


def _rig(
    effects: MixedFit,
    names: tuple[str, str],
    tolerances: BoardTolerances,
    alone: tuple[CameraCalibration, ...],
) -> Rig:
    fitted = effects.adjustment
    state, at = fitted.state, fitted.of_places
    covariance = fitted.covariance[at, at].copy()
    shift = state.translations[1]
    covariance[3:, 3:] += tolerances.scale**2 * np.outer(shift, shift)
    cameras = []
    for c, (camera, field) in enumerate(
        zip(state.cameras, effects.fields, strict=True)
    ):
        own = fitted.of_intrinsics(c)
        known = fitted.covariance[own, own]
        camera = replace(camera, covariance=known, lens_field=field)
        change = alone[c].change if alone else None
        cameras.append(camera if change is None else changed_camera(camera, change))
    return Rig(tuple(cameras), state.rotations, state.translations, covariance, names)


def _between(poses: tuple[BoardPoses, BoardPoses]) -> BoardPoses:
    """Return the place of the second camera by each view, (V, 3, 3) and (V, 3)."""
    one, other = poses
    rotations = other.rotations @ np.swapaxes(one.rotations, 1, 2)
    shifts = np.einsum("vij,vj->vi", rotations, one.translations)
    return BoardPoses(rotations, other.translations - shifts)


def _ordered(
    views: Views, cameras: tuple[Camera, ...], both: BoolArray
) -> tuple[Views, BoardPoses]:
    """Return the views with equal numbering, and the relative pose.

    Raises `CalibrationError` if the views do not agree on that.
    """
    first = start_board_poses(cameras[0], views)
    turned = []
    for order in views.board.orders:
        pixels = views.pixels.copy()
        pixels[:, 1] = pixels[:, 1][:, order]
        turned.append(replace(views, pixels=pixels))
    places = [
        _between((first, start_board_poses(cameras[1], each, 1))) for each in turned
    ]
    rotations = np.stack([each.rotations[both] for each in places])
    translations = np.stack([each.translations[both] for each in places])
    n_places = rotations.shape[1]
    some = np.linspace(0, n_places - 1, min(n_places, MAX_VOTED)).astype(np.int64)
    alike = _alike(rotations, translations, some)
    votes = alike.any(axis=2).sum(axis=-1)
    order, view = divmod(int(np.argmax(votes)), votes.shape[1])
    if votes[order, view] <= both.sum() / 2:
        raise CalibrationError(
            "pair.contradicting",
            n_agree=int(votes[order, view]),
            n_pairs=int(both.sum()),
        )
    chosen = some[view]
    found = BoardPoses(
        rotations[order, chosen][None], translations[order, chosen][None]
    )
    choice = np.zeros(views.n_views, dtype=np.int64)
    choice[both] = np.argmax(alike[order, view], axis=0)
    pixels = np.stack([turned[k].pixels[v] for v, k in enumerate(choice.tolist())])
    agree = ~both
    agree[both] = alike[order, view].any(axis=0)
    return replace(views, pixels=pixels).chosen(agree), found


def _alike(
    rotations: FloatArray, translations: FloatArray, some: IntArray
) -> BoolArray:
    """Tell which relative poses (K, V) agree with some (S,): (K, S, K, V)."""
    between = np.einsum("kvij,lwmj->kvlwim", rotations[:, some], rotations)
    turns = np.linalg.norm(vector_from_rotation(between), axis=-1)
    ours = translations[:, some, None, None]
    apart = np.linalg.norm(ours - translations, axis=-1)
    far = np.linalg.norm(ours, axis=-1)
    return np.asarray((turns < ALIKE_TURN) & (apart < ALIKE_SHIFT * far))


def _poses(views: Views, cameras: tuple[Camera, ...], place: BoardPoses) -> BoardPoses:
    """Return the poses in the rig, by the second camera where the first saw nothing."""
    first = start_board_poses(cameras[0], views)
    second = start_board_poses(cameras[1], views, 1)
    R, t = place.rotations[0], place.translations[0]
    missing = np.isnan(first.translations[:, 0])
    return BoardPoses(
        np.where(missing[:, None, None], R.T @ second.rotations, first.rotations),
        np.where(missing[:, None], (second.translations - t) @ R, first.translations),
    )


def _lag(
    views: Views, fitted: BoardFit, both: BoolArray, interval_ms: float | None
) -> PairLag | None:
    """Return the time lag of the second camera from the motion of the board.

    Its offset from the first camera is proportional to the velocity of the board.
    """
    state = fitted.state
    first = start_board_poses(state.cameras[0], views)
    points = fitted.board_points
    in_first = points @ np.swapaxes(first.rotations, 1, 2)
    in_first += first.translations[:, None]
    in_second = in_first @ state.rotations[1].T + state.translations[1]
    pixels = np.full_like(views.pixels[:, 1], np.nan)
    pixels[both] = state.cameras[1].project(in_second[both])
    middle = both[1:-1] & both[2:] & both[:-2]
    if not middle.any():
        return None
    seen = _means(views.pixels[:, 1])
    off = _means(views.pixels[:, 1] - pixels)[1:-1][middle].ravel()
    speed = (0.5 * (seen[2:] - seen[:-2]))[middle].ravel()
    power = float(speed @ speed)
    if power < (SIGMAS * fitted.sigma / LEAST_LAG) ** 2:
        return None
    lag = float(speed @ off) / power
    left = off - lag * speed
    sigma = float(np.sqrt(left @ left / max(len(left) - 1, 1) / power))
    depth = float(np.median(state.poses.translations[:, 2]))
    return PairLag(
        lag, sigma, interval_ms, PEN_SPEED / 1000 * state.cameras[0].fx / depth
    )


def _means(pixels: FloatArray) -> FloatArray:
    """Return the means of the points of each view, (V, 2); NaN without any."""
    counts = np.isfinite(pixels).sum(axis=1)
    return np.asarray(np.nansum(pixels, axis=1) / np.where(counts > 0, counts, np.nan))


def _message_on_moved(views: Views, fitted: BoardFit, usual: float) -> Message | None:
    """Return the message on views in which the cameras disagree.

    ``usual`` are the residuals of a camera alone, px rms.
    """
    both = np.all(views.found, axis=1)
    rms = np.nanmax(fitted.view_rms[both], axis=1)
    n_apart = int(np.sum(rms > APART * usual))
    if n_apart == 0:
        return None
    return message(
        "pair.moved", n_views=n_apart, n_pairs=int(both.sum()), rms=float(rms.max())
    )
