"""The name of a data folder's chain: the hash of its first station key.

``station.pub`` has that key, so that the notes on files and the chain of the archive
begin with the same one, whichever is first. Which keys count from then on, the signed
entries say; the file is not asked again.
"""

from contextlib import suppress
from pathlib import Path

from msgspec import Struct

from lightpen.errors import FileError, NameTakenError
from lightpen.formats.files import MEGABYTE, create_whole, read_bytes
from lightpen.formats.json_records import json_bytes
from lightpen.formats.own_json import DamagedError, parse_own_json
from lightpen.messages import message
from lightpen.record.library.signing.keys import PublicKey, chain_of, make_station_key

STATION_FILE = "station.pub"
STATION_KEY_FILE = message("file.station-key")


class _StationFile(Struct):
    station_key: PublicKey


def known_station_name(data: Path) -> str:
    """Return the name of the chain of a data folder; empty if it has not begun."""
    file = data / STATION_FILE
    if not file.exists():
        return ""
    try:
        found = parse_own_json(
            read_bytes(file, STATION_KEY_FILE, MEGABYTE), _StationFile
        )
    except DamagedError as error:
        raise FileError("signing.key-damaged", file=file) from error
    return chain_of(found.station_key)


def station_name(data: Path) -> str:
    """Return the name of the chain of a data folder, begun if need be."""
    file = data / STATION_FILE
    if not file.exists():
        public = make_station_key().public
        data.mkdir(parents=True, exist_ok=True)
        with suppress(NameTakenError):  # another program was first
            create_whole(file, json_bytes({"station_key": public}))
    return known_station_name(data)
