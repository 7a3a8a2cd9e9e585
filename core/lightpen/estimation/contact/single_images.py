"""Single images of one camera: their poses, and which agree on a tip."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.detection.labelling.causes import UNKNOWN_CAUSE, cause_of_misfit
from lightpen.detection.observations import Observations
from lightpen.detection.pose import MIN_POSE_LEDS, Poses, fit_poses
from lightpen.detection.reasons import Reason, counted
from lightpen.errors import CalibrationError
from lightpen.estimation.pivot.pivot import PivotFit, fit_pivot
from lightpen.messages import Message, message
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen

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
