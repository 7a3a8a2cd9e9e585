"""Two cameras from views in which both detect one board.

The intrinsics are as of each camera alone, or as of their files. With them the place of
the second camera, the board and its poses are fitted together; the covariance of the
place takes whole views as independent, and contains the intrinsics'. A board that looks
the same turned round is numbered as the places of the cameras have it, which is the
same in all views.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.errors import CalibrationError
from lightpen.messages import Message
from lightpen.model.camera import Camera
from lightpen.model.coverage import COVERAGE_FACTOR
from lightpen.model.rigid import Rig, of_camera, vector_from_rotation
from lightpen_extensions.boards.adjustment import (
    FINEST,
    N_POSE,
    N_SHAPE,
    BoardFit,
    BoardState,
    adjust_board,
    fit_board_poses,
    places_at,
)
from lightpen_extensions.boards.calibration import (
    CameraCalibration,
    calibrate_camera,
    without_outliers,
)
from lightpen_extensions.boards.changes import USELESS
from lightpen_extensions.boards.effects import views_without_field
from lightpen_extensions.boards.observing import (
    ObservedBoard,
    Views,
    message_on_duplicates,
    without_duplicates,
)
from lightpen_extensions.boards.report import (
    PINHOLE,
    TITLE,
    board_line,
    board_record,
    camera_record,
    left_out_lines,
    remark_lines,
)
from lightpen_extensions.boards.start import BoardPoses, start_board_poses

MIN_PAIRS = 3
ALIKE_TURN = np.radians(5.0)  # of the place of the second camera from view to view
ALIKE_SHIFT = 0.15  # of its distance
SCALE_SIGMA = 1e-4  # of a board that was not measured, relative; no view tells it
HELD = 1e20  # information of intrinsics that are not fitted again


@dataclass(frozen=True, eq=False)
class PairCalibration:
    """Extrinsics and intrinsics of two cameras."""

    rig: Rig  # with the covariance of the extrinsics, the board's scale included
    views: Views
    adjustment: BoardFit
    # Each camera by its own views; empty if files state the intrinsics.
    alone: tuple[CameraCalibration, ...]
    n_pairs: int  # views in which both cameras see the board
    left_out: tuple[str, ...]  # excluded views
    remarks: tuple[Message, ...]

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
    names: tuple[str, str],
    cameras: tuple[Camera, ...] = (),
    scale_sigma: float = SCALE_SIGMA,
) -> PairCalibration:
    """Calibrate the extrinsics of the second of two cameras.

    ``scale_sigma`` is the relative standard uncertainty of all lengths of the board.
    ``cameras`` are as in their files; by default they are calibrated by the same views.
    Raises `CalibrationError` if too few views are of both, or they contradict each
    other.
    """
    alone: tuple[CameraCalibration, ...] = ()
    if not cameras:
        alone = tuple(calibrate_camera(views.of_camera(c)) for c in range(2))
        cameras = tuple(each.camera for each in alone)
        views = _as_alone(views, alone)
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
    views = views.chosen(np.all(views.found, axis=1))
    for c, camera in enumerate(cameras):
        even = views_without_field(views.of_camera(c), camera.lens_field)
        pixels = views.pixels.copy()
        pixels[:, c] = even.pixels[:, 0]
        views = replace(views, pixels=pixels)
    offsets = np.zeros(3)
    if alone:  # the points of the board are as the first camera has them
        offsets = alone[0].adjustment.board_points - views.board.points
    state = BoardState(
        cameras,
        np.stack([np.eye(3), place.rotations[0]]),
        np.stack([np.zeros(3), place.translations[0]]),
        start_board_poses(cameras[0], views),
        np.zeros(N_SHAPE),
        offsets,
    )
    held = tuple(HELD * np.eye(len(camera.intrinsics)) for camera in cameras)
    fitted = adjust_board(views, state, held)
    kept = without_outliers(views, fitted)
    if int(kept.seen.sum()) < int(views.seen.sum()):
        which = np.isin(views.names, kept.names)
        poses = BoardPoses(*(each[which] for each in fitted.state.poses))
        views, state = kept, replace(state, poses=poses)
        fitted = adjust_board(views, state, held)
    rotations, translations = fitted.state.rotations, fitted.state.translations
    covariance = _covariance(fitted, scale_sigma)
    remarks = [
        of_camera(name, remark)
        for name, each in zip(names, alone, strict=False)
        for remark in each.remarks
        if remark.code != "intrinsics.duplicates"
    ]
    if duplicates:
        remarks.append(message_on_duplicates(views.n_views, duplicates))
    return PairCalibration(
        rig=Rig(cameras, rotations, translations, covariance, names),
        views=views,
        adjustment=fitted,
        alone=alone,
        n_pairs=views.n_views,
        left_out=tuple(
            name for name in names_of_all if name not in (*views.names, *duplicates)
        ),
        remarks=tuple(remarks),
    )


def _covariance(fitted: BoardFit, scale_sigma: float) -> FloatArray:
    """Return the covariance of the place of the second camera, (6, 6), rad and mm.

    What each view changes, its leverage corrected for, as in
    `lightpen_extensions.boards.effects`; then the intrinsics, as they move the place,
    and the scale of the board.
    """
    cameras, first = fitted.state.cameras, places_at(fitted.state.cameras).start
    n = N_POSE
    information = fitted.information[:, first:, first:]
    variance = max(fitted.sigma, FINEST) ** 2
    C = np.linalg.inv(information.sum(axis=0) + variance * fitted.prior[first:, first:])
    changes = []
    for own, score in zip(information, fitted.scores[:, first:], strict=True):
        held_out = np.linalg.solve(np.eye(len(C)) - own @ C, score)
        changes.append(C[:n] @ (0.5 * (score + held_out)))
    found, expected = np.array(changes).T @ np.array(changes), variance * C[:n, :n]
    scale = max(float(np.trace(np.linalg.solve(expected, found))) / n, 1.0)
    n_views = len(changes)
    covariance = (n_views * found + n * scale * expected) / (n_views + n)
    by_intrinsics = -C[:n] @ fitted.information[:, first:, :first].sum(axis=0)
    for c, camera in enumerate(cameras):
        if camera.covariance is not None:
            own = by_intrinsics[:, fitted.of_intrinsics(c)]
            covariance = covariance + own @ camera.covariance @ own.T
    shift = fitted.state.translations[1]
    covariance[3:, 3:] += scale_sigma**2 * np.outer(shift, shift)
    return np.asarray(0.5 * (covariance + covariance.T))


def _require_fit(views: Views, camera: Camera, name: str) -> None:
    """Raise `CalibrationError` if views do not fit their camera's file at any poses."""
    poses, shape = start_board_poses(camera, views), np.zeros(N_SHAPE)
    state = BoardState((camera,), np.eye(3)[None], np.zeros((1, 3)), poses, shape)
    rms = fit_board_poses(views, state).rms
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
    alike = _alike(rotations, translations)
    votes = alike.any(axis=2).sum(axis=-1)
    order, view = divmod(int(np.argmax(votes)), votes.shape[1])
    if votes[order, view] <= both.sum() / 2:
        raise CalibrationError(
            "pair.contradicting",
            n_agree=int(votes[order, view]),
            n_pairs=int(both.sum()),
        )
    found = BoardPoses(rotations[order, view][None], translations[order, view][None])
    choice = np.zeros(views.n_views, dtype=np.int64)
    choice[both] = np.argmax(alike[order, view], axis=0)
    pixels = np.stack([turned[k].pixels[v] for v, k in enumerate(choice.tolist())])
    agree = ~both
    agree[both] = alike[order, view].any(axis=0)
    return replace(views, pixels=pixels).chosen(agree), found


def _alike(rotations: FloatArray, translations: FloatArray) -> BoolArray:
    """Tell which relative poses (K, V) agree with each: (K, V, K, V)."""
    between = np.einsum("kvij,lwmj->kvlwim", rotations, rotations)
    turns = np.linalg.norm(vector_from_rotation(between), axis=-1)
    ours = translations[:, :, None, None]
    apart = np.linalg.norm(ours - translations, axis=-1)
    far = np.linalg.norm(ours, axis=-1)
    return np.asarray((turns < ALIKE_TURN) & (apart < ALIKE_SHIFT * far))


def pair_text(calibration: PairCalibration, observed: ObservedBoard) -> str:
    """Return the calibration of two cameras as text for the screen."""
    rig, fitted = calibration.rig, calibration.adjustment
    assert rig.covariance is not None
    u = COVERAGE_FACTOR * np.sqrt(np.diag(rig.covariance))
    turn = np.degrees(vector_from_rotation(rig.rotations[1]))
    one, other = rig.names
    lines = [
        f"{other} from {one}".ljust(30) + "".join(f"{axis:>13}" for axis in "xyz"),
        _row("Turn, degrees", turn),
        _row("  U (k = 2)", np.degrees(u[:3])),
        _row("Translation, mm", rig.translations[1]),
        _row("  U (k = 2)", u[3:]),
        "",
        f"{'Baseline':<{TITLE}}{calibration.baseline:.3f} mm, U = "
        f"{COVERAGE_FACTOR * calibration.baseline_sigma:.3f} mm",
        f"{'Views':<{TITLE}}{calibration.n_pairs} of both cameras used, of "
        f"{observed.views.n_views}",
        f"{'Residuals':<{TITLE}}{fitted.rms:.4f} px rms",
        *left_out_lines(calibration.left_out, "of one camera, or the cameras differ"),
    ]
    for name, camera in zip(rig.names, rig.cameras, strict=True):
        four = zip(PINHOLE, camera.intrinsics.tolist(), strict=False)
        values = [f"{n} {value:.2f}" for n, value in four]
        if camera.covariance is not None:
            of = COVERAGE_FACTOR * np.sqrt(np.diag(camera.covariance))
            values = [f"{v} \u00b1 {b:.2f}" for v, b in zip(values, of, strict=False)]
        lines.append(f"{name[: TITLE - 1]:<{TITLE}}{', '.join(values)} px")
    lines += [board_line(fitted), *remark_lines(calibration.remarks)]
    return "\n".join(lines)


def pair_record(
    calibration: PairCalibration, observed: ObservedBoard
) -> dict[str, Any]:
    """Return the calibration of two cameras as a record."""
    rig, fitted = calibration.rig, calibration.adjustment
    return {
        "kind": "extrinsics",
        "board": calibration.views.board.name,
        "cameras": [
            {"name": name, **camera_record(camera)}
            for name, camera in zip(rig.names, rig.cameras, strict=True)
        ],
        "cam_from_rig_rotation": rig.rotations[1],
        "cam_from_rig_translation_mm": rig.translations[1],
        "extrinsics_covariance": rig.covariance,
        "baseline_mm": calibration.baseline,
        "baseline_expanded_uncertainty_mm": (
            COVERAGE_FACTOR * calibration.baseline_sigma
        ),
        "rms_px": fitted.rms,
        "noise_px": fitted.sigma,
        "views_of_both": calibration.n_pairs,
        "board_found": board_record(fitted),
        "views": [
            {"name": name, "rms_px": rms}
            for name, rms in zip(calibration.views.names, fitted.view_rms, strict=True)
        ],
        "views_left_out": calibration.left_out,
        "images_without_board": observed.unseen,
        "remarks": calibration.remarks,
    }


def _row(title: str, values: FloatArray) -> str:
    return f"  {title:<28}" + "".join(f"{value:13.4f}" for value in values)
