"""``lightpen verify press``: two swings of a tip, one with firm pressure."""

import argparse
from pathlib import Path

from lightpen.commands.arguments import add_exit_by_verdict, add_file, add_json
from lightpen.commands.console import (
    printing,
    require_other_file,
    shown,
    verdict_status,
)
from lightpen.commands.entering import add_entering, keep_record
from lightpen.errors import UsageError
from lightpen.formats.hashes import all_hashed
from lightpen.formats.json_records import file_entry
from lightpen.record.calibrations.calibrations import read_calibration
from lightpen.record.calibrations.recomputing import recompute
from lightpen.verification.history.pen_health import require_one_pen
from lightpen.verification.history.press_test import PRESS_TEST, press_test
from lightpen.verification.reports.records import verification_record
from lightpen.verification.reports.summaries import press_test_text


def add_verify_press(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen verify press``."""
    parser.set_defaults(run=_verify_press)
    add_file(parser, "usual", "USUAL.json", "calibration with usual pressure")
    parser.add_argument(
        "firm",
        type=Path,
        metavar="FIRM.json",
        help="calibration with firm pressure: same tip, cone, pen and camera",
    )
    add_exit_by_verdict(parser)
    add_json(parser)
    add_entering(parser)


@printing
def _verify_press(options: argparse.Namespace) -> int:
    files = [options.usual, options.firm]
    require_other_file(options.json, *files)
    usual, firm = both = [read_calibration(path) for path in files]
    require_one_pen(both)
    if usual.camera_hashes != firm.camera_hashes:
        raise UsageError("press-test.another-camera", first=usual.name, other=firm.name)
    if (usual.tip_pen == firm.tip_pen).all():
        raise UsageError("repeatability.twice", one=usual.name, other=firm.name)
    found = press_test(*(recompute(path).calibration for path in files))
    print(shown(press_test_text(found)))
    record = verification_record(
        PRESS_TEST,
        found.entries,
        found.assessment,
        {},
        {"files": [file_entry(file) for file in all_hashed(files)]},
    )
    keep_record(options, record, usual)
    return verdict_status(options, found.assessment.grade)
