"""What a calibration found, on paper: the tip, the rule of its verdict, its budget."""

from collections.abc import Iterable, Sequence

import numpy as np
from PySide6.QtCore import QCoreApplication

from lightpen.arrays import FloatArray
from lightpen.estimation.uncertainty import COVERAGE_FACTOR, ShareName
from lightpen.record.decision_rule import decision_rule
from lightpen.record.results import Since
from lightpen.record.statement import StatedCalibration, Statement
from lightpen_app.look.quantities import AXES, MICROMETRES, decimals_for, number_text
from lightpen_app.look.sentences import worded
from lightpen_app.paper.charts import row_of_charts
from lightpen_app.paper.figures import budget_chart
from lightpen_app.paper.pieces import (
    MM,
    RIGHT,
    Column,
    Piece,
    heading,
    paragraph,
    subheading,
    table,
)
from lightpen_app.paper.recorded_words import worded_anew

translate = QCoreApplication.translate

CHART = 50 * MM  # high


def result_pieces(statement: Statement) -> Iterable[Piece]:
    """Return tip and cone with U, beside other tips, and what to look into."""
    calibration = statement.calibration
    tip, u = np.array(calibration.tip_pen_mm), _uncertainty(calibration)
    rows = [
        (translate("paper", "Tip / mm"), *_texts(tip, u)),
        (translate("paper", "U (k = 2) / mm"), *_texts(u, u)),
    ]
    if calibration.nominal_tip_mm is not None:
        nominal = np.array(calibration.nominal_tip_mm)
        rows += [
            (translate("paper", "Nominal tip / mm"), *_texts(nominal, u)),
            (translate("paper", "Tip minus nominal / mm"), *_texts(tip - nominal, u)),
        ]
    change = statement.change
    if change is not None:
        change_u = np.array(change.expanded_uncertainty_mm)
        since = translate("paper", "Change since {0} / mm").format(
            f"{change.accepted:%Y-%m-%d}"
        )
        difference = np.array(change.difference_mm)
        rows += _as_found_rows(change)
        rows += [
            (since, *_texts(difference, change_u)),
            (translate("paper", "its U (k = 2) / mm"), *_texts(change_u, change_u)),
        ]
    rows += _halves(calibration)
    yield heading(translate("paper", "Result"))
    title = translate("paper", "In the frame of the pen")
    yield from table(_number_columns(title, AXES), rows, strong=(0, 1))
    cone = np.array(calibration.cone_cam_mm)
    cone_u = np.array(calibration.cone_expanded_uncertainty_mm)
    title = translate("paper", "In the frame of the camera")
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
            "The tip is known least along ({0}) of the pen, where U (k = 2) is {1} mm. "
            "U is the standard uncertainty times k = 2, which for a normal "
            "distribution covers some 95 %, by JCGM 100:2008 (GUM).",
        ).format(
            ", ".join(f"{share:.2f}" for share in weakest.vector_pen),
            number_text(largest, decimals_for(largest)),
        )
    )
    if change is None and statement.accepted is not None:
        yield paragraph(
            translate("paper", "No earlier tip was in force to compare with.")
        )
    if change is not None:
        yield paragraph(_as_found_text(change))
    if statement.doubts:
        yield subheading(translate("paper", "To look into"))
        yield from (
            paragraph("\u2013 " + worded_anew(doubt.text)) for doubt in statement.doubts
        )


def _as_found_rows(change: Since) -> list[tuple[str, ...]]:
    """Return the tip that was in force before; nothing where it is not stated."""
    found, found_u = change.as_found_mm, change.as_found_expanded_uncertainty_mm
    if found is None or found_u is None:
        return []
    tip, u = np.array(found), np.array(found_u)
    return [
        (translate("paper", "Tip as found / mm"), *_texts(tip, u)),
        (translate("paper", "its U (k = 2) / mm"), *_texts(u, u)),
    ]


def _as_found_text(change: Since) -> str:
    """Return how far the tip as found was off, against its limit."""
    decimals = decimals_for(max(change.expanded_uncertainty_mm))
    off = number_text(change.distance_mm, decimals)
    words = {
        None: translate(
            "paper",
            "As found, the tip in force until then lay {0} mm from the tip as left; it "
            "had no limit of change.",
        ),
        True: translate(
            "paper",
            "As found, the tip in force until then lay {0} mm from the tip as left, "
            "within its limit of {1} mm.",
        ),
        False: translate(
            "paper",
            "As found, the tip in force until then lay {0} mm from the tip as left, "
            "BEYOND its limit of {1} mm.",
        ),
    }
    limit = "" if change.limit_mm is None else f"{change.limit_mm:g}"
    return words[change.is_within].format(off, limit)


def rule_pieces(statement: Statement) -> Iterable[Piece]:
    """Return by what the verdict is given."""
    calibration = statement.calibration
    yield heading(translate("paper", "Decision rule"))
    for part in decision_rule(calibration.verdict.limits):
        yield paragraph(worded(part))
    yield paragraph(
        translate(
            "paper",
            "No conformity of the tip with a specification is stated. The rule is that "
            "of the program which made this paper; the verdict is that of the file.",
        )
    )


def budget_pieces(calibration: StatedCalibration) -> Iterable[Piece]:
    """Return what U is made of."""
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
    yield heading(translate("paper", "Budget of uncertainty"))
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
            "The parts add up in squares. Assumed is what no file states; the station "
            "or the program stands for it.",
        )
    ]
    if parts.correlation_factor > 1:
        text = translate(
            "paper",
            "Images hang together: their noise counts {0} times (variance).",
        )
        texts.append(text.format(f"{parts.correlation_factor:.2f}"))
    yield paragraph(" ".join(texts))
    yield row_of_charts([budget_chart(calibration)], CHART)


def _halves(calibration: StatedCalibration) -> list[tuple[str, ...]]:
    parts = calibration.uncertainty
    difference = np.array(parts.halves_difference_mm, dtype=np.float64)
    u = np.array(parts.halves_expanded_uncertainty_mm, dtype=np.float64)
    if not (np.isfinite(difference).all() and np.isfinite(u).all()):
        return []
    return [
        (translate("paper", "Odd minus even images / mm"), *_texts(difference, u)),
        (translate("paper", "its U (k = 2) / mm"), *_texts(u, u)),
    ]


def _share_name(name: ShareName) -> str:
    """Return a part of the uncertainty in full."""
    return {
        ShareName.NOISE: translate("paper", "Noise of the images"),
        ShareName.CENTERS: translate("paper", "LED centres, what does not average out"),
        ShareName.SEAT: translate("paper", "Seat of the tip in the cone"),
        ShareName.FORM: translate("paper", "Form of ball and cone"),
        ShareName.DRIFT: translate("paper", "Drift of cone and camera"),
        ShareName.LEDS: translate("paper", "LED positions of the pen file"),
        ShareName.SCALE: translate("paper", "Scale of the pen file"),
        ShareName.TEMPERATURE: translate("paper", "Temperature of the pen"),
        ShareName.DISTANCE: translate("paper", "Distance of the cones"),
        ShareName.DIAMETER: translate("paper", "Diameter of the LED discs"),
        ShareName.CAMERA: translate("paper", "Intrinsics of the camera file"),
        ShareName.EXTRINSICS: translate("paper", "Places of the cameras"),
        ShareName.HELD_BACK: translate("paper", "Effects too uncertain to be fitted"),
    }[name]


def _number_columns(title: str, axes: Sequence[str]) -> list[Column]:
    return [Column(title, 2.2), *(Column(axis, 1, RIGHT) for axis in axes)]


def _uncertainty(calibration: StatedCalibration) -> FloatArray:
    return np.array(calibration.expanded_uncertainty_mm)


def _texts(values: FloatArray, uncertainties: FloatArray) -> tuple[str, ...]:
    """Return lengths to the digit that their uncertainty warrants."""
    pairs = zip(values.tolist(), uncertainties.tolist(), strict=True)
    return tuple(number_text(value, decimals_for(u)) for value, u in pairs)
