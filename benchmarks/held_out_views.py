"""Error of views that a calibration was not fitted to, beside OpenCV and mrcal.

    python -m benchmarks.held_out_views IMAGES --board chessboard:9x6:25

Each fifth of the views of a chessboard is left out in turn. All methods get the same
corners and the same parts; the views left out get their poses by the camera and the
board that each method found. mrcal (Debian: `mrcal`) is asked if it is installed.
"""

import argparse
import json
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import cv2
import numpy as np
from benchmarks.board_trials import photographed
from benchmarks.rows import Row
from benchmarks.workers import Workers

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.formats.images import find_images
from lightpen.model.camera import Camera
from lightpen_extensions.boards.adjustment import N_SHAPE, BoardState, fit_board_poses
from lightpen_extensions.boards.boards import parse_board
from lightpen_extensions.boards.calibration import calibrate_camera
from lightpen_extensions.boards.distortion import FEW
from lightpen_extensions.boards.effects import rms_together
from lightpen_extensions.boards.observing import Views, observe_board
from lightpen_extensions.boards.start import start_board_poses, start_camera

N_PARTS = 5
N_SETS = 6  # as photographed
MOST = 1.0  # times the least error of the others
MRCAL = "mrcal-calibrate-cameras"
SETTLED = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-9)
# Run by the interpreter of mrcal, which is the system's.
BY_MRCAL = """
import json, sys
import mrcal
import numpy as np

given = np.load(sys.argv[1])
n, start = len(given["frames"]), given["start"]
model = f"LENSMODEL_OPENCV{len(start) - 4}"
inputs = dict(
    intrinsics=start[None].copy(), extrinsics_rt_fromref=np.zeros((0, 6)),
    frames_rt_toref=given["frames"].copy(), points=None,
    observations_board=given["observations"].copy(),
    indices_frame_camintrinsics_camextrinsics=np.array(
        [[v, 0, -1] for v in range(n)], dtype=np.int32),
    observations_point=None, indices_point_camintrinsics_camextrinsics=None,
    lensmodel=model, imagersizes=given["size"].astype(np.int32)[None],
    calibration_object_spacing=float(given["pitch"]), verbose=False,
    calobject_warp=np.zeros(2))
mrcal.optimize(**inputs, do_optimize_intrinsics_distortions=False,
               do_optimize_calobject_warp=False, do_apply_outlier_rejection=False)
mrcal.optimize(**inputs, do_optimize_calobject_warp=True,
               do_apply_outlier_rejection=True)
points = mrcal.ref_calibration_object(
    *given["observations"].shape[2:0:-1], float(given["pitch"]),
    calobject_warp=inputs["calobject_warp"])
print(json.dumps([inputs["intrinsics"][0].tolist(), points.reshape(-1, 3).tolist()]))
"""


class Found(NamedTuple):
    """A camera, and the points of its board."""

    camera: Camera
    points: FloatArray  # (N, 3), mm


def by_this_program(views: Views) -> Found:
    """Return the camera of `lightpen intrinsics`."""
    found = calibrate_camera(views)
    return Found(found.camera, found.adjustment.board_points)


def by_opencv(views: Views, *, is_free: bool = False) -> Found:
    """Return the camera of `calibrateCamera`, or of `calibrateCameraRO`."""
    board = views.board
    points = [board.points.astype(np.float32)] * views.n_views
    seen = list(views.pixels[:, 0].astype(np.float32)[:, :, None])
    fixed = board.columns - 1 if is_free else -1
    found = cv2.calibrateCameraRO(
        *(points, seen, views.image_sizes[0], fixed, np.eye(3), np.zeros(5)),
        criteria=SETTLED,
    )
    K = np.asarray(found[1], dtype=np.float64)
    values = np.concatenate([K[[0, 1, 0, 1], [0, 1, 2, 2]], np.ravel(found[2])])
    places = np.reshape(found[5], (-1, 3)) if is_free else board.points
    return Found(_camera(views, values), np.asarray(places, dtype=np.float64))


def by_mrcal(views: Views, n_coefficients: int) -> Found:
    """Return the camera of mrcal with a board that may be bent."""
    board, near = views.board, start_camera(views, FEW)
    poses = start_board_poses(near, views)
    frames = [
        np.concatenate([cv2.Rodrigues(R)[0].ravel(), t + R @ board.points[0]])
        for R, t in zip(poses.rotations, poses.translations, strict=True)
    ]
    observations = np.ones((views.n_views, board.rows, board.columns, 3))
    observations[..., :2] = views.pixels[:, 0].reshape(*observations.shape[:3], 2)
    start = np.concatenate([near.intrinsics[:4], np.zeros(n_coefficients)])
    interpreter = _interpreter()
    assert interpreter is not None
    with TemporaryDirectory() as folder:
        file = Path(folder) / "views.npz"
        np.savez(
            file,
            frames=np.array(frames),
            observations=observations,
            start=start,
            size=np.array(views.image_sizes[0]),
            pitch=board.pitch,
        )
        ran = subprocess.run(
            [interpreter, "-c", BY_MRCAL, str(file)],
            capture_output=True,
            text=True,
            check=True,
        )
    values, points = map(np.array, json.loads(ran.stdout.splitlines()[-1]))
    return Found(_camera(views, values), points + board.points[0])


def _interpreter() -> str | None:
    """Return the Python that mrcal is installed for; None without mrcal."""
    tool = shutil.which(MRCAL)
    return None if tool is None else Path(tool).read_text().splitlines()[0][2:].strip()


def _camera(views: Views, values: FloatArray) -> Camera:
    near = start_camera(views, len(values) - 4)
    return near.with_intrinsics(values)


def methods() -> dict[str, Callable[[Views], Found]]:
    """Return the methods by name."""
    found: dict[str, Callable[[Views], Found]] = {
        "lightpen": by_this_program,
        "calibrateCamera": by_opencv,
        "calibrateCameraRO": partial(by_opencv, is_free=True),
    }
    if _interpreter() is not None:
        for n in (5, 8):
            found[f"mrcal {n}"] = partial(by_mrcal, n_coefficients=n)
    return found


def held_out(views: Views, method: Callable[[Views], Found]) -> float:
    """Return the error of views by the camera of the others, px rms.

    Infinite where that camera does not image them.
    """
    try:
        return _held_out(views, method)
    except CalibrationError:
        return np.inf


def _held_out(views: Views, method: Callable[[Views], Found]) -> float:
    part = np.random.default_rng(1).permutation(views.n_views) % N_PARTS
    errors = np.empty(views.n_views)
    for k in range(N_PARTS):
        camera, points = method(views.chosen(part != k))
        others = views.chosen(part == k)
        pixels = camera.without_lens_field(others.pixels)
        others = replace(others, pixels=pixels)
        plain = replace(camera, lens_field=None, covariance=None)
        state = BoardState(
            *((plain,), np.eye(3)[None], np.zeros((1, 3))),
            start_board_poses(plain, others),
            np.zeros(N_SHAPE),
            points - views.board.points,
        )
        errors[part == k] = fit_board_poses(others, state).view_rms[:, 0]
    return rms_together(errors, views)


def whole_views(views: Views) -> Views:
    """Return the views that show every corner, which OpenCV needs."""
    return views.chosen(np.all(views.seen, axis=(1, 2)))


def held_out_rows(workers: Workers, data: Path | None) -> list[Row]:
    """Return the error of views left out by all methods on the same parts."""
    sets = {f"{N_SETS} sets as photographed": list(map(photographed, range(N_SETS)))}
    if data is not None:
        folder = str(data / "chessboard")
        sets["`chessboard`"] = [_observed(folder, "chessboard:11x8:20")]
    return [
        _row(workers, name, list(map(whole_views, each))) for name, each in sets.items()
    ]


def _row(workers: Workers, name: str, sets: list[Views]) -> Row:
    """Return the mean ratio to the best of the others, and the errors."""
    names, functions = zip(*methods().items(), strict=True)
    jobs = [(views, method) for method in functions for views in sets]
    found = np.reshape(workers.map(_of_job, jobs), (len(names), len(sets)))
    errors = dict(zip(names, found, strict=True))
    ours = errors.pop("lightpen")
    ratio = float(np.exp(np.mean(np.log(ours / np.min(list(errors.values()), axis=0)))))
    return Row(
        f"{name}: error of views left out, over the least of the others",
        f"{np.sqrt(np.mean(ours**2)):.4f} px, {ratio:.3f}",
        f"<= {MOST:.2f}",
        ", ".join(f"{n} {np.sqrt(np.mean(e**2)):.4f} px" for n, e in errors.items()),
        met=ratio <= MOST,
    )


def _of_job(job: tuple[Views, Callable[[Views], Found]]) -> float:
    return held_out(*job)


def _observed(folder: str, word: str) -> Views:
    return observe_board(find_images(folder), parse_board(word), lambda _: None).views


def main() -> None:
    """Print the errors of views left out of a folder of photographs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("images")
    parser.add_argument("--board", required=True)
    options = parser.parse_args()
    views = whole_views(_observed(options.images, options.board))
    print(f"{views.n_views} views")
    for name, method in methods().items():
        print(f"{name:20} {held_out(views, method):.4f} px")


if __name__ == "__main__":
    main()
