"""Setting a supervisor password, limits and another station key.

Each change continues the one that was read: where another program made one meanwhile,
nothing is written.
"""

import os
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from msgspec import Struct, structs

from lightpen.errors import AcceptanceError, FileError, NameTakenError
from lightpen.formats import upgrades
from lightpen.formats.files import A_FILE, LARGEST_RECORD, read_bytes
from lightpen.formats.own_json import (
    CHECKSUM,
    DamagedError,
    parse_own_json,
    with_checksum,
)
from lightpen.formats.upgrades import newest_format
from lightpen.model.limits import LIMITS, StationLimits
from lightpen.record.library.guard_files import (
    NOTHING_BEFORE,
    LimitsChange,
    PasswordVerifier,
    write_limits_change,
)
from lightpen.record.library.key_changes import key_change
from lightpen.record.library.numbered_files import numbered_files
from lightpen.record.library.signing.keys import (
    SALT_LENGTH,
    SigningKey,
    chain_of,
    make_station_key,
    station_key,
    supervisor_key,
)
from lightpen.record.library.signing.signed_text import (
    Signers,
    entries_sha256,
    place_in,
)
from lightpen.record.library.signing.station import remember, station_name
from lightpen.record.library.supervision import (
    Signature,
    Supervision,
    read_supervision,
    require_name,
    require_supervisor,
)
from lightpen.record.library.tip_library import LIBRARY

LEAST_PASSWORD = 8  # characters
SIGNED_FOLDERS = (
    *("results", "simulated/results", LIBRARY),
    *("verifications", "simulated/verifications"),
)


class _Approval(Struct):
    supervisor: str = ""


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
        _change(guard, now, signature),
        password=PasswordVerifier(salt.hex(), key.public),
        known=_known(data, guard),
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
        _change(guard, now, signature), station=station.strip(), limits=entry
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
    (`AcceptanceError`). If a supervisor signs, the keys before sign no file any more.
    """
    guard = read_supervision(data)
    old = station_key(chain_of(guard.station_keys[-1]) if guard.station_keys else chain)
    approving = None
    if guard.is_guarded and (old is None or signature is not None):
        approving = require_supervisor(guard, signature)
    new = make_station_key()
    content = key_change(guard.chain or chain, new.public)
    change = structs.replace(
        _change(guard, now, signature or Signature("", "")),
        chain="" if guard.chain else chain,
        station_key=new.public,
        station_key_signature="" if old is None else old.sign(content),
        key_approval="" if approving is None else approving.sign(content),
        known=None if approving is None else _known(data, guard),
    )
    _write(data, guard, change, approving, new)
    return new.public


def _change(guard: Supervision, now: datetime, signature: Signature) -> LimitsChange:
    return LimitsChange(
        format=newest_format(upgrades.LIMITS),
        at=now,
        supervisor=signature.name.strip(),
        previous=guard.hashes[-1] if guard.hashes else NOTHING_BEFORE,
    )


def _known(data: Path, guard: Supervision) -> dict[str, str]:
    """Return the hashes of the valid files by their paths."""
    known = {}
    for folder in SIGNED_FOLDERS:
        for file in numbered_files(data / folder):
            with suppress(DamagedError, FileError):  # which does not count
                start = read_bytes(file, A_FILE, LARGEST_RECORD).partition(CHECKSUM)[0]
                text = with_checksum(start + b"}")
                named = parse_own_json(text, _Approval).supervisor
                has_supervisor = folder == LIBRARY or named != ""
                guard.require_signed(data, file, text, has_supervisor=has_supervisor)
                known[place_in(data, file)] = entries_sha256(text)
    return known


def _write(
    data: Path,
    guard: Supervision,
    change: LimitsChange,
    supervisor: SigningKey | None,
    station: SigningKey | None = None,
) -> None:
    if station is None and not guard.station_keys:
        name = station_name(data)
        station = station_key(name)
        if station is None:
            raise AcceptanceError("signing.key-missing", chain=name[:8])
        change = structs.replace(change, chain=name, station_key=station.public)
    signers = (
        guard.signers(supervisor) if station is None else Signers(station, supervisor)
    )
    number = len(guard.hashes) + 1
    try:
        digest = write_limits_change(data, number, change, signers)
    except NameTakenError as error:
        raise AcceptanceError("supervisor.changed-meanwhile") from error
    if guard.is_guarded or change.password is not None:
        remember(data, number, digest)
