"""The logbook of a station: it enters events, and updates the status of tips."""

import logging
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Protocol, TypeAlias

from msgspec import structs

from lightpen.archive.chains import (
    Event,
    Kind,
    StoredEntry,
    append,
    chain_at_home,
    chain_head,
    entry_of_result,
    is_swing_entered,
    own_chain,
    this_program,
)
from lightpen.archive.events import (
    ExtractedEvent,
    event_of_abandoned,
    event_of_change,
    event_of_refused,
    event_of_result,
    event_of_station,
    event_of_unreadable,
    is_station_file,
)
from lightpen.archive.history import due_tips
from lightpen.archive.store import Database, look_into, open_file
from lightpen.errors import AcceptanceError, ArchiveError, FileError, NoArchiveError
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.files import FOLDER, sha256, unreadable
from lightpen.local_time import local_now
from lightpen.messages import Message
from lightpen.model.limits import DueRule
from lightpen.record.calibrations import CalibrationFile
from lightpen.record.folder import data_folder_of_verification
from lightpen.record.library.entered_files import ARCHIVE, EntryPlace, entered_files
from lightpen.record.library.signing import (
    OwedFile,
    chain_of,
    forget_owed,
    owed_files,
    station_key,
)
from lightpen.record.library.supervision import renew_station_key
from lightpen.record.library.tip_library import (
    LIBRARY,
    CurrentResult,
    Library,
    StationStatus,
)
from lightpen.record.results.acceptance import SwingAssessment
from lightpen.record.results.result_folder import RECORDS, FolderArchive, data_folder_of
from lightpen.record.swings.reading import DISCARDED, JOURNAL, last_verdict, open_record
from lightpen.record.swings.solving import Solution

# The logbook of a station: enters the events of a data folder in its chain.
#
# A result file makes a tip current, or revokes it, and changes of the tip library,
# limits, verifications and calibrated cameras have files of their own. Each gets one
# entry, as soon as it is written; where that failed, or the program was killed, with
# whatever is entered next, and at every start, by the note in the user account: no file
# is entered that the program did not write, and none counts without its entry. The
# journal of a swing says that it was abandoned.


LONGEST_FAREWELL_S = 1.0  # maximum delay of the program's end by a server

_logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class ReplicationState:
    """Progress of the replication to a server."""

    n_waiting: int | None  # None as long as it did not answer
    fault: Message | None  # of the last attempt


class Replication(Protocol):
    """What delivers the entries to a server, as soon as it answers."""

    n_delivered: int | None  # None until the server answered first
    fault: Message | None  # why the last attempt failed

    def wake(self) -> None:
        """Deliver soon."""

    def close(self, timeout_s: float) -> None:
        """Finish the current transfer, within a time limit, and end."""


Replicate: TypeAlias = Callable[[Database, str], Replication | None]
"""Begins to deliver a chain of an archive; None where there is no server."""


class Logbook:
    """Enters the events of a data folder in its archive; thread-safe.

    Several programs may have one of the same folder, which need not exist. All is
    delivered to a server, if ``replicate`` finds one.
    """

    def __init__(self, data: Path, replicate: Replicate | None = None) -> None:
        self._data = data
        self._results = FolderArchive(data)
        self._lock = Lock()
        self.database: Database = open_file(data / ARCHIVE)
        try:
            self.chain = own_chain(self.database)
        except ArchiveError:
            self.database.close()
            raise
        self._renew_lost_key()
        self._replicator: Replication | None = None
        if replicate is not None:
            self._replicator = replicate(self.database, self.chain)

    def enter_owed(
        self, report: Callable[[float], None] = lambda fraction: None
    ) -> tuple[Message, ...]:
        """Enter events from files that the archive does not have yet.

        ``report`` is called with the fraction done; what it raises ends the work. What
        could not be entered is tried again next time; the returned messages say why.
        """
        with self._lock:
            owed, swings, faults = (*self._owed(),), (*self._abandoned(),), []
            n_all = len(owed) + len(swings)
            steps = (
                *(partial(self._enter_file, each) for each in owed),
                *(partial(self._enter_swing, each) for each in swings),
            )
            for n_done, step in enumerate(steps):
                report(n_done / n_all)
                try:
                    step()
                except FileError as error:
                    faults.append(error.message)
        return tuple(faults)

    def enter_refused(
        self, solution: Solution, assessment: SwingAssessment, at: datetime
    ) -> None:
        """Enter that the tip of an abandoned swing was not accepted."""
        with self._lock:
            self._enter(event_of_refused(self._results, solution, assessment, at))

    def enter_note(self, about: StoredEntry, text: str, operator: str) -> None:
        """Enter a comment on an entry."""
        of = about.entry.event
        event = Event(
            kind=Kind.NOTE,
            at=local_now(),
            names=replace(of.names, operator=operator),
            program=this_program(),
            origin=of.origin,
            reason=text,
            concerns=about.sha256,
        )
        with self._lock:
            self._enter(ExtractedEvent(event))

    def delivery(self) -> ReplicationState | None:
        """Return the progress of the replication; None without a server."""
        if self._replicator is None:
            return None
        n_delivered, fault = self._replicator.n_delivered, self._replicator.fault
        if n_delivered is None:
            return ReplicationState(None, fault)
        n_entries = chain_head(self.database, self.chain).number
        return ReplicationState(max(0, n_entries - n_delivered), fault)

    def close(self) -> None:
        """Close the archive."""
        if self._replicator is not None:
            self._replicator.close(LONGEST_FAREWELL_S)
        with self._lock:
            self.database.close()

    def _renew_lost_key(self) -> None:
        """Continue with a new key in a moved folder, without a password."""
        # Every acceptance reports these errors.
        with suppress(FileError, AcceptanceError):
            guard = self._results.supervision()
            present = entered_files(self._data).station_key
            name = chain_of(present) if present else self.chain
            if not guard.is_guarded and station_key(name) is None:
                renew_station_key(self._data, self.chain, None, local_now())

    def _owed(self) -> Iterator[OwedFile]:
        """Yield the files to be entered that are there; forget those never written.

        A program that is killed after its note leaves the place to another file.
        """
        notes = owed_files(self.chain)
        for owed in notes:
            file = self._data / owed.place
            if not file.exists():
                continue
            digest = sha256(file)
            others = [each.sha256 for each in notes if each.place == owed.place]
            entered = entered_files(self._data).files.get(owed.place)
            others += [] if entered is None else [entered.sha256]
            if digest != owed.sha256 and digest in others:
                forget_owed(self.chain, owed)
            else:
                yield owed

    def _abandoned(self) -> Iterator[Path]:
        """Yield the abandoned swings that have no entry."""
        for folder in _abandoned_swings(self._data / RECORDS):
            place = self._results.place_of(folder)
            if not is_swing_entered(self.database, self.chain, place):
                yield folder

    def _enter_file(self, owed: OwedFile) -> None:
        file = self._data / owed.place
        extracted = self._event_of(file)
        event = extracted.event
        if event.result is None or event.result.sha256 != owed.sha256:
            raise FileError("archive.another-result", file=file)
        event = structs.replace(event, approval=owed.approval)
        self._enter(replace(extracted, event=event))
        forget_owed(self.chain, owed)

    def _event_of(self, path: Path) -> ExtractedEvent:
        if path.parent.name == LIBRARY:
            return event_of_change(self._results, path)
        if is_station_file(path):
            return event_of_station(self._results, path)
        return event_of_result(self._results, path)

    def _enter_swing(self, folder: Path) -> None:
        """Enter an abandoned swing."""
        at = datetime.fromtimestamp((folder / JOURNAL).stat().st_mtime, UTC)
        try:
            record = open_record(folder)
        except FileError as error:
            why = error.message
            self._enter(event_of_unreadable(self._results, folder, at, why))
        else:
            self._enter(event_of_abandoned(self._results, record, at))

    def _enter(self, extracted: ExtractedEvent) -> None:
        event = extracted.event
        if extracted.takes_back:
            back = entry_of_result(self.database, self.chain, extracted.takes_back)
            event = event if back is None else _taking_back(event, back)
        append(self.database, self.chain, event, extracted.record)
        _logger.info("entered: %s", event.kind)
        if self._replicator is not None:
            self._replicator.wake()


def _taking_back(event: Event, back: StoredEntry) -> Event:
    """Return the event of a revocation with the data of the result."""
    of, operator = back.entry.event, event.names.operator
    return structs.replace(
        event,
        names=replace(of.names, operator=operator),
        origin=of.origin,
        swing=of.swing,
        concerns=back.sha256,
    )


def _abandoned_swings(records: Path) -> Iterator[Path]:
    """Yield the folders of the swings that were abandoned, the oldest first."""
    try:
        folders = sorted(records.iterdir()) if records.is_dir() else []
    except OSError as error:
        raise unreadable(records, FOLDER, error) from error
    for folder in folders:
        with suppress(OSError):  # it is no record
            if last_verdict(folder) == DISCARDED:
                yield folder


def with_entry(file: CalibrationFile) -> CalibrationFile:
    """Return a calibration that states, if accepted, whether it is entered."""
    if file.accepted is None:
        return file
    return replace(file, is_entered=entry_of_file(file.path, file.sha256) is not None)


def entry_of_file(result: Path, sha256: str) -> EntryPlace | None:
    """Return the entry of a result or a verification with a checksum as read.

    None of a file in no data folder, and of one that is not entered. Raises `FileError`
    if it is not the file that was entered.
    """
    data = data_folder_of_verification(result) or data_folder_of(result)
    if data is None:
        return None
    entered = entered_files(data)
    found = entered.files.get(entered.place_of(result))
    if found is None:
        return None
    if found.sha256 != sha256:
        raise FileError("archive.another-result", file=result)
    return found.entry


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
