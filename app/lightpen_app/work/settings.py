"""What a station remembers from one run to the next, in an INI file."""

import math
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, TypeVar

import platformdirs
from PySide6.QtCore import QByteArray, QLocale, QSettings
from PySide6.QtWidgets import QWidget

from lightpen.errors import FileError
from lightpen.model.limits import SwingLimits
from lightpen.sentences import sentence
from lightpen_app.look.languages import Language
from lightpen_app.look.theme import Appearance


@dataclass(frozen=True)
class Preferences:
    """What the user chose for all stations.

    Attributes
    ----------
    distance_m : float
        From the operator's eyes to the screen, m.
    """

    language: Language = Language.ENGLISH
    appearance: Appearance = Appearance.SYSTEM
    muted: bool = False
    distance_m: float = 3.0


@dataclass(frozen=True)
class Station:
    """What was chosen last at a station.

    Attributes
    ----------
    operator, pen, tip, cone : str
        Names or serial numbers.
    ball_diameter : float
        Of the tip, mm; 0 when it is not known.
    nominal_tip : str
        Its centre by design, "x y z" in mm, pen frame; empty when it is not known.
    source : str
        Kind of the image source; "simulated" unless something else was chosen.
    source_place : str
        Folder or serial number that the source needs.
    pen_units : str
        Of a pen file that does not say.
    mask : str
        Stray light to leave out, "x y radius" in px, circles parted by ";".
    exposure_us, gain_db : float
        Of the camera; not a number when they were never set.
    max_uncertainty : float
        U (k = 2) of the tip that ends a swing, mm.
    """

    operator: str = ""
    pen: str = ""
    tip: str = ""
    cone: str = ""
    ball_diameter: float = 0.0
    nominal_tip: str = ""
    source: str = "simulated"
    source_place: str = ""
    camera_file: str = ""
    pen_file: str = ""
    pen_units: str = ""
    mask: str = ""
    exposure_us: float = math.nan
    gain_db: float = math.nan
    max_uncertainty: float = SwingLimits.max_uncertainty
    min_images: int = SwingLimits.min_images
    max_images: int = SwingLimits.max_images


Group = TypeVar("Group", Preferences, Station)


class Settings:
    """The INI file; a value that is missing or makes no sense gives the default."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._ini = QSettings(str(file), QSettings.Format.IniFormat)
        self._ini.setFallbacksEnabled(False)

    @property
    def file(self) -> Path:
        """Where the settings are kept."""
        return self._file

    def preferences(self) -> Preferences:
        """Return what the user chose; at first, the language of the system."""
        return self._read("preferences", Preferences(language=_system_language()))

    def set_preferences(self, preferences: Preferences) -> None:
        """Remember what the user chose."""
        self._write("preferences", preferences)

    def stations(self) -> tuple[str, ...]:
        """Return the names of the stations, in alphabetical order."""
        self._ini.beginGroup("stations")
        names = self._ini.childGroups()
        self._ini.endGroup()
        return tuple(sorted(_decoded(name) for name in names))

    def station(self, name: str) -> Station:
        """Return what was chosen last at a station; defaults for a new one."""
        return self._read(f"stations/{_encoded(name)}", Station())

    def set_station(self, name: str, station: Station) -> None:
        """Remember what was chosen at a station."""
        if not name:
            raise ValueError("`name` of a station must not be empty.")
        self._write(f"stations/{_encoded(name)}", station)

    def last_station(self) -> str:
        """Return the name of the station used last; empty at first."""
        saved = self._ini.value("last/station")
        return saved if isinstance(saved, str) else ""

    def set_last_station(self, name: str) -> None:
        """Remember which station is used."""
        if name != self.last_station():
            self._ini.setValue("last/station", name)
            self.sync()

    def restore_geometry(self, window: QWidget) -> bool:
        """Put a window where it was when the program ended; False if never."""
        saved = self._ini.value(f"windows/{window.objectName()}")
        return isinstance(saved, QByteArray) and window.restoreGeometry(saved)

    def save_geometry(self, window: QWidget) -> None:
        """Remember where a window is, under its object name."""
        self._ini.setValue(f"windows/{window.objectName()}", window.saveGeometry())

    def sync(self) -> None:
        """Write what is not yet on the disk.

        Raises
        ------
        FileError
            The file cannot be written.
        """
        try:
            self._file.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise _cannot_be_saved(self._file) from error
        self._ini.sync()
        if self._ini.status() != QSettings.Status.NoError:
            raise _cannot_be_saved(self._file)

    def _read(self, group: str, default: Group) -> Group:
        values: dict[str, Any] = {}
        for each in fields(default):
            fallback = getattr(default, each.name)
            saved = self._ini.value(f"{group}/{each.name}")
            values[each.name] = _converted(saved, fallback)
        return type(default)(**values)

    def _write(self, group: str, value: Preferences | Station) -> None:
        for each in fields(value):
            content = getattr(value, each.name)
            text = repr(content) if isinstance(content, float) else str(content)
            self._ini.setValue(f"{group}/{each.name}", text)
        self.sync()


def settings_file() -> Path:
    """Return where the settings of this user belong on this system."""
    return platformdirs.user_config_path("lightpen", appauthor=False) / "lightpen.ini"


def data_folder() -> Path:
    """Return where records and crash reports of this user belong on this system."""
    return platformdirs.user_data_path("lightpen", appauthor=False)


def _cannot_be_saved(file: Path) -> FileError:
    return FileError(
        sentence(
            "settings.unwritable",
            "The settings cannot be saved: {file} cannot be written. Make sure that "
            "its folder is yours to write and that the disk is not full.",
            file=str(file),
        )
    )


def _converted(saved: object, fallback: Any) -> Any:
    """Return a saved text as the type of its default, or the default."""
    if not isinstance(saved, str):
        # QSettings turns a text with commas into a list.
        return fallback
    kind = type(fallback)
    if kind is bool:
        return {"True": True, "False": False}.get(saved, fallback)
    try:
        value = kind(saved)
    except ValueError:
        return fallback
    usable = not isinstance(value, float) or math.isfinite(value)
    return value if usable else fallback


def _system_language() -> Language:
    chinese = QLocale.system().language() == QLocale.Language.Chinese
    return Language.CHINESE if chinese else Language.ENGLISH


def _encoded(name: str) -> str:
    """Return a station's name without the characters that part groups."""
    return name.replace("%", "%25").replace("/", "%2F").replace("\\", "%5C")


def _decoded(group: str) -> str:
    return group.replace("%5C", "\\").replace("%2F", "/").replace("%25", "%")
