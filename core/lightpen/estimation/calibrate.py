"""The calibration of a probe tip: from observations to the tip and what it is worth."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.detection.observations import (
    Observations,
)
from lightpen.detection.pose import MIN_POSE_LEDS, Poses, fit_paper_poses, fit_poses
from lightpen.detection.reasons import Reason
from lightpen.errors import CalibrationError
from lightpen.estimation.adjustment import adjust
from lightpen.estimation.bundle import Bundle
from lightpen.estimation.contradictions import Contradiction
from lightpen.estimation.joint import JointFit, fit_joint, joint_at
from lightpen.estimation.led_quality import LedQuality, measure_leds
from lightpen.estimation.pivot import fit_pivot
from lightpen.estimation.priors import Priors
from lightpen.estimation.two_stage import (
    TwoStageFit,
    fit_two_stage,
    propagated_covariance,
)
from lightpen.estimation.uncertainty import Budget, Halves, combine, compare_halves
from lightpen.model.assumptions import USUAL, Assumptions
from lightpen.model.camera import Camera
from lightpen.model.coverage import Coverage, measure_coverage
from lightpen.model.pen import Pen
from lightpen.sentences import Sentence, sentence

MIN_IMAGES = 6  # the paper starts from six
MAX_SIGMA = 1.0  # px, of one image coordinate; LED errors of 0.3 mm make this
USUAL_SIGMA = 0.1  # px
# An LED that runs along an arc during the exposure appears inside it, which moves the
# pose of a blurred image by some hundredths of a millimetre; more is a slip.
MAX_SMEAR = 0.15  # mm
SMEARED = 1.25  # times the usual width of the LEDs' rims
TRUSTED_WEIGHT = 0.2  # of the Cauchy loss, at eight standard deviations


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated tip, with all that is known about it.

    The arrays over images hold all N images of the observations; the fits hold the
    M images that entered them, in the same order. An image of which the joint fit
    could use no LED is among these M and not among the used ones.

    Attributes
    ----------
    reasons : tuple of Reason
        Why an image was left out; `Reason.NONE` for the used ones.
    used : (N,) array of bool
    tips_cam : (N, 3) array
        Where each image alone puts the tip, camera frame, mm; NaN without a pose.
    rms : (N,) array
        Root mean square residual of each image, px: of a used one in the joint fit, of
        another about its own pose; NaN without a pose.
    leds_used : (N, L) array of bool
    joint : JointFit
        Tip, cone and rotations, with all else as the bundle adjustment has it.
    bundle : Bundle
        The bundle adjustment: everything that the files may have wrong.
    priors : Priors
        What it took from the files, as stated or assumed.
    contradictions : tuple of Contradiction
        What the images say against the files.
    two_stage : TwoStageFit
        The paper's method on the same images.
    two_stage_covariance : (6, 6) array
        Of its (tip, cone) by the covariances of the poses, mm^2.
    """

    observations: Observations
    reasons: tuple[Reason, ...]
    used: BoolArray
    tips_cam: FloatArray
    rms: FloatArray
    leds_used: BoolArray
    joint: JointFit
    bundle: Bundle
    priors: Priors
    contradictions: tuple[Contradiction, ...]
    two_stage: TwoStageFit
    two_stage_covariance: FloatArray
    budget: Budget
    halves: Halves
    leds: LedQuality
    coverage: Coverage

    @property
    def led_sigma(self) -> float:
        """Standard deviation of the LED file's coordinates by the images, mm.

        0 where they show no significant errors, or the file states its uncertainty.
        """
        found = self.bundle.components.leds
        return found.sigma if found.is_significant else 0.0


def calibrate(
    camera: Camera,
    pen: Pen,
    observations: Observations,
    assumptions: Assumptions = USUAL,
) -> Calibration:
    """Calibrate the tip of a pen from the LED centres of a swing.

    Poses of single images come first; images whose LEDs do not fit are left out, then
    those in which the tip was not where the others have it. The rest goes into the
    bundle adjustment, and into the paper's method beside it.

    Parameters
    ----------
    assumptions : Assumptions
        What stands in for the uncertainties that the files do not state.

    Raises
    ------
    CalibrationError
        The images do not determine the tip; the text says what is missing.
    """
    reasons = np.array(observations.reasons, dtype=object)
    posed = np.flatnonzero(reasons == Reason.NONE)
    _require_images(posed, reasons, observations.advice)
    all_poses = fit_poses(
        camera,
        pen,
        observations.pixels[posed],
        observations.rotations[posed],
        observations.translations[posed],
    )
    _require_fit(all_poses.sigma)
    fitting = _fitting(all_poses)
    reasons[posed[~fitting]] = Reason.MISFIT
    _require_images(posed[fitting], reasons, observations.advice)
    pivot = fit_pivot(
        all_poses.rotations[fitting],
        all_poses.translations[fitting],
        all_poses.covariances[fitting],
    )
    gated = posed[fitting][~pivot.used]
    distances = np.linalg.norm(pivot.residuals[~pivot.used], axis=1)
    smeared = _smeared(observations)[gated] & (distances < MAX_SMEAR)
    reasons[gated[smeared]] = Reason.BLURRED
    reasons[gated[~smeared]] = Reason.SLIPPED
    kept = np.flatnonzero(fitting)[pivot.used]
    chosen, poses = posed[kept], all_poses.of(kept)

    pixels = observations.pixels[chosen]
    start = fit_joint(
        camera, pen, pixels, poses.rotations, pivot.tip_pen, pivot.pivot_cam
    )
    _require_fit(start.sigma)
    adjusted = adjust(camera, pen, pixels, start, assumptions)
    bundle, fitted = adjusted.bundle, adjusted.bundle.state
    fitted_camera = fitted.rig.cameras[0]
    joint = joint_at(
        fitted_camera,
        fitted.pen,
        pixels,
        fitted.rotations,
        fitted.tip_pen,
        fitted.cone_rig,
        bundle.used[:, 0],
    )
    reasons[chosen[~joint.used.any(axis=1)]] = Reason.MISFIT
    paper_poses = fit_paper_poses(
        camera, pen, pixels, poses.rotations, poses.translations
    )
    two_stage = fit_two_stage(paper_poses.rotations, paper_poses.translations)

    n_images, n_leds = observations.pixels.shape[:2]
    tips_cam = np.full((n_images, 3), np.nan)
    refined = fit_poses(
        fitted_camera,
        fitted.pen,
        observations.pixels[posed],
        all_poses.rotations,
        all_poses.translations,
    )
    tips_cam[posed] = refined.rotations @ joint.tip_pen + refined.translations
    rms = np.full(n_images, np.nan)
    rms[posed] = refined.rms
    rms[chosen] = joint.image_rms
    leds_used = np.zeros((n_images, n_leds), dtype=bool)
    leds_used[chosen] = joint.used
    return Calibration(
        observations=observations,
        reasons=tuple(reasons),
        used=reasons == Reason.NONE,
        tips_cam=tips_cam,
        rms=rms,
        leds_used=leds_used,
        joint=joint,
        bundle=bundle,
        priors=adjusted.priors,
        contradictions=adjusted.contradictions,
        two_stage=two_stage,
        two_stage_covariance=propagated_covariance(
            paper_poses.rotations, paper_poses.covariances, two_stage.tip_pen
        ),
        budget=combine(adjusted, joint),
        halves=compare_halves(joint),
        leds=measure_leds(fitted_camera, pen, pixels, joint),
        coverage=measure_coverage(joint.rotations),
    )


def _smeared(observations: Observations) -> BoolArray:
    """Return which images have clearly wider LED rims than most."""
    widths = observations.edge_widths
    known = widths[np.isfinite(widths)]
    usual = np.median(known) if len(known) else np.inf
    return np.asarray(np.nan_to_num(widths) > SMEARED * usual)


def _require_fit(sigma: float) -> None:
    if sigma > MAX_SIGMA:
        raise CalibrationError(
            sentence(
                "calibrate.leds-do-not-fit",
                "The LED positions do not fit the images: {sigma:.1f} px, {usual} "
                "px or less is usual. Check that the pen file is of this pen with "
                "its LEDs in order, and the camera file of this camera.",
                sigma=sigma,
                usual=USUAL_SIGMA,
            )
        )


def _fitting(poses: Poses) -> BoolArray:
    """Return which images have a pose that most of their LEDs agree with."""
    n_seen = (poses.weights > 0).sum(axis=1)
    n_trusted = (poses.weights > TRUSTED_WEIGHT).sum(axis=1)
    return np.asarray((n_trusted >= MIN_POSE_LEDS) & (2 * n_trusted > n_seen))


def _require_images(
    chosen: IntArray, reasons: npt.NDArray[np.object_], advice: Sentence | None
) -> None:
    if len(chosen) >= MIN_IMAGES:
        return
    left_out = tuple(
        sentence(
            "calibrate.images-of-a-reason",
            "{n_images} {reason}",
            n_images=int(np.sum(reasons == reason)),
            reason=reason.words,
        )
        for reason in Reason
        if reason and np.any(reasons == reason)
    )
    usable = sentence(
        "calibrate.images-usable",
        "{n_usable} of {n_images} images are usable",
        n_usable=len(chosen),
        n_images=len(reasons),
    )
    if left_out:
        usable = sentence(
            "calibrate.images-left-out",
            "{usable} (left out: {left_out})",
            usable=usable,
            left_out=left_out,
        )
    more = sentence("calibrate.capture-more", "Capture more images.")
    raise CalibrationError(
        sentence(
            "calibrate.too-few-images",
            "{usable}; the tip needs at least {needed}. {advice}",
            usable=usable,
            needed=MIN_IMAGES,
            advice=advice or more,
        )
    )
