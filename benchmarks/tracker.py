"""Poses of a tracked pointer: real ones with a published answer, drifting ones."""

from functools import partial
from pathlib import Path

import numpy as np
from benchmarks.rows import Row, numbers, without_data
from benchmarks.workers import Workers
from tests.simulated_centers import correlated_noise
from tests.simulated_swings import swing_of_kind

from lightpen.arrays import BoolArray, FloatArray
from lightpen.estimation.pivot.pivot import fit_pivot
from lightpen.estimation.pivot_calibration import calibrate_pivot
from lightpen.formats.observation_files import PoseTable, read_poses

# scikit-surgerycalibration, algebraic one-step, in its tests
PUBLISHED_TIP = np.array([-14.476, 395.143, -7.558])  # mm
PUBLISHED_PIVOT = np.array([-805.285, -85.448, -2112.066])  # mm
PUBLISHED_LIMIT = 0.001  # mm
OUTLIERS = 0.3  # of the poses
OUTLIER_SIZE = (20.0, 200.0)  # mm
N_DRAWS = 20
SHIFT_LIMIT = 0.2  # mm, below the standard deviation of the tip along each axis
CORRELATIONS = (0.0, 0.5, 0.9, 0.95)  # of the noise of neighbouring poses
COVERED = {0.0: (0.93, 0.975)}  # by U (k = 2); 300 runs tell a share to 1.2 %
COVERED_CORRELATED = (0.9, 1.0)
N_POSES = 500
N_RUNS = 300
NOISE = 0.5  # mm
QUARTERS = 4
QUARTER_LIMIT = 2.0  # times U


def tracker_rows(workers: Workers, data: Path | None) -> list[Row]:
    """Return how true tip and uncertainty are of poses that a tracker measured."""
    return [
        *_published_rows(data),
        *(_coverage_row(workers, correlation) for correlation in CORRELATIONS),
    ]


def _is_covered(seed: int, correlation: float) -> BoolArray:
    """Return whether U covers the error of a calibration, per axis."""
    rng = np.random.default_rng(seed)
    swing = swing_of_kind(N_POSES, rng, "operator")
    noise = NOISE * correlated_noise(N_POSES, correlation, rng)
    found = calibrate_pivot(swing.rotations, swing.translations + noise)
    error = np.abs(found.fit.tip_pen - swing.tip_pen)
    return np.asarray(error < found.expanded_uncertainty[:3])


def _coverage_row(workers: Workers, correlation: float) -> Row:
    covered = workers.map(partial(_is_covered, correlation=correlation), range(N_RUNS))
    shares = np.mean(list(covered), axis=0)
    least, most = COVERED.get(correlation, COVERED_CORRELATED)
    return Row(
        f"`pivot`, {N_POSES} poses, noise of lag-1 correlation {correlation}: "
        f"U (k = 2) covers x y z, {N_RUNS} runs",
        f"{numbers(100 * shares, 1)} %",
        f"{100 * least:.0f} to {100 * most:.1f} %",
        "",
        bool(np.all((shares >= least) & (shares <= most))),
    )


def _quarters_row(poses: PoseTable) -> Row:
    """Return by how many U the tips of quarters are off that of all poses."""
    whole = calibrate_pivot(poses.rotations, poses.translations).fit.tip_pen
    ratios, independent = [], []
    for part in np.array_split(np.arange(len(poses.rotations)), QUARTERS):
        found = calibrate_pivot(poses.rotations[part], poses.translations[part])
        off = np.abs(found.fit.tip_pen - whole)
        ratios.append(off / found.expanded_uncertainty[:3])
        independent.append(off / (2 * np.sqrt(np.diag(found.fit.covariance)[:3])))
    return Row(
        "`optical-tracker`: quarters against the whole, largest difference over U",
        f"{np.max(ratios):.2f}",
        f"<= {QUARTER_LIMIT:.0f}",
        f"by independent noise {np.max(independent):.1f}",
        bool(np.max(ratios) <= QUARTER_LIMIT),
    )


def _published_rows(data: Path | None) -> list[Row]:
    names = (
        "`optical-tracker`: tip and pivot",
        "`optical-tracker`: 30 % outliers",
        "`optical-tracker`: quarters against the whole",
    )
    if data is None:
        return without_data(*names)
    poses = read_poses(data / "pivot-poses" / "optical-tracker.csv")
    plain = fit_pivot(poses.rotations, poses.translations, robust=False)
    difference = max(
        np.abs(plain.tip_pen - PUBLISHED_TIP).max(),
        np.abs(plain.pivot_cam - PUBLISHED_PIVOT).max(),
    )
    rng = np.random.default_rng(1)
    shifts = np.array([_shifts(poses, rng) for _ in range(N_DRAWS)])
    median, largest = np.median(shifts, axis=0), shifts.max(axis=0)
    return [
        Row(
            f"{names[0]}, plain least squares, against the published ones",
            f"{difference:.4f} mm",
            f"<= {PUBLISHED_LIMIT} mm",
            f"scikit-surgery {numbers(PUBLISHED_TIP, 3)} mm",
            bool(difference <= PUBLISHED_LIMIT),
        ),
        Row(
            f"{names[1]} of {OUTLIER_SIZE[0]:.0f} to {OUTLIER_SIZE[1]:.0f} mm: "
            f"shift of the tip, median and largest of {N_DRAWS} draws",
            f"{median[0]:.3f} {largest[0]:.3f} mm",
            f"<= {SHIFT_LIMIT} mm",
            f"plain least squares {median[1]:.1f} {largest[1]:.1f}",
            bool(largest[0] <= SHIFT_LIMIT),
        ),
        _quarters_row(poses),
    ]


def _shifts(poses: PoseTable, rng: np.random.Generator) -> FloatArray:
    """Return how far outliers move the tip of the rest, robust and plain, mm."""
    n = len(poses.rotations)
    hit = rng.permutation(n) < round(OUTLIERS * n)
    directions = rng.standard_normal((n, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    lengths = np.where(hit, rng.uniform(*OUTLIER_SIZE, n), 0.0)
    spoilt = poses.translations + lengths[:, None] * directions
    return np.array(
        [
            np.linalg.norm(
                fit_pivot(poses.rotations, spoilt, robust=robust).tip_pen
                - fit_pivot(
                    poses.rotations[~hit], poses.translations[~hit], robust=robust
                ).tip_pen
            )
            for robust in (True, False)
        ]
    )
