"""What a station remembers from one run to the next, in a JSON file.

What is chosen is in force at once, and written by a thread of its own: neither a disk
that does not answer nor another program that keeps the settings to itself holds the
window.
"""

import math
from dataclasses import astuple, dataclass, fields, replace
from pathlib import Path
from threading import Lock, Thread
from typing import Any, TypeVar, get_type_hints

import platformdirs
from PySide6.QtCore import QByteArray, QLocale, QObject, Qt, QTimer, Signal
from PySide6.QtWidgets import QWidget

from lightpen.cameras.protocol import CameraSettings, Region, TriggerMode
from lightpen.errors import LightpenError
from lightpen.formats.own_json import DamagedError, in_shape
from lightpen.model.assumptions import USUAL
from lightpen.model.due_rule import DueRule
from lightpen.model.limits import SwingLimits
from lightpen.sentences import Sentence
from lightpen.streaming.server import StreamPlace
from lightpen_app.look.languages import Language
from lightpen_app.look.theme import Appearance
from lightpen_app.work.settings_store import Changes, Content, load, save, with_changes

AGAIN_MS = 5000  # after which what could not be written is tried again


@dataclass(frozen=True)
class Preferences:
    """What the user chose for all stations.

    Attributes
    ----------
    distance_m : float
        From the operator's eyes to the screen, m.
    data_folder : str
        For swings and results, from the next start on; empty for the usual one.
    streams : bool
        Whether other programs may follow the pen,
    stream_address, stream_port : str and int
        and where; see `lightpen.streaming.server.StreamPlace`.
    """

    language: Language = Language.ENGLISH
    appearance: Appearance = Appearance.SYSTEM
    muted: bool = False
    distance_m: float = 3.0
    data_folder: str = ""
    streams: bool = False
    stream_address: str = StreamPlace.address
    stream_port: int = StreamPlace.port


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
    second_source, second_place, second_producer, second_mask : str
        Likewise of a second camera; empty where one looks alone.
    rig_file : str
        Of both.
    source_producer : str
        File of a GenTL producer, where one was chosen.
    max_uncertainty : float
        U (k = 2) of the tip that ends a swing, mm.
    focal_length, scale, form_error, center_bias, temperature, warmth, expansion : float
        What is assumed where files say nothing; see
        `lightpen.model.assumptions.Assumptions`.
    temperature_c : float or None
        Of the pen, degrees C; None when it was not measured.
    verified : str
        Names of what is touched to verify a tip, parted by "; ".
    ring_radius, ring_uncertainty, bar_length, bar_uncertainty : float
        What is certified, 0 where it is not known, and U (k = 2) of it, mm.
    ring_surface : str
        See `lightpen.verification.choices.Surface`.
    touch_images : int
        Of one touch.
    """

    operator: str = ""
    pen: str = ""
    tip: str = ""
    cone: str = ""
    ball_diameter: float = 0.0
    nominal_tip: str = ""
    source: str = "simulated"
    source_place: str = ""
    source_producer: str = ""
    camera_file: str = ""
    pen_file: str = ""
    pen_units: str = ""
    mask: str = ""
    second_source: str = ""
    second_place: str = ""
    second_producer: str = ""
    second_mask: str = ""
    rig_file: str = ""
    max_uncertainty: float = SwingLimits.max_uncertainty
    min_images: int = SwingLimits.min_images
    max_images: int = SwingLimits.max_images
    focal_length: float = USUAL.focal_length
    scale: float = USUAL.scale
    form_error: float = USUAL.form_error
    center_bias: float = USUAL.center_bias
    temperature_c: float | None = None
    temperature: float = USUAL.temperature
    warmth: float = USUAL.warmth
    expansion: float = USUAL.expansion
    verified: str = "fixed point"
    fixed_point_touches: int = 10
    ring_radius: float = 0.0
    ring_uncertainty: float = 0.0
    ring_surface: str = "groove"
    ring_runs: int = 1
    bar_length: float = 0.0
    bar_uncertainty: float = 0.0
    bar_surface: str = ""
    bar_places: int = 1
    touch_images: int = 5


@dataclass(frozen=True)
class KeptCamera:
    """How a camera was set up last.

    Attributes
    ----------
    exposure_us, gain_db, frame_rate : float or None
        None when they were never set; likewise the texts are empty and the size of
        packets is 0.
    region : str
        "x y width height" in px.
    trigger : str
        See `lightpen.cameras.protocol.TriggerMode`.
    """

    exposure_us: float | None = None
    gain_db: float | None = None
    frame_rate: float | None = None
    pixel_format: str = ""
    region: str = ""
    trigger: str = ""
    packet_size: int = 0


Group = TypeVar("Group", Preferences, Station, KeptCamera)


class Settings(QObject):
    """What was chosen; a value that is missing or makes no sense gives the default.

    Signals
    -------
    troubled(object)
        The `Sentence` why something is not, or not surely, remembered.
    relieved(object)
        The `Sentence` of `troubled` whose cause is gone: they could be written again.
    """

    troubled = Signal(object)
    relieved = Signal(object)
    _written = Signal(object, bool)

    def __init__(self, file: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._file = file
        loaded = load(file)
        self._content: Content = loaded.content
        self._trouble = loaded.trouble
        self._changes: Changes = {}  # that wait to be written
        self._is_writing = False
        self._why_unwritten: Sentence | None = None
        self._lock = Lock()
        self._thread: Thread | None = None

        # Connections
        self._written.connect(self._on_written, Qt.ConnectionType.QueuedConnection)

    @property
    def file(self) -> Path:
        """Where the settings are kept."""
        return self._file

    @property
    def trouble(self) -> Sentence | None:
        """Why they could not be read at the start."""
        return self._trouble

    def preferences(self) -> Preferences:
        """Return what the user chose; at first, the language of the system."""
        saved = self._content.get("preferences", {})
        return _read(saved, Preferences(language=_system_language()))

    def set_preferences(self, preferences: Preferences) -> None:
        """Remember what the user chose."""
        self._save("preferences", _entries(preferences))

    def stations(self) -> tuple[str, ...]:
        """Return the names of the stations, in alphabetical order."""
        return tuple(sorted(self._content.get("stations", {})))

    def station(self, name: str) -> Station:
        """Return what was chosen last at a station; defaults for a new one."""
        return _read(self._content.get("stations", {}).get(name), Station())

    def set_station(self, name: str, station: Station) -> None:
        """Remember what was chosen at a station."""
        if not name:
            raise ValueError("`name` of a station must not be empty.")
        self._save("stations", {name: _entries(station)})

    def cameras(self) -> dict[str, CameraSettings]:
        """Return how cameras were set up last, by their serial numbers."""
        kept = self._content.get("cameras", {})
        return {
            serial: _camera_settings(_read(entries, KeptCamera()))
            for serial, entries in kept.items()
        }

    def set_camera(self, serial: str, settings: CameraSettings) -> None:
        """Remember how a camera is set up."""
        self._save("cameras", {serial: _entries(_kept_camera(settings))})

    def last_station(self) -> str:
        """Return the name of the station used last; empty at first."""
        saved = self._content.get("last", {}).get("station")
        return saved if isinstance(saved, str) else ""

    def set_last_station(self, name: str) -> None:
        """Remember which station is used."""
        self._save("last", {"station": name})

    def export_folder(self) -> str:
        """Return the folder that results were saved in last; empty at first."""
        saved = self._content.get("last", {}).get("export folder")
        return saved if isinstance(saved, str) else ""

    def set_export_folder(self, folder: str) -> None:
        """Remember where results are saved."""
        self._save("last", {"export folder": folder})

    def due_rule(self) -> DueRule:
        """Return how long a tip may be in force."""
        saved = self._content.get("due", {})
        try:
            return DueRule(saved["days"], saved["swings"])
        except (KeyError, TypeError, ValueError):
            return DueRule()

    def set_due_rule(self, rule: DueRule) -> None:
        """Remember how long a tip may be in force."""
        self._save("due", {"days": rule.max_days, "swings": rule.max_swings})

    def restore_geometry(self, window: QWidget) -> bool:
        """Put a window where it was when the program ended; False if never."""
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
        """Wait until all is on the disk, and return whether nothing waits for it."""
        thread = self._thread
        if thread is not None:
            thread.join(timeout_s)
        with self._lock:
            return not self._is_writing

    def _save(self, section: str, entries: dict[str, Any]) -> None:
        """Remember entries; those that are as they were need not be written."""
        known = self._content.get(section, {})
        new = {n: e for n, e in entries.items() if n not in known or known[n] != e}
        changes = {(section, name): entry for name, entry in new.items()}
        self._content = with_changes(self._content, changes)
        with self._lock:
            self._changes.update(changes)
        self._write_soon()

    def _write_soon(self) -> None:
        """Write what waits for it, if anything does."""
        with self._lock:
            if self._is_writing or not self._changes:
                return
            self._is_writing = True
        self._thread = Thread(target=self._write, name="settings", daemon=True)
        self._thread.start()

    def _write(self) -> None:
        """Write until nothing new is left; what cannot be written waits for more."""
        unwritten: Changes = {}
        while changes := self._taken_changes(unwritten):
            try:
                trouble, unwritten = save(self._file, self._content, changes), {}
            except LightpenError as error:
                trouble, unwritten = error.sentence, changes
            if trouble is not None or self._why_unwritten is not None:
                self._written.emit(trouble, not unwritten)

    def _on_written(self, trouble: Sentence | None, is_written: bool) -> None:
        """Tell what went wrong, once, and when it is over; until then try again."""
        before = self._why_unwritten
        self._why_unwritten = None if is_written else trouble
        if not is_written:
            QTimer.singleShot(AGAIN_MS, self._write_soon)
        if before is not None and before != trouble:
            self.relieved.emit(before)
        if trouble is not None and before != trouble:
            self.troubled.emit(trouble)

    def _taken_changes(self, unwritten: Changes) -> Changes:
        """Return what is to be written next; nothing if only the old is left."""
        with self._lock:
            is_new = bool(self._changes)
            changes = unwritten | self._changes
            self._changes = {} if is_new else changes
            self._is_writing = is_new
            return changes if is_new else {}


def settings_file() -> Path:
    """Return where the settings of this user belong on this system."""
    return platformdirs.user_config_path("lightpen", appauthor=False) / "lightpen.json"


def data_folder(preferences: Preferences) -> Path:
    """Return where records and crash reports are kept, as chosen or as is usual."""
    if preferences.data_folder:
        return Path(preferences.data_folder)
    return platformdirs.user_data_path("lightpen", appauthor=False)


def _kept_camera(settings: CameraSettings) -> KeptCamera:
    region = settings.region
    return KeptCamera(
        exposure_us=settings.exposure_us,
        gain_db=settings.gain_db,
        frame_rate=settings.frame_rate,
        pixel_format=settings.pixel_format or "",
        region="" if region is None else " ".join(map(str, astuple(region))),
        trigger="" if settings.trigger is None else str(settings.trigger),
        packet_size=settings.packet_size or 0,
    )


def _camera_settings(kept: KeptCamera) -> CameraSettings:
    """Return settings; what was not kept, or makes no sense, is left as it is."""
    return CameraSettings(
        exposure_us=kept.exposure_us,
        gain_db=kept.gain_db,
        frame_rate=kept.frame_rate,
        pixel_format=kept.pixel_format or None,
        region=_region(kept.region),
        trigger=next((mode for mode in TriggerMode if mode == kept.trigger), None),
        packet_size=kept.packet_size or None,
    )


def _region(text: str) -> Region | None:
    words = text.split()
    if len(words) != 4 or not all(word.isdecimal() for word in words):
        return None
    return Region(*map(int, words))


def _entries(value: Preferences | Station | KeptCamera) -> dict[str, Any]:
    """Return the fields of a value as they are kept."""
    return {each.name: getattr(value, each.name) for each in fields(value)}


def _read(saved: object, default: Group) -> Group:
    """Return a default with what was saved of it and makes sense."""
    found: dict[str, Any] = {}
    for name, kind in get_type_hints(type(default)).items():
        if isinstance(saved, dict) and name in saved:
            try:
                value = in_shape(saved[name], kind, strict=False)
            except DamagedError:
                continue
            if not isinstance(value, float) or math.isfinite(value):
                found[name] = value
    return replace(default, **found)


def _system_language() -> Language:
    chinese = QLocale.system().language() == QLocale.Language.Chinese
    return Language.CHINESE if chinese else Language.ENGLISH
