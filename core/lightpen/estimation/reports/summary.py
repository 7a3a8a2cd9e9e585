"""A calibration as text for the screen."""

from typing import Any

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.reasons import Reason
from lightpen.estimation.calibrate import Calibration
from lightpen.estimation.contact.single_images import CameraImages
from lightpen.estimation.pivot.pivot import TwoStageFit
from lightpen.estimation.pivot_calibration import COVERED, NOT_COVERED, PivotCalibration
from lightpen.estimation.reports.report_warnings import (
    MethodResult,
    count_dropped,
    rejected_centres,
    result_of,
    two_stage_difference,
    warnings_of,
)
from lightpen.estimation.reports.verdict import Verdict
from lightpen.formats.opened_files import InputFile
from lightpen.formats.own_json import file_entry, plain, record_heading
from lightpen.local_time import local_now
from lightpen.model.coverage import COVERAGE_FACTOR
from lightpen.model.names import METHODS, Origin

MAX_NAMED = 5  # images
WIDTH = 10  # characters of a camera's name


def calibration_text(
    calibration: Calibration,
    nominal_tip: FloatArray | None,
    verdict: Verdict,
    origin: Origin | None = None,
) -> str:
    """Return a calibration as text for the screen, the verdict on it last."""
    results = {name: result_of(calibration, name) for name in METHODS}
    method = calibration.method
    chosen = results[method]
    lines = [_heading("Tip in the pen frame, mm", "xyz")]
    for name in (method, *(other for other in METHODS if other != method)):
        lines.append(_numbers(name, results[name].tip_pen))
        lines.append(_numbers("  U (k = 2)", results[name].expanded_uncertainty[:3]))
    off = two_stage_difference(calibration)[:3]
    lines.append(_numbers("two-stage - joint", off))
    lines.append(_numbers("  by projected discs", calibration.projection_bias[:3]))
    if nominal_tip is not None:
        lines.append(_numbers("nominal", nominal_tip))
        lines.append(_numbers("change from nominal", chosen.tip_pen - nominal_tip))
    lines += [
        "  Effective tip, in the scale of the LED file: min over x, c of sum "
        "|R_i x + T_i - c|^2"
    ]
    names = calibration.bundle.state.rig.names
    frame = f"frame of {names[0]}" if names else "camera frame"
    lines += ["", _heading(f"Cone in the {frame}, mm", "uvw")]
    lines.append(_numbers(method, chosen.cone_cam))
    lines.append(_numbers("  U (k = 2)", chosen.expanded_uncertainty[3:]))
    lines += [
        "",
        *_origin_lines(origin),
        *_image_lines(calibration),
        *_lamp_lines(calibration),
        "",
        *_quality_lines(calibration, chosen),
    ]
    warnings = warnings_of(calibration)
    if warnings:
        lines += ["", *map(str, warnings)]
    lines += [
        "",
        f"Verdict      {verdict.grade.upper()}: {verdict.reason}",
        f"             {verdict.next_step.message}",
    ]
    return "\n".join(lines)


def convergence_text(fit: TwoStageFit) -> str:
    """Return the iterations of the paper's equation (11) as a table."""
    names = ("x0", "y0", "z0", "u0", "v0", "w0")
    title = "".join(f"{name + ' / mm':>13}" for name in names)
    lines = [
        "Two-stage method, equations (9) to (12) of the paper",
        f"{'k':>3}{title}{'alpha':>10}{'|alpha dX|':>12}{'objective':>13}",
    ]
    steps = zip((np.nan, *fit.step_lengths), (np.nan, *fit.increments), strict=True)
    for k, (alpha, increment) in enumerate(steps):
        X = "".join(f"{value:13.6f}" for value in fit.iterates[k])
        step = f"{'':22}" if k == 0 else f"{alpha:10.4f}{increment:12.2e}"
        lines.append(f"{k:3}{X}{step}{fit.objectives[k]:13.6g}")
    return "\n".join(lines)


def pivot_text(calibration: PivotCalibration) -> str:
    """Return a pivot calibration as text for the screen."""
    fit, uncertainty = calibration.fit, calibration.expanded_uncertainty
    factor = np.sqrt(calibration.correlation_factor)
    warnings = map(str, calibration.warnings)
    return "\n".join(
        [
            _heading("Tip in the frame of the poses, mm", "xyz"),
            _numbers("tip", fit.tip_pen),
            _numbers("  U (k = 2)", uncertainty[:3]),
            "",
            _heading("Pivot in the camera frame, mm", "uvw"),
            _numbers("pivot", fit.pivot_cam),
            _numbers("  U (k = 2)", uncertainty[3:]),
            "",
            f"Poses        {fit.used.sum()} of {len(fit.used)} used",
            f"Residuals    {fit.rms:.3f} mm rms an axis",
            f"Correlation  U is {factor:.1f} times that of independent noise",
            f"U covers     {COVERED}",
            f"  leaves out {NOT_COVERED}",
            *(["", *warnings] if calibration.warnings else []),
        ]
    )


def _origin_lines(origin: Origin | None) -> list[str]:
    if origin is None:
        return []
    remark = ": this is the tip of no real pen" if origin is Origin.SIMULATED else ""
    return [f"Origin       {origin.upper()}{remark}"]


def _image_lines(calibration: Calibration) -> list[str]:
    n_used = int(calibration.used.sum())
    n_images = len(calibration.used)
    if len(calibration.cameras) > 1:
        moments = f"Moments      {n_used} of {n_images} used"
        return [moments, *_rig_lines(calibration)]
    images = calibration.cameras[0]
    lines = [f"Images       {n_used} of {n_images} used"]
    lines += [
        f"  dropped    {count} {reason}: {_named_images(images, reason)}"
        for reason, count in count_dropped(images.reasons).items()
    ]
    return lines


def _quality_lines(calibration: Calibration, chosen: MethodResult) -> list[str]:
    budget, halves = chosen.budget, calibration.halves
    joint = calibration.joint
    tilt = np.degrees(calibration.coverage.tilts)
    centres = rejected_centres(calibration)
    lines = [
        f"LED centres  {centres.n_rejected} of {centres.n_seen} rejected "
        f"({100 * centres.share:.1f} %), {centres.where}",
        f"Residuals    {joint.rms:.4f} px rms, tip of single images "
        f"{chosen.rms_mm:.4f} mm rms",
        f"Weakest      {_direction(budget.weakest_direction)}, "
        f"U = {budget.weakest_uncertainty:.4f} mm",
        _numbers("Odd - even images", halves.difference),
        _numbers("  U (k = 2)", halves.expanded_uncertainty),
    ]
    lines += [
        _numbers(
            f"U from {share.name}" + (", assumed" if share.assumed else ""),
            COVERAGE_FACTOR * share.standard_uncertainty,
        )
        for share in budget.shares
    ]
    lines.append(
        f"Repeatability between blocks of images: {np.sqrt(budget.block_ratio):.2f} "
        f"times that of independent noise, autocorrelation "
        f"{budget.autocorrelation:.2f}"
    )
    lines.append(
        f"Postures     tilt {tilt.min():.0f} to {tilt.max():.0f} degrees, turn "
        f"{np.degrees(np.ptp(calibration.coverage.turns)):.0f} degrees"
    )
    if calibration.coverage.missing:
        lines.append(f"  never leant {', '.join(calibration.coverage.missing)}")
    check = calibration.self_check
    if check is not None:
        lines.append(
            f"Self-check   half of the LEDs predict the others to {check.value:.2f} "
            f"times their uncertainty; by chance 1, at most {check.limit:.2f}"
        )
    lines += _pen_lines(calibration)
    if calibration.led_sigma > 0:
        lines.append(
            f"LED file     off by {calibration.led_sigma:.4f} mm (standard "
            "deviation of a coordinate), corrected as far as the images tell"
        )
    return lines


def _pen_lines(calibration: Calibration) -> list[str]:
    lines = []
    growth = calibration.priors.growth
    if growth != 0:
        lines.append(
            f"Temperature  the pen is {1e6 * growth:+.1f} ppm larger than its file "
            "says, which is corrected"
        )
    reading = calibration.priors.reading
    if reading is not None:
        lines.append(
            f"Discs        {reading.value:.2f} mm wide by their areas, U = "
            f"{COVERAGE_FACTOR * reading.sigma:.2f} mm"
        )
    else:
        bundle = calibration.bundle
        stated, fitted = (
            f"{pen.diameter:.2f} mm"
            for pen in (bundle.unknowns.start.pen, bundle.state.pen)
        )
        moved = "" if fitted == stated else f", {fitted} as fitted"
        lines.append(
            f"Discs        {stated} wide as stated or by default{moved}; LED centres "
            "alone do not tell"
        )
    return lines


def _heading(title: str, axes: str) -> str:
    return f"{title:<30}" + "".join(f"{axis:>13}" for axis in axes)


def _numbers(title: str, values: FloatArray) -> str:
    return f"  {title:<28}" + "".join(f"{value:13.4f}" for value in values)


def _direction(vector: FloatArray) -> str:
    axis = int(np.argmax(np.abs(vector)))
    if abs(vector[axis]) > 0.95:
        return f"along the pen's {'xyz'[axis]} axis"
    return "along ({:.2f}, {:.2f}, {:.2f}) of the pen".format(*vector)


def _rig_lines(calibration: Calibration) -> list[str]:
    """Return lines on the images and the position of each camera."""
    lines = []
    rig = calibration.bundle.state.rig
    moves = calibration.bundle.values[calibration.bundle.layout.extrinsics]
    moves = moves.reshape(-1, 2, 3)  # turn and shift of each camera but the first
    for c, (name, images) in enumerate(
        zip(rig.names, calibration.cameras, strict=True)
    ):
        n_images = len(images.reasons) - images.reasons.count(Reason.ABSENT)
        lines.append(
            f"  {name:<{WIDTH}} {images.used.sum()} of {n_images} images used, "
            f"{images.total_rms:.4f} px rms"
        )
        for reason, count in count_dropped(images.reasons).items():
            lines.append(
                f"    dropped  {count} {reason}: {_named_images(images, reason)}"
            )
        if c > 0:
            turn, shift = moves[c - 1]
            lines.append(
                f"    stands   {np.linalg.norm(shift):.3f} mm and "
                f"{np.degrees(np.linalg.norm(turn)):.4f} degrees off the rig file"
            )
    return lines


def _named_images(images: CameraImages, reason: str) -> str:
    """Return the names of the images left out for a reason, the first few of them."""
    names = [
        name
        for name, why in zip(images.observations.names, images.reasons, strict=True)
        if why == reason
    ]
    return ", ".join(names[:MAX_NAMED]) + (", ..." if len(names) > MAX_NAMED else "")


def _lamp_lines(calibration: Calibration) -> list[str]:
    """Return lines of text on the fixed lamps in view."""
    lines = []
    for images in calibration.cameras:
        path = images.path
        if path is None:
            continue
        motion = f"stable within {path.noise:.3f} px"
        if path.moved > 0:
            motion = f"moved by {path.moved:.2f} px, "
            motion += "which is corrected" if path.is_followed else "unlike the pen"
        lines.append(f"Fixed lamps  {len(path.lamps)} in view; {motion}")
    return lines


def pivot_record(
    calibration: PivotCalibration,
    poses: InputFile,
    least_squares: bool,
    places: IntArray,
    n_lost: int,
) -> dict[str, Any]:
    """Return the record of a pivot calibration; README.md documents its entries.

    ``places`` (N,) are the numbers of the poses in the file, ``n_lost`` how many others
    it has.
    """
    fit, uncertainty = calibration.fit, calibration.expanded_uncertainty
    record = {
        **record_heading(local_now()),
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
        "poses": {"total": len(fit.used), "used": int(fit.used.sum()), "lost": n_lost},
        "inputs": {"poses": file_entry(poses)},
        "frames": [
            {"pose": place, "used": used, "residual_mm": residual}
            for place, used, residual in zip(
                places.tolist(), fit.used.tolist(), fit.residuals.tolist(), strict=True
            )
        ],
    }
    return {name: plain(entry) for name, entry in record.items()}
