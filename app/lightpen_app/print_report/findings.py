"""Section of the report on the results: tip, decision rule, budget."""

from collections.abc import Iterable, Sequence

import numpy as np
from PySide6.QtCore import QCoreApplication

from lightpen.arrays import FloatArray
from lightpen.estimation.reports.calibration_record import CalibrationRecord
from lightpen.estimation.uncertainty.budget import ContributionName
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.record.calibrations.calibrations import CalibrationFile
from lightpen.record.calibrations.decision_rule import decision_rule
from lightpen.record.results.results import TipChange
from lightpen_app.look.quantities import AXES, MICROMETRES, decimals_for, number_text
from lightpen_app.look.sentences import worded
from lightpen_app.print_report.blocks import (
    MM,
    RIGHT,
    Block,
    Column,
    heading,
    paragraph,
    subheading,
    table,
)
from lightpen_app.print_report.charts import row_of_charts
from lightpen_app.print_report.figures import budget_chart

translate = QCoreApplication.translate

CHART = 50 * MM  # high


def result_blocks(calibration_file: CalibrationFile) -> Iterable[Block]:
    """Return tip and cone with U, earlier tips, and warnings."""
    calibration = calibration_file.calibration
    tip, u = np.array(calibration.tip_pen_mm), _uncertainty(calibration)
    rows = [
        (translate("paper", "Tip / mm"), *_texts(tip, u)),
        (translate("paper", "U (k = 2) / mm"), *_texts(u, u)),
    ]
    if calibration.nominal_tip_mm is not None:
        nominal = np.array(calibration.nominal_tip_mm)
        rows += [
            (translate("paper", "Nominal tip / mm"), *_texts(nominal, u)),
            (
                translate("paper", "Deviation from nominal / mm"),
                *_texts(tip - nominal, u),
            ),
        ]
    change = calibration_file.change
    if change is not None:
        change_u = np.array(change.expanded_uncertainty_mm)
        since = translate("paper", "Change since {0} / mm").format(
            f"{change.accepted:%Y-%m-%d}"
        )
        difference = np.array(change.difference_mm)
        rows += _as_found_rows(change)
        rows += [
            (since, *_texts(difference, change_u)),
            (
                translate("paper", "U (k = 2) of the difference / mm"),
                *_texts(change_u, change_u),
            ),
        ]
    rows += _halves(calibration)
    yield heading(translate("paper", "Result"))
    title = translate("paper", "In the pen frame")
    yield from table(_number_columns(title, AXES), rows, strong=(0, 1))
    yield paragraph(
        translate(
            "paper",
            "The tip is the effective one, in the scale of the LED file: min over x, c "
            "of sum |R_i x + T_i - c|\xb2 over the swing.",
        )
    )
    cone = np.array(calibration.cone_cam_mm)
    cone_u = np.array(calibration.cone_expanded_uncertainty_mm)
    title = translate("paper", "In the camera frame")
    yield from table(
        _number_columns(title, ("u", "v", "w")),
        [
            (translate("paper", "Cone / mm"), *_texts(cone, cone_u)),
            (translate("paper", "U (k = 2) / mm"), *_texts(cone_u, cone_u)),
        ],
    )
    covariance = MICROMETRES**2 * np.array(calibration.covariance)[:3, :3]
    decimals = decimals_for(float(np.diag(covariance).min()))
    yield from table(
        _number_columns(translate("paper", "Covariance of the tip / \xb5m\xb2"), AXES),
        [
            (axis, *(number_text(value, decimals) for value in row))
            for axis, row in zip(AXES, covariance.tolist(), strict=True)
        ],
    )
    weakest = calibration.weakest_direction
    largest = weakest.expanded_uncertainty_mm
    yield paragraph(
        translate(
            "paper",
            "The largest U (k = 2) is {1} mm, along ({0}) of the pen frame. U is "
            "the standard uncertainty times k = 2, with a coverage probability of "
            "about 95 % for a normal distribution (JCGM 100:2008, GUM).",
        ).format(
            ", ".join(f"{share:.2f}" for share in weakest.vector_pen),
            number_text(largest, decimals_for(largest)),
        )
    )
    if change is None and calibration_file.accepted is not None:
        yield paragraph(translate("paper", "No previous tip for comparison"))
    if change is not None:
        yield paragraph(_as_found_text(change))
    if calibration_file.doubts:
        yield subheading(translate("paper", "Findings"))
        yield from (
            paragraph("\u2013 " + worded(doubt)) for doubt in calibration_file.doubts
        )


def _as_found_rows(change: TipChange) -> list[tuple[str, ...]]:
    """Return the previous tip."""
    tip = np.array(change.as_found_mm)
    u = np.array(change.as_found_expanded_uncertainty_mm)
    return [
        (translate("paper", "Tip as found / mm"), *_texts(tip, u)),
        (translate("paper", "U (k = 2) of the difference / mm"), *_texts(u, u)),
    ]


def _as_found_text(change: TipChange) -> str:
    """Return the deviation of the tip as found, with its limit."""
    decimals = decimals_for(max(change.expanded_uncertainty_mm))
    off = number_text(change.distance_mm, decimals)
    words = {
        None: translate(
            "paper",
            "As found: the previous tip is {0} mm from the tip as left; no limit set.",
        ),
        True: translate(
            "paper",
            "As found: the previous tip is {0} mm from the tip as left, within its "
            "limit of {1} mm.",
        ),
        False: translate(
            "paper",
            "As found: the previous tip is {0} mm from the tip as left, BEYOND its "
            "limit of {1} mm.",
        ),
    }
    limit = "" if change.limit_mm is None else f"{change.limit_mm:g}"
    return words[change.is_within].format(off, limit)


def rule_blocks(calibration_file: CalibrationFile) -> Iterable[Block]:
    """Return the decision rule of the verdict."""
    calibration = calibration_file.calibration
    yield heading(translate("paper", "Decision rule"))
    for part in decision_rule(calibration.verdict.limits):
        yield paragraph(worded(part))
    yield paragraph(
        translate(
            "paper",
            "No statement of conformity with a specification is made. The decision "
            "rule is that of the program that made this report; the verdict is that "
            "of the file.",
        )
    )


def budget_blocks(calibration: CalibrationRecord) -> Iterable[Block]:
    """Return the uncertainty budget."""
    parts = calibration.uncertainty
    u = MICROMETRES * _uncertainty(calibration)
    largest = MICROMETRES * calibration.weakest_direction.expanded_uncertainty_mm
    decimals = 1 + max(map(decimals_for, u.tolist()))

    def row(
        name: str, values: FloatArray, weakest: float | None, assumed: str
    ) -> tuple[str, ...]:
        texts = (number_text(value, decimals) for value in values.tolist())
        last = "" if weakest is None else number_text(weakest, decimals)
        return (name, *texts, last, assumed)

    yes = translate("paper", "assumed")
    rows = [
        row(
            _share_name(share.name),
            MICROMETRES * np.array(share.standard_uncertainty_mm),
            MICROMETRES * share.weakest_expanded_uncertainty_mm,
            yes if share.assumed else "",
        )
        for share in parts.shares
    ]
    combined = translate("paper", "Combined standard uncertainty")
    expanded = translate("paper", "Expanded uncertainty U (k = 2)")
    rows += [
        row(combined, u / COVERAGE_FACTOR, None, ""),
        row(expanded, u, largest, ""),
    ]
    yield heading(translate("paper", "Uncertainty budget"))
    yield from table(
        [
            Column(translate("paper", "Standard uncertainty (k = 1) / \xb5m"), 3.4),
            *(Column(axis, 0.8, RIGHT) for axis in AXES),
            Column(translate("paper", "U (k = 2), weakest direction"), 1.9, RIGHT),
            Column("", 0.9),
        ],
        rows,
        strong=(len(rows) - 1,),
    )
    texts = [
        translate(
            "paper",
            "The contributions are combined as root sum of squares. Assumed values "
            "are stated in no file; they are set by the station or the program.",
        )
    ]
    if parts.correlation_factor > 1:
        text = translate("paper", "Images are correlated: noise variance \u00d7 {0}")
        texts.append(text.format(f"{parts.correlation_factor:.2f}"))
    check = calibration.self_check
    if check is not None:
        text = translate(
            "paper",
            "Self-check: half of the LEDs predict the others to {0} times their "
            "uncertainty; at most {1} by chance.",
        )
        texts.append(text.format(f"{check.value:.2f}", f"{check.limit:.2f}"))
    yield paragraph(" ".join(texts))
    yield row_of_charts([budget_chart(calibration)], CHART)


def _halves(calibration: CalibrationRecord) -> list[tuple[str, ...]]:
    parts = calibration.uncertainty
    difference = np.array(parts.halves_difference_mm, dtype=np.float64)
    u = np.array(parts.halves_expanded_uncertainty_mm, dtype=np.float64)
    if not (np.isfinite(difference).all() and np.isfinite(u).all()):
        return []
    return [
        (translate("paper", "Odd minus even images / mm"), *_texts(difference, u)),
        (translate("paper", "U (k = 2) of the difference / mm"), *_texts(u, u)),
    ]


def _share_name(name: ContributionName) -> str:
    return {
        ContributionName.NOISE: translate("paper", "Image noise"),
        ContributionName.SEAT: translate("paper", "Seating of the tip in the cone"),
        ContributionName.FORM: translate("paper", "Form error of ball and cone"),
        ContributionName.DRIFT: translate("paper", "Drift of cone and camera"),
        ContributionName.LEDS: translate("paper", "LED positions of the LED file"),
        ContributionName.DIAMETER: translate("paper", "Diameter of the LED discs"),
        ContributionName.CAMERA: translate("paper", "Intrinsics of the camera"),
        ContributionName.EXTRINSICS: translate("paper", "Extrinsics of the cameras"),
        ContributionName.METHOD: translate(
            "paper", "Two-stage method, difference from the joint fit"
        ),
        ContributionName.LENS: translate("paper", "Lens and LED centres"),
    }[name]


def _number_columns(title: str, axes: Sequence[str]) -> list[Column]:
    return [Column(title, 2.2), *(Column(axis, 1, RIGHT) for axis in axes)]


def _uncertainty(calibration: CalibrationRecord) -> FloatArray:
    return np.array(calibration.expanded_uncertainty_mm)


def _texts(values: FloatArray, uncertainties: FloatArray) -> tuple[str, ...]:
    """Return lengths to the digit that their uncertainty warrants."""
    pairs = zip(values.tolist(), uncertainties.tolist(), strict=True)
    return tuple(number_text(value, decimals_for(u)) for value, u in pairs)
