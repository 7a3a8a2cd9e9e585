"""Signatures in the text of a JSON object: its last entries, before the checksum.

The supervisor signs the entries before, the station the supervisor's signature too.
What is signed begins with the place of the file in the data folder, so that the file
counts at no other place. As in `lightpen.formats.own_json`, no text within JSON holds
the marks.
"""

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from lightpen.formats.own_json import CHECKSUM
from lightpen.record.library.signing.keys import SigningKey, is_signed

_SUPERVISOR = b', "supervisor_signature": "'
_STATION = b', "station_signature": "'


@dataclass(frozen=True)
class Signers:
    """The keys by which a file is signed; None where no supervisor has to approve."""

    station: SigningKey
    supervisor: SigningKey | None = None

    def signed(self, text: bytes, place: str) -> bytes:
        """Return a JSON object without checksum with the signatures; see `place_in`."""
        body = text.rstrip().removesuffix(b"}").rstrip()
        if self.supervisor is not None:
            body = _with(body, _SUPERVISOR, self.supervisor, place)
        return _with(body, _STATION, self.station, place) + b"}"


@dataclass(frozen=True)
class FoundSignatures:
    """The signatures of a text, empty if missing, and the content that each signs."""

    station: str = ""
    supervisor: str = ""
    of_station: bytes = b""
    of_supervisor: bytes = b""

    def is_by_station(self, key: str) -> bool:
        """Return whether it is signed by a public key of a station."""
        return is_signed(key, self.station, self.of_station)

    def is_by_supervisor(self, key: str) -> bool:
        """Return whether it is signed by a public key of a supervisor."""
        return is_signed(key, self.supervisor, self.of_supervisor)


def signatures_of(text: bytes, place: str) -> FoundSignatures:
    """Return the signatures in the text of an object with or without a checksum."""
    body = text.rstrip()
    if CHECKSUM in body:
        body = body.rpartition(CHECKSUM)[0]
    before_station, station = _parted(body, _STATION)
    before_supervisor, supervisor = _parted(before_station, _SUPERVISOR)
    return FoundSignatures(
        station,
        supervisor,
        _content(before_station, place),
        _content(before_supervisor, place),
    )


def entries_sha256(text: bytes) -> str:
    """Return the hash of the entries of a text before its first checksum."""
    return sha256(text.partition(CHECKSUM)[0]).hexdigest()


def place_in(data: Path, file: Path) -> str:
    """Return the place of a file in a data folder."""
    return file.absolute().relative_to(data.absolute()).as_posix()


def _with(body: bytes, mark: bytes, key: SigningKey, place: str) -> bytes:
    return body + mark + key.sign(_content(body, place)).encode() + b'"'


def _parted(body: bytes, mark: bytes) -> tuple[bytes, str]:
    before, found, rest = body.rpartition(mark)
    if not found:
        return body, ""
    return before, rest.partition(b'"')[0].decode("ascii", "replace")


def _content(body: bytes, place: str) -> bytes:
    return b"lightpen file " + place.encode() + b"\n" + body
