"""A calibration as its record."""

from collections.abc import Iterator

import numpy as np
from msgspec import structs

from lightpen.detection.reasons import Reason
from lightpen.detection.spots import EXACT_SIGMA
from lightpen.estimation.calibrate import Calibration
from lightpen.estimation.contact.single_images import CameraImages
from lightpen.estimation.reports.calibration_record import (
    AdjustedParameter,
    AdjustmentRecord,
    CalibrationRecord,
    CameraPlace,
    CameraRecord,
    ContradictionRecord,
    ContributionRecord,
    Convergence,
    CoverageRecord,
    DirectionRecord,
    Estimate,
    FrameRecord,
    ImageCounts,
    InputsRecord,
    InstrumentRecord,
    LedRecord,
    MethodRecord,
    OtherCameraRecord,
    PenScaleRecord,
    RigRecord,
    SelfCheckRecord,
    SpotRecord,
    UncertaintyRecord,
    VerdictLimits,
    VerdictRecord,
)
from lightpen.estimation.reports.report_warnings import (
    count_dropped,
    reported,
    result_of,
    two_stage_difference,
    warnings_of,
)
from lightpen.estimation.reports.verdict import judge
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.opened_files import Inputs
from lightpen.formats.own_json import THIS_PROGRAM, StoredMessage, file_entry, plain
from lightpen.local_time import local_now
from lightpen.model.coverage import COVERAGE_FACTOR, DIRECTION_NAMES
from lightpen.model.limits import SwingLimits
from lightpen.model.names import METHODS, Method


def calibration_record(
    calibration: Calibration, inputs: Inputs, limits: SwingLimits
) -> CalibrationRecord:
    """Return the record of a calibration, with the tip by its method."""
    result = reported(calibration)
    tip, nominal = result.tip_pen, inputs.nominal_tip
    several = len(calibration.cameras) > 1
    check = calibration.self_check
    return CalibrationRecord(
        program=THIS_PROGRAM,
        created=local_now().replace(microsecond=0),
        origin=inputs.origin,
        method=calibration.method,
        tip_pen_mm=plain(tip),
        cone_cam_mm=plain(result.cone_cam),
        covariance=plain(result.covariance),
        expanded_uncertainty_mm=plain(result.expanded_uncertainty[:3]),
        cone_expanded_uncertainty_mm=plain(result.expanded_uncertainty[3:]),
        coverage_factor=COVERAGE_FACTOR,
        nominal_tip_mm=plain(nominal),
        change_from_nominal_mm=None if nominal is None else plain(tip - nominal),
        rms_px=plain(calibration.joint.rms),
        rms_mm=plain(result.rms_mm),
        sigma_px=plain(calibration.bundle.sigma),
        images=ImageCounts(
            total=len(calibration.used),
            used=int(calibration.used.sum()),
            dropped=count_dropped(calibration.reasons),
        ),
        methods={name: _method(calibration, name) for name in METHODS},
        verdict=_verdict(calibration, limits),
        warnings=tuple(map(StoredMessage.of, warnings_of(calibration))),
        uncertainty=_uncertainty(calibration),
        adjusted=_adjusted(calibration),
        assumptions=calibration.assumptions,
        instrument=_instrument(calibration.instrument),
        weakest_direction=DirectionRecord(
            vector_pen=plain(result.budget.weakest_direction),
            expanded_uncertainty_mm=plain(result.budget.weakest_uncertainty),
        ),
        coverage=_coverage(calibration),
        leds=_leds(calibration),
        self_check=None if check is None else SelfCheckRecord(*check),
        rig=_rig(calibration) if several else None,
        inputs=_inputs(inputs, calibration.observations.interval_ms),
        frames=tuple(_frames(calibration)),
    )


def _inputs(inputs: Inputs, interval_ms: float | None) -> InputsRecord:
    rig = inputs.rig
    return InputsRecord(
        camera=file_entry(inputs.camera),
        pen=file_entry(inputs.pen),
        observations=tuple(map(file_entry, inputs.observations)),
        units=inputs.units,
        led_diameter_mm=inputs.led_diameter,
        image_interval_ms=interval_ms,
        rig=None if rig is None else file_entry(rig.rig),
        cameras=() if rig is None else tuple(map(file_entry, rig.cameras)),
    )


def _verdict(calibration: Calibration, limits: SwingLimits) -> VerdictRecord:
    verdict = judge(calibration, limits)
    reason = StoredMessage.of(verdict.reason)
    return VerdictRecord(
        code=reason.code,
        text=reason.text,
        values=reason.values,
        grade=verdict.grade,
        next_step=verdict.next_step,
        limits=VerdictLimits(
            max_uncertainty_mm=limits.max_uncertainty,
            min_images=limits.min_images,
            min_per_field=limits.min_per_field,
            requires_temperature=limits.requires_temperature,
        ),
    )


def _method(calibration: Calibration, name: Method) -> MethodRecord:
    result, two_stage = result_of(calibration, name), calibration.two_stage
    is_paper = name == "two-stage"
    steps = Convergence(
        x_mm=plain(two_stage.iterates),
        objective_mm2=plain(two_stage.objectives),
        alpha=plain(two_stage.step_lengths),
        increment_mm=plain(two_stage.increments),
    )
    return MethodRecord(
        tip_pen_mm=plain(result.tip_pen),
        cone_cam_mm=plain(result.cone_cam),
        covariance=plain(result.covariance),
        expanded_uncertainty_mm=plain(result.expanded_uncertainty[:3]),
        rms_mm=plain(result.rms_mm),
        convergence=steps if is_paper else None,
        off_joint_mm=plain(two_stage_difference(calibration)[:3]) if is_paper else None,
        projection_bias_mm=plain(calibration.projection_bias[:3]) if is_paper else None,
    )


def _uncertainty(calibration: Calibration) -> UncertaintyRecord:
    budget, halves = reported(calibration).budget, calibration.halves
    noise = np.sqrt(np.diag(budget.independent_noise)[:3])

    return UncertaintyRecord(
        shares=tuple(
            ContributionRecord(
                name=share.name,
                standard_uncertainty_mm=plain(share.standard_uncertainty),
                weakest_expanded_uncertainty_mm=plain(budget.weakest_share(share)),
                assumed=share.assumed,
            )
            for share in budget.shares
        ),
        independent_noise_mm=plain(noise),
        correlation_factor=plain(budget.correlation_factor),
        led_sigma_mm=plain(calibration.led_sigma),
        halves_difference_mm=plain(halves.difference),
        halves_expanded_uncertainty_mm=plain(halves.expanded_uncertainty),
    )


def _adjusted(calibration: Calibration) -> AdjustmentRecord:
    """Return the adjusted values of the files."""
    priors, reading = calibration.priors, calibration.priors.reading
    return AdjustmentRecord(
        intrinsics=_adjusted_intrinsics(calibration, 0),
        intrinsics_uncertainty_assumed=priors.cameras[0].assumed,
        pen_growth=plain(calibration.priors.growth),
        disc_diameter_mm=plain(calibration.bundle.state.pen.diameter),
        disc_diameter_by_areas_mm=(
            None
            if reading is None
            else Estimate(plain(reading.value), plain(reading.sigma))
        ),
        contradictions=tuple(
            ContradictionRecord(
                what=str(each.what),
                unit=each.unit,
                stated=plain(each.stated),
                stated_expanded_uncertainty=plain(each.stated_uncertainty),
                wanted=plain(each.estimated),
                wanted_expanded_uncertainty=plain(each.estimated_uncertainty),
                standard_deviations=plain(each.deviations),
                camera=each.camera,
            )
            for each in calibration.contradictions
        ),
    )


def _instrument(instrument: Instrument) -> InstrumentRecord:
    rig = instrument.rig
    others = zip(rig.cameras, rig.rotations, rig.translations, strict=True)
    return InstrumentRecord(
        intrinsics=plain(instrument.camera.intrinsics),
        disc_diameter_mm=plain(instrument.pen.diameter),
        leds_mm=plain(instrument.pen.leds),
        covariance=plain(instrument.covariance),
        scale=PenScaleRecord(*plain(tuple(instrument.scale))),
        other_cameras=tuple(
            OtherCameraRecord(
                intrinsics=plain(camera.intrinsics),
                cam_from_rig_rotation=plain(rotation),
                cam_from_rig_translation_mm=plain(translation),
            )
            for camera, rotation, translation in list(others)[1:]
        ),
    )


def _coverage(calibration: Calibration) -> CoverageRecord:
    coverage = calibration.coverage
    return CoverageRecord(
        directions=DIRECTION_NAMES,
        leaning=plain(coverage.counts[0]),
        leaning_far=plain(coverage.counts[1]),
        upright=int(coverage.n_upright),
        missing=tuple(coverage.missing),
        tilt_deg=plain(np.degrees([coverage.tilts.min(), coverage.tilts.max()])),
        turn_deg=plain(np.degrees([coverage.turns.min(), coverage.turns.max()])),
    )


def _leds(calibration: Calibration) -> tuple[LedRecord, ...]:
    leds = calibration.leds
    return tuple(
        LedRecord(
            led=j + 1,
            seen=int(leds.n_seen[j]),
            used=int(leds.n_used[j]),
            rms_px=plain(leds.rms[j]),
            mean_px=plain(leds.mean[j]),
            displacement_mm=plain(leds.displacement[j]),
            displaced=j + 1 in leds.displaced,
        )
        for j in range(len(leds.rms))
    )


def _frames(calibration: Calibration) -> Iterator[FrameRecord]:
    names = calibration.bundle.state.rig.names
    tips = plain(calibration.tips_cam)
    for c, images in enumerate(calibration.cameras):
        for i, frame in enumerate(_frames_of(images)):
            if frame.reason is not Reason.ABSENT:
                yield structs.replace(
                    frame,
                    camera=names[c] if names else "",
                    moment=i + 1 if names else 0,
                    tip_cam_mm=tips[i],
                )


def _frames_of(images: CameraImages) -> Iterator[FrameRecord]:
    """Yield the images of one camera, without a tip of each."""
    observations = images.observations
    pixels, areas = plain(observations.seen_pixels), plain(observations.areas)
    fit = np.isfinite(observations.pixels[..., 0]).tolist()
    sigmas = observations.sigmas
    usual = ~np.isfinite(sigmas) | (sigmas == EXACT_SIGMA)
    sigmas = plain(np.where(usual, np.nan, sigmas))
    rms, widths = plain(images.rms), plain(observations.edge_widths)
    leds_used, lamps = images.leds_used.tolist(), plain(observations.lamps)
    for i, reason in enumerate(images.reasons):
        finding = observations.details[i]
        detail = None if finding is None else StoredMessage.of(finding)
        yield FrameRecord(
            file=observations.names[i],
            used=reason is Reason.NONE,
            reason=reason,
            detail="" if detail is None else detail.text,
            detail_code="" if detail is None else detail.code,
            detail_values={} if detail is None else detail.values,
            rms_px=rms[i],
            tip_cam_mm=(None, None, None),
            edge_width_px=widths[i],
            lamps_px=lamps[i],
            leds=tuple(
                SpotRecord(
                    *(j + 1, x, y, areas[i][j], fit[i][j], leds_used[i][j]),
                    sigmas[i][j],
                )
                for j, (x, y) in enumerate(pixels[i])
                if x is not None
            ),
        )


def _adjusted_intrinsics(
    calibration: Calibration, c: int
) -> dict[str, AdjustedParameter]:
    """Return the adjusted intrinsics of the c-th camera."""
    camera = calibration.bundle.state.rig.cameras[c]
    place = calibration.bundle.layout.cameras[c]
    deviations = np.sqrt(np.diag(calibration.bundle.covariance)[place])
    before = np.sqrt(np.diag(calibration.stated.cameras[c].covariance))
    names = ("fx", "fy", "cx", "cy", *camera.distortion_names)
    columns = map(plain, (camera.intrinsics, deviations, before))
    return {
        name: AdjustedParameter(*values)
        for name, *values in zip(names, *columns, strict=False)
    }


def _rig(calibration: Calibration) -> RigRecord:
    """Return the results of each camera of a rig."""
    names = calibration.bundle.state.rig.names
    return RigRecord(
        tuple(
            CameraRecord(
                name=name,
                images=ImageCounts(
                    total=len(images.reasons) - images.reasons.count(Reason.ABSENT),
                    used=int(images.used.sum()),
                    dropped=count_dropped(images.reasons),
                ),
                rms_px=plain(images.total_rms),
                intrinsics=_adjusted_intrinsics(calibration, c),
                intrinsics_uncertainty_assumed=calibration.priors.cameras[c].assumed,
                cam_from_rig=_camera_place(calibration, c),
            )
            for c, (name, images) in enumerate(
                zip(names, calibration.cameras, strict=True)
            )
        )
    )


def _camera_place(calibration: Calibration, c: int) -> CameraPlace:
    bundle, prior = calibration.bundle, calibration.stated.extrinsics
    rig = bundle.state.rig
    rotation, translation = plain(rig.rotations[c]), plain(rig.translations[c])
    if c == 0 or prior is None:
        return CameraPlace(rotation, translation)
    own = slice(6 * (c - 1), 6 * c)
    place = bundle.layout.extrinsics
    lag = calibration.lags[c - 1]
    return CameraPlace(
        rotation,
        translation,
        change_from_file=plain(bundle.values[place][own]),
        standard_uncertainty=plain(np.sqrt(np.diag(bundle.covariance)[place][own])),
        standard_uncertainty_before=plain(np.sqrt(np.diag(prior.covariance)[own])),
        uncertainty_assumed=prior.assumed,
        lag_images=None if lag is None else plain(lag.value),
        lag_standard_uncertainty=None if lag is None else plain(lag.sigma),
    )
