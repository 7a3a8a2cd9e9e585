"""Who may change the limits of a station, and every change that was made.

Each change is a file of its own in the data folder, numbered in their order and never
changed: the newest password counts, and of each station the newest limits. A password
is kept as Argon2 makes it [1]_: what is on the disk tells nobody what it is.

References
----------
.. [1] RFC 9106, "Argon2 Memory-Hard Function for Password Hashing and Proof-of-Work
   Applications", 2021.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path

from msgspec import Struct, structs

from lightpen.errors import AcceptanceError, FileError
from lightpen.formats import upgrades
from lightpen.formats.files import MEGABYTE, printable, read_bytes
from lightpen.formats.json_records import record_bytes
from lightpen.formats.own_json import DamagedError, ZonedTime, require_usual
from lightpen.formats.upgrades import LaterFormatError, newest_format, parse_upgraded
from lightpen.messages import message
from lightpen.model.limits import LIMITS, StationLimits
from lightpen.record.library.numbered_files import add_numbered, numbered_files

LIMITS_FOLDER = "limits"
WHAT = message("file.limits")
LEAST_PASSWORD = 8  # characters


@dataclass(frozen=True)
class Signature:
    """Who signs as a supervisor, by name and password."""

    name: str
    password: str = field(repr=False)


@dataclass(frozen=True)
class Supervision:
    """What the supervisors of a data folder have laid down.

    Attributes
    ----------
    password_hash : str
        Empty where there is no password: then anybody may change limits.
    limits : mapping of str to StationLimits
        Limits by station name.
    """

    password_hash: str = ""
    limits: Mapping[str, StationLimits] = field(default_factory=dict)

    @property
    def is_guarded(self) -> bool:
        """Whether it takes a supervisor to change limits and to go beyond them."""
        return bool(self.password_hash)

    def limits_at(self, station: str, chosen: StationLimits) -> StationLimits:
        """Return the limits of a station: set by a supervisor, or chosen."""
        return self.limits.get(station, chosen)


class LimitsChange(Struct, omit_defaults=True):
    """What was laid down at one time: a password, or the limits of a station.

    Attributes
    ----------
    password : str
        Argon2 hash; empty if unchanged.
    limits : mapping of str to float or None
        Limits by `Limit.key`; None if only the password was changed.
    """

    format: int
    at: ZonedTime
    supervisor: str
    station: str = ""
    password: str = ""
    limits: dict[str, float] | None = None

    def __post_init__(self) -> None:
        require_usual(self.at)
        StationLimits().with_values(self.limits or {})


def read_supervision(data: Path) -> Supervision:
    """Read the supervision of a data folder.

    Raises
    ------
    FileError
        It cannot be read, or was changed: an older limit must not count again in
        silence.
    """
    password, limits = "", dict[str, StationLimits]()
    for file in reversed(numbered_files(data / LIMITS_FOLDER)):
        change = read_limits_change(read_bytes(file, WHAT, MEGABYTE), file)
        password = change.password or password
        if change.limits is not None:
            limits[change.station] = StationLimits().with_values(change.limits)
    return Supervision(password, limits)


def read_limits_change(content: bytes, file: Path) -> LimitsChange:
    """Read a limits file.

    Raises
    ------
    FileError
        It was changed since.
    """
    try:
        return parse_upgraded(content, LimitsChange, upgrades.LIMITS)
    except LaterFormatError as error:
        raise FileError("limits.later-version", file=printable(str(file))) from error
    except DamagedError as error:
        raise FileError("limits.damaged", file=printable(str(file))) from error


def set_password(data: Path, signature: Signature, new: str, now: datetime) -> None:
    """Lay down a supervisor's password; where there is one, by that one only.

    Raises
    ------
    AcceptanceError
        The present password is another one, the name is missing, or the new one is too
        short.
    FileError
        It cannot be kept.
    """
    from argon2 import PasswordHasher  # 20 ms that a start of the program need not take

    supervision = read_supervision(data)
    if supervision.is_guarded:
        require_supervisor(supervision, signature)
    else:
        _require_name(signature)
    if len(new) < LEAST_PASSWORD:
        raise AcceptanceError(
            "supervisor.short-password", length=len(new), needed=LEAST_PASSWORD
        )
    change = _change(now, signature)
    _add(data, structs.replace(change, password=PasswordHasher().hash(new)))


def set_limits(
    data: Path, station: str, limits: StationLimits, signature: Signature, now: datetime
) -> None:
    """Lay down the limits of a station.

    Raises
    ------
    AcceptanceError
        It is not signed by a supervisor.
    FileError
        It cannot be kept.
    """
    require_supervisor(read_supervision(data), signature)
    entry = {limit.key: limits.value(limit) for limit in LIMITS}
    change = _change(now, signature)
    _add(data, structs.replace(change, station=station, limits=entry))


def save_limits(
    data: Path,
    station: str,
    limits: StationLimits,
    signature: Signature,
    new_password: str,
    now: datetime,
) -> Supervision:
    """Lay down limits, and a password where there is none or a new one is given.

    Returns
    -------
    Supervision
        What is laid down now.

    Raises
    ------
    AcceptanceError
        It is not signed by a supervisor, or the password is too short.
    FileError
        It cannot be kept.
    """
    if not read_supervision(data).is_guarded:
        set_password(data, signature, signature.password, now)
    if new_password:
        set_password(data, signature, new_password, now)
        signature = replace(signature, password=new_password)
    set_limits(data, station, limits, signature, now)
    return read_supervision(data)


def require_supervisor(supervision: Supervision, signature: Signature) -> None:
    """Raise an error unless a supervisor signed.

    Raises
    ------
    AcceptanceError
        There is no password yet, it is another one, or the name is missing.
    """
    from argon2 import PasswordHasher  # as above
    from argon2.exceptions import InvalidHashError, VerifyMismatchError

    _require_name(signature)
    if not supervision.is_guarded:
        raise AcceptanceError("supervisor.no-password")
    try:
        PasswordHasher().verify(supervision.password_hash, signature.password)
    except (VerifyMismatchError, InvalidHashError) as error:
        raise AcceptanceError("supervisor.wrong-password") from error


def _require_name(signature: Signature) -> None:
    if not signature.name.strip():
        raise AcceptanceError("supervisor.no-name")


def _change(now: datetime, signature: Signature) -> LimitsChange:
    return LimitsChange(newest_format(upgrades.LIMITS), now, signature.name)


def _add(data: Path, change: LimitsChange) -> None:
    add_numbered(data / LIMITS_FOLDER, record_bytes(change))
