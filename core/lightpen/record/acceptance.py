"""Putting the tip of a swing in force: one transaction of archive and record.

The result is stored first, whole or not at all, and then the swing is concluded. What
is stored says which images of which swing it is of, so that a program killed between
the two leaves nothing undecided: the tip is in force, and whoever finds the swing
without its verdict next concludes it.
"""

from contextlib import suppress
from dataclasses import replace
from datetime import datetime

from lightpen.errors import FileError
from lightpen.estimation.report import calibration_record
from lightpen.estimation.verdict import judge
from lightpen.formats.files import printable
from lightpen.record.archive import Archive
from lightpen.record.reading import (
    Record,
    open_record,
    recorded_limits,
    recorded_names,
)
from lightpen.record.results import Result
from lightpen.record.solving import Solution, record_inputs
from lightpen.record.unfinished import Unfinished
from lightpen.record.writing import RecordWriter
from lightpen.sentences import sentence


def accept(archive: Archive, solution: Solution, now: datetime) -> Result:
    """Put the tip of a recorded swing in force, and conclude the swing.

    Killed at any moment, it leaves either the result before in force and the swing to
    be gone on with, or the new result. Accepting the same images of a swing again gives
    the result that is stored.

    Parameters
    ----------
    solution : Solution
        Of a record, as it is on the disk.
    now : datetime
        With its time zone.

    Raises
    ------
    FileError
        Another program writes to the record, it has changed since it was solved, or the
        result cannot be stored; what was in force before stays so.
    """
    record = open_record(solution.source.folder)
    limits = recorded_limits(record)
    verdict = judge(solution.calibration, limits)
    if not verdict.can_be_accepted:
        raise ValueError(f"The verdict must not be {verdict.grade}.")
    with RecordWriter.resume(record) as writer:
        _require_same_images(record, solution)
        result = _stored_result(archive, record)
        if result is None:
            result = Result(
                names=recorded_names(record),
                accepted=now,
                grade=verdict.grade,
                record=record.folder,
                images=_images_of(record),
                calibration=calibration_record(
                    solution.calibration,
                    record_inputs(solution.source),
                    "joint",
                    limits,
                ),
            )
            archive.store(result)
        _conclude(writer, record, result)
    return result


def conclude_accepted(archive: Archive, found: Unfinished) -> Unfinished:
    """Conclude the interrupted swings whose tip was accepted; return the others.

    Raises
    ------
    FileError
        The archive cannot be read at all.
    """
    interrupted = []
    for record in found.interrupted:
        result = _stored_result(archive, record)
        if result is None:
            interrupted.append(record)
            continue
        with suppress(FileError), RecordWriter.resume(record) as writer:
            _conclude(writer, record, result)
    return replace(found, interrupted=tuple(interrupted))


def _stored_result(archive: Archive, record: Record) -> Result | None:
    """Return the result of a record with the images that take part in it now."""
    result = archive.of_record(record.folder)
    if result is None or result.images != _images_of(record):
        return None
    return result


def _conclude(writer: RecordWriter, record: Record, result: Result) -> None:
    """Write the verdict; where that fails, the archive tells it the next time."""
    if record.verdict != result.grade:
        with suppress(FileError):
            writer.conclude(result.grade)


def _images_of(record: Record) -> tuple[int, ...]:
    return tuple(record.numbers.tolist())


def _require_same_images(record: Record, solution: Solution) -> None:
    is_same = record.all_numbers.tolist() == solution.numbers.tolist()
    if not is_same or set(record.taken_out) != set(solution.taken_out):
        raise FileError(
            sentence(
                "acceptance.changed",
                "The swing in {folder} has changed since its tip was computed. Compute "
                "it again to accept it.",
                folder=printable(str(record.folder)),
            )
        )
