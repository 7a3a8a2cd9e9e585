"""Settings of an administrator for all users of a computer, in a read-only file.

What a user chooses goes before it, and so do the limits of a supervisor.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path

import platformdirs

from lightpen.errors import FileError
from lightpen.formats.files import MEGABYTE, read_bytes
from lightpen.formats.own_json import DamagedError, in_shape, parse_own_json
from lightpen.messages import message
from lightpen.model.limits import LIMITS, StationLimits
from lightpen.model.names import PLACES, Laboratory, is_country

WHAT = message("file.machine-settings")


@dataclass(frozen=True)
class MachineSettings:
    """Default settings of the machine; an empty text sets nothing."""

    language: str = ""
    archive_server: str = ""
    limits: Mapping[str, float] = field(default_factory=dict)  # of new stations, by key
    laboratory: Laboratory | None = None

    def station_limits(self) -> StationLimits:
        """Return the limits of a new station."""
        return StationLimits().with_values(self.limits)


def machine_file() -> Path:
    r"""Return the folder: ``/etc/xdg/lightpen``, or ``C:\ProgramData\lightpen``."""
    return platformdirs.site_config_path("lightpen", appauthor=False) / "machine.json"


def machine_settings() -> MachineSettings:
    """Return the settings of the file; defaults without one."""
    file = machine_file()
    if not file.exists():
        return MachineSettings()
    data = read_bytes(file, WHAT, MEGABYTE)
    try:
        entries = parse_own_json(data, dict[str, object])
        _require_known(entries, [item.name for item in fields(MachineSettings)])
        settings = in_shape(entries, MachineSettings)
        ranges = {limit.key: limit.range for limit in LIMITS}
        _require_known(settings.limits, ranges)
        for key, value in settings.limits.items():
            least, most = ranges[key]
            if not least <= value <= most:
                raise DamagedError(f"{key} is {value}, not {least:g} to {most:g}")
        settings.station_limits()
        _require_laboratory(entries.get("laboratory"), settings.laboratory)
    except ValueError as error:
        raise FileError("machine-settings.wrong", file=file, why=str(error)) from error
    return settings


def _require_laboratory(entries: object, found: Laboratory | None) -> None:
    if found is None or not isinstance(entries, dict):
        return
    _require_known(entries, [item.name for item in fields(Laboratory)])
    _require_known([found.place], PLACES)
    if found.country and not is_country(found.country):
        raise DamagedError(f"{found.country!r} is not a country code such as DE")


def _require_known(names: Iterable[str], known: Collection[str]) -> None:
    for name in names:
        if name not in known:
            raise DamagedError(f"{name!r} is none of: {', '.join(known)}")
