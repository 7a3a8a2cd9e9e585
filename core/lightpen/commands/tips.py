"""``lightpen tips``: the library of pens, tips and cones."""

import argparse
import getpass
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import TypeVar

from lightpen.commands.arguments import (
    FORGOTTEN,
    DataFolder,
    add_data,
    finite,
    not_negative,
    whole_number,
)
from lightpen.formats.own_json import FIRST_YEAR, LAST_YEAR

T = TypeVar("T")

KINDS = ("pen", "tip", "cone", "camera", "reference")
SHAPES = ("ring", "length", "sphere", "plate")  # see `ArtefactKind`
SIDES = ("centre", "inside", "outside")
NOTHING = "none"  # instead of a value, clears it


def add_tips(parser: argparse.ArgumentParser, data_folder: DataFolder) -> None:
    """Add ``lightpen tips``."""
    parser.set_defaults(run=_run)
    actions = parser.add_subparsers(required=True, metavar="ACTION", dest="action")
    listed = actions.add_parser("list", help="list items and their calibration status")
    added = actions.add_parser("add", help="add a pen, tip, cone, camera or reference")
    changed = actions.add_parser("change", help="edit an item")
    retired = actions.add_parser(
        "retire", help="retire an item; it stays in the archive"
    )
    returned = actions.add_parser("return", help="reactivate a retired item")
    for action in (listed, added, changed, retired, returned):
        add_data(action, data_folder)
        action.add_argument("--json", action="store_true", help="print JSON")
    listed.add_argument("--all", action="store_true", help="include retired items")
    listed.add_argument(
        "--max-days",
        type=whole_number,
        metavar="N",
        help="calibration interval in days for tips without their own (30)",
    )
    for action in (added, changed, retired, returned):
        action.add_argument("kind", choices=KINDS)
        action.add_argument("id", metavar="ID", help="ID as on the label")
    for action in (added, changed):
        _add_entries(action)
    for action in (added, changed, retired, returned):
        _add_author(action)


def _add_entries(action: argparse.ArgumentParser) -> None:
    of_all = action.add_argument_group("all items")
    of_all.add_argument(
        "--due", type=_or_nothing(_date), metavar="YYYY-MM-DD", help="expiry date"
    )
    of_all.add_argument(
        "--certificate",
        metavar="NUMBER",
        help="number of the certificate: of the LED measurement of a pen, the ball of "
        "a tip, a cone, the intrinsics of a camera (its ID: the serial number), a "
        "reference",
    )
    of_all.add_argument(
        "--certified",
        type=_or_nothing(_date),
        metavar="YYYY-MM-DD",
        help="date of the certificate",
    )
    of_all.add_argument("--note", metavar="TEXT")
    of_references = action.add_argument_group(
        "references: rings, bars, spheres, plates"
    )
    of_references.add_argument(
        "--value",
        type=_or_nothing(finite),
        metavar="MM",
        help="certified value; reports find the reference by it",
    )
    of_references.add_argument(
        "--shape",
        choices=SHAPES,
        help="of a radius, length, diameter or flatness: the step Measure then offers "
        "its plan",
    )
    of_references.add_argument(
        "--value-uncertainty",
        type=not_negative,
        metavar="MM",
        help="U (k = 2) of the certified value",
    )
    of_references.add_argument(
        "--side",
        choices=SIDES,
        help="where the ball touches (centre: in a groove or cones)",
    )
    of_references.add_argument(
        "--expansion",
        type=not_negative,
        metavar="PPM/K",
        help="coefficient of thermal expansion",
    )
    of_tips = action.add_argument_group(
        "tips", f"'{NOTHING}' instead of a value clears the field"
    )
    for name, kind, unit, help_text in (
        ("--ball-diameter", finite, "MM", "ball diameter"),
        ("--max-change", finite, "MM", "maximum change since the last calibration"),
        ("--max-days", whole_number, "N", "calibration interval in days"),
        (
            "--max-swings",
            whole_number,
            "N",
            "calibration interval in swings of the pen",
        ),
        ("--picture", Path, "FILE", "picture of the tip"),
    ):
        of_tips.add_argument(name, type=_or_nothing(kind), metavar=unit, help=help_text)
    of_tips.add_argument(
        "--nominal",
        type=_or_nothing(finite),
        nargs="+",
        metavar="X Y Z",
        help="nominal tip centre, pen frame, mm",
    )


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


def _date(text: str) -> date:
    """Return a day that lies in every time zone."""
    try:
        day = date.fromisoformat(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(
            f"{text} is no date such as 2026-08-14."
        ) from error
    if not FIRST_YEAR <= day.year <= LAST_YEAR:
        raise argparse.ArgumentTypeError(
            f"{text} is not between the years {FIRST_YEAR} and {LAST_YEAR}."
        )
    return day


def _or_nothing(kind: Callable[[str], T]) -> Callable[[str], T | object]:
    """Return a parser of a value that accepts an empty text for no value."""

    def read(text: str) -> T | object:
        return FORGOTTEN if text.strip() == NOTHING else kind(text)

    return read


def _run(options: argparse.Namespace) -> int:
    # Imported here: it takes 0.2 s.
    from lightpen.commands.tips_actions import ACTIONS

    return ACTIONS[options.action](options)
