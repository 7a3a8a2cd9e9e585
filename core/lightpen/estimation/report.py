"""A calibration as a JSON record."""

from dataclasses import asdict
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.reasons import Reason
from lightpen.estimation.calibrate import Calibration
from lightpen.estimation.instrument import instrument_record
from lightpen.estimation.lamp_report import lamps_record
from lightpen.estimation.methods import METHODS, result_of
from lightpen.estimation.report_warnings import warnings_of
from lightpen.estimation.rig_report import (
    adjusted_intrinsics_record,
    count_dropped,
    rig_record,
)
from lightpen.estimation.second_cone import SecondCone
from lightpen.estimation.uncertainty import COVERAGE_FACTOR, ShareName
from lightpen.estimation.verdict import judge
from lightpen.formats.hashes import Inputs
from lightpen.formats.json_records import file_entry, plain, record_heading
from lightpen.local_time import local_now
from lightpen.model.coverage import DIRECTION_NAMES
from lightpen.model.limits import SwingLimits
from lightpen.sentences import Sentence


def calibration_record(
    calibration: Calibration, inputs: Inputs, method: str, limits: SwingLimits
) -> dict[str, Any]:
    """Return the record of a calibration, as it is read from its JSON.

    Parameters
    ----------
    method : str
        ``"joint"`` or ``"two-stage"``, of the tip.
    limits : SwingLimits
        By which the calibration is judged.

    Returns
    -------
    dict
        README.md documents its entries.
    """
    result = result_of(calibration, method)
    tip = result.tip_pen
    nominal = inputs.nominal_tip
    record = {
        **record_heading(local_now()),
        "origin": None if inputs.origin is None else inputs.origin.value,
        "method": method,
        "tip_pen_mm": tip,
        "cone_cam_mm": result.cone_cam,
        "covariance": result.covariance,
        "expanded_uncertainty_mm": result.expanded_uncertainty[:3],
        "cone_expanded_uncertainty_mm": result.expanded_uncertainty[3:],
        "coverage_factor": COVERAGE_FACTOR,
        "nominal_tip_mm": nominal,
        "change_from_nominal_mm": None if nominal is None else tip - nominal,
        "rms_px": calibration.joint.rms,
        "rms_mm": result.rms_mm,
        "sigma_px": calibration.joint.sigma,
        "images": {
            "total": len(calibration.used),
            "used": int(calibration.used.sum()),
            "dropped": dict(count_dropped(calibration.reasons)),
        },
        "methods": _methods(calibration),
        "verdict": _verdict(calibration, limits),
        "warnings": warnings_of(calibration),
        "uncertainty": _uncertainty(calibration),
        "adjusted": _adjusted(calibration),
        "assumptions": asdict(calibration.assumptions),
        "fixed_lamps": lamps_record(calibration),
        "second_cone": _second_cone(calibration.second),
        "instrument": instrument_record(calibration.instrument),
        "weakest_direction": {
            "vector_pen": calibration.budget.weakest_direction,
            "expanded_uncertainty_mm": calibration.budget.weakest_uncertainty,
        },
        "coverage": _coverage(calibration),
        "leds": _leds(calibration),
        **_rig(calibration),
        "inputs": {
            "camera": file_entry(inputs.camera),
            "pen": file_entry(inputs.pen),
            "observations": [file_entry(file) for file in inputs.observations],
            "units": inputs.units,
            "led_diameter_mm": inputs.led_diameter,
            **_rig_inputs(inputs),
        },
        "frames": _frames(calibration),
    }
    return {name: plain(entry) for name, entry in record.items()}


def _rig_inputs(inputs: Inputs) -> dict[str, Any]:
    """Return the further files of several cameras; nothing of one camera."""
    if inputs.rig is None:
        return {}
    return {
        "rig": file_entry(inputs.rig.rig),
        "cameras": [file_entry(file) for file in inputs.rig.cameras],
    }


def _rig(calibration: Calibration) -> dict[str, Any]:
    """Return what is told of each of several cameras; nothing of one camera."""
    if len(calibration.cameras) == 1:
        return {}
    return {"rig": rig_record(calibration)}


def _verdict(calibration: Calibration, limits: SwingLimits) -> dict[str, Any]:
    verdict = judge(calibration, limits)
    return {
        "grade": verdict.grade.value,
        **plain(verdict.reason),
        "next_step": verdict.next_step.value,
        "limits": {
            "max_uncertainty_mm": limits.max_uncertainty,
            "min_images": limits.min_images,
            "min_per_field": limits.min_per_field,
        },
    }


def _methods(calibration: Calibration) -> dict[str, Any]:
    methods: dict[str, Any] = {}
    for name in METHODS:
        result = result_of(calibration, name)
        methods[name] = {
            "tip_pen_mm": result.tip_pen,
            "cone_cam_mm": result.cone_cam,
            "covariance": result.covariance,
            "expanded_uncertainty_mm": result.expanded_uncertainty[:3],
            "rms_mm": result.rms_mm,
        }
    two_stage = calibration.two_stage
    methods["two-stage"]["convergence"] = {
        "x_mm": two_stage.iterates,
        "objective_mm2": two_stage.objectives,
        "alpha": two_stage.step_lengths,
        "increment_mm": two_stage.increments,
    }
    return methods


def _uncertainty(calibration: Calibration) -> dict[str, Any]:
    budget = calibration.budget
    shares = {share.name: share for share in budget.shares}

    def std(covariance: FloatArray | None) -> FloatArray | None:
        return None if covariance is None else np.sqrt(np.diag(covariance)[:3])

    return {
        "shares": [
            {
                "name": share.name.value,
                "standard_uncertainty_mm": share.standard_uncertainty,
                "weakest_expanded_uncertainty_mm": budget.weakest_share(share),
                "assumed": share.assumed,
            }
            for share in budget.shares
        ],
        **{
            f"{name.value.replace(' ', '_')}_mm": (
                shares[name].standard_uncertainty if name in shares else None
            )
            for name in ShareName
        },
        "independent_noise_mm": std(budget.independent_noise),
        "blocks_mm": std(budget.blocks),
        "block_ratio": budget.block_ratio,
        "correlation_factor": budget.correlation_factor,
        "lag1_autocorrelation": budget.autocorrelation,
        "led_sigma_mm": calibration.led_sigma,
        "halves_difference_mm": calibration.halves.difference,
        "halves_expanded_uncertainty_mm": calibration.halves.expanded_uncertainty,
    }


def _adjusted(calibration: Calibration) -> dict[str, Any]:
    """Return what the images made of the files."""
    prior = calibration.priors.cameras[0]
    reading = calibration.priors.reading
    return {
        "intrinsics": adjusted_intrinsics_record(calibration, 0),
        "intrinsics_uncertainty_assumed": prior.assumed,
        "scale_uncertainty_before": np.sqrt(calibration.stated.scale.covariance[0, 0]),
        "scale_uncertainty_assumed": calibration.priors.scale.assumed,
        "temperature_uncertainty_assumed": calibration.priors.temperature.assumed,
        "pen_growth": calibration.growth,
        "disc_diameter_mm": calibration.bundle.state.pen.diameter,
        "disc_diameter_by_areas_mm": (
            None
            if reading is None
            else {"value": reading.value, "standard_uncertainty": reading.sigma}
        ),
        "contradictions": [
            {
                "what": str(each.what),
                "unit": each.unit,
                "stated": each.stated,
                "stated_expanded_uncertainty": each.stated_uncertainty,
                "wanted": each.wanted,
                "wanted_expanded_uncertainty": each.wanted_uncertainty,
                "standard_deviations": each.deviations,
                **({"camera": each.camera} if each.camera else {}),
            }
            for each in calibration.contradictions
        ],
    }


def _second_cone(second: SecondCone | None) -> dict[str, Any] | None:
    if second is None:
        return None
    return {
        "cone_cam_mm": second.cone_cam,
        "images_used": second.n_used,
        "stated_distance_mm": second.separation.distance,
        "stated_standard_uncertainty_mm": second.separation.sigma,
        "distance_mm": second.distance,
        "expanded_uncertainty_without_mm": second.uncertainty_without,
        "expanded_uncertainty_with_mm": second.uncertainty_with,
    }


def _coverage(calibration: Calibration) -> dict[str, Any]:
    coverage = calibration.coverage
    return {
        "directions": list(DIRECTION_NAMES),
        "leaning": coverage.counts[0],
        "leaning_far": coverage.counts[1],
        "upright": coverage.n_upright,
        "missing": coverage.missing,
        "tilt_deg": np.degrees([coverage.tilts.min(), coverage.tilts.max()]),
        "turn_deg": np.degrees([coverage.turns.min(), coverage.turns.max()]),
        "spread_deg": np.degrees(coverage.spread),
        "spread_axes_pen": coverage.axes,
        "predicted_bound_mm": np.sqrt(
            np.diag(calibration.budget.independent_noise)[:3]
        ),
    }


def _leds(calibration: Calibration) -> list[dict[str, Any]]:
    leds = calibration.leds
    return [
        {
            "led": j + 1,
            "seen": leds.n_seen[j],
            "used": leds.n_used[j],
            "rms_px": leds.rms[j],
            "mean_px": leds.mean[j],
            "displacement_mm": leds.displacement[j],
            "displaced": j + 1 in leds.displaced,
            "correction_mm": calibration.bundle.led_corrections[j],
        }
        for j in range(len(leds.rms))
    ]


def _frames(calibration: Calibration) -> list[dict[str, Any]]:
    frames = []
    tips = calibration.tips_cam.tolist()
    for c, images in enumerate(calibration.cameras):
        observations = images.observations
        seen = np.isfinite(observations.seen_pixels[..., 0]).tolist()
        fit = np.isfinite(observations.pixels[..., 0]).tolist()
        pixels = observations.seen_pixels.tolist()
        leds_used = images.leds_used.tolist()
        rms = images.rms.tolist()
        frames += [
            {
                **_camera_of(calibration, c, i),
                "file": observations.names[i],
                "used": reason is Reason.NONE,
                "reason": str(reason),
                **_detail_of(observations.details[i]),
                "rms_px": rms[i],
                "tip_cam_mm": tips[i],
                "edge_width_px": observations.edge_widths[i],
                "lamps_px": observations.lamps[i],
                "leds": [
                    {
                        "led": j + 1,
                        "x_px": x,
                        "y_px": y,
                        "area_px2": observations.areas[i, j],
                        "fit": fit[i][j],
                        "used": leds_used[i][j],
                    }
                    for j, (x, y) in enumerate(pixels[i])
                    if seen[i][j]
                ],
            }
            for i, reason in enumerate(images.reasons)
            if reason is not Reason.ABSENT
        ]
    return frames


def _camera_of(calibration: Calibration, c: int, moment: int) -> dict[str, Any]:
    """Return which of several cameras took an image, and when; nothing of one."""
    names = calibration.bundle.state.rig.names
    return {"camera": names[c], "moment": moment + 1} if names else {}


def _detail_of(detail: Sentence | None) -> dict[str, str]:
    """Return what else there is to say of an image that is left out, and its code."""
    if detail is None:
        return {"detail": "", "detail_code": ""}
    return {"detail": str(detail), "detail_code": detail.code}
