"""Section of the report on the evidence: images, LEDs and files."""

from collections.abc import Iterable, Sequence

import numpy as np
from PySide6.QtCore import QCoreApplication

from lightpen.estimation.reports.calibration_record import CalibrationRecord, Pair
from lightpen.record.calibrations.reestimated_poses import ReestimatedPoses
from lightpen_app.look.phrases import reason_text
from lightpen_app.look.quantities import (
    MAX_DECIMALS,
    MICROMETRES,
    decimals_for,
    number_text,
)
from lightpen_app.look.sentences import listed
from lightpen_app.look.theme import LIGHT
from lightpen_app.print_report.blocks import (
    MM,
    RIGHT,
    Block,
    Column,
    PrintSize,
    facts,
    heading,
    paragraph,
    subheading,
    table,
)
from lightpen_app.print_report.charts import row_of_charts
from lightpen_app.print_report.figures import (
    certainty_chart,
    coverage_chart,
    histogram_chart,
    led_chart,
    misfit_chart,
    posture_chart,
    residual_chart,
    running_chart,
    tips_chart,
)

translate = QCoreApplication.translate

CHART = 50 * MM  # high
TALL_CHART = 66 * MM
MOST_IMAGES = 40  # number of excluded images that are named
PX_DECIMALS = 4
UNKNOWN = "\u2013"


def image_blocks(
    calibration: CalibrationRecord, reestimated: ReestimatedPoses | None
) -> Iterable[Block]:
    """Return the images by state, with their plots."""
    images, coverage = calibration.images, calibration.coverage
    tilt, turn = coverage.tilt_deg, coverage.turn_deg
    yield heading(translate("paper", "Images"))
    yield from facts(
        [
            (
                translate("paper", "Included"),
                translate("paper", "{0} of {1}").format(images.used, images.total),
            ),
            (
                translate("paper", "Pen tilt"),
                translate("paper", "{0} to {1}\xb0").format(*_rounded(tilt)),
            ),
            (translate("paper", "Excluded"), _dropped(calibration)),
            (
                translate("paper", "Rotation about its axis"),
                translate("paper", "{0} to {1}\xb0").format(*_rounded(turn)),
            ),
            (
                translate("paper", "Residuals, RMS"),
                f"{calibration.rms_px:.{PX_DECIMALS}f} px",
            ),
            (
                translate("paper", "Noise of LED centres"),
                f"{calibration.sigma_px:.{PX_DECIMALS}f} px",
            ),
            (
                translate("paper", "Residuals, worst image"),
                f"{_largest_misfit(calibration):.{PX_DECIMALS}f} px",
            ),
            (
                translate("paper", "Tip per image, RMS"),
                _micrometres(calibration.rms_mm),
            ),
        ]
    )
    yield row_of_charts([misfit_chart(calibration), tips_chart(calibration)], CHART)
    if reestimated is None:
        yield row_of_charts([coverage_chart(calibration)], TALL_CHART)
        yield paragraph(
            translate(
                "paper",
                "The plot of the tip per image is available only for one camera and "
                "one cone, and for complete files.",
            )
        )
    else:
        limit = calibration.verdict.limits.max_uncertainty_mm
        tip = np.array(calibration.tip_pen_mm)
        yield row_of_charts(
            [running_chart(reestimated, tip), certainty_chart(reestimated, limit)],
            CHART,
        )
        yield paragraph(
            translate(
                "paper",
                "The curves are computed from the poses of single images, the "
                "result from the joint adjustment of all images.",
            ),
            PrintSize.SMALL,
            LIGHT.muted,
        )
        yield row_of_charts(
            [posture_chart(reestimated), coverage_chart(calibration)], TALL_CHART
        )
        yield row_of_charts(
            [residual_chart(reestimated), histogram_chart(reestimated)], CHART
        )
    yield from _left_out(calibration)


def led_blocks(calibration: CalibrationRecord) -> Iterable[Block]:
    """Return the fit of each LED, and the fitted camera."""
    yield heading(translate("paper", "LEDs and camera"))
    yield row_of_charts([led_chart(calibration)], CHART)
    rows = []
    for led in calibration.leds:
        shift = np.array(led.displacement_mm, dtype=np.float64)
        distance = MICROMETRES * float(np.linalg.norm(shift))
        rows.append(
            (
                str(led.led),
                str(led.seen),
                str(led.used),
                *map(_pixels, (led.rms_px, *led.mean_px)),
                f"{distance:.1f}" if np.isfinite(distance) else UNKNOWN,
                translate("paper", "outlier") if led.displaced else "",
            )
        )
    yield from table(
        [
            Column(translate("paper", "LED"), 0.5, RIGHT),
            Column(translate("paper", "Detected"), 0.7, RIGHT),
            Column(translate("paper", "Included"), 0.7, RIGHT),
            Column(translate("paper", "RMS / px"), 1, RIGHT),
            Column(translate("paper", "mean x / px"), 1, RIGHT),
            Column(translate("paper", "mean y / px"), 1, RIGHT),
            Column(translate("paper", "Deviation / µm"), 1.3, RIGHT),
            Column("", 1),
        ],
        rows,
    )
    title = translate("paper", "Camera parameters from the images")
    if calibration.inputs.cameras:  # of a rig; the record itself has the first camera's
        title = f"{title} ({calibration.inputs.cameras[0].file})"
    yield subheading(title)
    yield from table(
        [
            Column(translate("paper", "Parameter")),
            Column(translate("paper", "Value"), 1, RIGHT),
            Column(translate("paper", "Standard uncertainty (k = 1)"), 1.4, RIGHT),
            Column("", 2),
        ],
        [
            (
                f"{name} / px" if name in ("fx", "fy", "cx", "cy") else name,
                *_with_uncertainty(each.value, each.standard_uncertainty),
                "",
            )
            for name, each in calibration.adjusted.intrinsics.items()
        ],
    )


def file_blocks(calibration: CalibrationRecord) -> Iterable[Block]:
    """Return the files that were read."""
    inputs = calibration.inputs
    files = [
        *([] if inputs.rig is None else [(translate("paper", "Rig"), inputs.rig)]),
        *(
            (translate("paper", "Camera"), each)
            for each in (inputs.cameras or (inputs.camera,))
        ),
        (translate("paper", "Pen"), inputs.pen),
    ]
    rows = [(what, each.file, each.sha256) for what, each in files]
    return input_blocks(rows, len(inputs.observations))


def input_blocks(
    files: Sequence[tuple[str, str, str]], n_observations: int
) -> Iterable[Block]:
    """Return kind, name and hash of each file, and the number of images."""
    yield heading(translate("paper", "Input files"))
    yield from table(
        [
            Column("", 0.7),
            Column(translate("paper", "File"), 1.6),
            Column("SHA-256", 3.6),
        ],
        files,
        size=PrintSize.SMALL,
    )
    text = translate(
        "paper",
        "Images or files of LED centres: {0}. The JSON file lists each with its "
        "SHA-256.",
    )
    yield paragraph(text.format(n_observations))


def _left_out(calibration: CalibrationRecord) -> Iterable[Block]:
    left_out = [
        (str(number), image.file, reason_text(image.reason))
        for number, image in enumerate(calibration.frames, 1)
        if not image.used
    ]
    if not left_out:
        return
    yield subheading(translate("paper", "Excluded images"))
    yield from table(
        [
            Column(translate("paper", "Image"), 0.5, RIGHT),
            Column(translate("paper", "File"), 2.5),
            Column(translate("paper", "Reason"), 2.5),
        ],
        left_out[:MOST_IMAGES],
    )
    if len(left_out) > MOST_IMAGES:
        text = translate("paper", "And {0} more, listed in the JSON file.")
        yield paragraph(text.format(len(left_out) - MOST_IMAGES))


def _dropped(calibration: CalibrationRecord) -> str:
    dropped = calibration.images.dropped
    if not dropped:
        return translate("paper", "none")
    return listed(f"{n} {reason_text(reason)}" for reason, n in dropped.items())


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


def _micrometres(length: float | None) -> str:
    return UNKNOWN if length is None else f"{MICROMETRES * length:.1f} \xb5m"


def _pixels(value: float | None) -> str:
    return UNKNOWN if value is None else number_text(value, PX_DECIMALS)


def _rounded(pair: Pair) -> Iterable[str]:
    return (UNKNOWN if each is None else number_text(each, 0) for each in pair)
