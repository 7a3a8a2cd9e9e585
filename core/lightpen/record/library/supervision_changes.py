"""Setting a supervisor password, limits and another station key.

Each change continues the one that was read: where another program made one meanwhile,
nothing is written.
"""

import os
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from msgspec import structs

from lightpen.errors import AcceptanceError, NameTakenError
from lightpen.formats.stored_format import FORMAT
from lightpen.model.limits import LIMITS, StationLimits
from lightpen.record.library.entered_files import entered_files
from lightpen.record.library.guard_files import (
    LimitsChange,
    PasswordVerifier,
    write_limits_change,
)
from lightpen.record.library.signing.chain_keys import key_change
from lightpen.record.library.signing.keys import (
    SALT_LENGTH,
    SigningKey,
    chain_of,
    make_station_key,
    station_key,
    supervisor_key,
)
from lightpen.record.library.supervision import (
    Signature,
    Supervision,
    read_supervision,
    require_name,
    require_supervisor,
)

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
