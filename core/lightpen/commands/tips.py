"""``lightpen tips``: the library of pens, tips and cones."""

import argparse
import getpass

from lightpen.commands.arguments import DataFolder, add_data, whole_number

KINDS = ("pen", "tip", "cone", "camera", "reference")


def add_tips(parser: argparse.ArgumentParser, data_folder: DataFolder) -> None:
    """Add ``lightpen tips``."""
    parser.set_defaults(run=_run)
    actions = parser.add_subparsers(required=True, metavar="ACTION", dest="action")
    listed = actions.add_parser("list", help="list items and their calibration status")
    added = actions.add_parser("add", help="add a pen, tip, cone, camera or reference")
    changed = actions.add_parser("change", help="edit an item, or retire it")
    for action in (listed, added, changed):
        add_data(action, data_folder)
        action.add_argument("--json", action="store_true", help="print JSON")
    listed.add_argument("--all", action="store_true", help="include retired items")
    listed.add_argument(
        "--max-days",
        type=whole_number,
        metavar="N",
        help="calibration interval in days for tips without their own (30)",
    )
    for action in (added, changed):
        action.add_argument("kind", choices=KINDS)
        action.add_argument("id", metavar="ID", help="ID as on the label")
        action.add_argument(
            "--set",
            nargs="+",
            action="extend",
            default=[],
            metavar="ENTRY=VALUE",
            help="entries by the names that list --json prints, such as "
            "ball_diameter_mm=3.0005, due=2027-03-31, nominal_tip_mm='0 -90 -25', "
            "or is_retired=true; without a value the entry is cleared",
        )
        _add_author(action)


def _add_author(action: argparse.ArgumentParser) -> None:
    who = action.add_argument_group("author of the change, for the archive")
    who.add_argument("--station", default="", metavar="NAME")
    who.add_argument(
        "--operator",
        default=getpass.getuser(),
        metavar="NAME",
        help="operator (default: current user)",
    )
    who.add_argument("--reason", default="", metavar="TEXT")
    who.add_argument(
        "--supervisor",
        metavar="NAME",
        help="supervisor who signs, if the data folder has a supervisor password; "
        "the password is requested, or read from LIGHTPEN_PASSWORD",
    )


def _run(options: argparse.Namespace) -> int:
    # Imported here: it takes 0.2 s.
    from lightpen.commands.tips_actions import ACTIONS

    return ACTIONS[options.action](options)
