"""Check of results, swings and images against the hashes in their entries.

An entry has the hash of the journal of its swing as far as it went then, and each line
of that the hashes of the images of all cameras: so the entry refers to every image.
"""

from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from hashlib import sha256
from pathlib import Path

from lightpen.archive.chains.entries import Entry, FileHash, StoredEntry
from lightpen.errors import FileError
from lightpen.formats.files import start_sha256
from lightpen.messages import Message, message, printable
from lightpen.record.swings.journal import (
    JOURNAL,
    ImageLine,
    journal_bytes,
    parse_lines,
)
from lightpen.record.swings.reading import image_name, open_record


class FilesCheck:
    """Reads each file once, however many entries refer to it, and counts them.

    Without a data folder there are no files to be read.
    """

    def __init__(self, data: Path | None) -> None:
        self._data = data
        self._seen = set[FileHash]()
        self._swings = set[str]()
        self.n_files = 0

    def findings(self, entries: Iterable[StoredEntry]) -> Iterator[Message]:
        """Check the files of entries and yield the findings."""
        if self._data is None:
            return
        for each in entries:
            yield from self._findings(self._data, each.entry)

    def _findings(self, data: Path, entry: Entry) -> Iterator[Message]:
        event = entry.event
        files = [] if event.result is None else [event.result]
        if event.files and not event.swing:
            files += _with_images(data, event.files)
        elif event.files:
            if (data / event.swing).is_dir():
                files += _with_images(data, event.files)
                yield from self._unreadable(data, event.swing)
            elif event.swing not in self._swings:
                yield message(
                    "archive.swing-missing",
                    folder=printable(event.swing),
                    number=entry.number,
                )
            self._swings.add(event.swing)
        new = [file for file in files if file not in self._seen]
        self._seen.update(new)
        self.n_files += len(new)
        if new:
            with ThreadPoolExecutor() as executor:
                found = executor.map(partial(file_finding, data, entry.number), new)
                yield from filter(None, found)

    def _unreadable(self, data: Path, swing: str) -> Iterator[Message]:
        """Yield damage of a swing after the part that its entries cover."""
        if swing in self._swings:
            return
        try:
            open_record(data / swing)
        except FileError as error:
            yield error.message


def _with_images(data: Path, files: Iterable[FileHash]) -> Iterator[FileHash]:
    """Yield files, and after each journal the images that it names."""
    for file in files:
        yield file
        if Path(file.place).name == JOURNAL:
            yield from _images(data, file)


def _images(data: Path, journal: FileHash) -> Iterator[FileHash]:
    """Yield the images of all cameras that a journal named when it was entered."""
    path = data / journal.place
    try:
        content = journal_bytes(path.parent)[: journal.n_bytes]
        if sha256(content).hexdigest() != journal.sha256:
            return  # that is a separate finding
        lines = parse_lines(content.splitlines(), path.parent)
    except FileError:
        return
    folder = Path(journal.place).parent.as_posix()
    for line in lines:
        if isinstance(line, ImageLine):
            digests = [line.sha256, *(other.sha256 for other in line.others)]
            for c, digest in enumerate(digests):
                yield FileHash(f"{folder}/{image_name(line.number, c)}", digest)


def file_finding(data: Path, number: int, file: FileHash) -> Message | None:
    """Return the differences between a file and its entry."""
    path = data / file.place
    if not path.exists():
        return message(
            "archive.vouched-missing", file=printable(file.place), number=number
        )
    try:
        if start_sha256(path, file.n_bytes) == file.sha256:
            return None
    except FileError as error:
        return error.message
    return message("archive.vouched-changed", file=printable(file.place), number=number)
