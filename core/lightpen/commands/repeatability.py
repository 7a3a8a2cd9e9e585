"""``lightpen repeatability``: one tip calibrated several times."""

import argparse
from itertools import combinations
from pathlib import Path

import numpy as np

from lightpen.commands.arguments import (
    above_zero,
    add_camera,
    add_file,
    add_json,
    add_pen_options,
    add_verdict,
)
from lightpen.commands.console import (
    centers_at,
    printing,
    progress,
    require_other_file,
    shown,
    verdict_status,
)
from lightpen.commands.entering import add_entering, keep_record, limits_in_force
from lightpen.comparisons.pen_health import require_one_pen
from lightpen.comparisons.records import (
    repeatability_entries,
    repeatability_text,
    verification_record,
)
from lightpen.comparisons.repeatability import TipEstimate, measure_repeatability
from lightpen.detection.observations import observe_centers
from lightpen.errors import UsageError
from lightpen.estimation.calibrate import calibrate
from lightpen.estimation.reports.report_warnings import result_of
from lightpen.formats.camera_files import read_camera
from lightpen.formats.opened_files import all_hashed
from lightpen.formats.own_json import file_entry
from lightpen.formats.pen_files import read_pen
from lightpen.messages import printable
from lightpen.model.limits import VerificationLimits, rule_in_words
from lightpen.record.calibrations import CalibrationFile, read_calibration


def add_repeatability(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen repeatability``."""
    parser.set_defaults(run=_repeatability)
    parser.add_argument(
        "results",
        nargs="+",
        type=Path,
        metavar="RESULT",
        help="calibrations of one tip: RESULT.json, or LED centres as FILE.csv",
    )
    add_camera(parser, "intrinsics file for LED centres")
    add_file(parser, "--pen", "FILE", "LED file for LED centres")
    add_pen_options(parser)
    parser.add_argument(
        "--method",
        choices=("joint", "two-stage"),
        default="joint",
        help="estimator for LED centres",
    )
    usual = VerificationLimits().repeatability
    parser.set_defaults(limits=("repeatability",))
    parser.add_argument(
        "--limit",
        dest="limit_repeatability",
        type=above_zero,
        metavar="MM",
        help=f"limit of the standard deviation of a coordinate ({usual:g})",
    )
    add_verdict(parser)
    add_json(parser)
    add_entering(parser)


@printing
def _repeatability(options: argparse.Namespace) -> int:
    inputs = [*options.results, options.camera, options.pen]
    require_other_file(options.json, *inputs)
    tips, first = _tips(options)
    for one, other in combinations(tips, 2):
        if np.array_equal(one.tip_pen, other.tip_pen):
            raise UsageError("repeatability.twice", one=one.name, other=other.name)
    limits = limits_in_force(options, first)
    rule = rule_in_words(limits)
    found = measure_repeatability(tips, limits)
    print(shown(repeatability_text(found, rule)))
    files = [each for each in inputs if each is not None]
    record = verification_record(
        "repeatability",
        repeatability_entries(found),
        found.assessment,
        {"repeatability": limits.repeatability},
        {"files": [file_entry(file) for file in all_hashed(files)]},
        rule,
    )
    keep_record(options, record, first)
    return verdict_status(options, found.assessment.grade)


def _tips(
    options: argparse.Namespace,
) -> tuple[list[TipEstimate], CalibrationFile | None]:
    """Return the tips, and the first calibration unless they are LED centres."""
    tables = [path for path in options.results if path.suffix.lower() == ".csv"]
    if tables and len(tables) < len(options.results):
        raise UsageError(
            "cli.results-mixed",
            one=str(next(each for each in options.results if each not in tables)),
            other=str(tables[0]),
        )
    if tables:
        return _from_centers(options, tables), None
    calibrations = [read_calibration(path) for path in options.results]
    require_one_pen(calibrations)
    for each in calibrations[1:]:
        if each.names.tip != calibrations[0].names.tip:
            raise UsageError(
                "cli.another-tip",
                other=each.path,
                its=printable(each.names.tip),
                first=str(calibrations[0].path),
                tip=printable(calibrations[0].names.tip),
            )
    tips = [
        TipEstimate(each.path.name, each.tip_pen, each.uncertainty, each.when)
        for each in calibrations
    ]
    return tips, calibrations[0]


def _from_centers(options: argparse.Namespace, tables: list[Path]) -> list[TipEstimate]:
    for option, file in (("--camera", options.camera), ("--pen", options.pen)):
        if file is None:
            raise UsageError("cli.centers-need", option=option)
    camera = read_camera(options.camera)
    pen = read_pen(options.pen, options.units, options.led_diameter, None)
    tips = []
    with progress("Calibrating") as report:
        for path in tables:
            seen = observe_centers(centers_at(path, pen), camera, pen)
            result = result_of(calibrate(camera, pen, seen), options.method)
            tips.append(
                TipEstimate(path.name, result.tip_pen, result.expanded_uncertainty[:3])
            )
            report(len(tips) / len(tables))
    return tips
