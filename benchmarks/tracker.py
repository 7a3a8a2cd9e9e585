"""Real poses of an optical tracker's pointer, with a published answer."""

from pathlib import Path

import numpy as np
from benchmarks.rows import Row, numbers, without_data

from lightpen.arrays import FloatArray
from lightpen.estimation.pivot import fit_pivot
from lightpen.formats.observation_files import PoseTable, read_poses

# scikit-surgerycalibration, algebraic one-step, in its tests
PUBLISHED_TIP = np.array([-14.476, 395.143, -7.558])  # mm
PUBLISHED_PIVOT = np.array([-805.285, -85.448, -2112.066])  # mm
PUBLISHED_LIMIT = 0.001  # mm
OUTLIERS = 0.3  # of the poses
OUTLIER_SIZE = (20.0, 200.0)  # mm
N_DRAWS = 20
SHIFT_LIMIT = 0.2  # mm, below the standard deviation of the tip along each axis


def tracker_rows(data: Path | None) -> list[Row]:
    """Return the difference from the published tip, and the shift by outliers."""
    names = ("`optical-tracker`: tip and pivot", "`optical-tracker`: 30 % outliers")
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
