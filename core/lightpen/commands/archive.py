"""``lightpen archive``: check, list, deliver and fetch entries."""

import argparse
from collections.abc import Sequence
from pathlib import Path

import platformdirs

from lightpen.commands.arguments import DataFolder, add_data, whole_number
from lightpen.extension import Extension

USUAL_LENGTH = 50  # entries that are listed


def usual_data_folder() -> Path:
    """Return the default data folder."""
    return platformdirs.user_data_path("lightpen", appauthor=False)


def add_archive(
    parser: argparse.ArgumentParser,
    data_folder: DataFolder,
    extensions: Sequence[Extension] = (),
) -> None:
    """Add ``lightpen archive``."""
    parser.set_defaults(run=_run)
    actions = parser.add_subparsers(required=True, metavar="ACTION", dest="action")
    check = actions.add_parser(
        "check", help="check every entry, record, result and image"
    )
    listed = actions.add_parser("list", help="print the newest entries")
    check.set_defaults(check_copy=None)
    for each in extensions:
        if each.add_archive_actions is not None:
            each.add_archive_actions(actions, check)
    renewed = actions.add_parser(
        "new-key", help="introduce another station key, if the present one was lost"
    )
    renewed.add_argument(
        "--supervisor",
        metavar="NAME",
        help="supervisor who approves it, if the data folder has a supervisor "
        "password; the password is requested, or read from LIGHTPEN_PASSWORD",
    )
    for name, action in actions.choices.items():
        if name != "server-sql":
            add_data(action, data_folder)
    for name in ("pen", "tip", "station"):
        listed.add_argument(
            f"--{name}", default="", help="list entries of this item only"
        )
    listed.add_argument(
        "--most",
        type=whole_number,
        default=USUAL_LENGTH,
        metavar="N",
        help=f"entries, the newest first ({USUAL_LENGTH})",
    )
    listed.add_argument(
        "--csv", action="store_true", help="write a table for other programs"
    )


def _run(options: argparse.Namespace) -> int:
    # Imported here: it takes 0.2 s.
    from lightpen.commands.archive_actions import ACTIONS

    return ACTIONS[options.action](options)
