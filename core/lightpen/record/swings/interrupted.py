"""Interrupted swings: found, resumed or discarded."""

from dataclasses import dataclass
from pathlib import Path

from lightpen.errors import FileError
from lightpen.formats.system_reasons import strerror
from lightpen.messages import Message, message
from lightpen.record.swings.header import HEADER
from lightpen.record.swings.journal import JOURNAL, last_verdict
from lightpen.record.swings.lock import is_locked
from lightpen.record.swings.reading import (
    DISCARDED,
    IMAGES,
    Record,
    is_press_test,
    open_record,
)
from lightpen.record.swings.writing import RecordWriter


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
    is_over = record.verdict is not None or is_press_test(record)
    return record if record.images and not is_over else None


def _newest_first(records: list[Record]) -> tuple[Record, ...]:
    records.sort(key=lambda record: record.header.created.timestamp(), reverse=True)
    return tuple(records)
