"""Stores and enters a verification by command in the data folder of its tip."""

import argparse
from collections.abc import Mapping
from contextlib import closing
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from lightpen.commands.arguments import chosen_limits
from lightpen.commands.console import shown, write_record
from lightpen.errors import UsageError
from lightpen.local_time import local_now
from lightpen.model.coverage import DecisionRule
from lightpen.model.limits import StationLimits, VerificationLimits
from lightpen.model.names import Origin
from lightpen.record.calibrations import CalibrationFile
from lightpen.record.folder import attributed, keep_verification
from lightpen.record.library.supervision import read_supervision
from lightpen.record.library.tip_library import read_library
from lightpen.record.results.result_folder import FolderArchive, data_folder_of
from lightpen.record.swings.header import Names


def add_entering(parser: argparse.ArgumentParser) -> None:
    """Add the options on the archive entry of a verification."""
    place = parser.add_mutually_exclusive_group()
    place.add_argument(
        "--data",
        type=Path,
        metavar="FOLDER",
        help="data folder in whose archive the result is entered (default: that of an "
        "accepted result)",
    )
    place.add_argument(
        "--no-entry", action="store_true", help="do not enter the result in an archive"
    )


def limits_in_force(
    options: argparse.Namespace, tip: CalibrationFile
) -> VerificationLimits:
    """Return the limits of a verification that is entered in a data folder.

    Those of a station with a supervisor can be tightened by options, not widened
    (`UsageError`).
    """
    chosen, data = chosen_limits(options), _data_of_entry(options, tip)
    supervision = None if data is None else read_supervision(data)
    if supervision is None or not supervision.is_guarded:
        return replace(VerificationLimits(), **chosen)
    own = supervision.limits_at(tip.names.station, StationLimits()).verification
    limits = replace(own, **chosen)
    wider = [
        each.name
        for each in fields(own)
        if each.name != "rule" and getattr(limits, each.name) > getattr(own, each.name)
    ]
    rules = limits.rule, own.rule
    if rules[0] is not rules[1] and rules != (
        DecisionRule.GUARD_BAND,
        DecisionRule.SIMPLE,
    ):
        wider.append("rule")
    for name in wider:
        raise UsageError(
            "cli.wider-limit",
            limit=name.replace("_", " "),
            given=f"{getattr(limits, name)}",
            station=f"{getattr(own, name)}",
        )
    return limits


def keep_record(
    options: argparse.Namespace,
    record: Mapping[str, Any],
    tip: CalibrationFile,
    origin: Origin | None = None,
) -> None:
    """Write a verification as JSON where requested, and enter it in the archive.

    That is in the data folder of the tip. By default the origin of the images is taken
    from the tip.
    """
    names = tip.names
    is_simulated = Origin.SIMULATED in (origin, tip.origin)
    if is_simulated:
        origin = Origin.SIMULATED
    operator = record.get("operator")  # of recorded images
    if operator:
        names = replace(names, operator=operator)
    record = attributed(record, names, origin or tip.origin)
    if options.json is not None:
        write_record(options.json, record)
    data = _data_of_entry(options, tip)
    if data is None:
        print("This result is not entered in an archive.")
        folder = data_folder_of(tip.path)
        if folder is not None and not is_simulated:
            _print_overdue(folder, names)
        return
    # Imported here: it takes 0.2 s.
    from lightpen.archive.logbook import Logbook

    kept = keep_verification(data, record, is_simulated=is_simulated)
    with closing(Logbook(data, options.replicate)) as logbook:
        for fault in logbook.enter_owed():
            print(shown(str(fault)))
    if not is_simulated:
        _print_overdue(data, names)
    print(shown(f"Entered in the archive: {kept}"))


def _data_of_entry(options: argparse.Namespace, tip: CalibrationFile) -> Path | None:
    """Return the data folder in which a result is entered; None of one that is not."""
    if getattr(options, "no_entry", True):
        return None
    return options.data or data_folder_of(tip.path)


def _print_overdue(data: Path, names: Names) -> None:
    from lightpen.archive.logbook import folder_statuses

    rule = FolderArchive(data).supervision().limits_at(names.station, StationLimits())
    found = folder_statuses(data, rule.due, read_library(data), local_now())
    overdue = found.overdue(names.pen, names.tip)
    if overdue is not None:
        print(shown(str(overdue)))
