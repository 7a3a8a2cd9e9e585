"""What a calibration rests on, on paper: its images, LEDs and files."""

from collections.abc import Iterable

import numpy as np
from PySide6.QtCore import QCoreApplication

from lightpen.record.retraced import Retraced
from lightpen.record.statement import StatedCalibration
from lightpen_app.look.phrases import reason_text
from lightpen_app.look.quantities import (
    MAX_DECIMALS,
    MICROMETRES,
    decimals_for,
    number_text,
)
from lightpen_app.look.theme import LIGHT
from lightpen_app.look.words import listed
from lightpen_app.paper.charts import row_of_charts
from lightpen_app.paper.figures import (
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
from lightpen_app.paper.pieces import (
    MM,
    RIGHT,
    Column,
    Piece,
    PrintSize,
    facts,
    heading,
    paragraph,
    subheading,
    table,
)

translate = QCoreApplication.translate

CHART = 50 * MM  # high
TALL_CHART = 66 * MM
MOST_IMAGES = 40  # of those left out, that are named
PX_DECIMALS = 4


def image_pieces(
    calibration: StatedCalibration, retraced: Retraced | None
) -> Iterable[Piece]:
    """Return what became of the images, with their plots."""
    images, coverage = calibration.images, calibration.coverage
    tilt, turn = coverage.tilt_deg, coverage.turn_deg
    yield heading(translate("paper", "Images"))
    yield from facts(
        [
            (
                translate("paper", "Used"),
                translate("paper", "{0} of {1}").format(images.used, images.total),
            ),
            (
                translate("paper", "Tilt of the pen"),
                translate("paper", "{0} to {1}\xb0").format(*_rounded(tilt)),
            ),
            (translate("paper", "Left out"), _dropped(calibration)),
            (
                translate("paper", "Turn about its axis"),
                translate("paper", "{0} to {1}\xb0").format(*_rounded(turn)),
            ),
            (
                translate("paper", "Residuals, rms"),
                f"{calibration.rms_px:.{PX_DECIMALS}f} px",
            ),
            (
                translate("paper", "Noise of a centre"),
                f"{calibration.sigma_px:.{PX_DECIMALS}f} px",
            ),
            (
                translate("paper", "Residuals, largest image"),
                f"{_largest_misfit(calibration):.{PX_DECIMALS}f} px",
            ),
            (
                translate("paper", "Tip of single images, rms"),
                f"{MICROMETRES * calibration.rms_mm:.1f} \xb5m",
            ),
        ]
    )
    yield row_of_charts([misfit_chart(calibration), tips_chart(calibration)], CHART)
    if retraced is None:
        yield row_of_charts([coverage_chart(calibration)], TALL_CHART)
        yield paragraph(
            translate(
                "paper",
                "The tip image by image is drawn of one camera and one cone only, and "
                "of files that hold what it takes.",
            )
        )
    else:
        limit = calibration.verdict.limits.max_uncertainty_mm
        tip = np.array(calibration.tip_pen_mm)
        yield row_of_charts(
            [running_chart(retraced, tip), certainty_chart(retraced, limit)],
            CHART,
        )
        yield paragraph(
            translate(
                "paper",
                "The curves are by the poses of single images, the result by the "
                "adjustment of all images together.",
            ),
            PrintSize.SMALL,
            LIGHT.muted,
        )
        yield row_of_charts(
            [posture_chart(retraced), coverage_chart(calibration)], TALL_CHART
        )
        yield row_of_charts(
            [residual_chart(retraced), histogram_chart(retraced)], CHART
        )
    yield from _left_out(calibration)


def led_pieces(calibration: StatedCalibration) -> Iterable[Piece]:
    """Return how each LED fits, and the camera as fitted."""
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
                f"{distance:.1f}" if np.isfinite(distance) else "\u2013",
                translate("paper", "stands out") if led.displaced else "",
            )
        )
    yield from table(
        [
            Column(translate("paper", "LED"), 0.5, RIGHT),
            Column(translate("paper", "Seen"), 0.7, RIGHT),
            Column(translate("paper", "Used"), 0.7, RIGHT),
            Column(translate("paper", "rms / px"), 1, RIGHT),
            Column(translate("paper", "mean x / px"), 1, RIGHT),
            Column(translate("paper", "mean y / px"), 1, RIGHT),
            Column(translate("paper", "off its place / \xb5m"), 1.3, RIGHT),
            Column("", 1),
        ],
        rows,
    )
    yield subheading(translate("paper", "Camera as the images have it"))
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


def file_pieces(calibration: StatedCalibration) -> Iterable[Piece]:
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
    yield heading(translate("paper", "Files that were read"))
    yield from table(
        [
            Column("", 0.7),
            Column(translate("paper", "File"), 1.6),
            Column("SHA-256", 3.6),
        ],
        [(what, each.file, each.sha256) for what, each in files],
        size=PrintSize.SMALL,
    )
    text = translate(
        "paper",
        "Images or files of LED centres: {0}. The JSON file names each with its "
        "SHA-256.",
    )
    yield paragraph(text.format(len(inputs.observations)))


def _left_out(calibration: StatedCalibration) -> Iterable[Piece]:
    left_out = [
        (str(number), image.file, reason_text(image.reason))
        for number, image in enumerate(calibration.frames, 1)
        if not image.used
    ]
    if not left_out:
        return
    yield subheading(translate("paper", "Images left out"))
    yield from table(
        [
            Column(translate("paper", "Image"), 0.5, RIGHT),
            Column(translate("paper", "File"), 2.5),
            Column(translate("paper", "Why left out"), 2.5),
        ],
        left_out[:MOST_IMAGES],
    )
    if len(left_out) > MOST_IMAGES:
        text = translate("paper", "And {0} more, which the JSON file names.")
        yield paragraph(text.format(len(left_out) - MOST_IMAGES))


def _dropped(calibration: StatedCalibration) -> str:
    dropped = calibration.images.dropped
    if not dropped:
        return translate("paper", "none")
    return listed(f"{n} {reason_text(reason)}" for reason, n in dropped.items())


def _largest_misfit(calibration: StatedCalibration) -> float:
    return max(
        (f.rms_px for f in calibration.frames if f.used and f.rms_px is not None),
        default=0.0,
    )


def _with_uncertainty(value: float, uncertainty: float) -> tuple[str, str]:
    decimals = decimals_for(uncertainty)
    if decimals == MAX_DECIMALS:  # of what a screen shows; coefficients have more
        decimals += decimals_for(10.0**MAX_DECIMALS * uncertainty)
    return number_text(value, decimals), number_text(uncertainty, decimals)


def _pixels(value: float | None) -> str:
    return "\u2013" if value is None else number_text(value, PX_DECIMALS)


def _rounded(pair: tuple[float, float]) -> tuple[str, str]:
    return number_text(pair[0], 0), number_text(pair[1], 0)
