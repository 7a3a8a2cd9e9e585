"""The calibration of a probe tip: from observations to the tip and what it is worth."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.detection.observations import Observations
from lightpen.detection.pose import Poses, fit_paper_poses, fit_poses
from lightpen.detection.reasons import Reason
from lightpen.errors import CalibrationError
from lightpen.estimation.adjustment import adjust
from lightpen.estimation.bundle import Bundle
from lightpen.estimation.camera_path import CameraPath, SteadyImages, pose_steadily
from lightpen.estimation.contradictions import Contradiction
from lightpen.estimation.disc_diameter import read_diameter
from lightpen.estimation.instrument import Instrument, adjusted_instrument
from lightpen.estimation.joint import ContactModel, JointFit, fit_contact, joint_at
from lightpen.estimation.led_quality import LedQuality, measure_leds
from lightpen.estimation.linearised import BundleState
from lightpen.estimation.placing import place_cameras
from lightpen.estimation.priors import Priors, priors_of, thermal_growth
from lightpen.estimation.rig_poses import RigPoses, join_poses
from lightpen.estimation.rig_readings import require_usual_rig
from lightpen.estimation.second_cone import (
    SecondCone,
    SecondSwing,
    second_cone,
    second_images,
)
from lightpen.estimation.single_images import (
    PosedImages,
    require_fit,
    require_images,
)
from lightpen.estimation.synchrony import Lag
from lightpen.estimation.two_stage import (
    TwoStageFit,
    fit_two_stage,
    propagated_covariance,
)
from lightpen.estimation.uncertainty import Budget, Halves, combine, compare_halves
from lightpen.model.assumptions import USUAL, Assumptions
from lightpen.model.camera import Camera
from lightpen.model.coverage import Coverage, measure_coverage
from lightpen.model.pen import Pen, grown
from lightpen.model.rig import Rig, of_camera, rig_of


@dataclass(frozen=True, eq=False)
class CameraImages:
    """The images of one camera in a calibration, one at each of the N moments.

    Attributes
    ----------
    reasons : tuple of Reason
        Why an image was left out; `Reason.NONE` for the used ones.
    rms : (N,) array
        Root mean square residual of each image, px; NaN without a pose.
    leds_used : (N, L) array of bool
    total_rms : float
        Of all LEDs that are used, px.
    path : CameraPath or None
        How the camera moved by its fixed lamps; None without any.
    """

    observations: Observations
    reasons: tuple[Reason, ...]
    rms: FloatArray
    leds_used: BoolArray
    total_rms: float
    path: CameraPath | None

    @property
    def used(self) -> BoolArray:
        """Images that take part, (N,)."""
        return np.array([reason is Reason.NONE for reason in self.reasons])


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated tip, with all that is known about it.

    The arrays over images hold all N images of the observations; the fits hold the
    M images that entered them, in the same order. An image of which the joint fit
    could use no LED is among these M and not among the used ones. Of a rig, its images
    of one moment count as one here, and the camera frame is that of the first camera.

    Attributes
    ----------
    cameras : tuple of CameraImages
        What became of the images of each camera.
    reasons : tuple of Reason
        Why an image was left out; `Reason.NONE` for the used ones.
    used : (N,) array of bool
    tips_cam : (N, 3) array
        Where each image alone puts the tip, camera frame, mm; NaN without a pose.
    rms : (N,) array
        Root mean square residual of each image, px: of a used one in the joint fit, of
        another about its own pose; NaN without a pose.
    joint : JointFit
        Tip, cone and rotations, with all else as the bundle adjustment has it.
    bundle : Bundle
        The bundle adjustment: everything that the files may have wrong.
    stated : Priors
        What the files state, and what is assumed in its place.
    priors : Priors
        The same without what the images contradict.
    assumptions : Assumptions
        What stood in for what the files do not state.
    growth : float
        By which the pen is larger than its file has it, as it is warmer; relative.
    contradictions : tuple of Contradiction
        What the images say against the files.
    two_stage : TwoStageFit
        The paper's method on the same images, of the first camera.
    two_stage_covariance : (6, 6) array
        Of its (tip, cone) by the covariances of the poses, mm^2.
    instrument : Instrument
        What is left to measure with, of the first camera.
    lags : tuple of Lag or None
        Of each camera of a rig but the first.
    """

    cameras: tuple[CameraImages, ...]
    reasons: tuple[Reason, ...]
    used: BoolArray
    tips_cam: FloatArray
    rms: FloatArray
    joint: JointFit
    bundle: Bundle
    stated: Priors
    priors: Priors
    assumptions: Assumptions
    growth: float
    contradictions: tuple[Contradiction, ...]
    two_stage: TwoStageFit
    two_stage_covariance: FloatArray
    budget: Budget
    instrument: Instrument
    halves: Halves
    leds: LedQuality
    coverage: Coverage
    lags: tuple[Lag | None, ...] = ()
    second: SecondCone | None = None

    @property
    def observations(self) -> Observations:
        """What the images of the first camera show."""
        return self.cameras[0].observations

    @property
    def leds_used(self) -> BoolArray:
        """Which LEDs of its images take part, (N, L)."""
        return self.cameras[0].leds_used

    @property
    def moved(self) -> float:
        """How far cone and camera moved against each other for certain, mm.

        As fixed lamps tell, or the pen.
        """
        by_lamps = [
            images.path.moved * float(self.joint.cone_cam[2]) / camera.fx
            for images, camera in zip(
                self.cameras, self.bundle.state.rig.cameras, strict=True
            )
            if images.path is not None and images.path.is_followed
        ]
        is_certain = self.bundle.counted.drift.is_significant
        return max([*by_lamps, self.bundle.drift if is_certain else 0.0])

    @property
    def led_sigma(self) -> float:
        """Standard deviation of the LED file's coordinates by the images, mm.

        0 where they show no significant errors, or the file states its uncertainty.
        """
        found = self.bundle.counted.leds
        return found.sigma if found.is_significant else 0.0


def calibrate(
    camera: Camera,
    pen: Pen,
    observations: Observations,
    assumptions: Assumptions = USUAL,
    second: SecondSwing | None = None,
) -> Calibration:
    """Calibrate the tip of a pen from the LED centres of a swing.

    Poses of single images come first; images whose LEDs do not fit are left out, then
    those in which the tip was not where the others have it. The rest goes into the
    bundle adjustment, and into the paper's method beside it.

    Parameters
    ----------
    assumptions : Assumptions
        What stands in for the uncertainties that the files do not state.
    second : SecondSwing or None
        With the same pen before the same camera, which has not moved in between.

    Raises
    ------
    CalibrationError
        The images do not determine the tip; the text says what is missing.
    """
    return calibrate_rig(rig_of(camera), pen, (observations,), assumptions, second)


def calibrate_rig(
    rig: Rig,
    pen: Pen,
    observations: Sequence[Observations],
    assumptions: Assumptions = USUAL,
    second: SecondSwing | None = None,
) -> Calibration:
    """Calibrate the tip of a pen that several cameras see at once; see `calibrate`.

    Each camera judges its images by itself. Where they put the cameras, the fit of all
    begins, whatever the file of the rig says; it enters with its uncertainty.

    Parameters
    ----------
    observations : sequence of Observations
        Of each camera, all of the same N moments.
    second : SecondSwing or None
        Of a rig of one camera.
    """
    growth = thermal_growth(pen, assumptions)
    pen = grown(pen, growth)
    steady = [
        _of_camera(rig, c, partial(pose_steadily, camera, pen, seen))
        for c, (camera, seen) in enumerate(zip(rig.cameras, observations, strict=True))
    ]
    parts = [each.posed for each in steady]
    reasons = _with_slips(parts)
    seen_by_all = np.stack([each.observations.pixels for each in steady], axis=1)
    there, places = rig, None
    lags: tuple[Lag | None, ...] = ()
    if rig.n_cameras > 1:
        placed = place_cameras(rig, parts)
        require_usual_rig(rig, placed, pen, seen_by_all, parts)
        there, places, lags = placed.rig, placed.deviations(rig), placed.lags
        for c, each in enumerate(reasons):
            each[placed.apart[:, c]] = Reason.OTHER_MOMENT
    kept = np.stack([each == Reason.NONE for each in reasons], axis=1)
    chosen, of_first = np.flatnonzero(kept.any(axis=1)), np.flatnonzero(kept[:, 0])
    require_images(of_first, reasons[0], observations[0].advice)
    pixels = np.where(kept[..., None, None], seen_by_all, np.nan)[chosen]
    telling = _telling(parts, kept)
    posed = [part.posed[some] for part, some in zip(parts, telling, strict=True)]

    def joined(of: Rig, poses: Sequence[Poses]) -> RigPoses:
        some = [each.of(i) for each, i in zip(poses, telling, strict=True)]
        return join_poses(of, len(kept), posed, some)

    alone = joined(there, [part.poses for part in parts])
    start = fit_contact(
        ContactModel(there, pen, pixels),
        alone.rotations[chosen],
        parts[0].pivot.tip_pen,
        parts[0].pivot.pivot_cam,
    )
    require_fit(start.sigma)
    state = BundleState(rig, pen, start.tip_pen, start.cone_cam, start.rotations)
    areas, edge_widths = (
        np.stack([getattr(seen, of) for seen in observations], axis=1)
        for of in ("areas", "edge_widths")
    )
    reading = read_diameter(
        replace(state, rig=there),
        np.where(kept[..., None], areas, np.nan)[chosen],
        edge_widths[chosen],
    )
    priors = replace(priors_of(rig, pen, assumptions), reading=reading)
    seen, shifts = pixels, _shifts_of(steady, chosen)
    if second is not None:
        others = second_images(rig.cameras[0], pen, second.observations)
        state, seen = others.joined(state, pixels)
        priors = replace(priors, separation=second.separation)
        shifts = None
    adjusted = adjust(state, seen, priors, places, shifts)
    bundle, fitted = adjusted.bundle, adjusted.bundle.state
    joint = joint_at(
        ContactModel(fitted.rig, fitted.pen, pixels),
        fitted.rotations[: len(chosen)],
        fitted.tip_pen,
        fitted.cone_rig,
        bundle.used[: len(chosen)].reshape(len(chosen), -1),
    )
    poses = parts[0].poses.of(np.searchsorted(parts[0].posed, of_first))
    paper_poses = fit_paper_poses(
        rig.cameras[0],
        pen,
        seen_by_all[of_first, 0],
        poses.rotations,
        poses.translations,
    )
    two_stage = fit_two_stage(paper_poses.rotations, paper_poses.translations)
    refined = [
        fit_poses(
            fitted.rig.cameras[c],
            fitted.pen,
            seen_by_all[part.posed, c],
            part.poses.rotations,
            part.poses.translations,
        )
        for c, part in enumerate(parts)
    ]
    single = joined(fitted.rig, refined)
    cameras = tuple(
        _images_of_camera(
            observations[c],
            reasons[c],
            part,
            refined[c],
            joint.of_camera(c, pen.n_leds),
            chosen,
            steady[c].path,
        )
        for c, part in enumerate(parts)
    )
    moments = _moments(cameras)
    budget = combine(adjusted, joint)
    return Calibration(
        cameras=cameras,
        reasons=moments,
        used=np.array([reason is Reason.NONE for reason in moments]),
        tips_cam=single.rotations @ joint.tip_pen + single.translations,
        rms=_rms_of_moments(cameras),
        joint=joint,
        bundle=bundle,
        stated=priors,
        priors=adjusted.priors,
        assumptions=assumptions,
        growth=growth,
        contradictions=adjusted.contradictions,
        two_stage=two_stage,
        two_stage_covariance=propagated_covariance(
            paper_poses.rotations, paper_poses.covariances, two_stage.tip_pen
        ),
        budget=budget,
        instrument=adjusted_instrument(adjusted, budget),
        halves=compare_halves(joint),
        leds=measure_leds(fitted.rig, pen, pixels, joint),
        coverage=measure_coverage(joint.rotations),
        lags=lags,
        second=(None if second is None else second_cone(adjusted, budget, len(chosen))),
    )


def _shifts_of(steady: Sequence[SteadyImages], chosen: IntArray) -> FloatArray | None:
    """Return the ways along which a single camera may have moved, (M, 2), px.

    What lamps show is all that the pen does only where they stand as far away as it.
    """
    path = steady[0].path
    return None if len(steady) > 1 or path is None else path.shifts[chosen]


def _images_of_camera(
    observations: Observations,
    reasons: npt.NDArray[np.object_],
    part: PosedImages,
    refined: Poses,
    own: JointFit,
    chosen: IntArray,
    path: CameraPath | None,
) -> CameraImages:
    """Return what became of a camera's images.

    ``own`` is the joint fit, of the moments ``chosen``, with this camera's residuals;
    an image that was kept but of which it uses no LED is put down as a misfit.
    """
    kept = reasons[chosen] == Reason.NONE
    reasons[chosen[kept & ~own.used.any(axis=1)]] = Reason.MISFIT
    rms = np.full(len(reasons), np.nan)
    rms[part.posed] = refined.rms
    rms[chosen[kept]] = own.image_rms[kept]
    leds_used = np.zeros(observations.pixels.shape[:2], dtype=bool)
    leds_used[chosen] = own.used
    return CameraImages(
        observations=observations,
        reasons=tuple(reasons),
        rms=rms,
        leds_used=leds_used,
        total_rms=own.rms if own.used.any() else float("nan"),
        path=path,
    )


def _telling(parts: Sequence[PosedImages], kept: BoolArray) -> list[IntArray]:
    """Return which poses of each camera tell that of a moment.

    Those of images that were left out do only where no other image of the moment takes
    part.
    """
    none_kept = np.logical_not(kept.any(axis=1))
    return [
        np.flatnonzero(kept[part.posed, c] | none_kept[part.posed])
        for c, part in enumerate(parts)
    ]


def _of_camera(rig: Rig, c: int, work: Callable[[], SteadyImages]) -> SteadyImages:
    """Return what the work on one camera's images gives; an error names the camera."""
    try:
        return work()
    except CalibrationError as error:
        if rig.n_cameras == 1:
            raise
        raise CalibrationError(of_camera(rig.names[c], error.sentence)) from error


def _with_slips(parts: Sequence[PosedImages]) -> list[npt.NDArray[np.object_]]:
    """Return the reasons of each camera's images: a tip slips before all of them."""
    reasons = [part.reasons.copy() for part in parts]
    slipped = np.any([each == Reason.SLIPPED for each in reasons], axis=0)
    for each in reasons:
        each[slipped & (each == Reason.NONE)] = Reason.SLIPPED
    return reasons


def _moments(cameras: Sequence[CameraImages]) -> tuple[Reason, ...]:
    """Return why each moment is left out; NONE where a camera's image takes part."""
    found = []
    for reasons in zip(*(each.reasons for each in cameras), strict=True):
        there = [reason for reason in reasons if reason is not Reason.ABSENT]
        found.append(Reason.NONE if Reason.NONE in there else there[0])
    return tuple(found)


def _rms_of_moments(cameras: Sequence[CameraImages]) -> FloatArray:
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
