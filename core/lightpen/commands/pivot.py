"""``lightpen pivot``: find the tip from given poses."""

import argparse
from pathlib import Path

from lightpen.commands.arguments import add_json
from lightpen.commands.console import note, printing, require_other_file, write_record
from lightpen.estimation.pivot_calibration import calibrate_pivot
from lightpen.estimation.reports.summary import pivot_record, pivot_text
from lightpen.formats.observation_files import read_poses
from lightpen.formats.opened_files import hashed
from lightpen.messages import message


def add_pivot(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen pivot``."""
    parser.set_defaults(run=_pivot)
    parser.add_argument(
        "poses",
        type=Path,
        metavar="POSES",
        help="poses in the order of capture: a table with quaternions or matrices, as "
        "of NDI Track or TUM, or a sequence of PLUS (.igs.mha)",
    )
    parser.add_argument(
        "--tool", metavar="NAME", help="the pen, of a file with several tools"
    )
    parser.add_argument(
        "--least-squares", action="store_true", help="weight all poses equally"
    )
    add_json(parser)


@printing
def _pivot(options: argparse.Namespace) -> None:
    require_other_file(options.json, options.poses)
    poses = read_poses(options.poses, options.tool)
    for remark in poses.remarks:
        note(remark)
    calibration = calibrate_pivot(
        poses.rotations,
        poses.translations,
        robust=not options.least_squares,
        places=poses.places,
    )
    print(pivot_text(calibration))
    if poses.n_lost:
        n_poses = len(poses.places) + poses.n_lost
        print(message("poses.lost", n_lost=poses.n_lost, n_poses=n_poses))
    if options.json is not None:
        record = pivot_record(
            calibration,
            hashed(options.poses),
            options.least_squares,
            poses.places,
            poses.n_lost,
        )
        write_record(options.json, record)
