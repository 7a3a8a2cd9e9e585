"""Events of a station besides swings: limits, verifications, cameras."""

from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

from lightpen.archive.chains.entries import Event, FileHash, Kind, this_program
from lightpen.archive.events.event_extraction import ExtractedEvent, file_text
from lightpen.formats.files import LARGEST_RECORD, read_bytes
from lightpen.formats.json_records import Plain
from lightpen.record.folder.camera_calibrations import (
    CAMERA_CALIBRATION,
    CAMERA_CALIBRATIONS,
    read_camera_trial,
)
from lightpen.record.folder.verifications import (
    TOUCHES,
    VERIFICATIONS,
    read_verification,
)
from lightpen.record.library.guard_files import LIMITS_FOLDER, read_limits_change
from lightpen.record.library.numbered_files import numbered_files
from lightpen.record.library.signing.chain_keys import (
    OLD_KEY_SIGNATURE,
    STATION_KEY,
    SUPERVISOR_KEY,
    SUPERVISOR_SIGNATURE,
)
from lightpen.record.library.supervision import read_supervision
from lightpen.record.results.result_folder import SIMULATED, FolderArchive
from lightpen.record.swings.journal import JOURNAL
from lightpen.record.swings.names import Names

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
    trial = read_camera_trial(content, file)
    return Event(
        kind=Kind.CAMERA,
        at=trial.created,
        names=Names(station=trial.station, operator=trial.operator),
        program=str(trial.program),
        origin=trial.origin,
        outcome=trial.outcome,
        settings={"board": trial.board, "camera": trial.serial},
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
    if done.supervisor:
        settings["supervisor"] = done.supervisor
    return Event(
        kind=Kind.VERIFICATION,
        at=done.created,
        names=Names(done.station, done.operator, done.pen, done.tip),
        program=str(done.program),
        origin=done.origin,
        grade="" if verdict is None else verdict.grade,
        why=done.why,
        reason=done.reason,
        outcome=done.outcome,
        settings=settings,
        result=place,
        files=journals,
        record_sha256=place.sha256,
    )
