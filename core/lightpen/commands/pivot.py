"""``lightpen pivot``: find the tip from given poses."""

import argparse
from pathlib import Path

from lightpen.commands.arguments import add_json
from lightpen.commands.console import printing, require_other_file, write_record
from lightpen.estimation.pivot_calibration import calibrate_pivot
from lightpen.estimation.reports.pivot_report import pivot_record
from lightpen.estimation.reports.summary import pivot_text
from lightpen.formats.hashes import hashed
from lightpen.formats.observation_files import read_poses


def add_pivot(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen pivot``."""
    parser.set_defaults(run=_pivot)
    parser.add_argument(
        "poses",
        type=Path,
        metavar="POSES.csv",
        help="poses in the order of capture (r11 to r33, tx_mm, ty_mm, tz_mm)",
    )
    parser.add_argument(
        "--least-squares", action="store_true", help="weight all poses equally"
    )
    add_json(parser)


@printing
def _pivot(options: argparse.Namespace) -> None:
    require_other_file(options.json, options.poses)
    poses = read_poses(options.poses)
    calibration = calibrate_pivot(
        poses.rotations,
        poses.translations,
        poses.covariances,
        robust=not options.least_squares,
    )
    print(pivot_text(calibration))
    if options.json is not None:
        record = pivot_record(calibration, hashed(options.poses), options.least_squares)
        write_record(options.json, record)
