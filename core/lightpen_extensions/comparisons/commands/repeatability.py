"""``lightpen repeatability``: one tip calibrated several times."""

import argparse
from itertools import combinations
from pathlib import Path

import numpy as np

from lightpen.archive.trends import TipEstimate
from lightpen.commands.arguments import above_zero, add_json
from lightpen.commands.console import printing, require_other_file, shown
from lightpen.errors import UsageError
from lightpen.formats.opened_files import all_hashed
from lightpen.formats.own_json import file_entry
from lightpen.messages import printable
from lightpen.model.limits import VerificationLimits
from lightpen.record.calibrations import CalibrationFile, read_calibration
from lightpen_extensions.comparisons.assessment import (
    rule_in_words,
    verification_record,
)
from lightpen_extensions.comparisons.commands.entering import (
    add_entering,
    add_verdict,
    keep_record,
    limits_in_force,
    verdict_status,
)
from lightpen_extensions.comparisons.pen_health import require_one_pen
from lightpen_extensions.comparisons.repeatability import (
    measure_repeatability,
    repeatability_entries,
    repeatability_text,
)


def add_repeatability(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen repeatability``."""
    parser.set_defaults(run=_repeatability)
    parser.add_argument(
        "results",
        nargs="+",
        type=Path,
        metavar="RESULT.json",
        help="calibrations of one tip",
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
    require_other_file(options.json, *options.results)
    calibrations = _calibrations(options.results)
    tips = [
        TipEstimate(each.path.name, each.tip_pen, each.uncertainty, each.when)
        for each in calibrations
    ]
    for one, other in combinations(tips, 2):
        if np.array_equal(one.tip_pen, other.tip_pen):
            raise UsageError("repeatability.twice", one=one.name, other=other.name)
    limits = limits_in_force(options, calibrations[0])
    rule = rule_in_words(limits)
    found = measure_repeatability(tips, limits)
    print(shown(repeatability_text(found, rule)))
    record = verification_record(
        "repeatability",
        repeatability_entries(found),
        found.assessment,
        {"repeatability": limits.repeatability},
        {"files": [file_entry(file) for file in all_hashed(options.results)]},
        rule,
    )
    keep_record(options, record, calibrations[0])
    return verdict_status(options, found.assessment.grade)


def _calibrations(paths: list[Path]) -> list[CalibrationFile]:
    """Read calibrations of one tip."""
    calibrations = [read_calibration(path) for path in paths]
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
    return calibrations
