"""The content of a calibration report."""

from collections.abc import Iterable, Sequence

import numpy as np
from PySide6.QtCore import QCoreApplication

from lightpen.arrays import FloatArray
from lightpen.estimation.reports.calibration_record import CalibrationRecord, Pair
from lightpen.estimation.reports.verdict import Grade
from lightpen.model.coverage import COVERAGE_FACTOR
from lightpen.model.names import Laboratory, Origin
from lightpen.record.calibrations import (
    OVERDUE,
    RETIRED,
    CalibrationFile,
    decision_rule,
)
from lightpen.record.library.entered_files import EntryPlace
from lightpen.record.results.results import TipChange
from lightpen_app.look.languages import listed, worded
from lightpen_app.look.phrases import grade_text, origin_text, reason_text, share_text
from lightpen_app.look.words import (
    AXES,
    MAX_DECIMALS,
    MICROMETRES,
    decimals_for,
    number_text,
)
from lightpen_app_extensions.report.charts import charts_of
from lightpen_app_extensions.report.reestimated import ReestimatedPoses
from lightpen_app_extensions.report.template import (
    ANCHOR,
    Content,
    Piece,
    cells,
    condition,
    environment_texts,
    fill_template,
    laboratory_texts,
    markup,
    paragraph,
    printed_text,
    proof_texts,
    signatures,
    traced_rows,
    zoned_moment_text,
)

translate = QCoreApplication.translate

MOST_IMAGES = 40  # number of excluded images that are named
PX_DECIMALS = 4
UNKNOWN = "\u2013"
OF_CHANGE = (  # fields of the template
    *("since", "change", "change_u", "found", "found_u", "distance", "limit"),
    *("unlimited", "within", "beyond"),
)
TONES = {  # classes of the style sheet
    Grade.PASS: "good",
    Grade.SCALE: "accent",
    Grade.STEADY: "accent",
    Grade.CHECK: "warn",
    Grade.REPEAT: "bad",
}


def calibration_parts(
    file: CalibrationFile,
    reestimated: ReestimatedPoses | None,
    entered: EntryPlace | None,
    laboratory: Laboratory | None = None,
) -> tuple[Piece, ...]:
    """Return the parts of the whole report, from its title to its end mark."""
    calibration = file.calibration
    texts = {
        **_item_texts(file),
        **laboratory_texts(laboratory, file.traced),
        **_result_texts(file),
        **_budget_texts(calibration),
        **_image_texts(calibration, reestimated),
        **proof_texts(file.name, file.sha256, entered),
        "n_observations": str(len(calibration.inputs.observations)),
    }
    tables: dict[str, Sequence[Sequence[str]]] = {
        "traced": traced_rows(file.traced),
        "covariance": _covariance_rows(calibration),
        "budget": _budget_rows(calibration),
        "excluded": _left_out(calibration)[:MOST_IMAGES],
        "leds": _led_rows(calibration),
        "intrinsics": _intrinsics_rows(calibration),
        "files": _file_rows(calibration),
    }
    drawn = {
        "verdict": [_verdict(file)],
        "doubts": [paragraph("\u2013 " + worded(doubt)) for doubt in file.doubts],
        "rules": [
            paragraph(worded(part))
            for part in decision_rule(calibration.verdict.limits)
        ],
        "signatures": [signatures(translate("paper", "Calibrated by"))],
    }
    charts = charts_of(calibration, reestimated)
    return fill_template(
        "calibration", Content(texts, tables, charts=charts, drawn=drawn)
    )


def status_words(file: CalibrationFile) -> tuple[str, ...]:
    """Return why pen or tip are not valid."""
    words = {
        RETIRED: translate("paper", "RETIRED"),
        OVERDUE: translate("paper", "OVERDUE"),
    }
    return tuple(words[each] for each in file.library_status)


def _verdict(file: CalibrationFile) -> Piece:
    word = grade_text(file.grade)
    lines = [worded(file.why)]
    if file.accepted is None:
        lines.append(translate("paper", "This tip has not been accepted."))
    elif file.origin is Origin.SIMULATED:
        lines.append(translate("paper", "Practice: not used for any pen."))
    elif file.grade is Grade.PASS:
        lines.append(translate("paper", "The tip was accepted."))
    else:
        accepted = translate("paper", "The tip was accepted. Reason: {0}")
        lines.append(accepted.format(file.reason))
    tone = TONES[file.grade]
    return Piece(
        f'<table width="100%" cellspacing="0"><tr>'
        f'<td class="verdict {tone} word" width="18%">'
        f'<h1 class="{tone}">{ANCHOR}{markup(word)}</h1></td>'
        f'<td class="verdict {tone} why" valign="middle">'
        f"{markup(chr(10).join(lines))}</td></tr></table>"
    )


def _item_texts(file: CalibrationFile) -> dict[str, str | None]:
    names, calibration, due = file.names, file.calibration, file.due
    is_practice = file.origin is Origin.SIMULATED
    diameter, program = names.ball_diameter, calibration.program
    assumed = calibration.assumptions
    if is_practice:
        status = translate("paper", "practice")
    elif due is None:
        status = ""
    else:
        status = listed(status_words(file)) or translate("paper", "valid")
    method = translate("paper", "two-stage, as published by S. Liu et al. (2013)")
    if calibration.method == "joint":
        method = translate("paper", "joint adjustment of all images")
    given = (names.pen, names.tip, names.cone, names.station, names.operator)
    printed = all(printed_text(each) == each for each in (*given, file.reason))
    return {
        "pen": names.pen,
        "station": names.station,
        "tip": names.tip,
        "operator": names.operator,
        "ball": "" if diameter is None else f"{diameter:g} mm",
        "measured": "" if file.measured is None else zoned_moment_text(file.measured),
        "computed": zoned_moment_text(calibration.created),
        "cone": names.cone,
        "practice": condition(is_practice),
        "real": condition(not is_practice),
        "accepted": translate("paper", "no")
        if file.accepted is None
        else zoned_moment_text(file.accepted),
        "origin": origin_text(file.origin),
        **environment_texts(assumed.temperature_c, assumed.humidity_percent),
        "method": method,
        "due": "" if due is None or is_practice else due.isoformat(),
        "status": status,
        "program": f"{program.name} {program.version}",
        "unprintable": condition(not printed),
    }


def _result_texts(file: CalibrationFile) -> dict[str, str | None]:
    calibration, change = file.calibration, file.change
    u, tip = calibration.expanded_uncertainty_mm, file.tip_pen
    nominal = file.nominal_tip
    cone_u = calibration.cone_expanded_uncertainty_mm
    weakest = calibration.weakest_direction
    largest = weakest.expanded_uncertainty_mm
    parts = calibration.uncertainty
    halves = np.array(parts.halves_difference_mm, dtype=np.float64)
    halves_u = np.array(parts.halves_expanded_uncertainty_mm, dtype=np.float64)
    has_halves = bool(np.isfinite([*halves, *halves_u]).all())
    return {
        "tip_mm": _texts(tip, u),
        "tip_u": _texts(u, u),
        "nominal": None if nominal is None else _texts(nominal, u),
        "deviation": None if nominal is None else _texts(tip - nominal, u),
        **_change_texts(change),
        "halves": _texts(halves, halves_u) if has_halves else None,
        "halves_u": _texts(halves_u, halves_u) if has_halves else None,
        "cone_mm": _texts(calibration.cone_cam_mm, cone_u),
        "cone_u": _texts(cone_u, cone_u),
        "direction": ", ".join(f"{share:.2f}" for share in weakest.vector_pen),
        "largest": number_text(largest, decimals_for(largest)),
        "first": condition(change is None and file.accepted is not None),
        "doubted": condition(file.doubts),
    }


def _change_texts(change: TipChange | None) -> dict[str, str | None]:
    """Return the previous tip, and the deviation from it with its limit."""
    if change is None:
        return dict.fromkeys(OF_CHANGE)
    u, found_u = change.expanded_uncertainty_mm, change.as_found_expanded_uncertainty_mm
    return {
        "since": f"{change.accepted:%Y-%m-%d}",
        "change": _texts(change.difference_mm, u),
        "change_u": _texts(u, u),
        "found": _texts(change.as_found_mm, found_u),
        "found_u": _texts(found_u, found_u),
        "distance": number_text(change.distance_mm, decimals_for(max(u))),
        "limit": "" if change.limit_mm is None else f"{change.limit_mm:g}",
        "unlimited": condition(change.is_within is None),
        "within": condition(change.is_within is True),
        "beyond": condition(change.is_within is False),
    }


def _covariance_rows(calibration: CalibrationRecord) -> list[tuple[str, ...]]:
    covariance = MICROMETRES**2 * np.array(calibration.covariance)[:3, :3]
    decimals = decimals_for(float(np.diag(covariance).min()))
    return [
        (axis, *(number_text(value, decimals) for value in row))
        for axis, row in zip(AXES, covariance.tolist(), strict=True)
    ]


def _budget_texts(calibration: CalibrationRecord) -> dict[str, str | None]:
    u, decimals = _u_and_decimals(calibration)
    largest = MICROMETRES * calibration.weakest_direction.expanded_uncertainty_mm
    factor, check = calibration.uncertainty.correlation_factor, calibration.self_check
    combined = u / COVERAGE_FACTOR
    return {
        "combined": cells(number_text(each, decimals) for each in combined.tolist()),
        "expanded": cells(number_text(each, decimals) for each in u.tolist()),
        "expanded_weakest": number_text(largest, decimals),
        "correlation": f"{factor:.2f}" if factor > 1 else None,
        "self_check": None if check is None else f"{check.value:.2f}",
        "self_check_limit": None if check is None else f"{check.limit:.2f}",
    }


def _budget_rows(calibration: CalibrationRecord) -> list[tuple[str, ...]]:
    decimals = _u_and_decimals(calibration)[1]
    return [
        (
            share_text(share.name, is_whole=True),
            *(
                number_text(MICROMETRES * value, decimals)
                for value in (
                    *share.standard_uncertainty_mm,
                    share.weakest_expanded_uncertainty_mm,
                )
            ),
            translate("paper", "assumed") if share.assumed else "",
        )
        for share in calibration.uncertainty.shares
    ]


def _u_and_decimals(calibration: CalibrationRecord) -> tuple[FloatArray, int]:
    """Return U (3,), micrometres, and the decimals of the budget."""
    u = MICROMETRES * np.array(calibration.expanded_uncertainty_mm)
    return u, 1 + max(map(decimals_for, u.tolist()))


def _image_texts(
    calibration: CalibrationRecord, reestimated: ReestimatedPoses | None
) -> dict[str, str | None]:
    images, dropped = calibration.images, calibration.images.dropped
    (least_tilt, largest_tilt), (least_turn, largest_turn) = map(
        _rounded, (calibration.coverage.tilt_deg, calibration.coverage.turn_deg)
    )
    n_left_out, cameras = len(_left_out(calibration)), calibration.inputs.cameras
    scatter = calibration.rms_mm
    return {
        "n_used": str(images.used),
        "n_images": str(images.total),
        "least_tilt": least_tilt,
        "largest_tilt": largest_tilt,
        "least_turn": least_turn,
        "largest_turn": largest_turn,
        "dropped": listed(f"{n} {reason_text(reason)}" for reason, n in dropped.items())
        or translate("paper", "none"),
        "rms": f"{calibration.rms_px:.{PX_DECIMALS}f} px",
        "noise": f"{calibration.sigma_px:.{PX_DECIMALS}f} px",
        "worst": f"{_largest_misfit(calibration):.{PX_DECIMALS}f} px",
        "scatter": UNKNOWN if scatter is None else f"{MICROMETRES * scatter:.1f} \xb5m",
        "alone": condition(reestimated is None),
        "reestimated": condition(reestimated is not None),
        "left_out": condition(n_left_out),
        "n_more": f"{n_left_out - MOST_IMAGES}" if n_left_out > MOST_IMAGES else None,
        # Of a rig the record itself has the first camera's.
        "of_camera": f" ({cameras[0].file})" if cameras else "",
    }


def _left_out(calibration: CalibrationRecord) -> list[tuple[str, str, str]]:
    return [
        (str(number), image.file, reason_text(image.reason))
        for number, image in enumerate(calibration.frames, 1)
        if not image.used
    ]


def _led_rows(calibration: CalibrationRecord) -> list[tuple[str, ...]]:
    rows = []
    for led in calibration.leds:
        shift = np.array(led.displacement_mm, dtype=np.float64)
        distance = MICROMETRES * float(np.linalg.norm(shift))
        rows.append(
            (
                *map(str, (led.led, led.seen, led.used)),
                *map(_pixels, (led.rms_px, *led.mean_px)),
                f"{distance:.1f}" if np.isfinite(distance) else UNKNOWN,
                translate("paper", "outlier") if led.displaced else "",
            )
        )
    return rows


def _intrinsics_rows(calibration: CalibrationRecord) -> list[tuple[str, ...]]:
    return [
        (
            f"{name} / px" if name in ("fx", "fy", "cx", "cy") else name,
            *_with_uncertainty(each.value, each.standard_uncertainty),
            "",
        )
        for name, each in calibration.adjusted.intrinsics.items()
    ]


def _file_rows(calibration: CalibrationRecord) -> list[tuple[str, str, str]]:
    inputs = calibration.inputs
    files = [
        *([] if inputs.rig is None else [(translate("paper", "Rig"), inputs.rig)]),
        *(
            (translate("paper", "Camera"), each)
            for each in (inputs.cameras or (inputs.camera,))
        ),
        (translate("paper", "Pen"), inputs.pen),
    ]
    return [(what, each.file, each.sha256) for what, each in files]


def _largest_misfit(calibration: CalibrationRecord) -> float:
    return max(
        (f.rms_px for f in calibration.frames if f.used and f.rms_px is not None),
        default=0.0,
    )


def _with_uncertainty(value: float, uncertainty: float | None) -> tuple[str, str]:
    if uncertainty is None:
        return number_text(value, MAX_DECIMALS), UNKNOWN
    decimals = decimals_for(uncertainty)
    if decimals == MAX_DECIMALS:  # of what a screen shows; coefficients have more
        decimals += decimals_for(10.0**MAX_DECIMALS * uncertainty)
    return number_text(value, decimals), number_text(uncertainty, decimals)


def _pixels(value: float | None) -> str:
    return UNKNOWN if value is None else number_text(value, PX_DECIMALS)


def _rounded(pair: Pair) -> Iterable[str]:
    return (UNKNOWN if each is None else number_text(each, 0) for each in pair)


def _texts(values: Iterable[float], uncertainties: Iterable[float]) -> str:
    """Return lengths to the digit that their uncertainty warrants."""
    pairs = zip(values, uncertainties, strict=True)
    return cells(number_text(float(x), decimals_for(float(u))) for x, u in pairs)
