"""Reinstating an older tip: a new result from an earlier calibration."""

from collections.abc import Iterator
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from lightpen.archive.chains.entries import IN_FORCE_BY, StoredEntry
from lightpen.archive.checks.files_check import file_finding
from lightpen.archive.history.queries import calibrating
from lightpen.archive.store.database import Database
from lightpen.errors import AcceptanceError, ArchiveError, FileError
from lightpen.estimation.reports.verdict import Grade, change_since
from lightpen.local_time import local_time
from lightpen.messages import Message, message
from lightpen.model.limits import DueRule
from lightpen.record.library.tip_library import Library
from lightpen.record.results.assessment import overdue_items
from lightpen.record.results.results import Result, TipChange, parse_result
from lightpen.record.swings.names import Names


def require_restorable(entry: StoredEntry, data: Path) -> None:
    """Refuse an entry whose result file has changed."""
    result = entry.entry.event.result
    if result is None:
        return
    finding = file_finding(data, entry.entry.number, result)
    if finding is not None:
        raise ArchiveError(finding)


def due_doubts(
    database: Database,
    entry: StoredEntry,
    library: Library,
    now: datetime,
    rule: DueRule,
) -> Iterator[Message]:
    """Yield the overdue items of the tip of an entry.

    The station's rule is for tips that have none of their own.
    """
    names = entry.entry.event.names
    yield from overdue_items(library, names, local_time(now).date())
    due = library.rule_of(names.tip, rule).due(
        calibrating(database, entry).entry.event.at
    )
    if now > due:
        yield message("doubt.calibration-overdue", due=f"{local_time(due):%Y-%m-%d}")


def restored_result(
    entry: StoredEntry,
    record: str | None,
    data: Path,
    by: Names,
    reason: str,
    now: datetime,
) -> Result:
    """Return the result that reinstates the tip of an entry.

    The record of the entry is the file of its result; ``by`` names the operator who
    reinstates it, and the station. Raises `ArchiveError` if the entry put no tip in
    force, or the archive does not show all of it.
    """
    event = entry.entry.event
    if not reason.strip():
        raise AcceptanceError("reinstating.no-reason")
    if event.kind not in IN_FORCE_BY:
        raise ArchiveError("archive.not-restorable", number=entry.entry.number)
    try:
        data_then = (record or "").encode("utf-8", "surrogateescape")
        calibration = parse_result(data_then, data, data.joinpath).calibration
        grade = Grade(event.grade)
    except (ValueError, FileError) as error:
        raise ArchiveError(
            "archive.too-little-kept", number=entry.entry.number
        ) from error
    return Result(
        names=replace(event.names, station=by.station, operator=by.operator),
        accepted=now,
        grade=grade,
        record=data / event.swing,
        images=None,
        calibration=calibration,
        origin=event.origin,
        reason=reason,
        why=event.why,
        restores=entry.sha256,
    )


def with_change(result: Result, last: Result | None) -> Result:
    """Return a result with the change from the tip that was current before."""
    if last is None:
        return result
    change = change_since(
        result.tip_pen, result.uncertainty, last.tip_pen, last.uncertainty
    )
    return replace(result, change=TipChange.of(last, change))
