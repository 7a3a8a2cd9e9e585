"""Writing the record of a swing, as `lightpen.record.swings.reading` describes it."""

import os
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from datetime import datetime
from hashlib import sha256
from io import FileIO
from itertools import chain, count
from pathlib import Path
from types import TracebackType
from typing import IO, Self

import numpy as np

from lightpen.arrays import FloatArray, Image
from lightpen.cameras.protocol import Stats
from lightpen.errors import FileError
from lightpen.formats.decoding import encode_png
from lightpen.formats.files import sync_folder, why_unwritten, write_whole
from lightpen.formats.part_files import NO_LOCKS, locked, sweep_parts, unlock
from lightpen.record.swings.header import (
    HEADER,
    Header,
    Names,
    folder_name,
    header_bytes,
    header_copies,
)
from lightpen.record.swings.reading import (
    JOURNAL,
    OPENER,
    ExcludedLine,
    Line,
    MoreLine,
    OutLine,
    Record,
    RecordedImage,
    SecondaryImage,
    VerdictLine,
    image_name,
    images_folder,
    line_bytes,
    open_record,
    sound_length,
)

# One program at a time writes to a record.
#
# The lock is one of the operating system on the open journal: it goes when the process
# ends, however it ends, and there is no file of its own that could be left behind. It
# keeps writers from each other; reading needs no lock and is never kept out. A network
# disk without locks is written to without this protection.


PATIENCE = 0.5  # s, wait for a reader or a closing process to release the lock


def lock_journal(journal: IO[bytes], folder: Path) -> None:
    """Keep other writers out until the journal is unlocked, or the process ends.

    Raises `FileError` if another program writes to the record.
    """
    if not _is_taken_over(journal.fileno(), shared=False):
        raise FileError("record.locked", folder=folder)


def unlock_journal(journal: IO[bytes]) -> None:
    """Let other writers in."""
    try:
        unlock(journal.fileno())
    except OSError as error:
        if error.errno not in NO_LOCKS:
            raise


def is_locked(path: Path) -> bool:
    """Return whether a program writes to the record of a journal."""
    with path.open("rb") as journal:
        if not _is_taken_over(journal.fileno(), shared=True):
            return True
        unlock_journal(journal)
    return False


def _is_taken_over(descriptor: int, shared: bool) -> bool:
    try:
        return locked(descriptor, shared=shared, patience_s=PATIENCE)
    except OSError as error:
        if error.errno in NO_LOCKS:
            return True
        raise


OPENER_TEXT = b"Open this file to see the swing of this folder in Lightpen.\n"


@dataclass(frozen=True, eq=False)
class SecondaryView:
    """Simultaneous image of another camera, as `RecordWriter.append` takes it."""

    image: Image
    pixels: FloatArray
    device_time_ns: int | None


class RecordWriter:
    """Appends to a record; every method returns when its data is on the disk.

    No other writer can be made of the record, by this program or another, until it is
    closed.
    """

    def __init__(self, folder: Path, next_number: int, length: int) -> None:
        self._folder = folder
        self._next_number = next_number
        self._length = length
        self._journal = _own_journal(folder, length)

    @classmethod
    def create(cls, folder: Path, header: Header, *, is_swing: bool = True) -> Self:
        """Create a record in a folder that does not exist or is empty.

        The file manager opens a swing, not touches, with the program.
        """
        if folder.is_dir() and any(folder.iterdir()):
            raise FileError("record.not-empty", folder=folder)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            (folder / JOURNAL).touch(exist_ok=False)
        except OSError as error:
            raise _unwritable(folder, error) from error
        with ExitStack() as stack:
            writer = cls(folder, 1, 0)  # locked from here on
            stack.callback(writer.close)
            copies = header_copies(header)
            try:
                for c in range(len(header.cameras)):
                    (folder / images_folder(c)).mkdir()
            except OSError as error:
                raise _unwritable(folder, error) from error
            for name, copy in copies.items():
                if not copy.data:  # of a header that was read
                    raise ValueError(f"The content of {name} is missing.")
                write_whole(folder / name, copy.data)
            write_whole(folder / HEADER, header_bytes(header))
            if is_swing:
                write_whole(folder / OPENER, OPENER_TEXT)
            _sync_folder(folder)
            _sync_folder(folder.parent)
            stack.pop_all()
        return writer

    @classmethod
    def resume(cls, record: Record) -> Self:
        """Resume a record; incomplete data after a crash is overwritten.

        Raises `FileError` if another program writes to the record or did so since.
        """
        writer = cls(record.folder, record.next_number, record.length)
        for c in range(len(record.header.cameras)):
            sweep_parts(record.folder / images_folder(c))
        return writer

    @classmethod
    def of_damaged(cls, folder: Path) -> Self:
        """Write into the journal of a record that cannot be read, to conclude it."""
        length = sound_length(folder) if (folder / JOURNAL).exists() else 0
        return cls(folder, 1, length)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def next_number(self) -> int:
        """Number that the next image gets."""
        return self._next_number

    def append(
        self,
        image: Image,
        pixels: FloatArray,
        rotation: FloatArray,
        translation: FloatArray,
        time: float,
        device_time_ns: int | None = None,
        stats: Stats | None = None,
        others: Sequence[SecondaryView] = (),
        touch: int = 0,
        run: int = 0,
        approach: FloatArray | None = None,
    ) -> int:
        """Record an image (H, W), or simultaneous ones, and return its number.

        That acknowledges that it is on the disk, as are all before it if
        `FileError` is raised. See
        `lightpen.record.swings.reading.RecordedImage` for what is recorded of
        it; the others are those of the other cameras of a rig, in their order.
        """
        number = self._next_number
        digest = self._write_image(image, number, 0)
        other_images = tuple(
            SecondaryImage(
                self._write_image(other.image, number, c),
                other.device_time_ns,
                tuple(map(_point, other.pixels)),
            )
            for c, other in enumerate(others, start=1)
        )
        self._write_line(
            RecordedImage(
                number=number,
                sha256=digest,
                time=time,
                device_time_ns=device_time_ns,
                pixels=tuple(map(_point, pixels)),
                rotation=rotation.tolist(),
                translation=translation.tolist(),
                camera=stats,
                others=other_images,
                touch=touch,
                run=run,
                approach=None if approach is None else tuple(approach.tolist()),
            )
        )
        self._next_number = number + 1
        return number

    def _write_image(self, image: Image, number: int, c: int) -> str:
        """Put an image of the c-th camera on the disk, and return its checksum."""
        data = encode_png(image)
        path = self._folder / image_name(number, c)
        write_whole(path, data)
        _sync_folder(path.parent)
        return sha256(data).hexdigest()

    def exclude(self, numbers: Sequence[int], reason: str) -> None:
        """Leave images out of the calibration; they stay on the disk."""
        self._write_line(OutLine(tuple(numbers), str(reason)))

    def set_excluded(self, excluded: Mapping[int, str]) -> None:
        """Exclude exactly these images from the calibration, each with a reason.

        It is one line, so that a kill leaves all of an edit or nothing.
        """
        reasons: dict[str, tuple[int, ...]] = {}
        for number, reason in sorted(excluded.items()):
            reasons[reason] = (*reasons.get(reason, ()), number)
        self._write_line(ExcludedLine(reasons))

    def ask_for_more(self, min_images: int, max_images: int) -> None:
        """Record that the swing continues up to a number of images."""
        self._write_line(MoreLine(min_images, max_images))

    def conclude(self, verdict: str) -> None:
        """Write the verdict: the swing is no longer interrupted."""
        self._write_line(VerdictLine(str(verdict)))

    def close(self) -> None:
        """Close and unlock the journal."""
        if self._journal.closed:
            return
        with self._journal, suppress(OSError):  # closing unlocks it anyway
            unlock_journal(self._journal)

    def _write_line(self, entries: Line) -> None:
        line = line_bytes(entries)
        length = len(line)
        try:
            # Rest of a line after a crash or a failed write.
            self._journal.truncate(self._length)
            while line:
                line = line[self._journal.write(line) :]
            os.fsync(self._journal.fileno())
        except OSError as error:
            with suppress(OSError):
                self._journal.truncate(self._length)
            raise _unwritable(self._folder / JOURNAL, error) from error
        self._length += length


def make_record_folder(root: Path, names: Names, now: datetime) -> Path:
    """Make a folder for a record among the others, with a name that none had.

    Of two programs that do so in the same second each gets its own.
    """
    name = folder_name(names, now)
    try:
        root.mkdir(parents=True, exist_ok=True)
        for tail in chain([""], map("-{}".format, count(2))):
            with suppress(FileExistsError):
                (folder := root / (name + tail)).mkdir()
                break
    except OSError as error:
        raise _unwritable(root, error) from error
    return folder


def note_excluded(folder: Path, excluded: Mapping[int, str]) -> None:
    """Note the numbers of all images of a record that take no part, and why."""
    record = open_record(folder)
    with RecordWriter.resume(record) as writer:
        if record.excluded != excluded:
            writer.set_excluded(excluded)


def _own_journal(folder: Path, length: int) -> FileIO:
    """Open a journal of ``length`` bytes exclusively; refuse another length."""
    path = folder / JOURNAL
    with ExitStack() as stack:
        try:
            journal = stack.enter_context(path.open("ab", buffering=0))
            lock_journal(journal, folder)
            if sound_length(folder) != length:
                raise FileError("record.changed-meanwhile", folder=folder)
        except OSError as error:
            raise _unwritable(path, error) from error
        stack.pop_all()
    return journal


def _point(point: FloatArray) -> tuple[float, float] | None:
    return (float(point[0]), float(point[1])) if np.isfinite(point).all() else None


def _unwritable(path: Path, error: OSError) -> FileError:
    return FileError("record.unwritable", path=path, reason=why_unwritten(error))


def _sync_folder(folder: Path) -> None:
    """Put the names in a folder on the disk."""
    try:
        sync_folder(folder)
    except OSError as error:
        raise _unwritable(folder, error) from error
