"""An older tip put in force again: a new result, of what was calibrated then."""

import json
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from lightpen.archive.entries import IN_FORCE_BY, Written
from lightpen.errors import ArchiveError, FileError
from lightpen.estimation.verdict import change_since
from lightpen.record.names import Names
from lightpen.record.results import Result, Since, parse_result, result_bytes
from lightpen.sentences import sentence


def restored_result(
    entry: Written,
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
        Of the entry, as JSON.
    data : Path
        Data folder.
    by : Names
        Who restores it, and at which station.
    reason : str
        In their words.

    Raises
    ------
    ArchiveError
        The entry put no tip in force, or the archive does not tell all of it.
    """
    event = entry.entry.event
    if event.kind not in IN_FORCE_BY:
        raise ArchiveError(
            sentence(
                "archive.not-restorable",
                "Entry {number} put no tip in force. Choose one that did.",
                number=entry.entry.number,
            )
        )
    result = Result(
        names=replace(event.names, station=by.station, operator=by.operator),
        accepted=now,
        grade=event.grade,
        record=data / event.swing,
        images=None,
        calibration={} if record is None else json.loads(record),
        origin=event.origin,
        reason=reason,
        why=event.why,
        restores=entry.sha256,
    )
    try:
        return parse_result(result_bytes(result, event.swing), data, data.joinpath)
    except FileError as error:
        raise ArchiveError(
            sentence(
                "archive.too-little-kept",
                "The archive does not tell enough of entry {number} to put its tip in "
                "force: its record is missing, or of an early version of the program. "
                "Calibrate the tip again.",
                number=entry.entry.number,
            )
        ) from error


def with_change(result: Result, last: Result | None) -> Result:
    """Return a result that tells how far its tip lies from that in force before."""
    if last is None:
        return result
    change = change_since(
        result.tip_pen, result.uncertainty, last.tip_pen, last.uncertainty
    )
    return replace(result, change=Since.of(last, change))
