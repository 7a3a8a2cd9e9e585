"""A calibration as a JSON record."""

import json
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import version
from math import isfinite
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.reasons import Reason
from lightpen.estimation.calibrate import Calibration
from lightpen.estimation.instrument import instrument_record
from lightpen.estimation.lamp_report import lamp_warnings, lamps_record
from lightpen.estimation.linearised import N_CONE
from lightpen.estimation.pivot_calibration import COVERED, NOT_COVERED, PivotCalibration
from lightpen.estimation.rig_report import (
    count_dropped,
    intrinsics_record,
    rig_record,
    rig_warnings,
)
from lightpen.estimation.seat_forms import FORMS
from lightpen.estimation.second_cone import SecondCone
from lightpen.estimation.single_images import USUAL_SIGMA
from lightpen.estimation.uncertainty import COVERAGE_FACTOR, ShareName
from lightpen.estimation.verdict import judge
from lightpen.formats.hashes import InputFile, Inputs
from lightpen.formats.own_json import with_checksum
from lightpen.local_time import local_now
from lightpen.model.coverage import DIRECTION_NAMES
from lightpen.model.limits import SwingLimits
from lightpen.sentences import Sentence, sentence

METHODS = ("joint", "two-stage")


@dataclass(frozen=True, eq=False)
class MethodResult:
    """Tip and cone by one of the methods.

    Attributes
    ----------
    tip_pen, cone_cam : (3,) array
        mm.
    covariance : (6, 6) array
        Of both, mm^2.
    rms_mm : float
        Root mean square distance of the tip of single images from the cone point.
    """

    tip_pen: FloatArray
    cone_cam: FloatArray
    covariance: FloatArray
    rms_mm: float

    @property
    def expanded_uncertainty(self) -> FloatArray:
        """U (k = 2) of tip and cone, (6,), mm."""
        return COVERAGE_FACTOR * np.sqrt(np.diag(self.covariance))


def result_of(calibration: Calibration, method: str) -> MethodResult:
    """Return tip and cone by ``"joint"`` or ``"two-stage"``."""
    if method == "two-stage":
        fit = calibration.two_stage
        return MethodResult(
            fit.tip_pen, fit.cone_cam, calibration.two_stage_covariance, fit.rms
        )
    joint = calibration.joint
    deviations = calibration.tips_cam[calibration.used] - joint.cone_cam
    return MethodResult(
        joint.tip_pen,
        joint.cone_cam,
        calibration.budget.covariance,
        float(np.sqrt(np.mean(np.sum(deviations**2, axis=1)))),
    )


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
        "program": _program(),
        "created": local_now().isoformat(timespec="seconds"),
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
            "camera": _input(inputs.camera),
            "pen": _input(inputs.pen),
            "observations": [_input(file) for file in inputs.observations],
            "units": inputs.units,
            "led_diameter_mm": inputs.led_diameter,
            **_rig_inputs(inputs),
        },
        "frames": _frames(calibration),
    }
    return {name: plain(entry) for name, entry in record.items()}


def pivot_record(
    calibration: PivotCalibration, poses: InputFile, least_squares: bool
) -> dict[str, Any]:
    """Return the record of a pivot calibration; README.md documents its entries."""
    fit, groups = calibration.fit, calibration.groups
    uncertainty = calibration.expanded_uncertainty
    group = np.ones(len(fit.used), dtype=int) if groups is None else groups.group
    record = {
        "program": _program(),
        "created": local_now().isoformat(timespec="seconds"),
        "method": "least squares" if least_squares else "robust",
        "tip_pen_mm": fit.tip_pen,
        "pivot_cam_mm": fit.pivot_cam,
        "covariance": calibration.covariance,
        "expanded_uncertainty_mm": uncertainty[:3],
        "pivot_expanded_uncertainty_mm": uncertainty[3:],
        "coverage_factor": COVERAGE_FACTOR,
        "uncertainty": {
            "covers": str(COVERED),
            "leaves_out": str(NOT_COVERED),
            "independent_noise": fit.covariance,
            "correlation_factor": calibration.correlation_factor,
        },
        "rms_mm": fit.rms,
        "warnings": calibration.warnings,
        "poses": {"total": len(fit.used), "used": int(fit.used.sum())},
        "inputs": {"poses": _input(poses)},
        "frames": [
            {
                "pose": i + 1,
                "used": used,
                "group": name or None,
                "residual_mm": residual,
            }
            for i, (used, name, residual) in enumerate(
                zip(
                    fit.used.tolist(),
                    group.tolist(),
                    fit.residuals.tolist(),
                    strict=True,
                )
            )
        ],
    }
    return {name: plain(entry) for name, entry in record.items()}


def record_bytes(record: Mapping[str, Any]) -> bytes:
    """Return a record as JSON that tells when it was changed."""
    return with_checksum(json_bytes(record)) + b"\n"


def json_bytes(record: Mapping[str, Any]) -> bytes:
    """Return a record as JSON, readable: one line an entry, and one an image.

    The bytes of a file name that is no text in this system's encoding become JSON
    escapes.
    """
    lines = []
    for name, entry in record.items():
        if name == "frames":
            rows = ",\n    ".join(map(_dumps, entry))
            lines.append(f'  "frames": [\n    {rows}\n  ]')
        else:
            lines.append(f"  {_dumps(name)}: {_dumps(entry)}")
    text = "{\n" + ",\n".join(lines) + "\n}\n"
    return text.encode("utf-8", "backslashreplace")


def warnings_of(calibration: Calibration) -> list[Sentence]:
    """Return what the user should look into, one sentence or two each."""
    leds, sigma = calibration.leds, calibration.joint.sigma
    warnings = [
        *rig_warnings(calibration),
        *(each.sentence for each in calibration.contradictions),
        *lamp_warnings(calibration),
        *_seat_warnings(calibration),
    ]
    warnings += [
        sentence(
            "warning.led-unseen",
            "LED {led} was found in no image. A finger may cover it, it may be off, or "
            "its place in the pen file may be wrong.",
            led=int(led) + 1,
        )
        for led in np.flatnonzero(leds.n_seen == 0)
    ]
    warnings += [
        sentence(
            "warning.led-displaced",
            "LED {led} sits {distance:.3f} mm off its place in the pen file. Check the "
            "file, or measure the pen again.",
            led=led,
            distance=float(np.linalg.norm(leds.displacement[led - 1])),
        )
        for led in leds.displaced
    ]
    if sigma > USUAL_SIGMA:
        warnings.append(
            sentence(
                "warning.large-residuals",
                "The residuals are large: {sigma:.2f} px, {usual} px or less is usual. "
                "Check that the camera file is of this camera, lens and focus, and the "
                "pen file of this pen.",
                sigma=sigma,
                usual=USUAL_SIGMA,
            )
        )
    return warnings


def _seat_warnings(calibration: Calibration) -> list[Sentence]:
    """Return what is told of a tip that did not rest where the model has it."""
    bundle, found = calibration.bundle, calibration.bundle.counted
    warnings = []
    jitter = found.jitter.covariance
    # Ball and cone that are as round as assumed move the tip by so much as well.
    by_form = calibration.priors.form_error * float(np.sqrt(N_CONE * sum(FORMS)))
    distance = 0.0 if jitter is None else float(np.sqrt(np.trace(jitter)))
    if distance > by_form:
        warnings.append(
            sentence(
                "warning.seat-jitter",
                "The tip did not come to rest in the same place: it moved by "
                "{distance:.4f} mm (standard deviation) from image to image. Clean tip "
                "and cone, look for wear, and press the tip in. It is in the "
                "uncertainty.",
                distance=distance,
            )
        )
    forms = (*found.seat, found.oval)
    if any(form.is_significant for form in forms):
        warnings.append(
            sentence(
                "warning.seat-form",
                "The tip moved in its seat as the pen leant, by some {distance:.4f} "
                "mm. Tip or cone may be out of round, worn or dirty. It is in the "
                "uncertainty.",
                distance=max(form.sigma for form in forms),
            )
        )
    if found.drift.is_significant:
        warnings.append(
            sentence(
                "warning.drift",
                "The cone moved by {distance:.4f} mm against the camera during the "
                "swing. Clamp both, let the camera warm up, and repeat. It is in the "
                "uncertainty.",
                distance=bundle.drift,
            )
        )
    stated = calibration.priors.led_sigma
    if stated is not None and found.leds.is_significant:
        warnings.append(
            sentence(
                "warning.led-file-contradicted",
                "The images contradict the LED file: its coordinates are off by "
                "{found:.4f} mm (standard deviation), the file states {stated:.4f} mm. "
                "Measure the pen again, or check that the file is of this pen.",
                found=found.leds.sigma,
                stated=stated,
            )
        )
    return warnings


def _program() -> dict[str, str]:
    return {"name": "lightpen", "version": version("lightpen")}


def _input(file: InputFile) -> dict[str, str]:
    named = {"file": file.path.name, "sha256": file.sha256}
    if file.content is not None:
        named["base64"] = b64encode(file.content).decode()
    return named


def _rig_inputs(inputs: Inputs) -> dict[str, Any]:
    """Return the further files of several cameras; nothing of one camera."""
    if inputs.rig is None:
        return {}
    return {
        "rig": _input(inputs.rig.rig),
        "cameras": [_input(file) for file in inputs.rig.cameras],
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
        "intrinsics": intrinsics_record(calibration, 0),
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
                "detail": str(observations.details[i] or ""),
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


def _dumps(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def plain(value: Any) -> Any:
    """Return arrays as lists, what is not a number as null, sentences with codes."""
    if isinstance(value, Sentence):
        value = {"code": value.code, "text": str(value), "values": value.values}
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "f" and np.isfinite(value).all():
            return value.tolist()
        value = value.tolist()
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return value if isfinite(value) else None
    if isinstance(value, dict):
        return {name: plain(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    return value
