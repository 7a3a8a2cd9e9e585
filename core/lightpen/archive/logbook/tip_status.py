"""Calibration status of a station's tips, from its archive."""

from contextlib import closing
from datetime import datetime
from pathlib import Path

from lightpen.archive.chains.chains import chain_at_home
from lightpen.archive.history.due import due_tips
from lightpen.archive.store.database import Database, look_into
from lightpen.errors import NoArchiveError
from lightpen.estimation.reports.verdict import Grade
from lightpen.model.limits import DueRule
from lightpen.record.library.calibration_status import CurrentResult, StationStatus
from lightpen.record.library.entered_files import ARCHIVE
from lightpen.record.library.tip_library import Library


def statuses(
    database: Database, chain: str, rule: DueRule, library: Library, now: datetime
) -> StationStatus:
    """Return the current status of all tips of a station, whose chain it is.

    The rule is for tips without their own.
    """
    in_force = {}
    for tip in due_tips(database, chain, rule, library):
        event = tip.entry.entry.event
        pair = event.names.pen, event.names.tip
        u = event.expanded_uncertainty_mm
        in_force[pair] = CurrentResult(
            tip.calibrated,
            tip.due,
            tip.is_due(now),
            None if u is None else max(u),
            Grade(event.grade) if event.grade else None,
        )
    return StationStatus(library, in_force, now)


def folder_statuses(
    data: Path, rule: DueRule, library: Library, now: datetime
) -> StationStatus:
    """Return the same by the archive of a data folder, which is only read."""
    try:
        with closing(look_into(data / ARCHIVE)) as database:
            chain = chain_at_home(database) or ""
            return statuses(database, chain, rule, library, now)
    except NoArchiveError:
        return StationStatus(library, now=now)
