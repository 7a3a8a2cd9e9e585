"""An interrupted verification: read back to resume it, or concluded as abandoned.

Points are measured again from the LED centres in the records of the touches, run by
run, which gives the same results. An incomplete touch does not count. Fixed lamps are
searched again in the images of these records.
"""

from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from lightpen.errors import FileError, LightpenError, UsageError
from lightpen.formats.hashes import InputFile, hashed
from lightpen.messages import printable
from lightpen.model.origin import Origin
from lightpen.record.folder.outcome import TrialOutcome
from lightpen.record.folder.verifications import (
    TOUCHES,
    keep_verification,
    verifications_folder,
)
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.swings.interrupted import discard_swing
from lightpen.record.swings.reading import Record, RecordedImage, open_record
from lightpen.runners.serial_queue import Report
from lightpen.swing.preparation import Preparation
from lightpen_extensions.measure.verification.probing.current_tip import (
    CurrentTip,
    read_tip_in_force,
)
from lightpen_extensions.measure.verification.probing.drift_reference import (
    LampObservations,
    lamps_in,
)
from lightpen_extensions.measure.verification.probing.image_locations import touch_place
from lightpen_extensions.measure.verification.probing.sources import observe_place
from lightpen_extensions.measure.verification.session.session import (
    run_again,
    setup_of,
    touch_again,
)
from lightpen_extensions.measure.verification.session.session_state import (
    SessionSetup,
    SessionState,
    with_drift,
)
from lightpen_extensions.measure.verification.storage.checkpoint import (
    CheckpointFile,
    InterruptedVerification,
    VerificationCheckpoint,
    written_since,
)
from lightpen_extensions.measure.verification.storage.conclusion import (
    Conclusion,
    conclusion_record,
)
from lightpen_extensions.measure.verification.storage.point_images import (
    CONCLUDED,
    touch_image_name,
)
from lightpen_extensions.measure.verification.tasks.probed_point import (
    ProbingFrame,
    StillFrames,
    measure_touches,
)


@dataclass(frozen=True, eq=False)
class ResumedVerification:
    """State of a verification at its interruption."""

    under_way: VerificationCheckpoint
    tip: CurrentTip
    setup: SessionSetup
    state: SessionState
    files: tuple[Path, ...]  # records written of it
    lamps: LampObservations  # in the images of touches


def resume_verification(
    archive: FolderArchive,
    data: Path,
    preparation: Preparation,
    under_way: VerificationCheckpoint,
    report: Report,
) -> ResumedVerification:
    """Return an interrupted verification with its results and touches.

    The preparation has the names and files of the session. Raises `LightpenError` if
    another tip is current by now, other files are chosen, or a record of touches
    cannot be read.
    """
    tip = read_tip_in_force(archive, preparation)
    _require_same(tip, under_way)
    root = _root(data, under_way)
    setup, state = setup_of(tip, under_way.choices), SessionState()
    task = under_way.choices.task
    lamps, cameras = LampObservations(), setup.instrument.rig.cameras
    for n, run in enumerate(under_way.runs, start=1):
        record = open_record(root / TOUCHES / run.folder)
        held = _held_in(record, under_way.choices.frames_of(task))
        lamps = lamps.then(_lamps_in(record, setup))
        drifted = with_drift(setup, lamps.lamp_drift(cameras, setup.choices.limits))
        if record.verdict == CONCLUDED:
            touches = measure_touches(setup.instrument, held)
            state = run_again(drifted, state, touches, is_last=run.is_last)
        else:
            state = touch_again(drifted, state, held)
        report(n / len(under_way.runs))
    since = written_since(root, under_way)
    files = tuple(root / name for name in since.files)
    return ResumedVerification(under_way, tip, setup, state, files, lamps)


def abandon_interrupted(
    data: Path, interrupted: InterruptedVerification, now: datetime
) -> None:
    """Conclude an interrupted verification as abandoned; its files are kept.

    A damaged file is set aside.
    """
    under_way, held = interrupted.under_way, CheckpointFile(interrupted.path)
    held.hold()
    if under_way is None:
        held.put_aside()
        return
    root = _root(data, under_way)
    for run in under_way.runs:
        with suppress(FileError):  # a missing or damaged one is reported elsewhere
            if open_record(root / TOUCHES / run.folder).verdict is None:
                discard_swing(root / TOUCHES / run.folder)
    files = []
    for name in written_since(root, under_way).files:
        with suppress(FileError):
            files.append(hashed(root / name))
    record = conclusion_record(
        under_way.names,
        under_way.origin,
        InputFile(Path(under_way.tip_file), under_way.tip_sha256),
        Conclusion(TrialOutcome.ABANDONED, under_way.began, now),
        tuple(files),
    )
    is_simulated = under_way.origin is Origin.SIMULATED
    keep_verification(data, record, is_simulated=is_simulated)
    held.conclude()


def _root(data: Path, under_way: VerificationCheckpoint) -> Path:
    is_simulated = under_way.origin is Origin.SIMULATED
    return verifications_folder(data, is_simulated=is_simulated)


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


def _lamps_in(record: Record, setup: SessionSetup) -> LampObservations:
    """Return the lamps in the images of a record; empty if they are missing."""
    with suppress(LightpenError):  # the touches are known without their images
        place = touch_place((str(record.folder),))
        return lamps_in(observe_place(place, setup.instrument))
    return LampObservations()


def _held_in(record: Record, n_frames: int) -> tuple[StillFrames, ...]:
    """Return the touches in a record that are complete."""
    by_touch: dict[int, list[RecordedImage]] = {}
    for image in record.used_images:
        by_touch.setdefault(image.touch, []).append(image)
    return tuple(
        StillFrames(tuple(map(_frame, images)), approach_cam=images[0].approach_cam)
        for images in by_touch.values()
        if len(images) >= n_frames
    )


def _frame(image: RecordedImage) -> ProbingFrame:
    return ProbingFrame(
        touch_image_name(image.number),
        image.rig_pixels,
        image.rotation,
        image.translation,
    )
