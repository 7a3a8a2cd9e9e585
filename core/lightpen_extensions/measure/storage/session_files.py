"""The files of verifications: a record for each task that was done, and the conclusion.

A task's record has the format that the command of its kind writes, with operator, item
and session in addition. A verification is concluded when its task is complete: accepted
if the limits are kept, else refused. One that is given up before is abandoned. Each
names all records of its session by their hashes, so that it stands for the whole. Files
of simulated pens are kept apart.
"""

import logging
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from lightpen.errors import FileError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.files import unreadable
from lightpen.formats.opened_files import InputFile, all_hashed, hashed
from lightpen.formats.own_json import file_entry, plain, record_heading
from lightpen.model.names import Origin
from lightpen.record.folder import TrialOutcome
from lightpen.record.swings.reading import DISCARDED, open_record
from lightpen.record.swings.writing import RecordWriter
from lightpen_extensions.comparisons.assessment import (
    CONCLUSION,
    VerificationAssessment,
    attributed,
    conditions_entries,
    keep_verification,
    verification_record,
    verifications_folder,
)
from lightpen_extensions.measure.probing.current_tip import CurrentTip
from lightpen_extensions.measure.probing.sources import PenCameras
from lightpen_extensions.measure.session import VerificationStatus
from lightpen_extensions.measure.storage.session_record import (
    DAMAGED,
    WHAT,
    BeginRecord,
    InterruptedVerification,
    ResumedVerification,
    SessionRecord,
    VerificationCheckpoint,
    remove_note,
    written_since,
)
from lightpen_extensions.measure.tasks.task import rule_of

_logger = logging.getLogger(__name__)


def conclusion_record(
    of: VerificationCheckpoint,
    outcome: TrialOutcome,
    at: datetime,
    files: tuple[InputFile, ...],
    found: VerificationAssessment | None = None,
) -> dict[str, Any]:
    """Return the record of a conclusion; ``files`` are all records of the session."""
    tip_file = InputFile(Path(of.tip_file), of.tip_sha256)
    record = {
        **record_heading(at),
        "verification": CONCLUSION,
        "outcome": outcome,
        "verdict": None
        if found is None
        else {"grade": found.grade.value, **plain(found.reason)},
        "inputs": {"tip": file_entry(tip_file)},
        "records": [file_entry(file) for file in files],
    }
    return attributed(record, of.names, of.origin, of.began)


def task_record(
    status: VerificationStatus, now: datetime, journal: list[dict[str, str]]
) -> dict[str, Any] | None:
    """Return the record of a complete task; None if there is none.

    ``journal`` names the images of its points.
    """
    setup, state, tip = status.setup, status.state, status.tip
    if setup is None or state is None or state.found is None or tip is None:
        return None
    task, limits = setup.task, asdict(setup.choices.limits)
    record = verification_record(
        task.kind,
        {
            "camera_serials": camera_serials(tip.instrument),
            "remarks": list(tip.instrument.remarks),
            **conditions_entries(tip.temperature_c, tip.humidity_percent),
            **task.entries(state.found, tip.instrument),
            "rejected": [],
        },
        state.found.assessment,
        {name: limits[name] for name in task.limits},
        {
            "tip": file_entry(tip.tip_file),
            **viewer_entries(tip.viewers),
            "pen": file_entry(tip.pen_file),
            "images": [],
            "touches": journal,
        },
        rule_of(setup.choices, setup.choices.limits),
    )
    return attributed(record, tip.names, tip.origin, status.began or now)


def camera_serials(instrument: Instrument) -> list[str]:
    """Return the serial number of each camera, as an entry of a record."""
    return [each.serial for each in instrument.rig.cameras]


def viewer_entries(viewers: PenCameras) -> dict[str, Any]:
    """Return the files of cameras, as inputs of a record."""
    first, *others = (file_entry(file) for file in viewers.files)
    if not others:
        return {"camera": first}
    return {"camera": others[0], "rig": first, "cameras": others}


@dataclass(frozen=True, eq=False)
class PendingRecord:
    """A record to be written, after earlier ones of its session."""

    record_of: Callable[[tuple[InputFile, ...]], Mapping[str, Any]]  # by files before
    files: list[Path]  # of its session, to which its own is added
    ends: SessionRecord | None = None  # that this record concludes


class SessionKeeping:
    """Stores points and results in a data folder as soon as they are known."""

    def __init__(
        self, data: Path, begin: BeginRecord, now: Callable[[], datetime]
    ) -> None:
        self._data = data
        self._begin = begin
        self._now = now
        self.images = SessionRecord(begin)
        self._files: list[Path] = []  # of the current session
        self._waiting: list[PendingRecord] = []

    @property
    def files(self) -> tuple[Path, ...]:
        """The written files of the current session."""
        return tuple(self._files)

    @property
    def is_behind(self) -> bool:
        """Whether something could not be written yet."""
        return bool(self._waiting)

    def root(self, tip: CurrentTip) -> Path:
        """Return the folder of the verifications of a tip."""
        is_simulated = tip.origin is Origin.SIMULATED
        return verifications_folder(self._data, is_simulated=is_simulated)

    def add_task(self, status: VerificationStatus) -> None:
        """Have the result of a complete task written, now or as soon as it can be."""
        record = task_record(status, self._now(), self.images.journal)
        if record is not None:
            self._waiting.append(PendingRecord(lambda _: record, self._files))

    def conclude(self, status: VerificationStatus, outcome: TrialOutcome) -> None:
        """Write the outcome of the verification with all its records."""
        now, of, found = self._now(), self._checkpoint(status), status.assessment
        if of is not None:
            self._waiting.append(
                PendingRecord(
                    lambda files: conclusion_record(of, outcome, now, files, found),
                    self._files,
                    self.images,
                )
            )

    def give_up(self, status: VerificationStatus) -> None:
        """Conclude an incomplete session, as another begins."""
        if status.began is not None and not status.is_done:
            self.images.end(DISCARDED)
            self.conclude(status, TrialOutcome.ABANDONED)

    def begin(self) -> None:
        """Begin another session."""
        if not any(kept.ends is self.images for kept in self._waiting):
            self.images.release()
        self._files, self.images = [], SessionRecord(self._begin)

    def release(self) -> None:
        """Close the images of sessions whose records could not be written."""
        for kept in self._waiting:
            if kept.ends is not None:
                kept.ends.release()

    def write(self) -> None:
        """Write pending records; what cannot be written stays pending."""
        while self._waiting:
            self._write(self._waiting[0])
            self._waiting.pop(0)

    def note(self, status: VerificationStatus) -> None:
        """Write the checkpoint from which the verification can be resumed."""
        checkpoint = self._checkpoint(status)
        if checkpoint is not None and not status.is_done:
            self.images.note(checkpoint)

    def take_over(self, path: Path, before: ResumedVerification) -> None:
        """Continue an interrupted verification, unless another window has it."""
        n_runs = before.under_way.n_runs
        self.images = SessionRecord.resume(path, n_runs, self._begin)
        self._files = list(before.files)

    def _write(self, kept: PendingRecord) -> None:
        """Write a record, after the files of its session before it."""
        record = kept.record_of(all_hashed(kept.files))
        is_simulated = record["origin"] == Origin.SIMULATED
        file = keep_verification(self._data, record, is_simulated=is_simulated)
        kept.files.append(file)
        _logger.info("verification written: %s", file)
        if kept.ends is not None:
            kept.ends.close()

    def _checkpoint(self, status: VerificationStatus) -> VerificationCheckpoint | None:
        """Return how far a verification is; None before its first image."""
        tip, setup, began = status.tip, status.setup, status.began
        if tip is None or setup is None or began is None:
            return None
        return VerificationCheckpoint(
            began=began,
            names=tip.names,
            origin=tip.origin,
            tip_file=tip.tip_file.path.name,
            tip_sha256=tip.tip_file.sha256,
            pen_sha256=tip.pen_file.sha256,
            seen_by=tip.viewers.hashes,
            choices=setup.choices,
            n_runs=self.images.n_runs,
        )


def abandon_interrupted(
    data: Path, interrupted: InterruptedVerification, now: datetime
) -> None:
    """Conclude an interrupted verification as abandoned; its files are kept.

    A damaged file is set aside.
    """
    under_way, path = interrupted.under_way, interrupted.path
    with _writer_of(path.parent) as writer:
        writer.conclude(DISCARDED)
        if under_way is None:
            try:
                path.replace(path.with_suffix(DAMAGED))
            except OSError as error:
                raise unreadable(path, WHAT, error) from error
            return
        root, files = path.parents[2], []
        for name in written_since(root, under_way):
            with suppress(FileError):
                files.append(hashed(root / name))
        record = conclusion_record(under_way, TrialOutcome.ABANDONED, now, tuple(files))
        is_simulated = under_way.origin is Origin.SIMULATED
        keep_verification(data, record, is_simulated=is_simulated)
        remove_note(path)


def _writer_of(folder: Path) -> RecordWriter:
    """Return the writer of a record, which may be damaged; refuse one in use."""
    try:
        record = open_record(folder)
    except FileError:
        return RecordWriter.of_damaged(folder)
    return RecordWriter.resume(record)
