"""Options of verdicts and entries; stores and enters a verification by command."""

import argparse
from collections.abc import Mapping
from contextlib import closing
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from lightpen.commands.arguments import above_zero, not_negative, number_from
from lightpen.commands.console import (
    DONE,
    NOT_THE_TIP,
    TO_CHECK,
    TO_REPEAT,
    shown,
    write_record,
)
from lightpen.errors import UsageError
from lightpen.estimation.reports.verdict import Grade
from lightpen.local_time import local_now
from lightpen.model.coverage import DecisionRule
from lightpen.model.limits import (
    BALL_UNCERTAINTY,
    LIMITS,
    StationLimits,
    VerificationLimits,
)
from lightpen.model.names import Origin
from lightpen.record.calibrations import CalibrationFile
from lightpen.record.library.supervision import read_supervision
from lightpen.record.library.tip_library import read_library
from lightpen.record.results.result_folder import FolderArchive, data_folder_of
from lightpen.record.swings.header import Names
from lightpen_extensions.comparisons.assessment import attributed, keep_verification

RULE_WORDS = {
    "simple": DecisionRule.SIMPLE,
    "guard-band": DecisionRule.GUARD_BAND,
    "risk": DecisionRule.RISK,
}


def add_limits(parser: argparse.ArgumentParser, *names: str) -> None:
    """Add options for fields of `VerificationLimits`; `chosen_limits` reads them."""
    parser.set_defaults(limits=names)
    for limit in LIMITS:
        if limit.part == "verification" and limit.name in names:
            parser.add_argument(
                f"--limit-{limit.name.replace('_', '-')}",
                type=above_zero if limit.range[0] else not_negative,
                metavar=limit.unit.upper(),
                help=f"{limit.label} ({limit.default:g})",
            )


def chosen_limits(options: argparse.Namespace) -> dict[str, Any]:
    """Return the limits and the decision rule that are given, by their names."""
    given = {
        name: getattr(options, f"limit_{name}", None)
        for name in getattr(options, "limits", ())
    }
    rule = getattr(options, "decision_rule", None)
    given["rule"] = None if rule is None else RULE_WORDS[rule]
    given["risk"] = getattr(options, "max_risk", None)
    return {name: value for name, value in given.items() if value is not None}


def add_verdict(parser: argparse.ArgumentParser) -> None:
    """Add the options of the verdict and its output; see `chosen_limits`."""
    parser.add_argument(
        "--decision-rule",
        choices=tuple(RULE_WORDS),
        help="how a value with U is compared with its limit: simple acceptance, guard "
        "band (ISO 14253-1), or risk (JCGM 106)",
    )
    parser.add_argument(
        "--max-risk",
        type=number_from(0.1, 50.0, "risk", "%"),
        metavar="PERCENT",
        help="risk of a wrong decision by --decision-rule risk (5)",
    )
    add_exit_by_verdict(parser)


def add_exit_by_verdict(parser: argparse.ArgumentParser) -> None:
    """Add the exit status by the verdict; `verdict_status` returns it."""
    parser.add_argument(
        "--exit-by-verdict",
        action="store_true",
        help="exit status 3 if the verdict is REPEAT (of a part: out of tolerance), 4 "
        "if it is CHECK (not proven), 5 if it passes but does not verify the tip",
    )


def add_ball(parser: argparse.ArgumentParser, meaning: str) -> None:
    """Add the options of the ball."""
    parser.add_argument(
        "--ball-diameter", type=not_negative, metavar="MM", help=meaning
    )
    parser.add_argument(
        "--ball-uncertainty",
        type=not_negative,
        default=BALL_UNCERTAINTY,
        metavar="MM",
        help=f"U (k = 2) of the ball diameter ({BALL_UNCERTAINTY:g})",
    )


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


STATUSES = {
    Grade.REPEAT: TO_REPEAT,
    Grade.CHECK: TO_CHECK,
    Grade.SCALE: NOT_THE_TIP,
    Grade.STEADY: NOT_THE_TIP,
}


def verdict_status(options: argparse.Namespace, grade: Grade | None) -> int:
    """Return the exit status of a verdict, if it is requested."""
    if grade is None or not options.exit_by_verdict:
        return DONE
    return STATUSES.get(grade, DONE)
