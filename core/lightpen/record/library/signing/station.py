"""The station key of a data folder, and what its user account remembers of the folder.

``station.pub`` names the first key, so that the limits and the chain of the archive
begin with the same one, whichever is first. Which keys count from then on, the signed
limits and entries say; the file is not asked again.

The number of changes of limits is remembered beside the private keys, outside of the
data folder. So removed or rolled-back limits are detected even if the archive was
removed as well.
"""

from contextlib import suppress
from hashlib import sha256
from pathlib import Path

from msgspec import Struct

from lightpen.errors import FileError, NameTakenError
from lightpen.formats.files import MEGABYTE, create_whole, read_bytes, write_whole
from lightpen.formats.json_records import json_bytes
from lightpen.formats.own_json import DamagedError, Digest, parse_own_json
from lightpen.messages import message
from lightpen.record.library.signing.keys import (
    PublicKey,
    chain_of,
    key_folder,
    make_station_key,
)

STATION_FILE = "station.pub"
WHAT = message("file.station-key")


class RememberedFolder(Struct, frozen=True):
    """Memory of a user account about a data folder with a supervisor password."""

    folder: str
    n_changes: int  # files of limits
    sha256: Digest  # of the newest of them


class _StationFile(Struct):
    station_key: PublicKey


def station_name(data: Path) -> str:
    """Return the name of the first station key of a data folder, made if need be."""
    file = data / STATION_FILE
    if not file.exists():
        public = make_station_key().public
        data.mkdir(parents=True, exist_ok=True)
        with suppress(NameTakenError):  # another program was first
            create_whole(file, json_bytes({"station_key": public}))
    try:
        found = parse_own_json(read_bytes(file, WHAT, MEGABYTE), _StationFile)
    except DamagedError as error:
        raise FileError("signing.key-damaged", file=file) from error
    return chain_of(found.station_key)


def remembered(data: Path) -> RememberedFolder | None:
    """Return the entry of this user account for a data folder, if any."""
    file = memory_file(data)
    if not file.exists():
        return None
    try:
        return parse_own_json(read_bytes(file, WHAT, MEGABYTE), RememberedFolder)
    except DamagedError as error:
        raise FileError("signing.key-damaged", file=file) from error


def remember(data: Path, n_changes: int, digest: str) -> None:
    """Remember the limits of a data folder."""
    entry = RememberedFolder(str(data.absolute()), n_changes, digest)
    key_folder().mkdir(parents=True, exist_ok=True, mode=0o700)
    write_whole(memory_file(data), json_bytes(entry))


def memory_file(data: Path) -> Path:
    """Return the file in which a user account remembers a data folder."""
    place = str(data.absolute()).encode("utf-8", "surrogateescape")
    return key_folder() / f"folder-{sha256(place).hexdigest()[:32]}.json"
