"""The selection of a station, stored, and limited by its supervisors."""

import getpass
import platform
from dataclasses import replace
from typing import Any

from PySide6.QtCore import QObject, Signal

from lightpen.model.limits import USUAL, StationLimits, SwingLimits
from lightpen.record.library.supervision import Supervision
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import NO_SOURCE, Preparation, SourceChoice
from lightpen_app.work.settings import (
    FilePaths,
    Group,
    Settings,
    preparation_of,
    read_group,
    station_of,
    stored_group,
)

# Nothing that is chosen for a trial is remembered.
TRIAL = Names("Trial", "Trainee", "SIM-1", "T-1", "C-1", 10.0)

FIRST_CONE = "C-1"


def trial_of(preparation: Preparation) -> Preparation:
    """Return the choices of a trial with a simulated pen, without its files."""
    trial = replace(
        preparation,
        names=TRIAL,
        camera_file=None,
        pen_file=None,
        nominal_tip=None,
        limits=SwingLimits(),
        assumptions=USUAL,
        second=None,
    )
    return trial.with_source(SourceChoice())


def is_trial_ready(preparation: Preparation) -> bool:
    """Return whether a trial can begin."""
    return preparation.names == TRIAL and not preparation.missing_inputs()


def account_name() -> str:
    """Return the name of the user's account; empty if the system has none."""
    try:
        return getpass.getuser()
    except (ImportError, KeyError, OSError):
        return ""


class Selection(QObject):
    """The choices for a calibration, and those for extensions."""

    # Preparation: something else is chosen; with what was chosen before
    changed = Signal(object)
    # FilePaths: another station is chosen, which had these files in use. What is still
    # being read is not for it.
    station_changed = Signal(object)

    def __init__(self, settings: Settings, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._settings = settings
        self._preparation = Preparation(source=NO_SOURCE)
        self._extensions: dict[str, dict[str, Any]] = {}
        self._supervision = Supervision()
        self._unread = FilePaths()

    @property
    def preparation(self) -> Preparation:
        """Choices for a calibration."""
        return self._preparation

    def of_extension(self, key: str, usual: Group) -> Group:
        """Return the choices for an extension, where valid; else what is usual."""
        return read_group(self._extensions.get(key), usual)

    @property
    def supervision(self) -> Supervision:
        """Limits and guard of the data folder."""
        return self._supervision

    @property
    def limits(self) -> StationLimits:
        """The limits of the station: as set, or as chosen."""
        return self._limits_for(self._preparation)

    def stations(self) -> tuple[str, ...]:
        """Return the names of the stations that are known."""
        return self._settings.stations()

    def choose_station(self, name: str) -> None:
        """Restore the last selection at a station; its files are read later."""
        station = self._settings.station(name)
        before = self._preparation
        chosen = preparation_of(name, station, before)
        limits = self._limits_for(chosen)
        self._preparation = replace(chosen, limits=limits.swing)
        self._extensions = dict(station.extensions)
        self._unread = station.files
        self._remember_last()
        self.station_changed.emit(station.files)
        self._follow(before)

    def begin_station(self) -> None:
        """Begin a station by what the computer tells; it has no image source yet."""
        names = Names(platform.node() or "1", account_name(), cone=FIRST_CONE)
        before = self._preparation.with_source(NO_SOURCE)
        self.observe(replace(before, names=names))

    def open_last_station(self) -> None:
        """Restore the last station, or begin the first one."""
        name = self._settings.last().station
        if name:
            self.choose_station(name)
        else:
            self.begin_station()

    def set_preparation(self, preparation: Preparation) -> None:
        """Take over other choices, and remember them for the station."""
        before, self._preparation = self._preparation, preparation
        self._remember_last()
        self._remember()
        self._follow(before)

    def observe(self, preparation: Preparation) -> None:
        """Apply data from cameras or files; not stored."""
        before, self._preparation = self._preparation, preparation
        self._follow(before)

    def forget_unread(self) -> None:
        """Note that no file of the station is still to be read."""
        self._unread = FilePaths()

    def set_of_extension(self, key: str, choices: object) -> None:
        """Take over other choices for an extension, and remember them."""
        self._extensions[key] = stored_group(choices)
        self._remember()
        self.changed.emit(self._preparation)

    def set_supervision(self, supervision: Supervision) -> None:
        """Use the limits set by supervisors from now on."""
        self._supervision = supervision
        before, limits = self._preparation, self.limits
        self._preparation = replace(before, limits=limits.swing)
        self._remember()
        self._follow(before)

    def _limits_for(self, preparation: Preparation) -> StationLimits:
        chosen = StationLimits(swing=preparation.limits)
        return self._supervision.limits_at(preparation.names.station, chosen)

    def _follow(self, before: Preparation) -> None:
        if self._preparation.sources != before.sources:
            self._preparation = self._preparation.without_images()
        self.changed.emit(before)

    def _remember_last(self) -> None:
        station = self._preparation.names.station
        if station not in ("", TRIAL.station):
            self._settings.set_last(station=station)

    def _remember(self) -> None:
        name = self._preparation.names.station
        if name not in ("", TRIAL.station):
            station = station_of(self._preparation, self._extensions, self._unread)
            self._settings.set_station(name, station)
