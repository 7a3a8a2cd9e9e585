"""Changes of password, limits and station key of a data folder, one file each.

A file counts if it is entered, see `lightpen.record.library.entered_files`, and once
there is a password, if a supervisor approved it. All files have the mode 0600: a
password can be guessed by its salt and public key.
"""

from pathlib import Path
from typing import Annotated, TypeAlias

from msgspec import Meta, Struct

from lightpen.errors import FileError
from lightpen.formats.files import MEGABYTE
from lightpen.formats.json_records import json_bytes
from lightpen.formats.own_json import (
    DamagedError,
    ZonedTime,
    require_usual,
    with_checksum,
)
from lightpen.formats.stored_format import LaterFormatError, parse_stored
from lightpen.messages import message
from lightpen.model.limits import StationLimits
from lightpen.record.library.entered_files import write_counted
from lightpen.record.library.numbered_files import make_folder, numbered_file
from lightpen.record.library.signing.keys import (
    PRIVATE,
    SALT_LENGTH,
    PublicKey,
    SigningKey,
    supervisor_key,
)

LIMITS_FOLDER = "limits"
LIMIT = 8 * MEGABYTE  # holds some 80,000 files
LIMITS_FILE = message("file.limits")

_Signed: TypeAlias = Annotated[str, Meta(pattern="^([0-9a-f]{128})?$")]


class PasswordVerifier(Struct, frozen=True):
    """Verifier of a password: salt, hexadecimal, and the public key by both."""

    salt: Annotated[str, Meta(pattern=f"^[0-9a-f]{{{2 * SALT_LENGTH}}}$")]
    key: PublicKey

    def key_from(self, password: str) -> SigningKey | None:
        """Return the supervisor's key, in some 0.1 s; None for another password."""
        key = supervisor_key(password, bytes.fromhex(self.salt))
        return key if key.public == self.key else None


class LimitsChange(Struct, omit_defaults=True, kw_only=True):
    """One setting: a password, limits of a station, or a station key."""

    format: int
    at: ZonedTime
    supervisor: str
    station: str = ""
    password: PasswordVerifier | None = None  # None: unchanged
    # By `Limit.key`.
    limits: dict[str, float] | None = None
    # Public key from then on
    station_key: Annotated[str, Meta(pattern="^([0-9a-f]{64})?$")] = ""
    station_key_signature: _Signed = ""  # of `key_change` by the key before
    key_approval: _Signed = ""  # and by the supervisor

    def __post_init__(self) -> None:
        require_usual(self.at)
        StationLimits().with_values(self.limits or {})


def read_limits_change(content: bytes, file: Path) -> LimitsChange:
    """Return the content of a file of limits, whether it counts or not."""
    try:
        return parse_stored(content, LimitsChange)
    except LaterFormatError as error:
        raise FileError("limits.later-version", file=file) from error
    except DamagedError as error:
        raise FileError("limits.damaged", file=file) from error


def write_limits_change(
    data: Path, number: int, change: LimitsChange, supervisor: SigningKey | None
) -> None:
    """Write a change as the file of a number, approved by a supervisor.

    Raises `NameTakenError` if another program made a change meanwhile.
    """
    file = numbered_file(data / LIMITS_FOLDER, number)
    make_folder(file.parent)
    content = with_checksum(json_bytes(change)) + b"\n"
    write_counted(data, file, content, supervisor, PRIVATE)
