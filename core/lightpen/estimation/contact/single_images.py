"""Single images of one camera: their poses, and which agree on a tip."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.detection.labelling.causes import UNKNOWN_CAUSE, cause_of_misfit
from lightpen.detection.observations import Observations
from lightpen.detection.pose import MIN_POSE_LEDS, Poses, fit_poses
from lightpen.detection.reasons import Reason, counted
from lightpen.errors import CalibrationError
from lightpen.estimation.pivot.pivot import PivotFit, fit_pivot
from lightpen.estimation.variance_components import CERTAIN
from lightpen.messages import Message, message
from lightpen.model.camera import Camera
from lightpen.model.coverage import chi_square_quantile
from lightpen.model.pen import Pen
from lightpen.model.rigid import rotation_from_vector

MIN_IMAGES = 6  # the paper starts from six
MAX_SIGMA = 1.0  # px, of one image coordinate; LED errors of 0.3 mm make this
USUAL_SIGMA = 0.1  # px
# An LED that runs along an arc during the exposure appears inside it, which moves the
# pose of a blurred image by some hundredths of a millimetre; more is a slip.
MAX_SMEAR = 0.15  # mm
SMEARED = 1.25  # times the usual edge width of the LEDs
TRUSTED_WEIGHT = 0.2  # of the Cauchy loss, at eight standard deviations


@dataclass(frozen=True, eq=False)
class PosedImages:
    """The images of one camera, each alone."""

    reasons: npt.NDArray[np.object_]  # (N,), why an image is left out
    posed: IntArray  # (M,), images that have a pose
    poses: Poses
    # (F,), images whose pose most LEDs agree with; ``pivot`` is of these.
    fitted: IntArray
    kept: IntArray  # (K,), indices among the M whose tip agrees with most
    pivot: PivotFit  # tip and cone, from poses mostly in ``kept``

    @property
    def chosen(self) -> IntArray:
        """Usable images, (K,)."""
        return np.asarray(self.posed[self.kept])


def pose_images(camera: Camera, pen: Pen, observations: Observations) -> PosedImages:
    """Fit the pose of each image and exclude images of another tip.

    Raises `CalibrationError` if the images do not determine the tip.
    """
    reasons = np.array(observations.reasons, dtype=object)
    posed = np.flatnonzero(reasons == Reason.NONE)
    require_images(posed, reasons, observations.advice)
    poses = fit_poses(
        camera,
        pen,
        observations.pixels[posed],
        observations.rotations[posed],
        observations.translations[posed],
    )
    seen = observations.pixels[posed]
    require_fit(poses.sigma, camera, pen, seen)
    fitting = _fitting(poses)
    reasons[posed[~fitting]] = Reason.MISFIT
    require_images(posed[fitting], reasons, observations.advice)
    try:
        pivot = fit_pivot(
            poses.rotations[fitting],
            poses.translations[fitting],
            poses.covariances[fitting],
        )
    except CalibrationError as error:
        if error.message.code != "pivot.tip-moved" or poses.sigma <= USUAL_SIGMA:
            raise
        raise CalibrationError(
            "calibrate.leds-do-not-fit-nor-tip",
            sigma=poses.sigma,
            usual=USUAL_SIGMA,
            cause=cause_of_misfit(camera, pen, seen) or UNKNOWN_CAUSE,
        ) from error
    outliers = posed[fitting][~pivot.used]
    distances = np.linalg.norm(pivot.residuals[~pivot.used], axis=1)
    smeared = _smeared(observations)[outliers] & (distances < MAX_SMEAR)
    reasons[outliers[smeared]] = Reason.BLURRED
    reasons[outliers[~smeared]] = Reason.SLIPPED
    return PosedImages(
        reasons=reasons,
        posed=posed,
        poses=poses,
        fitted=posed[fitting],
        kept=np.flatnonzero(fitting)[pivot.used],
        pivot=pivot,
    )


def require_fit(sigma: float, camera: Camera, pen: Pen, pixels: FloatArray) -> None:
    """Raise `CalibrationError` if LEDs lie farther off the model than any measured, px.

    It names the cause by the centres ``pixels`` (N, L, 2), px.
    """
    if sigma > MAX_SIGMA:
        cause = cause_of_misfit(camera, pen, pixels) or UNKNOWN_CAUSE
        raise CalibrationError(
            "calibrate.leds-do-not-fit", sigma=sigma, usual=USUAL_SIGMA, cause=cause
        )


def _smeared(observations: Observations) -> BoolArray:
    """Return the mask of images with clearly wider LED edges than most."""
    widths = observations.edge_widths
    known = widths[np.isfinite(widths)]
    usual = np.median(known) if len(known) else np.inf
    return np.asarray(np.nan_to_num(widths) > SMEARED * usual)


def _fitting(poses: Poses) -> BoolArray:
    """Return the mask of images whose pose agrees with most of their LEDs."""
    n_seen = (poses.weights > 0).sum(axis=1)
    n_trusted = (poses.weights > TRUSTED_WEIGHT).sum(axis=1)
    return np.asarray((n_trusted >= MIN_POSE_LEDS) & (2 * n_trusted > n_seen))


def require_images(
    chosen: IntArray, reasons: npt.NDArray[np.object_], advice: Message | None
) -> None:
    """Raise `CalibrationError` if too few images are usable.

    ``chosen`` (M,) are those that are. It names the ``reasons`` (N,) of the others, and
    the advice on the whole set.
    """
    if len(chosen) >= MIN_IMAGES:
        return
    left_out = tuple(
        counted(int(np.sum(reasons == reason)), reason)
        for reason in Reason
        if reason and np.any(reasons == reason)
    )
    usable = message(
        "calibrate.images-usable", n_usable=len(chosen), n_images=len(reasons)
    )
    if left_out:
        usable = message("calibrate.images-left-out", usable=usable, left_out=left_out)
    more = message("calibrate.capture-more")
    raise CalibrationError(
        "calibrate.too-few-images",
        usable=usable,
        needed=MIN_IMAGES,
        advice=advice or more,
    )


# Motion of the camera during a swing by fixed lamps in view.
#
# A small motion of the camera shifts lamps and pen alike. The common shift of the lamps
# is a random walk, of the first order or of the second, whichever is likelier; its step
# is estimated beside the noise of a lamp's centre by maximum likelihood. The
# coefficients of the cosine transform are independent [1]_; each is filtered of its
# noise (Wiener).
#
# A lamp itself may move, so the shift is removed from the images only if the pen shifts
# with it.
#
# References
# ----------
# .. [1] G. Strang, "The discrete cosine transform", SIAM Review 41 (1999) 135-147.


MIN_LIT_IMAGES = 10
LEAST = 1e-6  # px, of noise and motion; exact lamps would divide by zero
RATIOS = np.geomspace(1e-8, 1e4, 200)  # of the variances of a step and of a lamp
HALF = 0.5  # of the lamp shift, by which the pen shifts at least if the camera moved
WITH_LAMPS = 1.5  # times the lamp shift, largest shift of a pen beside them
FAR = 3.0  # times the usual distance; beyond, the tip has slipped


@dataclass(frozen=True, eq=False)
class CameraPath:
    """Shift of the images of a camera by its fixed lamps."""

    lamps: FloatArray  # (K, 2), of the lamps, px
    # (N, 2), shift of each image, filtered of noise, px; 0 on average.
    shifts: FloatArray
    noise: float  # standard deviation of a coordinate of the lamps in one image, px
    is_followed: bool = False  # whether the pen shifts with the lamps: the camera moves

    @cached_property
    def moved(self) -> float:
        """Largest difference between two shifts, px; 0 without motion."""
        apart = self.shifts[:, None] - self.shifts
        return float(np.linalg.norm(apart, axis=2).max())


@dataclass(frozen=True, eq=False)
class SteadyImages:
    """The images of one camera with its motion removed."""

    observations: Observations  # observations with the camera motion removed
    posed: PosedImages
    path: CameraPath | None  # None without a fixed lamp in view


def pose_steadily(camera: Camera, pen: Pen, observations: Observations) -> SteadyImages:
    """Fit the pose of each image, with the motion of the camera removed.

    Raises `CalibrationError` if the images do not determine the tip.
    """
    path = _way_of(observations)
    if path is None:
        return SteadyImages(observations, pose_images(camera, pen, observations), path)
    with suppress(CalibrationError):  # raised for a camera that moves too far
        posed = pose_images(camera, pen, observations)
        if _share_of_pen(camera, path, posed) < HALF:
            return SteadyImages(observations, posed, path)
    path = replace(path, is_followed=True)
    still = steadied(camera, observations, path)
    return SteadyImages(still, pose_images(camera, pen, still), path)


def _way_of(observations: Observations) -> CameraPath | None:
    """Return the motion of the camera by the images that show the pen.

    A captured swing contains no others.
    """
    shown = np.flatnonzero([reason.shows_pen for reason in observations.reasons])
    path = follow_lamps(observations.lamps[shown])
    if path is None:
        return None
    index = np.arange(len(observations.reasons))
    shifts = [np.interp(index, shown, each) for each in path.shifts.T]
    return replace(path, shifts=np.stack(shifts, axis=1))


def steadied(
    camera: Camera, observations: Observations, path: CameraPath | None
) -> Observations:
    """Return observations with the camera's motion removed, as a rotation of it."""
    if path is None or not path.is_followed:
        return observations
    turns = _turns(camera, path)
    seen = np.isfinite(observations.seen_pixels[..., 0])
    image = np.nonzero(seen)[0]

    def turned_back(pixels: FloatArray) -> FloatArray:
        rays = np.ones((len(image), 3))
        rays[:, :2] = camera.unproject(pixels[seen])
        moved = np.full_like(pixels, np.nan)
        moved[seen] = camera.project(np.einsum("nji,nj->ni", turns[image], rays))
        return moved

    return replace(
        observations,
        pixels=turned_back(observations.pixels),
        seen_pixels=turned_back(observations.seen_pixels),
    )


def without_field(camera: Camera, observations: Observations) -> Observations:
    """Return observations less the lens field that the camera file states."""
    return replace(observations, pixels=camera.without_lens_field(observations.pixels))


def _turns(camera: Camera, path: CameraPath) -> FloatArray:
    """Return the turn of the camera in each image, (N, 3, 3).

    Along x and y; lamps hardly show its rotation about the line of sight.
    """
    plane = camera.unproject_with_jacobian(path.lamps.mean(axis=0))
    x, y = plane.points
    # A small rotation w moves the image there by this matrix times (w_x, w_y).
    by_turn = np.array([[-x * y, 1 + x * x], [-1 - y * y, x * y]])
    about = np.linalg.solve(by_turn, plane.jacobian @ path.shifts.T).T
    return rotation_from_vector(np.column_stack([about, np.zeros(len(about))]))


def follow_lamps(lamps: FloatArray) -> CameraPath | None:
    """Estimate the motion of a camera by its lamps (N, K, 2), px; NaN where not shown.

    None without lamps, or with too few images.
    """
    n_images, n_lamps, _ = lamps.shape
    if n_lamps == 0 or n_images < MIN_LIT_IMAGES:
        return None
    from scipy.fft import dct, idct  # takes 0.1 s

    places = np.nanmedian(lamps, axis=0)
    seen = np.isfinite(lamps[..., 0]).any(axis=1)
    together = np.nanmedian((lamps - places)[seen], axis=1)
    index = np.arange(n_images)
    way = np.stack([np.interp(index, index[seen], each) for each in together.T], axis=1)
    coefficients = dct(way, axis=0, norm="ortho")[1:]
    waves = np.arange(1, n_images)
    # Variances of a random walk with steps of 1, and of the sum of such a walk.
    by_steps = 1 / (2 - 2 * np.cos(np.pi * waves / n_images))[:, None]
    walks = by_steps ** np.array([[[1]], [[2]]])
    ratios = np.concatenate([[0.0], RATIOS])
    totals = 1 + ratios[:, None, None, None] * walks
    variances = np.mean(coefficients**2 / totals, axis=(2, 3)) + LEAST**2
    costs = coefficients.size * np.log(variances) + 2 * np.log(totals).sum(axis=(2, 3))
    best = np.unravel_index(int(np.argmin(costs)), costs.shape)
    shifts = np.zeros_like(way)
    if costs[0, 0] - costs[best] > chi_square_quantile(1, CERTAIN):
        shifts[1:] = coefficients * (1 - 1 / totals[best])
        shifts = idct(shifts, axis=0, norm="ortho")
    noise = float(np.sqrt(variances[best]))
    return CameraPath(places, shifts, noise)


def _share_of_pen(camera: Camera, path: CameraPath, posed: PosedImages) -> float:
    """Return the shift of the tip over that of the lamps, by least squares."""
    pivot = posed.pivot
    by_lamps = path.shifts[posed.fitted] * pivot.pivot_cam[2] / camera.fx
    by_pen = pivot.residuals[:, :2]
    lengths = np.linalg.norm(by_pen - np.median(by_pen, axis=0), axis=1)
    farthest = WITH_LAMPS * np.linalg.norm(np.ptp(by_lamps, axis=0))
    near = lengths < FAR * np.median(lengths) + farthest
    by_lamps, by_pen = (
        each[near] - each[near].mean(axis=0) for each in (by_lamps, by_pen)
    )
    together = np.sum(by_lamps * by_pen)
    return float(together / max(np.sum(by_lamps**2), LEAST**2))


# The images of one camera after the calibration, and of all at one moment.


@dataclass(frozen=True, eq=False)
class CameraImages:
    """The images of one camera in a calibration, one at each of N moments."""

    observations: Observations
    # Why an image was left out; `Reason.NONE` for the used ones.
    reasons: tuple[Reason, ...]
    # (N,), root mean square residual of each image, px; NaN without a pose.
    rms: FloatArray
    leds_used: BoolArray  # (N, L)
    total_rms: float  # root mean square residual of all LEDs used, px
    path: CameraPath | None  # motion of the camera by its fixed lamps; None without any

    @property
    def used(self) -> BoolArray:
        """Mask of the used images, (N,)."""
        return np.array([reason is Reason.NONE for reason in self.reasons])


def reasons_of_moments(cameras: Sequence[CameraImages]) -> tuple[Reason, ...]:
    """Return why each moment is excluded; NONE if one of its images is used."""
    reasons = []
    for of_cameras in zip(*(each.reasons for each in cameras), strict=True):
        present = [reason for reason in of_cameras if reason is not Reason.ABSENT]
        reasons.append(Reason.NONE if Reason.NONE in present else present[0])
    return tuple(reasons)


def rms_of_moments(cameras: Sequence[CameraImages]) -> FloatArray:
    """Return the rms residual of the images of each moment, px, (N,)."""
    rms = np.stack([each.rms for each in cameras], axis=1)
    known = np.isfinite(rms)
    seen = np.stack([each.observations.pixels[..., 0] for each in cameras], axis=1)
    counts = np.where(known, np.isfinite(seen).sum(axis=2), 0)
    clean = np.where(known, rms, 0.0)
    mean = np.sum(counts * clean**2, axis=1) / np.maximum(counts.sum(axis=1), 1)
    alone = known.sum(axis=1) == 1
    together = np.where(alone, clean.sum(axis=1), np.sqrt(mean))
    return np.where(known.any(axis=1), together, np.nan)
