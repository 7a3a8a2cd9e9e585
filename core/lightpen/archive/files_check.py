"""Whether the results, swings and images that entries vouch for are as they were."""

from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from hashlib import sha256
from pathlib import Path

from msgspec import Struct

from lightpen.archive.entries import Entry, FileHash, StoredEntry
from lightpen.errors import FileError
from lightpen.formats.files import A_FILE, printable, unreadable
from lightpen.formats.own_json import DamagedError, parse_own_json
from lightpen.messages import Message, message
from lightpen.record.swings.reading import IMAGES, open_record


class _Image(Struct):
    file: str
    sha256: str


class _Inputs(Struct, frozen=True):
    observations: tuple[_Image, ...] = ()


class _Record(Struct):
    inputs: _Inputs = _Inputs()


class FilesCheck:
    """Reads each file once, however many entries vouch for it.

    Parameters
    ----------
    data : Path or None
        Data folder; without one there are no files to be read.

    Attributes
    ----------
    n_files : int
        That were read so far.
    """

    def __init__(self, data: Path | None) -> None:
        self._data = data
        self._seen = set[FileHash]()
        self._swings = set[str]()
        self.n_files = 0

    def findings(
        self, entries: Iterable[StoredEntry], records: Mapping[str, str]
    ) -> Iterator[Message]:
        """Yield what is not right with the files of entries.

        Parameters
        ----------
        records : mapping of str to str
            Of the entries, as JSON, by their hash.
        """
        if self._data is None:
            return
        for each in entries:
            yield from self._findings(self._data, each.entry, records)

    def _findings(
        self, data: Path, entry: Entry, records: Mapping[str, str]
    ) -> Iterator[Message]:
        event = entry.event
        files = [] if event.result is None else [event.result]
        if event.files and not event.swing:
            files += event.files
        elif event.files:
            if (data / event.swing).is_dir():
                files += event.files
                files += _images(event.swing, records.get(event.record_sha256 or ""))
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
                found = executor.map(partial(_finding, data, entry.number), new)
                yield from filter(None, found)

    def _unreadable(self, data: Path, swing: str) -> Iterator[Message]:
        """Yield what is damaged of a swing behind what its entries vouch for."""
        if swing in self._swings:
            return
        try:
            open_record(data / swing)
        except FileError as error:
            yield error.message


def _images(swing: str, record: str | None) -> list[FileHash]:
    """Return the images that a record names."""
    try:
        found = parse_own_json((record or "{}").encode(), _Record)
    except DamagedError:  # which is found where records are looked at
        return []
    return [
        FileHash(f"{swing}/{IMAGES}/{image.file}", image.sha256)
        for image in found.inputs.observations
    ]


def _finding(data: Path, number: int, file: FileHash) -> Message | None:
    """Return what is not right with a file that an entry vouches for."""
    path = data / file.place
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return message(
            "archive.vouched-missing", file=printable(file.place), number=number
        )
    except OSError as error:
        return unreadable(path, A_FILE, error).message
    if sha256(content[: file.n_bytes]).hexdigest() == file.sha256:
        return None
    return message("archive.vouched-changed", file=printable(file.place), number=number)
