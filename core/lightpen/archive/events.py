"""The events of a data folder that are entered, taken from its files."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from hashlib import sha256
from pathlib import Path

from msgspec.structs import replace

from lightpen.archive.chains import Event, FileHash, Kind, text_sha256, this_program
from lightpen.errors import FileError
from lightpen.estimation.reports.report import calibration_record
from lightpen.estimation.reports.report_warnings import reported
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.files import LARGEST_RECORD, read_bytes
from lightpen.formats.files import sha256 as file_sha256
from lightpen.formats.own_json import Plain, StoredMessage, json_bytes
from lightpen.messages import Message
from lightpen.record.folder import (
    CAMERA_CALIBRATION,
    CAMERA_CALIBRATIONS,
    TOUCHES,
    VERIFICATIONS,
    read_camera_calibration,
    read_verification,
)
from lightpen.record.library.entered_files import numbered_files
from lightpen.record.library.signing import (
    OLD_KEY_SIGNATURE,
    STATION_KEY,
    SUPERVISOR_KEY,
    SUPERVISOR_SIGNATURE,
)
from lightpen.record.library.supervision import (
    LIMITS_FOLDER,
    read_limits_change,
    read_supervision,
)
from lightpen.record.library.tip_library import ItemKind, item_entries, read_change
from lightpen.record.results.acceptance import SwingAssessment
from lightpen.record.results.result_folder import RESULT, SIMULATED, FolderArchive
from lightpen.record.results.results import Result
from lightpen.record.swings.header import HEADER, Names, header_copies
from lightpen.record.swings.reading import JOURNAL, Record, journal_bytes, open_record
from lightpen.record.swings.solving import Solution, record_inputs


@dataclass(frozen=True)
class ExtractedEvent:
    """An event to be entered, with its files."""

    event: Event
    # File from which the result can be made again, or a calibration record
    record: str | None = None
    takes_back: str = ""  # file that is revoked, as `FileHash.place`


def event_of_result(results: FolderArchive, file: Path) -> ExtractedEvent:
    """Return the event of a result file or of a revocation."""
    content = read_bytes(file, RESULT, LARGEST_RECORD)
    place = FileHash(results.place_of(file), sha256(content).hexdigest())
    found = results.content(file)
    if isinstance(found, Result):
        event = _event_of_acceptance(results, place, found)
        return ExtractedEvent(event, file_text(content))
    event = Event(
        kind=Kind.REVOKED,
        at=found.at,
        names=found.names,
        program=this_program(),
        reason=found.reason,
        settings={"supervisor": found.supervisor} if found.supervisor else {},
        result=place,
        record_sha256=place.sha256,
    )
    revoked = file.with_name(f"{found.takes_back}.json")
    return ExtractedEvent(event, file_text(content), results.place_of(revoked))


def event_of_change(results: FolderArchive, file: Path) -> ExtractedEvent:
    """Return the event of a change of the tip library."""
    content, change = read_bytes(file, RESULT, LARGEST_RECORD), read_change(file)
    place = FileHash(results.place_of(file), sha256(content).hexdigest())
    item = change.item
    event = Event(
        kind=Kind.LIBRARY,
        at=change.at,
        names=Names(
            station=change.station,
            operator=change.operator,
            pen=item.id if item.kind is ItemKind.PEN else "",
            tip=item.id if item.kind is ItemKind.TIP else "",
            cone=item.id if item.kind is ItemKind.CONE else "",
        ),
        program=this_program(),
        reason=change.reason,
        settings=item_entries(item) | {"supervisor": change.supervisor},
        result=place,
        record_sha256=place.sha256,
    )
    return ExtractedEvent(event, file_text(content))


def file_text(content: bytes) -> str:
    """Return a file as the text that is stored with its event, without loss."""
    return content.decode("utf-8", "surrogateescape")


def event_of_abandoned(
    results: FolderArchive, record: Record, at: datetime
) -> ExtractedEvent:
    """Return the event of a swing that was abandoned."""
    return ExtractedEvent(_event_of_swing(results, record, Kind.ABANDONED, at))


def event_of_unreadable(
    results: FolderArchive, folder: Path, at: datetime, why: Message
) -> ExtractedEvent:
    """Return the event of a discarded swing that cannot be read."""
    event = Event(
        kind=Kind.ABANDONED,
        at=at,
        names=Names(),
        program=this_program(),
        why=StoredMessage.of(why),
        swing=results.place_of(folder),
    )
    return ExtractedEvent(event)


def event_of_refused(
    results: FolderArchive,
    solution: Solution,
    assessment: SwingAssessment,
    at: datetime,
) -> ExtractedEvent:
    """Return the event of a solved swing whose tip was not accepted.

    A tip that passed is abandoned by its operator, any other is refused.
    """
    record, calibration = open_record(solution.source.folder), solution.calibration
    has_passed = assessment.verdict.grade is Grade.PASS
    kind = Kind.ABANDONED if has_passed else Kind.REFUSED
    found = reported(calibration)
    event = replace(
        _event_of_swing(results, record, kind, at),
        grade=assessment.verdict.grade.value,
        why=StoredMessage.of(assessment.verdict.reason),
        tip_pen_mm=tuple(found.tip_pen.tolist()),
        expanded_uncertainty_mm=tuple(found.expanded_uncertainty[:3].tolist()),
    )
    inputs, limits = record_inputs(solution.source), assessment.limits
    written = calibration_record(calibration, inputs, limits)
    text = json_bytes(written).decode()
    return ExtractedEvent(replace(event, record_sha256=text_sha256(text)), text)


def _event_of_acceptance(
    results: FolderArchive, place: FileHash, result: Result
) -> Event:
    event = Event(
        kind=Kind.ACCEPTED,
        at=result.accepted,
        names=result.names,
        program=str(result.calibration.program),
        origin=result.origin,
        grade=result.grade,
        why=result.why,
        reason=result.reason,
        tip_pen_mm=tuple(result.tip_pen.tolist()),
        expanded_uncertainty_mm=tuple(result.uncertainty.tolist()),
        change=result.change,
        swing=results.place_of(result.record),
        result=place,
        record_sha256=place.sha256,
    )
    with suppress(FileError):  # a result outlives the record of its swing
        record = open_record(result.record)
        files = _files_of(results, record)
        event = replace(event, settings=record.header.settings, files=files)
    return event


def _event_of_swing(
    results: FolderArchive, record: Record, kind: Kind, at: datetime
) -> Event:
    return Event(
        kind=kind,
        at=at,
        names=record.header.names,
        program=record.header.program,
        origin=record.header.origin,
        swing=results.place_of(record.folder),
        settings=record.header.settings,
        files=_files_of(results, record),
    )


def _files_of(results: FolderArchive, record: Record) -> tuple[FileHash, ...]:
    """Return header, journal and the copies of the files of cameras, rig and pen.

    Of the journal no more than was read: lines are added to it. It names the images.
    """
    folder = record.folder
    digest = sha256(journal_bytes(folder)[: record.length]).hexdigest()
    read = FileHash(results.place_of(folder / JOURNAL), digest, record.length)
    header, *copies = (
        FileHash(results.place_of(folder / name), file_sha256(folder / name))
        for name in (HEADER, *header_copies(record.header))
    )
    return (header, read, *copies)


FOLDERS = (
    *(LIMITS_FOLDER, CAMERA_CALIBRATIONS, VERIFICATIONS),
    f"{SIMULATED}/{VERIFICATIONS}",
)


def station_files(data: Path) -> Iterator[Path]:
    """Yield the files of limits, cameras and verifications, each kind in order."""
    for folder in FOLDERS:
        yield from reversed(numbered_files(data / folder))


def is_station_file(file: Path) -> bool:
    """Return whether a file is one of `station_files`."""
    return file.parent.name in FOLDERS


def event_of_station(results: FolderArchive, file: Path) -> ExtractedEvent:
    """Return the event of a limits, verification or camera file."""
    content = read_bytes(file, CAMERA_CALIBRATION, LARGEST_RECORD)
    place = FileHash(results.place_of(file), sha256(content).hexdigest())
    if file.parent.name == LIMITS_FOLDER:
        return ExtractedEvent(_of_limits(file, content, place))
    if file.parent.name == CAMERA_CALIBRATIONS:
        event = _of_camera(file, content, place)
    else:
        event = _of_tip(results, file, content, place)
    return ExtractedEvent(event, file_text(content))


def _of_limits(file: Path, content: bytes, place: FileHash) -> Event:
    """Return a change of limits, once all of them are known to be approved."""
    read_supervision(file.parents[1])
    change = read_limits_change(content, file)
    settings: dict[str, Plain] = {"changes_password": change.password is not None}
    if change.limits is not None:
        settings |= change.limits
    if change.password is not None:
        settings[SUPERVISOR_KEY] = change.password.key
    if change.station_key:
        settings |= {
            STATION_KEY: change.station_key,
            OLD_KEY_SIGNATURE: change.station_key_signature,
            SUPERVISOR_SIGNATURE: change.key_approval,
        }
    return Event(
        kind=Kind.LIMITS,
        at=change.at,
        names=Names(station=change.station, operator=change.supervisor),
        program=this_program(),
        settings=settings,
        result=place,
    )


def _of_camera(file: Path, content: bytes, place: FileHash) -> Event:
    camera = read_camera_calibration(content, file)
    return Event(
        kind=Kind.CAMERA,
        at=camera.created,
        names=Names(station=camera.station, operator=camera.operator),
        program=str(camera.program),
        origin=camera.origin,
        settings={"board": camera.board, "camera": camera.serial},
        result=place,
        record_sha256=place.sha256,
    )


def _of_tip(
    results: FolderArchive, file: Path, content: bytes, place: FileHash
) -> Event:
    """Return the verification of a tip."""
    done = read_verification(content, file)
    verdict, touches = done.verdict, file.parent / TOUCHES
    journals = tuple(  # they name the images
        FileHash(results.place_of(touches / run.folder / JOURNAL), run.journal_sha256)
        for run in done.inputs.touches
    )
    limits = {} if verdict is None else verdict.limits_mm
    settings: dict[str, Plain] = {
        "verified": done.verification,
        **{f"max_{name}_mm": value for name, value in limits.items()},
    }
    return Event(
        kind=Kind.VERIFICATION,
        at=done.created,
        names=Names(done.station, done.operator, done.pen, done.tip),
        program=str(done.program),
        origin=done.origin,
        grade="" if verdict is None else verdict.grade,
        why=done.why,
        outcome=done.outcome,
        settings=settings,
        result=place,
        files=journals,
        record_sha256=place.sha256,
    )
