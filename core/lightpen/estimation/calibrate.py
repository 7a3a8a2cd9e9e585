"""The calibration of a probe tip, from observations to the tip and its uncertainty.

`calibrate_rig` takes four steps, each a function with a frozen result:

1. `_fit_single_cameras`: poses of single images; images are left out whose LEDs do not
   fit, or in which the tip was not where the others have it.
2. `_find_start`: where the images put the cameras of a rig, and the joint fit of tip
   and cone with all parameters of the files held.
3. `_adjust_jointly`: the bundle adjustment with priors, equation (2) of method.md.
4. `_calibration_of`: the uncertainty budget, the paper's method beside it, and the
   residuals of all images.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.detection.labelling.causes import cause_of_misfit
from lightpen.detection.observations import Observations, without_copies
from lightpen.detection.pose import Poses, fit_paper_poses, fit_poses
from lightpen.detection.reasons import Reason
from lightpen.errors import CalibrationError
from lightpen.estimation.bundle.adjustment import (
    Adjustment,
    FoundField,
    adjust,
    found_fields,
)
from lightpen.estimation.bundle.bundle import Bundle
from lightpen.estimation.bundle.change_point import ChangePoint, step_of_poses
from lightpen.estimation.bundle.consistency_findings import Contradiction
from lightpen.estimation.bundle.consistency_test import SelfCheck, check_prediction
from lightpen.estimation.bundle.led_quality import LedQuality, measure_leds
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.estimation.bundle.priors import Priors, priors_of, read_diameter
from lightpen.estimation.contact.joint import (
    ContactModel,
    JointFit,
    fit_contact,
    joint_at,
)
from lightpen.estimation.contact.single_images import (
    CameraImages,
    PosedImages,
    SteadyImages,
    pose_steadily,
    reasons_of_moments,
    require_fit,
    require_images,
    rms_of_moments,
    without_field,
)
from lightpen.estimation.pivot.pivot import TwoStageFit, fit_two_stage, projection_bias
from lightpen.estimation.rigs.rig_poses import (
    RigPoses,
    TimeLag,
    find_initial_extrinsics,
    join_poses,
    require_usual_rig,
)
from lightpen.estimation.uncertainty.budget import (
    Budget,
    SplitHalfCheck,
    combine,
    compare_halves,
)
from lightpen.estimation.uncertainty.instrument import Instrument, adjusted_instrument
from lightpen.messages import Message
from lightpen.model.camera import Camera
from lightpen.model.coverage import Coverage, measure_coverage
from lightpen.model.limits import USUAL, Assumptions
from lightpen.model.names import Method
from lightpen.model.pen import Pen, grown
from lightpen.model.rigid import Rig, of_camera, rig_of

NOT_SETTLED = ("joint.not-settled", "bundle.not-settled")


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated tip.

    Arrays over images hold all N images of the observations; the fits hold the M images
    that entered them, in the same order. An image of which the joint fit uses no LED is
    among these M and not among the used ones. For a rig, the images of one moment count
    as one, and the first camera defines the camera frame.
    """

    cameras: tuple[CameraImages, ...]
    # Why an image was left out; `Reason.NONE` for the used ones.
    reasons: tuple[Reason, ...]
    used: BoolArray  # (N,)
    # (N, 3), tip by the pose of each image alone, camera frame, mm; NaN without a pose.
    tips_cam: FloatArray
    # (N,), root mean square residual of each image, px: of a used one in the joint fit,
    # of another about its own pose; NaN without a pose.
    rms: FloatArray
    joint: JointFit  # tip, cone and rotations, with all parameters as adjusted
    bundle: Bundle
    stated: Priors  # priors from the files, with defaults where these state none
    priors: Priors  # the same with contradicted numbers released
    assumptions: Assumptions  # default uncertainties where the files state none
    # Whether files were found from these images, which then count once.
    shares_images: bool
    contradictions: tuple[Contradiction, ...]
    two_stage: TwoStageFit  # the paper's method on the same images, of the first camera
    # (6,), error of its (tip, cone) as it takes projected discs for points, mm.
    projection_bias: FloatArray
    budget: Budget
    # Cameras and pen as adjusted, for measurements with this tip.
    instrument: Instrument
    halves: SplitHalfCheck
    leds: LedQuality
    coverage: Coverage
    lags: tuple[TimeLag | None, ...] = ()  # of each camera of a rig but the first
    step: ChangePoint | None = None  # its ``first`` counts all images
    method: Method = "joint"  # of the reported tip

    @property
    def observations(self) -> Observations:
        """Observations of the first camera."""
        return self.cameras[0].observations

    @property
    def moved(self) -> float:
        """Significant motion of cone against camera, by fixed lamps or the pen, mm."""
        by_lamps = [
            images.path.moved * float(self.joint.cone_cam[2]) / camera.fx
            for images, camera in zip(
                self.cameras, self.bundle.state.rig.cameras, strict=True
            )
            if images.path is not None and images.path.is_followed
        ]
        is_certain = self.bundle.budget_components.drift.is_significant
        return max([*by_lamps, self.bundle.drift if is_certain else 0.0])

    @cached_property
    def fields(self) -> tuple[FoundField, ...]:
        """Shifts of the images that these support."""
        return found_fields(self.bundle)

    @cached_property
    def cause_of_misfit(self) -> Message | None:
        """The cause that removes a misfit of the LEDs in the first camera, if one."""
        start, images = self.bundle.unknowns.start, self.cameras[0]
        pixels = images.observations.pixels[images.used]
        return cause_of_misfit(start.rig.cameras[0], start.pen, pixels)

    @cached_property
    def self_check(self) -> SelfCheck | None:
        """Cross-validation: prediction of LEDs by the others."""
        bundle = self.bundle
        return check_prediction(
            *(bundle.state, bundle.residuals, bundle.used, bundle.unknowns.noise),
            self.budget.correlation_factor,
        )

    @property
    def led_sigma(self) -> float:
        """Estimated standard deviation of the LED file's coordinates, mm.

        0 where it is not significant, or the file states its uncertainty.
        """
        found = self.bundle.budget_components.leds
        return found.sigma if found.is_significant else 0.0


def calibrate(
    camera: Camera,
    pen: Pen,
    observations: Observations,
    assumptions: Assumptions = USUAL,
) -> Calibration:
    """Calibrate the tip of a pen by a single camera; see `calibrate_rig`."""
    return calibrate_rig(rig_of(camera), pen, (observations,), assumptions)


def calibrate_rig(
    rig: Rig,
    pen: Pen,
    observations: Sequence[Observations],
    assumptions: Assumptions = USUAL,
) -> Calibration:
    """Calibrate the tip of a pen that one camera or several see swing in a cone.

    Raises `CalibrationError` if the images do not determine the tip; the text says what
    is missing.

    Parameters
    ----------
    rig, pen : Rig and Pen
        As in their files.
    observations : sequence of Observations
        Of each camera at the same N instants.
    assumptions : Assumptions
        Default uncertainties where the files state none.
    """
    inputs = _before_images(rig, pen, observations, assumptions)
    single = _fit_single_cameras(inputs, observations)
    try:
        start = _find_start(inputs, single)
        adjusted = _adjust_jointly(inputs, single, start)
    except CalibrationError as error:
        if error.message.code not in NOT_SETTLED:
            raise
        cause = cause_of_misfit(rig.cameras[0], inputs.pen, single.pixels[:, 0])
        if cause is None:
            raise
        raise CalibrationError("calibrate.files-disagree", cause=cause) from error
    return _calibration_of(inputs, single, start, adjusted)


class _Inputs(NamedTuple):
    """Prior knowledge of rig and pen."""

    rig: Rig
    pen: Pen
    assumptions: Assumptions
    shares_images: bool


def _before_images(
    rig: Rig, pen: Pen, observations: Sequence[Observations], assumptions: Assumptions
) -> _Inputs:
    """Return rig and pen without what their files state by these same images."""
    cameras, shares = list(rig.cameras), False
    for c, seen in enumerate(observations):
        if cameras[c].is_found_from(seen.pixels):
            cameras[c], shares = cameras[c].before_images(), True
        if pen.is_found_from(seen.pixels):
            pen, shares = pen.before_images(), True
    rig = replace(rig, cameras=tuple(cameras))
    return _Inputs(rig, pen, assumptions, shares)


@dataclass(frozen=True, eq=False)
class _SingleCameraFits:
    """Step 1: the images of C cameras at N moments, each alone."""

    observations: tuple[Observations, ...]
    steady: tuple[SteadyImages, ...]  # the same with the camera's own motion removed
    pixels: FloatArray  # (N, C, L, 2), LED centres of these, px
    reasons: npt.NDArray[np.object_]  # (N, C)

    @property
    def posed(self) -> list[PosedImages]:
        """The images of each camera with their poses."""
        return [each.posed for each in self.steady]

    def rig_poses(self, rig: Rig, poses: Sequence[Poses], used: BoolArray) -> RigPoses:
        """Join poses of the posed images of each camera to poses rig_from_pen.

        Images that are not ``used`` (N, C) enter only where no image of the moment is.
        """
        at_moment = [
            np.flatnonzero(used[part.posed, c] | ~used[part.posed].any(axis=1))
            for c, part in enumerate(self.posed)
        ]
        moments = [part.posed[i] for part, i in zip(self.posed, at_moment, strict=True)]
        chosen = [each.of(i) for each, i in zip(poses, at_moment, strict=True)]
        return join_poses(rig, len(used), moments, chosen)


@dataclass(frozen=True, eq=False)
class _Start:
    """Step 2: the fit that the adjustment starts from, parameters of the files held."""

    rig: Rig  # cameras of the file, with extrinsics by the images
    extrinsics: FloatArray  # (6 (C - 1),), deviation from the file's, rad and mm
    lags: tuple[TimeLag | None, ...]
    reasons: npt.NDArray[np.object_]  # (N, C)
    moments: IntArray  # (M,), moments with an image that takes part
    # (M, C, L, 2), of these, px; NaN of images that do not take part.
    pixels: FloatArray
    joint: JointFit


@dataclass(frozen=True, eq=False)
class _Adjusted:
    """Step 3: the bundle adjustment, and the joint fit at its solution."""

    adjustment: Adjustment
    joint: JointFit
    stated: Priors
    # (M, C, L, 2), LED centres less the fields of the images, px
    pixels: FloatArray


def _fit_single_cameras(
    inputs: _Inputs, observations: Sequence[Observations]
) -> _SingleCameraFits:
    """Fit the poses of each camera's images; a tip slips before all cameras."""
    rig = inputs.rig
    steady = []
    for c, (camera, seen) in enumerate(zip(rig.cameras, observations, strict=True)):
        own = without_field(camera, without_copies(seen))
        try:
            steady.append(pose_steadily(camera, inputs.pen, own))
        except CalibrationError as error:
            if rig.n_cameras == 1:
                raise
            raise CalibrationError(of_camera(rig.names[c], error.message)) from error
    reasons = np.stack([each.posed.reasons for each in steady], axis=1)
    slipped = np.any(reasons == Reason.SLIPPED, axis=1, keepdims=True)
    reasons[slipped & (reasons == Reason.NONE)] = Reason.SLIPPED
    pixels = np.stack([each.observations.pixels for each in steady], axis=1)
    return _SingleCameraFits(tuple(observations), tuple(steady), pixels, reasons)


def _find_start(inputs: _Inputs, single: _SingleCameraFits) -> _Start:
    """Estimate the extrinsics from the images alone, and fit.

    A file that contradicts them grossly is refused.
    """
    rig, pen, posed = inputs.rig, inputs.pen, single.posed
    reasons = single.reasons.copy()
    found = find_initial_extrinsics(rig, posed)
    require_usual_rig(rig, found)
    reasons[found.apart] = Reason.OTHER_MOMENT
    used = reasons == Reason.NONE
    advice = single.observations[0].advice
    require_images(np.flatnonzero(used[:, 0]), reasons[:, 0], advice)
    moments = np.flatnonzero(used.any(axis=1))
    pixels = np.where(used[..., None, None], single.pixels, np.nan)[moments]
    poses = single.rig_poses(found.rig, [part.poses for part in posed], used)
    joint = fit_contact(
        ContactModel(found.rig, pen, pixels),
        poses.rotations[moments],
        posed[0].pivot.tip_pen,
        posed[0].pivot.pivot_cam,
    )
    require_fit(joint.sigma, rig.cameras[0], pen, pixels[:, 0])
    return _Start(
        found.rig, found.deviations(rig), found.lags, reasons, moments, pixels, joint
    )


def _adjust_jointly(
    inputs: _Inputs, single: _SingleCameraFits, start: _Start
) -> _Adjusted:
    """Adjust tip, cone and all parameters of the files."""
    rig, pen = inputs.rig, inputs.pen
    moments, fitted = start.moments, start.joint
    state = BundleState(rig, pen, fitted.tip_pen, fitted.cone_cam, fitted.rotations)
    areas, edge_widths = (
        np.stack([getattr(each, name) for each in single.observations], axis=1)
        for name in ("areas", "edge_widths")
    )
    used = start.reasons == Reason.NONE
    reading = read_diameter(
        replace(state, rig=start.rig),
        np.where(used[..., None], areas, np.nan)[moments],
        edge_widths[moments],
    )
    priors = replace(priors_of(rig, pen, inputs.assumptions), reading=reading)
    path, pixels = single.steady[0].path, start.pixels
    # Of several cameras each has lamps of its own, and what they leave is not fitted.
    shifts = None if rig.n_cameras > 1 or path is None else path.shifts[moments]
    sigmas = np.stack([each.sigmas for each in single.observations], axis=1)[moments]
    adjustment = adjust(state, pixels, priors, start.extrinsics, shifts, sigmas)
    bundle, found = adjustment.bundle, adjustment.bundle.state
    corrected = pixels - bundle.field_shifts
    joint = joint_at(
        ContactModel(found.rig, found.pen, corrected),
        found.rotations,
        bundle.tip_pen,
        bundle.cone_rig,
        bundle.used.reshape(len(moments), -1),
    )
    return _Adjusted(adjustment, joint, priors, corrected)


def _calibration_of(
    inputs: _Inputs, single: _SingleCameraFits, start: _Start, adjusted: _Adjusted
) -> Calibration:
    """State the uncertainty, and the residuals of all images as adjusted."""
    pen = inputs.pen
    adjustment, joint = adjusted.adjustment, adjusted.joint
    state = adjustment.bundle.state
    refined = [
        fit_poses(
            state.rig.cameras[c],
            state.pen,
            single.pixels[part.posed, c],
            part.poses.rotations,
            part.poses.translations,
            is_near=True,
        )
        for c, part in enumerate(single.posed)
    ]
    poses = single.rig_poses(state.rig, refined, start.reasons == Reason.NONE)
    cameras = tuple(
        _camera_images(single, start, c, refined[c], joint.of_camera(c, pen.n_leds))
        for c in range(len(refined))
    )
    reasons = reasons_of_moments(cameras)
    budget = combine(adjustment, joint)
    paper_poses = _paper_poses(inputs.rig.cameras[0], pen, single, start)
    two_stage = fit_two_stage(paper_poses.rotations, paper_poses.translations)
    return Calibration(
        cameras=cameras,
        reasons=reasons,
        used=np.array([reason is Reason.NONE for reason in reasons]),
        tips_cam=poses.rotations @ joint.tip_pen + poses.translations,
        rms=rms_of_moments(cameras),
        joint=joint,
        bundle=adjustment.bundle,
        stated=adjusted.stated,
        priors=adjustment.priors,
        assumptions=inputs.assumptions,
        shares_images=inputs.shares_images,
        contradictions=adjustment.contradictions,
        two_stage=two_stage,
        projection_bias=projection_bias(
            *(state.rig.cameras[0], state.pen),
            *(paper_poses.rotations, paper_poses.translations),
            np.isfinite(paper_poses.residuals[..., 0]),
        ),
        budget=budget,
        instrument=adjusted_instrument(adjustment, budget),
        halves=compare_halves(joint),
        leds=measure_leds(
            state.rig,
            grown(pen, adjustment.bundle.scale, joint.tip_pen),
            adjusted.pixels,
            joint,
        ),
        coverage=measure_coverage(joint.rotations),
        lags=start.lags,
        step=_step_of(adjustment.step, start, single.posed[0], refined[0]),
    )


def _step_of(
    step: ChangePoint | None, start: _Start, part: PosedImages, poses: Poses
) -> ChangePoint | None:
    """Return a step with its index among all images, a large one by the poses."""
    reasons = start.reasons[part.posed, 0]
    chosen = np.flatnonzero((reasons == Reason.NONE) | (reasons == Reason.SLIPPED))
    large = step_of_poses(poses.of(chosen), reasons[chosen] == Reason.SLIPPED)
    if large is not None:
        return replace(large, first=int(part.posed[chosen][large.first]))
    if step is None:
        return None
    return replace(step, first=int(start.moments[step.first]))


def _paper_poses(
    camera: Camera, pen: Pen, single: _SingleCameraFits, start: _Start
) -> Poses:
    """Return the poses of the first camera's images by the paper's equations."""
    part = single.posed[0]
    used = np.flatnonzero(start.reasons[:, 0] == Reason.NONE)
    poses = part.poses.of(np.searchsorted(part.posed, used))
    return fit_paper_poses(
        camera, pen, single.pixels[used, 0], poses.rotations, poses.translations
    )


def _camera_images(
    single: _SingleCameraFits, start: _Start, c: int, refined: Poses, own: JointFit
) -> CameraImages:
    """Return the images of the c-th camera.

    ``own`` is the joint fit with this camera's residuals; an image of which it uses no
    LED is a misfit.
    """
    reasons, moments = start.reasons[:, c].copy(), start.moments
    used = reasons[moments] == Reason.NONE
    reasons[moments[used & ~own.used.any(axis=1)]] = Reason.MISFIT
    rms = np.full(len(reasons), np.nan)
    rms[single.posed[c].posed] = refined.rms
    rms[moments[used]] = own.image_rms[used]
    leds_used = np.zeros((len(reasons), own.used.shape[1]), dtype=bool)
    leds_used[moments] = own.used
    return CameraImages(
        observations=single.observations[c],
        reasons=tuple(reasons),
        rms=rms,
        leds_used=leds_used,
        total_rms=own.rms if own.used.any() else float("nan"),
        path=single.steady[c].path,
    )
