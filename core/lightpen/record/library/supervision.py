"""Who may change the limits of a station, and go beyond them.

The password and the limits in force follow from the changes in the data folder that are
entered, see `lightpen.record.library.supervision`. All of them must be there, unchanged
and approved; else nothing is accepted.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import Annotated, TypeAlias

from msgspec import Meta, Struct, structs

from lightpen.errors import AcceptanceError, FileError, NameTakenError
from lightpen.formats.files import MEGABYTE, read_bytes
from lightpen.formats.own_json import (
    FORMAT,
    DamagedError,
    LaterFormatError,
    ZonedTime,
    json_bytes,
    parse_stored,
    require_usual,
    with_checksum,
)
from lightpen.messages import message
from lightpen.model.limits import LIMITS, StationLimits
from lightpen.model.names import same_name
from lightpen.record.library.entered_files import (
    CountedFile,
    entered_files,
    make_folder,
    newest_number,
    numbered_file,
    numbered_files,
    write_counted,
)
from lightpen.record.library.signing import (
    PRIVATE,
    SALT_LENGTH,
    PublicKey,
    SigningKey,
    chain_of,
    key_change,
    make_station_key,
    station_key,
    supervisor_key,
)

# Changes of password, limits and station key of a data folder, one file each.
#
# A file counts if it is entered, see `lightpen.record.library.entered_files`, and once
# there is a password, if a supervisor approved it. All files have the mode 0600: a
# password can be guessed by its salt and public key.


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


@dataclass(frozen=True)
class Signature:
    """Name and password of a supervisor."""

    name: str
    password: str = field(repr=False)


@dataclass(frozen=True)
class Supervision:
    """Limits and guard set by the supervisors of a data folder."""

    password: PasswordVerifier | None = None  # without one, anybody may change limits
    # By the name of the station, as last written
    limits: Mapping[str, StationLimits] = field(default_factory=dict)
    n_changes: int = 0  # number of the newest file

    @property
    def key(self) -> str:
        """Public key of the supervisor; empty without a password."""
        return "" if self.password is None else self.password.key

    @property
    def is_guarded(self) -> bool:
        """Whether it takes a supervisor to change limits and to go beyond them."""
        return self.password is not None

    def limits_at(self, station: str, chosen: StationLimits) -> StationLimits:
        """Return the limits in force at a station: those set for it, or the chosen."""
        found = self._limits_of(station)
        return chosen if found is None else found

    def is_unknown(self, station: str) -> bool:
        """Return whether a guarded folder has no limits for a station."""
        return self.is_guarded and self._limits_of(station) is None

    def _limits_of(self, station: str) -> StationLimits | None:
        name = same_name(station, self.limits)
        return None if name is None else self.limits[name]


def read_supervision(data: Path) -> Supervision:
    """Return limits and guard of a data folder.

    Raises `FileError` if a file is missing, changed or not approved: other limits or
    another password must not count in silence.
    """
    folder, entered = data / LIMITS_FOLDER, entered_files(data)
    guard, files = Supervision(), reversed(numbered_files(folder))
    entered.require_all(folder)
    for file in files:
        counted = entered.counted(file, read_bytes(file, LIMITS_FILE, LIMIT))
        if counted is not None:
            guard = _followed(guard, file, counted)
    return replace(guard, n_changes=newest_number(folder))


def require_supervisor(
    supervision: Supervision, signature: Signature | None
) -> SigningKey:
    """Return the key of a supervisor; refuse anybody else.

    Raises `AcceptanceError` if there is no password yet, it is another one, or the name
    is missing.
    """
    if signature is None:
        raise AcceptanceError("supervisor.needed")
    require_name(signature)
    if supervision.password is None:
        raise AcceptanceError("supervisor.no-password")
    key = supervision.password.key_from(signature.password)
    if key is None:
        raise AcceptanceError("supervisor.wrong-password")
    return key


def approval_of_change(
    supervision: Supervision, signature: Signature | None, reason: str
) -> SigningKey | None:
    """Return the key of the supervisor who approves another current tip.

    None where there is no password; else a signature and a reason are needed
    (`AcceptanceError`).
    """
    if not supervision.is_guarded:
        return None
    if signature is None or not reason.strip():
        raise AcceptanceError("supervisor.needed")
    return require_supervisor(supervision, signature)


def require_name(signature: Signature) -> None:
    """Refuse a signature without a name."""
    if not signature.name.strip():
        raise AcceptanceError("supervisor.no-name")


def _followed(guard: Supervision, file: Path, counted: CountedFile) -> Supervision:
    """Return limits and guard after one more change."""
    change = read_limits_change(counted.content, file)
    password = change.password or guard.password
    if password is not None:
        # The first password approves itself, the others are approved by those before.
        # A station key that the one before introduces takes no supervisor.
        changes_rules = change.password is not None or change.limits is not None
        key = (guard.password or password).key
        if not counted.is_approved_by(key) and (
            changes_rules or not change.station_key
        ):
            raise FileError("limits.unapproved", file=file)
    return Supervision(password, _with_limits(guard.limits, change))


def _with_limits(
    limits: Mapping[str, StationLimits], change: LimitsChange
) -> Mapping[str, StationLimits]:
    if change.limits is None:
        return limits
    same = same_name(change.station, limits)
    others = {name: each for name, each in limits.items() if name != same}
    return {**others, change.station: StationLimits().with_values(change.limits)}


# Setting a supervisor password, limits and another station key.
#
# Each change continues the one that was read: where another program made one meanwhile,
# nothing is written.


LEAST_PASSWORD = 8  # characters


def set_password(data: Path, signature: Signature, new: str, now: datetime) -> None:
    """Set the supervisor password; changing it needs the present one.

    Raises `AcceptanceError` if that is another one, the name is missing, or the new one
    is too short.
    """
    guard = read_supervision(data)
    approving = None
    if guard.is_guarded:
        approving = require_supervisor(guard, signature)
    else:
        require_name(signature)
    if len(new) < LEAST_PASSWORD:
        raise AcceptanceError(
            "supervisor.short-password", length=len(new), needed=LEAST_PASSWORD
        )
    salt = os.urandom(SALT_LENGTH)
    key = supervisor_key(new, salt)
    change = structs.replace(
        _change(now, signature), password=PasswordVerifier(salt.hex(), key.public)
    )
    _write(data, guard, change, approving or key)


def set_limits(
    data: Path,
    station: str,
    limits: StationLimits,
    signature: Signature,
    now: datetime,
    before: StationLimits | None = None,
) -> None:
    """Set the limits of a station; ``before`` are those shown while they were entered.

    Raises `AcceptanceError` if no supervisor signs, or the limits were changed
    meanwhile.
    """
    guard = read_supervision(data)
    key = require_supervisor(guard, signature)
    if before is not None and guard.limits_at(station, before) != before:
        raise AcceptanceError("supervisor.changed-meanwhile")
    entry = {limit.key: limits.value(limit) for limit in LIMITS}
    change = structs.replace(
        _change(now, signature), station=station.strip(), limits=entry
    )
    _write(data, guard, change, key)


def save_limits(
    data: Path,
    station: str,
    limits: StationLimits,
    signature: Signature,
    new_password: str,
    now: datetime,
    before: StationLimits | None = None,
) -> Supervision:
    """Set limits, and a password where there is none or a new one is given.

    Returns what is set now. Raises `AcceptanceError` as `set_limits`, or if the
    password is too short.
    """
    if not read_supervision(data).is_guarded:
        set_password(data, signature, signature.password, now)
    if new_password:
        set_password(data, signature, new_password, now)
        signature = replace(signature, password=new_password)
    set_limits(data, station, limits, signature, now, before)
    return read_supervision(data)


def renew_station_key(
    data: Path, chain: str, signature: Signature | None, now: datetime
) -> str:
    """Introduce another station key for a chain, and return its public half.

    It is approved by the key before where that is in this user account, and by the
    supervisor who signs. Where there is a password, one of both is needed
    (`AcceptanceError`). The keys before sign no entry any more.
    """
    guard, present = read_supervision(data), entered_files(data).station_key
    old = station_key(chain_of(present) if present else chain)
    approving = None
    if guard.is_guarded and (old is None or signature is not None):
        approving = require_supervisor(guard, signature)
    new = make_station_key()
    content = key_change(chain, new.public)
    change = structs.replace(
        _change(now, signature or Signature("", "")),
        station_key=new.public,
        station_key_signature="" if old is None else old.sign(content),
        key_approval="" if approving is None else approving.sign(content),
    )
    _write(data, guard, change, approving)
    return new.public


def _change(now: datetime, signature: Signature) -> LimitsChange:
    return LimitsChange(format=FORMAT, at=now, supervisor=signature.name.strip())


def _write(
    data: Path, guard: Supervision, change: LimitsChange, supervisor: SigningKey | None
) -> None:
    try:
        write_limits_change(data, guard.n_changes + 1, change, supervisor)
    except NameTakenError as error:
        raise AcceptanceError("supervisor.changed-meanwhile") from error
