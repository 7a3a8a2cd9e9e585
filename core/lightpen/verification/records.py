"""Verifications as JSON records."""

from collections.abc import Mapping, Sequence
from typing import Any

from lightpen.estimation.instrument import Instrument
from lightpen.estimation.uncertainty import COVERAGE_FACTOR
from lightpen.formats.json_records import plain, record_heading
from lightpen.local_time import local_now
from lightpen.verification.articulation import Articulation
from lightpen.verification.assessment import Conformity
from lightpen.verification.circle import Circle, CircleRun
from lightpen.verification.drift import Drift
from lightpen.verification.fixed_point import FixedPoint, Scatter
from lightpen.verification.length import Length
from lightpen.verification.pen_health import PenHealth
from lightpen.verification.repeatability import Repeatability
from lightpen.verification.touch import RejectedFrame, Touch


def verification_record(
    kind: str,
    entries: Mapping[str, Any],
    assessment: Conformity | None,
    limits: Mapping[str, float],
    inputs: Mapping[str, Any],
) -> dict[str, Any]:
    """Return the record of a verification.

    Parameters
    ----------
    kind : str
        What was verified.
    entries : mapping
        What was found.
    assessment : Conformity or None
        None of what is measured and not judged.
    limits : mapping of str to float
        That it was judged by, mm.
    inputs : mapping
        What it was made from.
    """
    record = {
        **record_heading(local_now()),
        "verification": kind,
        "coverage_factor": COVERAGE_FACTOR,
        "verdict": None
        if assessment is None
        else {
            "grade": assessment.grade.value,
            **plain(assessment.reason),
            "next_step": assessment.next_step,
            "decision_rule": "simple acceptance: within the limit, U stated beside it",
            "limits_mm": limits,
        },
        **entries,
        "inputs": inputs,
    }
    return {name: plain(entry) for name, entry in record.items()}


def fixed_point_entries(found: FixedPoint, instrument: Instrument) -> dict[str, Any]:
    """Return what was found of a fixed point."""
    return {
        "calibrated": _scatter(found.calibrated),
        "nominal": None if found.nominal is None else _scatter(found.nominal),
        "expanded_uncertainty_mm": found.uncertainty,
        "expected_std_mm": found.expected_deviation,
        "moved_mm": found.moved,
        "tip_change_mm": found.tip_change,
        "tip_change_expanded_uncertainty_mm": found.tip_change_uncertainty,
        "wants_other_tip": found.wants_other_tip,
        "touches": [touch_entries(touch, instrument) for touch in found.touches],
        "left_out": [touch_entries(touch, instrument) for touch in found.left_out],
    }


def circle_entries(found: Circle, instrument: Instrument) -> dict[str, Any]:
    """Return what was found of a circle."""
    errors = found.errors
    return {
        "certified_radius_mm": found.certified,
        "mean_radius_mm": found.radii.mean(),
        "mean_error_mm": errors.mean(),
        "mean_relative_error": errors.mean() / found.certified,
        "std_mm": found.deviation,
        "expanded_uncertainty_mm": found.uncertainty,
        "runs": [
            {
                **_circle_run(run, instrument),
                "error_mm": error,
                "relative_error": error / found.certified,
            }
            for run, error in zip(found.runs, errors.tolist(), strict=True)
        ],
    }


def length_entries(found: Length, instrument: Instrument) -> dict[str, Any]:
    """Return what was found of a known length."""
    return {
        "certified_length_mm": found.certified,
        "certified_expanded_uncertainty_mm": found.certified_uncertainty,
        "scale": {
            "factor": found.scale.factor,
            "expanded_uncertainty": found.scale.uncertainty,
            "expanded_uncertainty_before": found.scale.uncertainty_before,
        },
        "runs": [
            {
                "name": run.name,
                "length_mm": run.measured,
                "error_mm": error,
                "expanded_uncertainty_mm": uncertainty,
                "along_view": run.along_view,
                "ends": [
                    [touch_entries(touch, instrument) for touch in end]
                    for end in run.ends
                ],
            }
            for run, error, uncertainty in zip(
                found.runs,
                found.errors.tolist(),
                found.uncertainties.tolist(),
                strict=True,
            )
        ],
    }


def articulation_entries(found: Articulation) -> dict[str, Any]:
    """Return what was found of a location error."""
    return {
        "in_the_form_of": "ISO 10360-12, articulated location error",
        "location_error_mm": found.location_error,
        "expected_mm": found.expected,
        "postures": [
            {"name": name, "location_cam_mm": location, "spread_mm": spread}
            for name, location, spread in zip(
                found.names,
                found.locations.tolist(),
                found.spreads.tolist(),
                strict=True,
            )
        ],
    }


def rejected_entries(rejected: Sequence[RejectedFrame]) -> list[dict[str, str]]:
    """Return the images that take no part."""
    return [{"file": each.name, "reason": str(each.reason)} for each in rejected]


def touch_entries(touch: Touch, instrument: Instrument) -> dict[str, Any]:
    """Return a touch."""
    return {
        "images": list(touch.names),
        "point_cam_mm": touch.point_cam,
        "covariance": touch.covariance(instrument),
        "noise_covariance": touch.noise,
        "rms_px": touch.rms,
        "rejected": rejected_entries(touch.rejected),
    }


def _scatter(scatter: Scatter) -> dict[str, Any]:
    return {
        "points_cam_mm": scatter.points,
        "mean_mm": scatter.mean,
        "std_mm": scatter.deviation,
        "range_mm": scatter.range,
    }


def _circle_run(run: CircleRun, instrument: Instrument) -> dict[str, Any]:
    return {
        "name": run.name,
        "radius_mm": run.radius,
        "expanded_uncertainty_mm": run.uncertainty,
        "center_cam_mm": run.fit.center_cam,
        "normal_cam": run.fit.normal_cam,
        "roundness_mm": run.fit.roundness,
        "flatness_mm": run.fit.flatness,
        "covered_deg": run.fit.covered,
        "touches": [touch_entries(touch, instrument) for touch in run.touches],
        "left_out": [touch_entries(touch, instrument) for touch in run.left_out],
    }


def repeatability_entries(found: Repeatability) -> dict[str, Any]:
    """Return what was found of calibrations of one tip."""
    study = found.capability
    return {
        "mean_mm": found.scatter.mean,
        "std_mm": found.scatter.deviation,
        "range_mm": found.scatter.range,
        "control": {
            "lower_mm": found.control.lower,
            "center_mm": found.control.center,
            "upper_mm": found.control.upper,
            "out_of_control": [tip.name for tip in found.out_of_control],
        },
        "capability": (
            None
            if study is None
            else {"tolerance_mm": study.tolerance, "cg": study.cg, "cgk": study.cgk}
        ),
        "fixed_point_std_mm": (
            None if found.touched is None else found.touched.deviation
        ),
        "points_to": found.points_to,
        "tips": [
            {
                "name": tip.name,
                "tip_pen_mm": tip.tip_pen,
                "expanded_uncertainty_mm": tip.uncertainty,
                "when": None if tip.when is None else tip.when.isoformat(),
            }
            for tip in found.tips
        ],
    }


def pen_health_entries(found: PenHealth) -> dict[str, Any]:
    """Return what was found of a pen over its swings."""
    return {
        "moved_leds": found.moved,
        "growth": found.growth,
        "swings": [
            {"name": swing.name, "shifts_mm": swing.shifts, "growth": swing.growth}
            for swing in found.swings
        ],
    }


def drift_entries(found: Drift) -> dict[str, Any]:
    """Return what was found of a witness."""
    return {
        "visits": [
            {"name": name, "move_mm": move, "expanded_uncertainty_mm": uncertainty}
            for name, move, uncertainty in zip(
                found.names,
                found.moves.tolist(),
                found.uncertainties.tolist(),
                strict=True,
            )
        ],
        "standard_uncertainty_share_mm": found.share,
    }
