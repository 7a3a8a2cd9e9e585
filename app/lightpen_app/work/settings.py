"""Settings, stored in a JSON file.

What is chosen applies at once, and is written by its own thread: neither a disk
that does not answer nor another program that keeps the settings to itself holds the
window.
"""

from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from threading import Lock, Thread
from typing import Any, TypeAlias, TypeVar, get_type_hints

import numpy as np
import platformdirs
from msgspec import json
from PySide6.QtCore import QByteArray, QObject, Qt, QTimer, Signal
from PySide6.QtWidgets import QWidget

from lightpen.arrays import FloatArray
from lightpen.cameras.protocol import CameraSettings
from lightpen.cameras.sources import source_named
from lightpen.errors import LightpenError
from lightpen.formats.own_json import DamagedError, in_shape
from lightpen.messages import Message
from lightpen.model.names import Laboratory
from lightpen.swing.preparation import (
    NO_SOURCE,
    Preparation,
    SecondCamera,
    SourceChoice,
    StationChoices,
)
from lightpen_app.look.languages import system_language
from lightpen_app.look.theme import Appearance
from lightpen_app.work.settings_store import Changes, Content, load, save, with_changes
from lightpen_resources import SOURCE_LANGUAGE, languages

Triple: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True)
class StoredCamera:
    """Stored source of a camera's images, and its mask."""

    source: SourceChoice = NO_SOURCE
    mask: tuple[Triple, ...] = ()  # circles of stray light: centre x, y and radius, px


@dataclass(frozen=True)
class CameraFiles:
    """Settings of a camera, independent of the station."""

    file: str = ""  # path of the intrinsics file; for a pair, of the rig file
    sha256: str = ""  # hash of the intrinsics file
    mask: tuple[Triple, ...] = ()  # circles of stray light: centre x, y and radius, px


@dataclass(frozen=True)
class FilePaths:
    """Paths of the files in use, empty for none; units if the pen file states none."""

    camera: str = ""
    pen: str = ""
    pen_units: str = ""
    rig: str = ""


@dataclass(frozen=True)
class Station(StationChoices):
    """Last choices at a station."""

    # Nominal tip centre, mm, pen frame; None: the LED file's.
    nominal_tip: Triple | None = None
    camera: StoredCamera = field(default_factory=StoredCamera)
    second: StoredCamera | None = None  # None for a single camera
    files: FilePaths = field(default_factory=FilePaths)
    # Choices for extensions by their keys, each as it stores them.
    extensions: dict[str, dict[str, Any]] = field(default_factory=dict)


def preparation_of(name: str, station: Station, before: Preparation) -> Preparation:
    """Return the last selection at a station; its files are read later.

    A source of a later version is passed over.
    """
    camera, second, tip = station.camera, station.second, station.nominal_tip
    kept = _kept(station) | {"names": replace(station.names, station=name)}
    return replace(
        before,
        nominal_tip=None if tip is None else np.array(tip),
        source=camera.source if _is_known(camera) else NO_SOURCE,
        second=SecondCamera(second.source, mask=mask_of(second.mask))
        if second is not None and _is_known(second)
        else None,
        camera_file=None,
        pen_file=None,
        mask=mask_of(camera.mask),
        **kept,
    )


def station_of(
    preparation: Preparation, extensions: dict[str, dict[str, Any]], unread: FilePaths
) -> Station:
    """Return the stored form of a station, with the paths of files still being read."""
    second, tip = preparation.second, preparation.nominal_tip
    camera_file, pen_file = preparation.camera_file, preparation.pen_file
    rig_file = preparation.rig_file
    return Station(
        nominal_tip=None if tip is None else tuple(tip.tolist()),
        camera=StoredCamera(preparation.source, circles_of(preparation.mask)),
        second=None
        if second is None
        else StoredCamera(second.source, circles_of(second.mask)),
        files=FilePaths(
            unread.camera if camera_file is None else str(camera_file.path),
            unread.pen if pen_file is None else str(pen_file.path),
            unread.pen_units if pen_file is None else pen_file.units or "",
            unread.rig if rig_file is None else str(rig_file.path),
        ),
        extensions=extensions,
        **_kept(preparation),
    )


def _kept(choices: StationChoices) -> dict[str, Any]:
    return {each.name: getattr(choices, each.name) for each in fields(StationChoices)}


def _is_known(camera: StoredCamera) -> bool:
    return source_named(camera.source.kind) is not None


def mask_of(circles: tuple[Triple, ...]) -> FloatArray:
    """Return stored circles of stray light as a mask (N, 3)."""
    return np.array(circles).reshape(-1, 3)


def circles_of(mask: FloatArray) -> tuple[Triple, ...]:
    """Return a mask as it is stored."""
    return tuple((x, y, radius) for x, y, radius in mask.tolist())


AGAIN_MS = 5000  # delay before writing again after a failure


@dataclass(frozen=True)
class Preferences:
    """Preferences for all stations."""

    language: str = SOURCE_LANGUAGE
    appearance: Appearance = Appearance.SYSTEM
    muted: bool = False
    distance_m: float = 3.0  # from the operator's eyes to the screen, m
    data_folder: str = ""  # data folder from the next start on; empty for the default


Group = TypeVar("Group")  # a frozen dataclass


@dataclass(frozen=True)
class LastChoices:
    """What was chosen last, whatever the station."""

    station: str = ""
    export_folder: str = ""  # results are saved in it
    hidden_columns: tuple[str, ...] = ()  # of the table of History, their keys
    laboratory: Laboratory | None = None  # named by a certificate


class Settings(QObject):
    """The settings; missing and invalid values give the default."""

    # The `Message` why something is not, or not surely, remembered.
    failed = Signal(object)
    # The `Message` of `failed` whose cause is gone: they could be written again.
    recovered = Signal(object)
    _written = Signal(object, bool)

    def __init__(self, file: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.file = file
        loaded = load(file)
        self._content: Content = loaded.content
        self.fault = loaded.fault
        self._changes: Changes = {}  # that wait to be written
        self._is_writing = False
        self._why_unwritten: Message | None = None
        self._lock = Lock()
        self._thread: Thread | None = None

        # Connections
        self._written.connect(self._on_written, Qt.ConnectionType.QueuedConnection)

    def preferences(self) -> Preferences:
        """Return the preferences; at first in the system's language."""
        usual = Preferences(language=system_language())
        read = read_group(self._content.get("preferences", {}), usual)
        known = read.language if read.language in languages() else usual.language
        return replace(read, language=known)

    def set_preferences(self, preferences: Preferences) -> None:
        """Store the preferences."""
        self._save("preferences", stored_group(preferences))

    def stations(self) -> tuple[str, ...]:
        """Return the names of the stations, in alphabetical order."""
        return tuple(sorted(self._content.get("stations", {})))

    def station(self, name: str) -> Station:
        """Return the last selection at a station; defaults for a new one."""
        return read_group(self._content.get("stations", {}).get(name), Station())

    def set_station(self, name: str, station: Station) -> None:
        """Store the selection at a station."""
        if not name:
            raise ValueError("`name` of a station must not be empty.")
        self._save("stations", {name: stored_group(station)})

    def cameras(self) -> dict[str, CameraSettings]:
        """Return the last camera settings, by serial number."""
        kept = self._content.get("cameras", {})
        return {
            serial: read_group(entries, CameraSettings())
            for serial, entries in kept.items()
        }

    def set_camera(self, serial: str, settings: CameraSettings) -> None:
        """Remember how a camera is set up."""
        self._save("cameras", {serial: stored_group(settings)})

    def camera_files(self, serials: str) -> CameraFiles:
        """Return the stored settings of a camera by serial number, or of a pair."""
        kept = self._content.get("camera_files", {}).get(serials)
        return read_group(kept, CameraFiles())

    def set_camera_files(self, serials: str, files: CameraFiles) -> None:
        """Remember the files of a camera, or of a pair."""
        self._save("camera_files", {serials: stored_group(files)})

    def camera_of_file(self, sha256: str) -> str:
        """Return the serial number of the camera that a file is stored for."""
        kept = self._content.get("camera_files", {})
        for serial in kept:
            if sha256 and self.camera_files(serial).sha256 == sha256:
                return serial
        return ""

    def of_extension(self, key: str, usual: Group) -> Group:
        """Return what an extension has stored, where valid; else what is usual."""
        return read_group(self._content.get("extensions", {}).get(key), usual)

    def set_of_extension(self, key: str, value: object) -> None:
        """Store the settings of an extension."""
        self._save("extensions", {key: stored_group(value)})

    def last(self) -> LastChoices:
        """Return the last choices."""
        return read_group(self._content.get("last"), LastChoices())

    def set_last(self, **choices: object) -> None:
        """Remember choices by the names of `LastChoices`."""
        self._save("last", stored_group(choices))

    def restore_geometry(self, window: QWidget) -> bool:
        """Restore the geometry of a window; False if never stored."""
        saved = self._content.get("windows", {}).get(window.objectName())
        if not isinstance(saved, str):
            return False
        place = QByteArray.fromBase64(saved.encode("ascii", "ignore"))
        return window.restoreGeometry(place)

    def save_geometry(self, window: QWidget) -> None:
        """Remember where a window is, under its object name."""
        place = window.saveGeometry().toBase64().toStdString()
        self._save("windows", {window.objectName(): place})

    def await_saved(self, timeout_s: float) -> bool:
        """Wait until all is written; return whether it is."""
        thread = self._thread
        if thread is not None:
            thread.join(timeout_s)
        with self._lock:
            return not self._is_writing

    def _save(self, section: str, entries: dict[str, Any]) -> None:
        """Store entries; unchanged ones are not written."""
        known = self._content.get(section, {})
        new = {n: e for n, e in entries.items() if n not in known or known[n] != e}
        changes = {(section, name): entry for name, entry in new.items()}
        self._content = with_changes(self._content, changes)
        with self._lock:
            self._changes.update(changes)
        self._write_soon()

    def _write_soon(self) -> None:
        with self._lock:
            if self._is_writing or not self._changes:
                return
            self._is_writing = True
        self._thread = Thread(target=self._write, name="settings", daemon=True)
        self._thread.start()

    def _write(self) -> None:
        """Write until nothing new is left; retry failed changes with later ones."""
        unwritten: Changes = {}
        while changes := self._taken_changes(unwritten):
            try:
                fault, unwritten = save(self.file, self._content, changes), {}
            except LightpenError as error:
                fault, unwritten = error.message, changes
            if fault is not None or self._why_unwritten is not None:
                self._written.emit(fault, not unwritten)

    def _on_written(self, fault: Message | None, is_written: bool) -> None:
        """Report a failure once, and its end; retry until then."""
        before = self._why_unwritten
        self._why_unwritten = None if is_written else fault
        if not is_written:
            QTimer.singleShot(AGAIN_MS, self._write_soon)
        if before is not None and before != fault:
            self.recovered.emit(before)
        if fault is not None and before != fault:
            self.failed.emit(fault)

    def _taken_changes(self, unwritten: Changes) -> Changes:
        """Return the entries to write next; empty without changes."""
        with self._lock:
            is_new = bool(self._changes)
            changes = unwritten | self._changes
            self._changes = {} if is_new else changes
            self._is_writing = is_new
            return changes if is_new else {}


def settings_file() -> Path:
    """Return the path of the settings of this user on this system."""
    return platformdirs.user_config_path("lightpen", appauthor=False) / "lightpen.json"


def data_folder(preferences: Preferences) -> Path:
    """Return the data folder, selected or default."""
    if preferences.data_folder:
        return Path(preferences.data_folder)
    return platformdirs.user_data_path("lightpen", appauthor=False)


def stored_group(value: object) -> dict[str, Any]:
    """Return the fields of a value for storing."""
    entries: dict[str, Any] = json.decode(json.encode(value))
    return entries


def read_group(saved: object, default: Group) -> Group:
    """Return a default updated with valid stored fields."""
    found: dict[str, Any] = {}
    for name, kind in get_type_hints(type(default)).items():
        if isinstance(saved, dict) and name in saved:
            with suppress(DamagedError):
                found[name] = in_shape(saved[name], kind)
    try:
        return replace(default, **found)  # type: ignore[type-var]
    except ValueError:
        return default
