"""Storage of one verification after another: images, records and checkpoint."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from lightpen.formats.hashes import InputFile, all_hashed
from lightpen.model.origin import Origin
from lightpen.record.folder.outcome import TrialOutcome
from lightpen.record.folder.verifications import (
    TOUCHES,
    keep_verification,
    verifications_folder,
)
from lightpen.record.library.signing.keys import SigningKey
from lightpen_extensions.measure.verification.probing.current_tip import CurrentTip
from lightpen_extensions.measure.verification.session.status import VerificationStatus
from lightpen_extensions.measure.verification.storage.checkpoint import (
    CheckpointFile,
    VerificationCheckpoint,
    under_way_path,
)
from lightpen_extensions.measure.verification.storage.conclusion import (
    Conclusion,
    conclusion_record,
)
from lightpen_extensions.measure.verification.storage.point_images import (
    NewRecord,
    PointImages,
)
from lightpen_extensions.measure.verification.storage.resuming import (
    ResumedVerification,
)
from lightpen_extensions.measure.verification.storage.verification_files import (
    task_record,
)

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class PendingRecord:
    """A record to be written, after earlier ones of its session."""

    record_of: Callable[[tuple[InputFile, ...]], Mapping[str, Any]]  # by files before
    is_simulated: bool
    ends: CheckpointFile | None = None  # that this record concludes
    supervisor: SigningKey | None = None  # whom the record names


def concluding(
    tip: CurrentTip, conclusion: Conclusion, ends: CheckpointFile | None
) -> PendingRecord:
    """Return the record of a conclusion, to be written when its session is."""
    return PendingRecord(
        lambda files: conclusion_record(
            tip.names, tip.origin, tip.tip_file, conclusion, files
        ),
        tip.origin is Origin.SIMULATED,
        ends=ends,
        supervisor=conclusion.supervisor_key,
    )


class SessionKeeping:
    """Stores touches and results in a data folder as soon as they are known."""

    def __init__(
        self,
        data: Path,
        new_record: Callable[[], NewRecord],
        now: Callable[[], datetime],
    ) -> None:
        self._data = data
        self._now = now
        self.images = PointImages(new_record)
        self._files: list[Path] = []  # of the current session
        self._waiting: list[tuple[PendingRecord, list[Path]]] = []  # with its files
        self._file: CheckpointFile | None = None  # of the verification under way

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
        setup, state, tip = status.setup, status.state, status.tip
        if setup is None or state is None or state.found is None or tip is None:
            return
        record = task_record(
            setup.choices.task,
            state.found,
            tip,
            setup.choices,
            status.began or self._now(),
            status.lamp_drift,
            self.images.records,
        )
        is_simulated = tip.origin is Origin.SIMULATED
        self._queue(PendingRecord(lambda _: record, is_simulated))

    def conclude(self, status: VerificationStatus, outcome: TrialOutcome) -> None:
        """Write the outcome of the verification with all its records."""
        tip, began = status.tip, status.began
        if tip is not None and began is not None:
            conclusion = Conclusion(outcome, began, self._now(), status.assessment)
            self._queue(concluding(tip, conclusion, self._file))

    def accept(self, tip: CurrentTip, conclusion: Conclusion) -> None:
        """Write the acceptance of a tip despite findings."""
        self._write(concluding(tip, conclusion, None), self._files)

    def give_up(self, status: VerificationStatus) -> None:
        """Conclude an incomplete session, as another begins."""
        self.images.begin()
        if status.began is not None and not status.is_done:
            self.conclude(status, TrialOutcome.ABANDONED)

    def begin(self) -> None:
        """Begin another session."""
        self._files, self._file = [], None

    def write(self) -> None:
        """Write pending records; what cannot be written stays pending."""
        while self._waiting:
            self._write(*self._waiting[0])
            self._waiting.pop(0)

    def note(self, status: VerificationStatus) -> None:
        """Write the checkpoint from which the verification can be resumed."""
        tip, setup, runs = status.tip, status.setup, self.images.runs
        if tip is None or setup is None or status.began is None:
            return
        if status.is_done or not runs:
            return
        if self._file is None:
            path = under_way_path(self.root(tip), tip.names, status.began)
            self._file = CheckpointFile(path)
        self._file.note(
            VerificationCheckpoint(
                began=status.began,
                names=tip.names,
                origin=tip.origin,
                tip_file=tip.tip_file.path.name,
                tip_sha256=tip.tip_file.sha256,
                pen_sha256=tip.pen_file.sha256,
                seen_by=tip.viewers.hashes,
                choices=setup.choices,
                runs=runs,
            )
        )

    def take_over(self, path: Path, before: ResumedVerification) -> None:
        """Continue an interrupted verification, unless another window has it."""
        under_way, file = before.under_way, CheckpointFile(path)
        file.hold()
        try:
            self.images.take_over(under_way.runs, self.root(before.tip) / TOUCHES)
        except BaseException:
            file.release()
            raise
        self._file, self._files = file, list(before.files)

    def _queue(self, kept: PendingRecord) -> None:
        self._waiting.append((kept, self._files))

    def _write(self, kept: PendingRecord, files: list[Path]) -> None:
        """Write a record, after the files of its session before it."""
        record = kept.record_of(all_hashed(files))
        file = keep_verification(
            self._data, record, kept.supervisor, is_simulated=kept.is_simulated
        )
        files.append(file)
        _logger.info("verification written: %s", file)
        if kept.ends is not None:
            kept.ends.conclude()
