"""A verification on disk: the images of its points, and how far it is.

The images are one record, see `lightpen.record.swings.reading`: an image is written,
with the numbers of point and run, before it counts; one that no longer counts is
excluded. So a session can be read like any recorded images. Beside them a file says
what is verified and how far. It is replaced whole at each step and removed with the
conclusion; a record that has it and that no program writes to was interrupted. When it
is resumed, its points are measured again from the LED centres in the record, which
gives the same results; an incomplete point does not count.
"""

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Self, TypeAlias

from msgspec import Struct, to_builtins

from lightpen.arrays import FloatArray
from lightpen.cameras.protocol import Frame
from lightpen.detection.pen_detection import PenDetection
from lightpen.errors import FileError, UsageError
from lightpen.formats.files import (
    LARGEST_RECORD,
    MEGABYTE,
    read_bytes,
    sync_folder,
    unreadable,
    write_whole,
)
from lightpen.formats.opened_files import hashed
from lightpen.formats.own_json import (
    DamagedError,
    Digest,
    ZonedTime,
    parse_checked,
    parse_own_json,
    require_usual,
    with_checksum,
)
from lightpen.formats.part_files import sweep_parts
from lightpen.messages import Message, message, printable
from lightpen.model.names import Origin
from lightpen.record.folder import TOUCHES, VERIFICATIONS
from lightpen.record.library.entered_files import numbered_files
from lightpen.record.results.result_folder import SIMULATED, FolderArchive
from lightpen.record.swings.header import Header, Names
from lightpen.record.swings.reading import JOURNAL, open_record
from lightpen.record.swings.writing import RecordWriter, SecondaryView, is_locked
from lightpen.swing.preparation import Preparation
from lightpen_extensions.comparisons.assessment import CONCLUSION
from lightpen_extensions.measure.probing.current_tip import (
    CurrentTip,
    read_tip_in_force,
)
from lightpen_extensions.measure.probing.instruments import see_together
from lightpen_extensions.measure.probing.probing import ProbingPhase, approach_of
from lightpen_extensions.measure.probing.sources import held_in, point_image_name
from lightpen_extensions.measure.session import (
    SessionSetup,
    SessionState,
    SessionTransition,
    advance_session,
    run_again,
    setup_of,
    touch_again,
)
from lightpen_extensions.measure.tasks.task import VerificationChoices

SESSION, DAMAGED = "session.json", ".damaged"
CONCLUDED = "concluded"
NOT_COUNTED = "not counted"
WHAT = message("file.under-way")
BeginRecord: TypeAlias = Callable[[], tuple[Path, Header]]  # makes the folder


class VerificationCheckpoint(Struct, frozen=True):
    """A verification that began and is not concluded."""

    began: ZonedTime
    names: Names
    origin: Origin
    tip_file: str  # name of the result that is verified
    tip_sha256: Digest
    pen_sha256: Digest
    seen_by: tuple[Digest, ...]  # of the camera files
    choices: VerificationChoices
    n_runs: int = 0  # that are complete

    def __post_init__(self) -> None:
        require_usual(self.began)


@dataclass(frozen=True)
class InterruptedVerification:
    """A verification that no window holds, or why it cannot be resumed."""

    path: Path  # of its file, in the record of its images
    under_way: VerificationCheckpoint | None
    fault: Message | None = None


class SessionRecord:
    """Keeps the images of one session; no other program writes to it meanwhile."""

    def __init__(self, begin: BeginRecord) -> None:
        self._begin = begin
        self._folder: Path | None = None
        self._writer: RecordWriter | None = None
        self._numbers: dict[str, int] = {}  # of images of this run that count, by name
        self._point = 1  # of the next image
        self.n_runs = 0  # that are complete
        self._noted: VerificationCheckpoint | None = None

    @classmethod
    def resume(cls, path: Path, n_runs: int, begin: BeginRecord) -> Self:
        """Continue an interrupted session; refuse if another program has it."""
        record = open_record(path.parent)
        resumed = cls(begin)
        resumed._writer = RecordWriter.resume(record)
        sweep_parts(path.parent)
        resumed._folder, resumed.n_runs = path.parent, n_runs
        resumed._numbers = {
            point_image_name(image.number): image.number
            for image in record.used_images
            if image.run > n_runs
        }
        resumed._point = 1 + max((image.touch for image in record.images), default=0)
        return resumed

    @property
    def journal(self) -> list[dict[str, str]]:
        """Folder and hash of the journal, for a record; empty without one."""
        if self._folder is None:
            return []
        digest = hashed(self._folder / JOURNAL).sha256
        return [{"folder": self._folder.name, "journal_sha256": digest}]

    def process_image(
        self,
        setup: SessionSetup,
        state: SessionState,
        frame: Frame,
        detection: PenDetection,
    ) -> SessionTransition:
        """Process an image and return the transition of the verification.

        An image of a point is put on the disk before it counts.
        """
        touching, rules, instrument = state.touching, setup.rules, setup.instrument
        seen = see_together(instrument.rig, instrument.pen, detection)
        name, is_holding = str(frame.seq), touching.phase is ProbingPhase.HOLDING
        may_count = is_holding and len(touching.held) >= rules.n_settling
        if may_count and seen.has_pose and not seen.is_blurred:
            tip_cam = seen.rotation @ instrument.tip_pen + seen.translation
            name = self.keep(frame, seen, approach_of(touching, tip_cam))
        transition = advance_session(setup, state, name, seen)
        self.follow(state, transition)
        return transition

    def keep(
        self, frame: Frame, seen: PenDetection, approach: FloatArray | None = None
    ) -> str:
        """Put an image on the disk, and return its name in the record."""
        if self._writer is None:
            folder, header = self._begin()
            self._writer = RecordWriter.create(folder, header, is_swing=False)
            self._folder = folder
        others = frame.others[: len(seen.others)]
        number = self._writer.append(
            frame.image,
            seen.pixels,
            seen.rotation,
            seen.translation,
            frame.host_ts_ns * 1e-9,
            frame.device_ts_ns,
            others=[
                SecondaryView(other.image, view.pixels, other.device_ts_ns)
                for other, view in zip(others, seen.others, strict=True)
            ],
            touch=self._point,
            run=self.n_runs + 1,
            approach=approach,
        )
        name = point_image_name(number)
        self._numbers[name] = number
        return name

    def follow(self, before: SessionState, transition: SessionTransition) -> None:
        """Exclude images that no longer count, and end a completed run."""
        state = transition.state
        is_over = transition.finished is not None
        has_ended = is_over or len(state.runs) > len(before.runs)
        counting = before if has_ended else state
        touching = counting.touching
        names = {frame.name for still in touching.taken for frame in still.frames}
        if has_ended:
            names.update(transition.recorded)
        else:
            deviating = () if touching.deviating is None else (touching.deviating,)
            held = touching.held if touching.phase is ProbingPhase.HOLDING else ()
            names.update(seen.frame.name for seen in (*held, *deviating))
        self._point += bool(transition.recorded)
        self._exclude([name for name in self._numbers if name not in names])
        if has_ended:
            self._numbers = {}
            self.n_runs += 1
        if is_over:
            self.end(CONCLUDED)

    def note(self, value: VerificationCheckpoint) -> None:
        """Write how far the session is, if that has changed."""
        if self._folder is None or value == self._noted:
            return
        text = json.dumps(to_builtins(value), allow_nan=False)
        write_whole(self._folder / SESSION, with_checksum(text.encode()))
        self._noted = value

    def end(self, verdict: str) -> None:
        """Conclude the images; the session stays open until it is closed."""
        if self._writer is not None:
            self._writer.conclude(verdict)

    def close(self) -> None:
        """Close the session: its conclusion is written."""
        if self._folder is not None:
            remove_note(self._folder / SESSION)
        self.release()

    def release(self) -> None:
        """Let another program take over."""
        if self._writer is not None:
            self._writer.close()

    def _exclude(self, names: list[str]) -> None:
        if names and self._writer is not None:
            self._writer.exclude([self._numbers[name] for name in names], NOT_COUNTED)
            for name in names:
                del self._numbers[name]


def remove_note(path: Path) -> None:
    """Remove the file of a concluded session."""
    with suppress(OSError):
        path.unlink(missing_ok=True)
        sync_folder(path.parent)


def find_interrupted(data: Path) -> tuple[InterruptedVerification, ...]:
    """Return the verifications that no window holds, the newest first."""
    found: list[InterruptedVerification] = []
    for root in (data, data / SIMULATED):
        folder = root / VERIFICATIONS / TOUCHES
        try:
            paths = folder.glob(f"*/{SESSION}")
            found += (
                _read(path) for path in paths if not is_locked(path.parent / JOURNAL)
            )
        except OSError as error:
            raise unreadable(folder, WHAT, error) from error
    open_ones = [each for each in found if not _is_concluded(each)]
    return tuple(
        sorted(open_ones, key=lambda each: each.path.parent.name, reverse=True)
    )


def written_since(folder: Path, under_way: VerificationCheckpoint) -> dict[str, str]:
    """Return the records of a verification that is under way: file names and tasks.

    The oldest is the first.
    """
    session = under_way.began.isoformat(timespec="seconds")
    since: dict[str, str] = {}
    for file in numbered_files(folder):
        try:
            record = parse_own_json(read_bytes(file, WHAT, LARGEST_RECORD), _OfSession)
        except (FileError, DamagedError):
            continue  # reported by whoever reads the archive
        if record.created < under_way.began.replace(microsecond=0):
            break
        if record.session == session:
            since[file.name] = record.verification
    return dict(reversed(since.items()))


class _OfSession(Struct):
    created: ZonedTime
    verification: str
    session: str = ""


def _is_concluded(found: InterruptedVerification) -> bool:
    """Return whether it is concluded; then its left-over file is deleted."""
    if found.under_way is None:
        return False
    since = written_since(found.path.parents[2], found.under_way)
    if CONCLUSION not in since.values():
        return False
    remove_note(found.path)
    return True


def _read(path: Path) -> InterruptedVerification:
    try:
        data = read_bytes(path, WHAT, MEGABYTE)
        return InterruptedVerification(
            path, parse_checked(data, VerificationCheckpoint)
        )
    except FileError as error:
        return InterruptedVerification(path, None, error.message)
    except DamagedError:
        why = message("under-way.damaged", file=path)
        return InterruptedVerification(path, None, why)


@dataclass(frozen=True, eq=False)
class ResumedVerification:
    """State of a verification at its interruption."""

    under_way: VerificationCheckpoint
    tip: CurrentTip
    setup: SessionSetup
    state: SessionState
    files: tuple[Path, ...]  # records written of it


def resume_verification(
    archive: FolderArchive,
    preparation: Preparation,
    path: Path,
    under_way: VerificationCheckpoint,
) -> ResumedVerification:
    """Return an interrupted verification, whose file is at a path, with its points.

    The preparation has the names and files of the session. Raises `LightpenError` if
    another tip is current by now, other files are chosen, or the record of the points
    cannot be read.
    """
    tip = read_tip_in_force(archive, preparation)
    _require_same(tip, under_way)
    record, setup = open_record(path.parent), setup_of(tip, under_way.choices)
    n_frames, state = setup.rules.n_frames, SessionState()
    held = [(n, each) for n, each in held_in(record) if len(each.frames) >= n_frames]
    for run in range(1, under_way.n_runs + 1):
        state = run_again(setup, state, [still for n, still in held if n == run])
    now = under_way.n_runs + 1
    state = touch_again(setup, state, [still for n, still in held if n == now])
    root = path.parents[2]
    files = tuple(root / name for name in written_since(root, under_way))
    return ResumedVerification(under_way, tip, setup, state, files)


def _require_same(tip: CurrentTip, under_way: VerificationCheckpoint) -> None:
    names = under_way.names
    if tip.tip_file.sha256 != under_way.tip_sha256:
        raise UsageError(
            "under-way.other-tip",
            result=printable(under_way.tip_file),
            tip=printable(names.tip),
            pen=printable(names.pen),
        )
    is_pen = tip.pen_file.sha256 == under_way.pen_sha256
    if not is_pen or tip.viewers.hashes != under_way.seen_by:
        raise UsageError("under-way.other-files")
