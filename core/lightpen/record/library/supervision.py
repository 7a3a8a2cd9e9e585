"""Who may change the limits of a station, and go beyond them.

The password and the limits in force follow from the changes in the data folder that are
entered, see `lightpen.record.library.guard_files`. All of them must be there, unchanged
and approved; else nothing is accepted.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from lightpen.errors import AcceptanceError, FileError
from lightpen.formats.files import read_bytes
from lightpen.model.limits import StationLimits
from lightpen.model.names import same_name
from lightpen.record.library.entered_files import CountedFile, entered_files
from lightpen.record.library.guard_files import (
    LIMIT,
    LIMITS_FILE,
    LIMITS_FOLDER,
    LimitsChange,
    PasswordVerifier,
    read_limits_change,
)
from lightpen.record.library.numbered_files import newest_number, numbered_files
from lightpen.record.library.signing.keys import SigningKey


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
