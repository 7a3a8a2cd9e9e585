"""``lightpen archive``: check, list, deliver and fetch entries."""

import argparse
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path

from lightpen.archive.chains import SHORT
from lightpen.archive.checks import check_file
from lightpen.archive.history import EntryFilter, Line, entries_csv, lines, newest
from lightpen.archive.logbook import Logbook
from lightpen.archive.store import Database, look_into
from lightpen.commands.arguments import (
    add_data,
    data_of,
    supervisor_signature,
    whole_number,
)
from lightpen.commands.console import Command, printing, progress, shown
from lightpen.extension import Extension
from lightpen.local_time import local_now, local_time
from lightpen.record.library.entered_files import ARCHIVE
from lightpen.record.library.supervision import renew_station_key

USUAL_LENGTH = 50  # entries that are listed
CHANGED = 1  # exit status of a check that found something


def add_archive(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen archive``, with the actions of the extensions."""
    parser.set_defaults(run=lambda options: ACTIONS[options.action](options))
    extensions: Sequence[Extension] = parser.get_default("extensions")
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
            add_data(action)
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


def _check(options: argparse.Namespace) -> int:
    has_findings = False

    @printing
    def run(options: argparse.Namespace) -> None:
        nonlocal has_findings
        data = data_of(options)
        with progress("Checking") as report:
            checked = check_file(data / ARCHIVE, data, report)
        findings, delivery = checked.findings, ""
        if options.check_copy is not None:  # of an extension
            with _looked_into(data) as database:
                found, delivery = options.check_copy(database)
            findings += found
        for finding in findings:
            print(shown(str(finding)))
        for note in checked.notes:
            print(shown(f"Note: {note}"))
        has_findings = bool(findings)
        outcome = "Something was changed" if has_findings else "No change was found"
        counts = f"{checked.n_entries} entries, {checked.n_files} files"
        print(f"{outcome}: {counts}.{delivery}")

    return run(options) or (CHANGED if has_findings else 0)


@printing
def _list(options: argparse.Namespace) -> None:
    wanted = EntryFilter(options.pen, options.tip, options.station)
    with _looked_into(data_of(options)) as database:
        if options.csv:
            text = entries_csv(newest(database, wanted, options.most))
        else:
            found = lines(database, wanted, 0, options.most)
            text = "\n".join(map(_line, found))
    print(shown(text.removesuffix("\n")))


@printing
def _new_key(options: argparse.Namespace) -> None:
    data = data_of(options)
    with closing(Logbook(data)) as logbook:
        signature = supervisor_signature(options.supervisor)
        public = renew_station_key(data, logbook.chain, signature, local_now())
        for fault in logbook.enter_owed():
            print(shown(str(fault)))
    print(f"The station key is {public} from now on.")


ACTIONS: dict[str, Command] = {"check": _check, "list": _list, "new-key": _new_key}


@contextmanager
def _looked_into(data: Path) -> Iterator[Database]:
    with closing(look_into(data / ARCHIVE)) as database:
        yield database


def _line(line: Line) -> str:
    if line.entry is None:
        return f"entry {line.number} of the chain {line.chain[:SHORT]}  CHANGED"
    event = line.entry.entry.event
    names, tip = event.names, event.tip_pen_mm
    when = f"{local_time(event.at):%Y-%m-%d %H:%M}"
    words = [when, names.station, names.pen, names.tip, event.kind.value, event.grade]
    if tip is not None:
        words.append(" ".join(f"{value:.4f}" for value in tip))
    return "  ".join(filter(None, words))
