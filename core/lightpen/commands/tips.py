"""``lightpen tips``: the library of pens, tips and cones."""

import argparse

from lightpen.commands.arguments import DataFolder, add_data, whole_number


def add_tips(parser: argparse.ArgumentParser, data_folder: DataFolder) -> None:
    """Add ``lightpen tips``."""
    parser.set_defaults(run=_run)
    actions = parser.add_subparsers(required=True, metavar="ACTION", dest="action")
    listed = actions.add_parser("list", help="list items and their calibration status")
    add_data(listed, data_folder)
    listed.add_argument("--json", action="store_true", help="print JSON")
    listed.add_argument("--all", action="store_true", help="include retired items")
    listed.add_argument(
        "--max-days",
        type=whole_number,
        metavar="N",
        help="calibration interval in days for tips without their own (30)",
    )


def _run(options: argparse.Namespace) -> int:
    # Imported here: it takes 0.2 s.
    from lightpen.commands.tips_actions import list_items

    return list_items(options)
