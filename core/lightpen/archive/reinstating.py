"""Reinstating an older tip: a new result from an earlier calibration."""

from dataclasses import replace
from datetime import datetime
from pathlib import Path

from lightpen.archive.entries import IN_FORCE_BY, StoredEntry
from lightpen.errors import ArchiveError
from lightpen.estimation.reports.calibration_record import CalibrationRecord
from lightpen.estimation.reports.verdict import Grade, change_since
from lightpen.formats.own_json import parse_own_json
from lightpen.record.results.results import Result, TipChange
from lightpen.record.swings.names import Names


def restored_result(
    entry: StoredEntry,
    record: str | None,
    data: Path,
    by: Names,
    reason: str,
    now: datetime,
) -> Result:
    """Return the result that puts the tip of an entry in force again.

    Parameters
    ----------
    record : str or None
        Record of the entry, as JSON.
    data : Path
        Data folder.
    by : Names
        Operator who reinstates it, and station.

    Raises
    ------
    ArchiveError
        The entry put no tip in force, or the archive does not tell all of it.
    """
    event = entry.entry.event
    if event.kind not in IN_FORCE_BY:
        raise ArchiveError("archive.not-restorable", number=entry.entry.number)
    try:
        calibration = parse_own_json((record or "").encode(), CalibrationRecord)
        grade = Grade(event.grade)
    except ValueError as error:
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
