"""The actions of ``lightpen archive``."""

import argparse
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from lightpen.archive.chains import SHORT
from lightpen.archive.checks import check_file
from lightpen.archive.history import EntryFilter, Line, entries_csv, lines, newest
from lightpen.archive.logbook import Logbook
from lightpen.archive.store import Database, look_into
from lightpen.commands.arguments import data_of, supervisor_signature
from lightpen.commands.console import Command, printing, progress, shown
from lightpen.local_time import local_now, local_time
from lightpen.record.library.entered_files import ARCHIVE
from lightpen.record.library.supervision import renew_station_key

CHANGED = 1  # exit status of a check that found something


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
