"""An interrupted swing: found, read back to go on with it, or set aside for good."""

from dataclasses import dataclass
from pathlib import Path

from lightpen.errors import FileError
from lightpen.formats.files import printable
from lightpen.formats.system_reasons import strerror
from lightpen.record.header import HEADER
from lightpen.record.journal import JOURNAL, last_verdict
from lightpen.record.lock import is_locked
from lightpen.record.reading import DISCARDED, IMAGES, Record, open_record
from lightpen.record.writing import RecordWriter
from lightpen.sentences import Sentence, sentence


@dataclass(frozen=True)
class DamagedSwing:
    """A swing without a verdict that cannot be read.

    Attributes
    ----------
    sentence : Sentence
        What is damaged, and what to do.
    """

    folder: Path
    sentence: Sentence


@dataclass(frozen=True, eq=False)
class Unfinished:
    """The swings in a folder that have no verdict, each kind the newest first.

    Attributes
    ----------
    interrupted : tuple of Record
        Those that wait to be gone on with; they have images.
    under_way : tuple of Record
        Those that somebody writes to just now.
    """

    interrupted: tuple[Record, ...] = ()
    under_way: tuple[Record, ...] = ()
    damaged: tuple[DamagedSwing, ...] = ()


def find_unfinished(root: Path) -> Unfinished:
    """Return the swings in a folder that have no verdict.

    Of a concluded record only the end is read, so that thousands of them cost little. A
    folder in which there is nothing of a swing is passed over, be it that a record was
    just being made when the program was killed.

    Raises
    ------
    FileError
        The folder of the records itself cannot be read.
    """
    try:
        folders = list(root.iterdir()) if root.is_dir() else []
    except OSError as error:
        raise FileError(
            sentence(
                "unfinished.folder-unreadable",
                "The folder {folder} cannot be read: {reason}. Interrupted swings "
                "in it are not offered; make sure that it is yours to read.",
                folder=printable(str(root)),
                reason=strerror(error),
            )
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
            unreadable = sentence(
                "unfinished.swing-unreadable",
                "The swing in {folder} cannot be read: {reason}. Make sure that it is "
                "yours to read, or move the folder away.",
                folder=printable(str(folder)),
                reason=strerror(error),
            )
            damaged.append(DamagedSwing(folder, unreadable))
        except FileError as error:
            damaged.append(DamagedSwing(folder, error.sentence))
    return Unfinished(
        _newest_first(interrupted), _newest_first(under_way), tuple(damaged)
    )


def discard_swing(folder: Path) -> None:
    """Conclude an interrupted swing without a verdict; its images are kept.

    Raises
    ------
    FileError
        The record cannot be read or written.
    """
    with RecordWriter.resume(open_record(folder)) as writer:
        writer.conclude(DISCARDED)


def discard_damaged(folder: Path) -> None:
    """Conclude a swing that cannot be read, without a verdict; its files are kept.

    Nothing but the verdict is added, so that whoever restores the damaged file has the
    swing as it was.

    Raises
    ------
    FileError
        The record cannot be written.
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
            raise FileError(
                sentence(
                    "unfinished.file-missing",
                    "{folder} holds images of a swing, but no {name}. Restore this "
                    "file from a copy, or move the folder away.",
                    folder=printable(str(folder)),
                    name=name,
                )
            )
    record = open_record(folder)
    # A crash leaves no more than one image without a line.
    if not record.images and n_images > 1:
        raise FileError(
            sentence(
                "unfinished.unknown-images",
                "{journal} knows none of the {n_images} images in its folder. "
                "Restore this file from a copy.",
                journal=printable(str(journal)),
                n_images=n_images,
            )
        )
    return record if record.images and record.verdict is None else None


def _newest_first(records: list[Record]) -> tuple[Record, ...]:
    records.sort(key=lambda record: record.header.created.timestamp(), reverse=True)
    return tuple(records)
