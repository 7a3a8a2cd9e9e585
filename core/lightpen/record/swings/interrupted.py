"""Interrupted swings to be resumed or discarded, and the images of solved ones."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lightpen.detection.reasons import Reason
from lightpen.errors import FileError
from lightpen.formats.files import strerror
from lightpen.messages import Message, message
from lightpen.record.swings.header import HEADER
from lightpen.record.swings.reading import (
    DISCARDED,
    IMAGES,
    JOURNAL,
    Record,
    last_verdict,
    open_record,
)
from lightpen.record.swings.solving import Solution
from lightpen.record.swings.writing import RecordWriter, is_locked


@dataclass(frozen=True)
class DamagedSwing:
    """A swing without a verdict that cannot be read: the damage, and the remedy."""

    folder: Path
    message: Message


@dataclass(frozen=True, eq=False)
class InterruptedSwings:
    """The swings in a folder that have no verdict, each kind the newest first."""

    interrupted: tuple[Record, ...] = ()  # with images, to be resumed
    under_way: tuple[Record, ...] = ()  # recorded by another process
    damaged: tuple[DamagedSwing, ...] = ()


def find_unfinished(root: Path) -> InterruptedSwings:
    """Return the swings in a folder that have no verdict.

    Of a concluded record only the end is read, so that thousands of them cost little. A
    folder in which there is nothing of a swing is passed over, be it that a record was
    just being made when the program was killed.
    """
    try:
        folders = list(root.iterdir()) if root.is_dir() else []
    except OSError as error:
        raise FileError(
            "unfinished.folder-unreadable", folder=root, reason=strerror(error)
        ) from error
    interrupted, under_way, damaged = [], [], []
    for folder in sorted(folders, reverse=True):
        try:
            record = _read_unfinished(folder)
            if record is None:
                continue
            if is_locked(folder / JOURNAL):
                under_way.append(record)
            else:
                interrupted.append(record)
        except OSError as error:
            unreadable = message(
                "unfinished.swing-unreadable", folder=folder, reason=strerror(error)
            )
            damaged.append(DamagedSwing(folder, unreadable))
        except FileError as error:
            damaged.append(DamagedSwing(folder, error.message))
    return InterruptedSwings(
        _newest_first(interrupted), _newest_first(under_way), tuple(damaged)
    )


def discard_swing(folder: Path) -> None:
    """Conclude an interrupted swing without a verdict; the images are kept."""
    with RecordWriter.resume(open_record(folder)) as writer:
        writer.conclude(DISCARDED)


def discard_damaged(folder: Path) -> None:
    """Conclude an unreadable swing without a verdict; the files are kept.

    Only the verdict is added, so that restoring the damaged file restores the swing.
    """
    with RecordWriter.of_damaged(folder) as writer:
        writer.conclude(DISCARDED)


def _read_unfinished(folder: Path) -> Record | None:
    """Return the record in a folder if it has images and no verdict, else None."""
    journal = folder / JOURNAL
    try:
        if last_verdict(folder) is not None:
            return None
        has_lines = journal.stat().st_size > 0
    except (FileNotFoundError, NotADirectoryError):
        has_lines = False
    n_images = sum(1 for _ in (folder / IMAGES).glob("*.png"))
    if n_images == 0 and not has_lines:
        return None
    for name in (HEADER, JOURNAL):
        if not (folder / name).exists():
            raise FileError("unfinished.file-missing", folder=folder, name=name)
    record = open_record(folder)
    # A crash leaves no more than one image without a line.
    if not record.images and n_images > 1:
        raise FileError("unfinished.unknown-images", journal=journal, n_images=n_images)
    is_over = record.verdict is not None or record.header.is_press_test
    return record if record.images and not is_over else None


def _newest_first(records: list[Record]) -> tuple[Record, ...]:
    records.sort(key=lambda record: record.header.created.timestamp(), reverse=True)
    return tuple(records)


@dataclass(frozen=True)
class ImageRow:
    """One image of a solved swing."""

    number: int  # number in the record
    misfit: float  # rms residual with the tip in the cone, px; NaN without the pen
    n_leds: int  # LEDs that were seen, by all cameras together
    reason: Reason  # for not using it; `Reason.NONE` for a used one
    can_be_included: bool  # excluded by the user, or as slipped

    @property
    def is_used(self) -> bool:
        """Whether it takes part."""
        return self.reason is Reason.NONE


def worst_first(solution: Solution) -> tuple[ImageRow, ...]:
    """Return all images of a solved swing by residual; images without a pen first.

    An image keeps its place when excluded or included, but for what that changes
    of the fit.
    """
    misfits = solution.misfits
    seen = (solution.observations, *solution.others)
    n_leds = sum(np.isfinite(each.seen_pixels[..., 0]).sum(axis=1) for each in seen)
    order = np.argsort(-np.nan_to_num(misfits, nan=np.inf), kind="stable")
    return tuple(
        ImageRow(
            number=int(solution.numbers[i]),
            misfit=float(misfits[i]),
            n_leds=int(n_leds[i]),
            reason=solution.calibration.reasons[i],
            can_be_included=int(solution.numbers[i]) in solution.excluded,
        )
        for i in order.tolist()
    )


def count_left_out(solution: Solution) -> Mapping[Reason, int]:
    """Return the number of excluded images by reason, the most frequent first."""
    counts = Counter(reason for reason in solution.calibration.reasons if reason)
    return dict(counts.most_common())
