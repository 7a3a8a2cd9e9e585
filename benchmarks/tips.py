"""The tip from the image sets: errors against the truth, and repeatability."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np
from benchmarks.image_sets import ImageSet, read_image_set
from benchmarks.peers import (
    DEFAULT_BLOB_STEP,
    blob_centers,
    blob_detector,
    grey_centroids,
    nearest,
)
from benchmarks.rows import NO_LIMIT, Row, numbers, without_data
from benchmarks.workers import Workers

from lightpen.arrays import FloatArray, Image
from lightpen.detection.observations import (
    Observations,
    observe_centers,
    observe_images,
)
from lightpen.detection.pose import Poses, fit_poses
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.pivot.pivot import PivotFit, fit_pivot
from lightpen.formats.observation_files import read_centers

TIP_LIMITS = {"swing-full": 3.5, "swing-clean": 4.0, "fixed-point": None}  # µm
CENTER_LIMIT = 0.006  # px
REPEAT_LIMITS = np.array([0.7, 1.5, 1.5])  # µm
UM = 1000.0  # in a millimetre
N_PEER_IMAGES = 60  # of a set, for the centres of others


@dataclass(frozen=True, eq=False)
class _Outcome:
    """Errors of one image set: tips in µm, centres in px."""

    joint: float
    two_stage: float
    one_step: float
    weighted: float
    centers: float
    blobs: float
    default_blobs: float
    centroids: float


def tip_rows(workers: Workers, data: Path | None) -> list[Row]:
    """Return the errors of tip and LED centres on the sets of images."""
    if data is None:
        figures = ("tip error", "LED centres, rms")
        return without_data(*(f"`{n}`: {what}" for n in TIP_LIMITS for what in figures))
    outcomes = workers.map(_outcome, [data / name for name in TIP_LIMITS])
    rows = []
    for (name, limit), found in zip(TIP_LIMITS.items(), outcomes, strict=True):
        rows += [
            Row(
                f"`{name}`: tip error",
                f"{found.joint:.1f} µm",
                NO_LIMIT if limit is None else f"<= {limit:g} µm",
                f"two-stage (paper) {found.two_stage:.1f}; algebraic one-step "
                f"{found.one_step:.1f}, weighted {found.weighted:.1f}",
                limit is None or found.joint <= limit,
            ),
            Row(
                f"`{name}`: LED centres, rms",
                f"{found.centers:.4f} px",
                f"<= {CENTER_LIMIT} px",
                f"cv2.SimpleBlobDetector {found.blobs:.4f}, at its default step "
                f"{found.default_blobs:.4f}; grey centroid {found.centroids:.4f}",
                found.centers <= CENTER_LIMIT,
            ),
        ]
    return rows


def repeat_rows(workers: Workers, data: Path | None) -> list[Row]:
    """Return the repeatability over the ten calibrations of `repeat`."""
    what = "`repeat`: std of 10 calibrations, x y z"
    if data is None:
        return without_data(what)
    files = sorted((data / "repeat").glob("calib_*.csv"))
    tips = UM * np.array(workers.map(_repeated_tips, files))
    joint, two_stage, one_step = tips.std(axis=0, ddof=1)
    return [
        Row(
            what,
            f"{numbers(joint, 2)} µm",
            f"<= {numbers(REPEAT_LIMITS, 1)} µm",
            f"two-stage (paper) {numbers(two_stage, 1)}; algebraic one-step "
            f"{numbers(one_step, 1)}",
            bool(np.all(joint <= REPEAT_LIMITS)),
        )
    ]


def one_step(poses: Poses, *, weighted: bool) -> PivotFit:
    """Fit tip and cone by linear least squares, weighted by the poses' covariances."""
    covariances = poses.covariances if weighted else None
    return fit_pivot(poses.rotations, poses.translations, covariances, robust=False)


def poses_of(image_set: ImageSet, calibration: Calibration) -> Poses:
    """Return the poses that a calibration was made from."""
    seen: Observations = calibration.observations
    return fit_poses(
        image_set.camera,
        image_set.pen,
        seen.pixels[calibration.used],
        seen.rotations[calibration.used],
        seen.translations[calibration.used],
    )


def _outcome(folder: Path) -> _Outcome:
    image_set = read_image_set(folder)
    camera, pen = image_set.camera, image_set.pen
    seen = observe_images(image_set.images, camera, pen, n_threads=1)
    calibration = calibrate(camera, pen, seen)
    poses = poses_of(image_set, calibration)

    def error(tip_pen: FloatArray) -> float:
        return UM * float(np.linalg.norm(tip_pen - image_set.true_tip))

    return _Outcome(
        joint=error(calibration.joint.tip_pen),
        two_stage=error(calibration.two_stage.tip_pen),
        one_step=error(one_step(poses, weighted=False).tip_pen),
        weighted=error(one_step(poses, weighted=True).tip_pen),
        centers=_rms(seen.pixels - image_set.true_centers),
        blobs=_rms_of(partial(blob_centers, blob_detector()), image_set),
        default_blobs=_rms_of(
            partial(blob_centers, blob_detector(DEFAULT_BLOB_STEP)), image_set
        ),
        centroids=_rms_of(grey_centroids, image_set),
    )


def _rms_of(find: Callable[[Image], FloatArray], image_set: ImageSet) -> float:
    """Return the rms error of the centres that another method finds, px."""
    true = image_set.true_centers[:N_PEER_IMAGES]
    loaders = islice(image_set.images.open(), N_PEER_IMAGES)
    found = [nearest(find(load()), t) for load, t in zip(loaders, true, strict=True)]
    return _rms(np.array(found) - true)


def _rms(errors: FloatArray) -> float:
    """Return the root mean square length of errors (N, L, 2), NaN left out."""
    return float(np.sqrt(np.nanmean(np.sum(errors**2, axis=-1))))


def _repeated_tips(file: Path) -> FloatArray:
    """Return the tip by joint, two-stage and one-step estimator, (3, 3), mm."""
    image_set = read_image_set(file.parent)
    camera, pen = image_set.camera, image_set.pen
    centers = read_centers(file, pen.n_leds)
    calibration = calibrate(camera, pen, observe_centers(centers, camera, pen))
    plain = one_step(poses_of(image_set, calibration), weighted=False)
    return np.array(
        [calibration.joint.tip_pen, calibration.two_stage.tip_pen, plain.tip_pen]
    )
