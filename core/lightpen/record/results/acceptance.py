"""Acceptance of the tip of a swing: one transaction of archive and record.

The result is stored first, whole or not at all, and then the swing is concluded. The
stored result names its swing and images, so that a program killed between the two steps
leaves nothing undecided: the tip is current, and the next program that finds the swing
without its verdict concludes it.

The grade decides how: PASS is accepted without a reason, CHECK only with a reason,
which is stored, and REPEAT not at all. Where a supervisor has set a password, one
beyond the limit of U is accepted by a supervisor only.
"""

import logging
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import date, datetime
from itertools import chain

import numpy as np

from lightpen.errors import AcceptanceError, FileError
from lightpen.estimation.reports.report import calibration_record
from lightpen.estimation.reports.report_warnings import reported, warnings_of
from lightpen.estimation.reports.verdict import (
    Change,
    Grade,
    Verdict,
    change_doubt,
    change_since,
    distance_from_nominal,
    judge,
    judge_change,
    judge_unknown,
    repeats,
)
from lightpen.formats.own_json import StoredMessage
from lightpen.local_time import local_time
from lightpen.messages import Code, Message, message, printable, too_little_tilt
from lightpen.model.coverage import dial_counts
from lightpen.model.limits import StationLimits, SwingLimits
from lightpen.model.names import Origin
from lightpen.record.library.signing import SigningKey
from lightpen.record.library.supervision import (
    Signature,
    Supervision,
    require_supervisor,
)
from lightpen.record.library.tip_library import KIND_WORDS, SWUNG, ItemKind, Library
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.results.results import Result, TipChange
from lightpen.record.swings.header import Names
from lightpen.record.swings.interrupted import InterruptedSwings
from lightpen.record.swings.reading import Record, open_record
from lightpen.record.swings.solving import Solution, record_inputs
from lightpen.record.swings.writing import RecordWriter


@dataclass(frozen=True, eq=False)
class SwingAssessment:
    """Assessment of a solved swing."""

    verdict: Verdict
    last: Result | None  # of this pen and tip; None if none can be read
    change: Change | None
    doubts: tuple[Message, ...]  # besides the verdict, the worst first
    max_change: float | None = None  # limit of the tip, mm, if it has one
    limits: SwingLimits = field(default_factory=SwingLimits)
    names: Names = field(default_factory=Names)  # as the library or `last` spells them


def assess(
    archive: FolderArchive, record: Record, solution: Solution
) -> SwingAssessment:
    """Judge a solved swing by itself and beside the current result."""
    names, origin = record.header.names, record.header.origin
    limits, limit, last, unknown = record.header.limits, None, None, None
    library = Library()
    try:
        limits = _limits_in_force(archive, names, limits)
        library = archive.library()
        listed = library.tip(names.tip)
        limit = None if listed is None else listed.max_change_mm
        is_simulated = origin is Origin.SIMULATED
        last = archive.in_force(names.pen, names.tip, is_simulated=is_simulated)
    except (FileError, AcceptanceError) as error:
        unknown = error.message
    verdict, found = judge(solution.calibration, limits), reported(solution.calibration)
    if unknown is not None:
        verdict = judge_unknown(verdict, unknown)
    change, doubt = None, None
    if last is not None:
        date = f"{local_time(last.accepted):%Y-%m-%d}"
        change = change_since(
            found.tip_pen,
            found.expanded_uncertainty[:3],
            last.tip_pen,
            last.uncertainty,
        )
        doubt = change_doubt(change, date, limit)
        verdict = judge_change(verdict, change, date, limit)
    all_doubts = chain(
        [] if unknown is None else [message(Code.LAST_UNKNOWN, why=unknown)],
        [] if doubt is None else [doubt],
        overdue_items(library, names, local_time(record.header.created).date()),
        _far_from_nominal(solution),
        _bare_sides(solution, limits) if record.header.is_of_recording else [],
        warnings_of(solution.calibration),
    )
    doubts = tuple(each for each in all_doubts if not repeats(each, verdict.reason))
    return SwingAssessment(
        verdict, last, change, doubts, limit, limits, _spelled(names, library, last)
    )


def _spelled(names: Names, library: Library, last: Result | None) -> Names:
    """Return names as the library spells them, or else the current result."""
    before = names if last is None else last.names
    pen, tip, cone = (
        library.item(kind, name)
        for kind, name in zip(SWUNG, (names.pen, names.tip, names.cone), strict=True)
    )
    return replace(
        names,
        pen=before.pen if pen is None else pen.id,
        tip=before.tip if tip is None else tip.id,
        cone=names.cone if cone is None else cone.id,
    )


def _limits_in_force(
    archive: FolderArchive, names: Names, recorded: SwingLimits
) -> SwingLimits:
    """Return the limits set for a station now; without any, those of the swing.

    Those of the swing are in a file that anybody can edit, and may be older.
    """
    chosen = StationLimits(swing=recorded)
    now = archive.supervision().limits_at(names.station, chosen).swing
    return replace(now, spacing=recorded.spacing, min_per_field=recorded.min_per_field)


def overdue_items(library: Library, names: Names, day: date) -> Iterator[Message]:
    """Return the items that were overdue on the day of the swing."""
    for item in (
        library.item(ItemKind.PEN, names.pen),
        library.item(ItemKind.TIP, names.tip),
        library.item(ItemKind.CONE, names.cone),
    ):
        if item is not None and item.is_overdue(day):
            yield message(
                "doubt.overdue",
                kind=KIND_WORDS[item.kind],
                id=item.id,
                due=str(item.due),
            )


def _far_from_nominal(solution: Solution) -> list[Message]:
    nominal = solution.source.pen.nominal_tip
    distance = distance_from_nominal(reported(solution.calibration).tip_pen, nominal)
    if distance is None:
        return []
    return [message("doubt.far-from-nominal", distance=distance)]


def _bare_sides(solution: Solution, limits: SwingLimits) -> list[Message]:
    """Return the directions without images in recorded swings."""
    counts = dial_counts(solution.calibration.joint.rotations)[1:].sum(axis=0)
    bare = np.flatnonzero(counts == 0)
    if not (len(bare) and limits.min_per_field):
        return []
    return [too_little_tilt(limits.min_per_field * len(bare), map(int, bare))]


BEYOND_LIMIT = {
    *(Code.UNCERTAIN, Code.CAMERA_TILTS, Code.FILE_UNCERTAIN, Code.FILE_ASSUMED),
    Code.CHANGE_BEYOND_LIMIT,
}

_logger = logging.getLogger(__name__)


def accept(
    archive: FolderArchive,
    solution: Solution,
    now: datetime,
    reason: str = "",
    signature: Signature | None = None,
) -> Result:
    """Accept the tip of a recorded swing, and conclude the swing.

    Killed at any moment, it leaves either the previous result current and the swing to
    be resumed, or the new result. Accepting the same images of a swing again gives
    the result that is stored. A tip to be checked needs a reason, and a supervisor
    where the station has one (`AcceptanceError`).

    Raises `FileError` if another program writes to the record, it has changed since it
    was solved, or the result cannot be stored; the previous one stays current.
    """
    record = open_record(solution.source.folder)
    if record.header.is_press_test:
        raise AcceptanceError("press-test.not-accepted")
    with RecordWriter.resume(record) as writer:
        _require_same_images(record, solution)
        result = _stored_result(archive, record)
        if result is None:
            assessment = assess(archive, record, solution)
            require_in_use(archive, record.header.names.tip)
            _require_acceptable(assessment.verdict, reason)
            supervision, station = archive.supervision(), record.header.names.station
            key = _approval(supervision, station, assessment, signature, reason)
            result = _result(record, solution, assessment, now, reason.strip())
            if key is not None and signature is not None:
                result = replace(result, supervisor=signature.name.strip())
            archive.store(result, key)
            _logger.info("result stored of %s", record.folder)
        _conclude(writer, record, result)
    return result


def conclude_accepted(
    archive: FolderArchive, found: InterruptedSwings
) -> InterruptedSwings:
    """Conclude the interrupted swings with accepted tips; return the others."""
    interrupted = []
    for record in found.interrupted:
        result = _stored_result(archive, record)
        if result is None:
            interrupted.append(record)
            continue
        with suppress(FileError), RecordWriter.resume(record) as writer:
            _conclude(writer, record, result)
    return replace(found, interrupted=tuple(interrupted))


def takes_supervisor(
    supervision: Supervision, assessment: SwingAssessment, station: str
) -> bool:
    """Return whether only a supervisor can accept a tip.

    It is beyond the limit, or its station has no limits.
    """
    findings = assessment.verdict.reason, *assessment.doubts
    is_beyond = any(each.code in BEYOND_LIMIT for each in findings)
    return supervision.is_guarded and (is_beyond or supervision.is_unknown(station))


def _approval(
    supervision: Supervision,
    station: str,
    assessment: SwingAssessment,
    signature: Signature | None,
    reason: str,
) -> SigningKey | None:
    """Return the key of the supervisor who accepts a tip; None where it takes none."""
    if not takes_supervisor(supervision, assessment, station):
        return None
    if supervision.is_unknown(station) and (signature is None or not reason.strip()):
        raise AcceptanceError("acceptance.unknown-station", station=printable(station))
    if signature is None:
        raise AcceptanceError("acceptance.no-supervisor", why=assessment.verdict.reason)
    return require_supervisor(supervision, signature)


def require_in_use(archive: FolderArchive, name: str) -> None:
    """Reject a retired tip.

    A library that cannot be read is reported with the verdict.
    """
    with suppress(FileError):
        if archive.library().has_retired(name):
            raise AcceptanceError("acceptance.retired", tip=name)


def _require_acceptable(verdict: Verdict, reason: str) -> None:
    """Reject a tip whose grade does not allow this acceptance."""
    if verdict.grade is Grade.REPEAT:
        raise AcceptanceError("acceptance.repeat", why=verdict.reason)
    if verdict.grade is Grade.CHECK and not reason.strip():
        raise AcceptanceError("acceptance.no-reason", why=verdict.reason)


def _result(
    record: Record,
    solution: Solution,
    assessment: SwingAssessment,
    now: datetime,
    reason: str,
) -> Result:
    last, change, since = assessment.last, assessment.change, None
    if last is not None and change is not None:
        since = TipChange.of(last, change, assessment.max_change)
    return Result(
        names=assessment.names,
        accepted=now,
        grade=assessment.verdict.grade,
        record=record.folder,
        images=_images_of(record),
        calibration=calibration_record(
            solution.calibration, record_inputs(solution.source), assessment.limits
        ),
        origin=record.header.origin,
        reason=reason,
        why=StoredMessage.of(assessment.verdict.reason),
        doubts=tuple(map(StoredMessage.of, assessment.doubts)),
        change=since,
    )


def _stored_result(archive: FolderArchive, record: Record) -> Result | None:
    """Return the stored result of a record if it uses the same images as now."""
    result = archive.of_record(record.folder)
    if result is None or result.images != _images_of(record):
        return None
    return result


def _conclude(writer: RecordWriter, record: Record, result: Result) -> None:
    """Write the verdict; if that fails, it is taken from the archive next time."""
    if record.verdict != result.grade:
        with suppress(FileError):
            writer.conclude(result.grade)


def _images_of(record: Record) -> tuple[int, ...]:
    return tuple(record.numbers.tolist())


def _require_same_images(record: Record, solution: Solution) -> None:
    is_same = record.all_numbers.tolist() == solution.numbers.tolist()
    if not is_same or set(record.excluded) != set(solution.excluded):
        raise FileError("acceptance.changed", folder=record.folder)
