"""Poses as trackers and other programs write them."""

from collections.abc import Callable
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lightpen.errors import FileError
from lightpen.formats.observation_files import read_poses

N_POSES = 12
RNG = np.random.default_rng(5)
ROTATIONS = Rotation.from_rotvec(0.3 * RNG.standard_normal((N_POSES, 3)))
PIVOT, TIP = np.array([60.0, -80.0, -1400.0]), np.array([-18.2, 3.1, -151.4])
MOVED = PIVOT - ROTATIONS.apply(TIP)
QUATERNIONS = ROTATIONS.as_quat()  # x y z w
LOST = 4  # index of the pose that is lost in some files


def rows(*columns: object) -> list[str]:
    """Join columns of N numbers or texts to lines."""
    cells = [
        np.asarray(each).reshape(N_POSES, -1).astype(str).tolist() for each in columns
    ]
    return ["\t".join(chain.from_iterable(row)) for row in zip(*cells, strict=True)]


def ndi(states: list[str]) -> list[str]:
    scalar_first = np.roll(QUATERNIONS, 1, axis=1)
    numbers = np.hstack([scalar_first, MOVED])
    for i, state in enumerate(states):
        numbers[i] = -3.69731e28 if state == "Missing" else numbers[i]
    ports = ["Port 1: NDI 8700000"] * N_POSES
    header = (
        "Tools\tPort 1\tFrame\tState\tQ0\tQx\tQy\tQz\tTx\tTy\tTz\tState\tTx\tTy\tTz"
    )
    frames, markers = np.arange(N_POSES), np.tile(["OK", "1", "2", "3"], (N_POSES, 1))
    ones = np.ones(N_POSES, dtype=int)
    return [header, *rows(ones, ports, frames, states, numbers, markers)]


def scalar_last() -> list[str]:
    header = "time\tqx\tqy\tqz\tqw\ttx_mm\tty_mm\ttz_mm"
    return [header, *rows(np.arange(N_POSES), QUATERNIONS, MOVED)]


def scalar_first() -> list[str]:
    header = "time\tqw\tqx\tqy\tqz\ttx_mm\tty_mm\ttz_mm"
    quaternions = np.roll(QUATERNIONS, 1, axis=1)
    return [header, *rows(np.arange(N_POSES), quaternions, MOVED)]


def tum() -> list[str]:
    lines = rows(np.arange(N_POSES) / 10, MOVED / 1000, QUATERNIONS)
    return [line.replace("\t", " ") for line in lines]


def matrices() -> list[str]:
    whole = np.tile(np.eye(4), (N_POSES, 1, 1))
    whole[:, :3, :3], whole[:, :3, 3] = ROTATIONS.as_matrix(), MOVED
    return [line.replace("\t", ",") for line in rows(whole.reshape(N_POSES, 16))]


@pytest.mark.parametrize(
    "lines", [scalar_last, scalar_first, tum, matrices, lambda: ndi(["OK"] * N_POSES)]
)
def test_poses_of_other_programs_are_read_in_their_conventions(
    tmp_path: Path, lines: Callable[[], list[str]]
) -> None:
    path = tmp_path / "poses.txt"
    path.write_text("\n".join(lines()) + "\n")

    found = read_poses(path)

    np.testing.assert_allclose(found.rotations, ROTATIONS.as_matrix(), atol=1e-9)
    np.testing.assert_allclose(found.translations, MOVED, atol=1e-9)
    assert found.n_lost == 0


def test_lost_frames_of_a_tracker_are_left_out_and_counted(tmp_path: Path) -> None:
    states = ["OK"] * N_POSES
    states[LOST] = "Missing"
    path = tmp_path / "track.tsv"
    path.write_text("\n".join(ndi(states)) + "\n")

    found = read_poses(path)

    kept = np.delete(np.arange(N_POSES), LOST)
    np.testing.assert_allclose(found.translations, MOVED[kept])
    assert (found.places.tolist(), found.n_lost) == ((kept + 1).tolist(), 1)


def test_angles_are_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    path.write_text("rx,ry,rz,tx_mm,ty_mm,tz_mm\n1,2,3,4,5,6\n")

    with pytest.raises(FileError, match=r"quaternions or matrices|columns of poses"):
        read_poses(path)
