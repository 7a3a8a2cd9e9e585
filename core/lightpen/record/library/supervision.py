"""Who may change the limits of a station, and go beyond them.

The password and the limits in force follow from the signed changes in the data folder,
see `lightpen.record.library.guard_files`. All of them must be there, unchanged and
signed; else nothing is accepted.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

from lightpen.errors import AcceptanceError, FileError
from lightpen.formats.files import read_bytes
from lightpen.model.limits import StationLimits
from lightpen.model.names import same_name
from lightpen.record.library.guard_files import (
    LIMIT,
    LIMITS_FOLDER,
    NOTHING_BEFORE,
    WHAT,
    LimitsChange,
    PasswordVerifier,
    read_limits_change,
)
from lightpen.record.library.key_changes import key_change
from lightpen.record.library.numbered_files import number_of, numbered_files
from lightpen.record.library.signing.keys import (
    SigningKey,
    chain_of,
    is_signed,
    station_key,
)
from lightpen.record.library.signing.signed_text import (
    Signers,
    entries_sha256,
    place_in,
    signatures_of,
)
from lightpen.record.library.signing.station import memory_file, remembered


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
    chain: str = ""  # begun by the first station key; empty without files
    station_keys: tuple[str, ...] = ()  # valid keys, the present one last
    known: Mapping[str, str] = field(default_factory=dict)  # as of `LimitsChange`
    hashes: tuple[str, ...] = ()  # of the files, the oldest first

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

    def signers(self, supervisor: SigningKey | None = None) -> Signers:
        """Return the keys by which a new file is signed; see `station_key`."""
        key = station_key(chain_of(self.station_keys[-1]))
        if key is None:
            raise FileError("signing.key-missing", chain=self.chain[:8])
        return Signers(key, supervisor)

    def require_signed(
        self, data: Path, file: Path, text: bytes, *, has_supervisor: bool
    ) -> None:
        """Refuse a file of a guarded folder that is not signed as it must be.

        It must be signed by valid keys, or unchanged since a supervisor introduced
        them. ``text`` is the JSON object with the signatures; it may name a supervisor.
        """
        place = place_in(data, file)
        if self.password is None or self.known.get(place) == entries_sha256(text):
            return
        found = signatures_of(text, place)
        is_signed_so = any(map(found.is_by_station, self.station_keys)) and (
            not has_supervisor or found.is_by_supervisor(self.password.key)
        )
        if not is_signed_so:
            raise FileError("signing.unsigned-file", file=file)


def read_supervision(data: Path) -> Supervision:
    """Return limits and guard of a data folder.

    Raises `FileError` if a file is missing, changed or not signed: other limits or
    another password must not count in silence.
    """
    folder = data / LIMITS_FOLDER
    guard = Supervision()
    for number, file in enumerate(reversed(numbered_files(folder)), start=1):
        if number_of(file) != number:
            raise FileError("limits.missing", folder=folder)
        content = read_bytes(file, WHAT, LIMIT)
        guard = _followed(guard, data, file, content)
    before = remembered(data)
    if before is not None:
        there = guard.hashes[before.n_changes - 1 : before.n_changes]
        if there != (before.sha256,):
            raise FileError(
                "limits.rolled-back", folder=folder, memory=memory_file(data)
            )
    return guard


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


def _followed(
    guard: Supervision, data: Path, file: Path, content: bytes
) -> Supervision:
    """Return limits and guard after one more change."""
    change = read_limits_change(content, file)
    found = signatures_of(content, place_in(data, file))
    password, station_keys = change.password or guard.password, guard.station_keys
    is_sound = change.previous == (guard.hashes[-1:] or (NOTHING_BEFORE,))[0]
    if change.station_key:
        is_sound &= _is_introduced(guard, change)
        before = station_keys if change.known is None else ()
        station_keys = *before, change.station_key
    is_sound &= bool(station_keys) and found.is_by_station(station_keys[-1])
    if password is not None:
        # The first password approves itself, the others are approved by those before.
        approving = guard.password or password
        is_sound &= found.is_by_supervisor(approving.key) or (
            _is_by_old_key(guard, change)
            and change.password is None
            and change.known is None
        )
    if not is_sound:
        raise FileError("limits.unsigned", file=file)
    return Supervision(
        password,
        _with_limits(guard.limits, change),
        guard.chain or change.chain,
        station_keys,
        guard.known if change.known is None else change.known,
        (*guard.hashes, sha256(content).hexdigest()),
    )


def _with_limits(
    limits: Mapping[str, StationLimits], change: LimitsChange
) -> Mapping[str, StationLimits]:
    if change.limits is None:
        return limits
    same = same_name(change.station, limits)
    others = {name: each for name, each in limits.items() if name != same}
    return {**others, change.station: StationLimits().with_values(change.limits)}


def _is_introduced(guard: Supervision, change: LimitsChange) -> bool:
    """Return whether a station key may be used from a change on."""
    if not guard.station_keys and chain_of(change.station_key) == change.chain:
        return True
    if guard.password is None:  # it could not be approved
        return True
    content = key_change(guard.chain, change.station_key)
    return is_signed(
        guard.password.key, change.key_approval, content
    ) or _is_by_old_key(guard, change)


def _is_by_old_key(guard: Supervision, change: LimitsChange) -> bool:
    """Return whether a change of the station key is signed by the one before."""
    if not change.station_key or not guard.station_keys or change.limits is not None:
        return False
    content = key_change(guard.chain, change.station_key)
    return is_signed(guard.station_keys[-1], change.station_key_signature, content)
