"""An interrupted verification: read back to resume it.

Points are measured again from the LED centres in the record of the session, which gives
the same results. An incomplete point does not count.
"""

from dataclasses import dataclass
from pathlib import Path

from lightpen.errors import UsageError
from lightpen.messages import printable
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.swings.reading import Record, RecordedImage, open_record
from lightpen.swing.preparation import Preparation
from lightpen_extensions.measure.probing.current_tip import (
    CurrentTip,
    read_tip_in_force,
)
from lightpen_extensions.measure.session import (
    SessionSetup,
    SessionState,
    run_again,
    setup_of,
    touch_again,
)
from lightpen_extensions.measure.storage.session_record import (
    VerificationCheckpoint,
    point_image_name,
    written_since,
)
from lightpen_extensions.measure.tasks.probed_point import ProbingFrame, StillFrames


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
    held, state = _held_in(record, setup.rules.n_frames), SessionState()
    for run in range(1, under_way.n_runs + 1):
        state = run_again(setup, state, [still for n, still in held if n == run])
    now = under_way.n_runs + 1
    state = touch_again(setup, state, [still for n, still in held if n == now])
    root = path.parents[2]
    files = tuple(root / name for name in written_since(root, under_way).files)
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


def _held_in(record: Record, n_frames: int) -> list[tuple[int, StillFrames]]:
    """Return the points in a record that are complete, with their runs."""
    by_point: dict[int, list[RecordedImage]] = {}
    for image in record.used_images:
        by_point.setdefault(image.touch, []).append(image)
    return [
        (own[0].run, StillFrames(tuple(map(_frame, own)), (), own[0].approach_cam))
        for own in by_point.values()
        if len(own) >= n_frames
    ]


def _frame(image: RecordedImage) -> ProbingFrame:
    return ProbingFrame(
        point_image_name(image.number),
        image.rig_pixels,
        image.rotation,
        image.translation,
    )
