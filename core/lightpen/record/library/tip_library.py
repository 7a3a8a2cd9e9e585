"""The library of pens, tips and cones: items, limits and due dates.

Each change is a separate file in the data folder, numbered in their order and never
changed, as limits are: it holds the whole of one item as it is from then on, and who
changed it. The newest file of an item counts, so what the library says follows from
its history alone, and each of these files is owed an entry of the archive. An item is
retired, never removed: results name it.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import date, datetime
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeAlias

import numpy as np
from msgspec import Meta, Struct, to_builtins

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.files import MEGABYTE, read_bytes
from lightpen.formats.own_json import (
    DamagedError,
    Digest,
    LaterFormatError,
    Plain,
    Vector,
    ZonedTime,
    parse_stored,
    require_usual,
)
from lightpen.local_time import local_time
from lightpen.messages import Message, message
from lightpen.model.artefacts import Artefact, ArtefactKind, Side
from lightpen.model.bending import Bending, MeasuredBending, bending_on
from lightpen.model.limits import MOST_DAYS, DueRule
from lightpen.model.names import folded_name, same_name
from lightpen.record.library.entered_files import entered_files, numbered_files
from lightpen.record.library.supervision import read_supervision

LIBRARY = "library"
WHAT = message("file.library")
LONGEST_ID = 200  # characters
LARGEST_BALL = 100.0  # mm
LARGEST_CHANGE = 10.0  # mm
LARGEST_REFERENCE = 10_000.0  # mm
LARGEST_EXPANSION = 1e-3  # 1/K

Size: TypeAlias = Annotated[float, Meta(ge=0, le=LARGEST_REFERENCE)]
Id: TypeAlias = Annotated[str, Meta(min_length=1, max_length=LONGEST_ID)]


class ItemKind(StrEnum):
    """Kinds of items of the library."""

    PEN = "pen"
    TIP = "tip"
    CONE = "cone"
    CAMERA = "camera"
    REFERENCE = "reference"


SWUNG = (ItemKind.PEN, ItemKind.TIP, ItemKind.CONE)  # kinds that a swing names
KIND_WORDS: Mapping[ItemKind, Message] = {
    ItemKind.PEN: message("library.pen"),
    ItemKind.TIP: message("library.tip"),
    ItemKind.CONE: message("library.cone"),
    ItemKind.CAMERA: message("library.camera"),
    ItemKind.REFERENCE: message("library.reference"),
}


class Item(Struct, frozen=True, kw_only=True):
    """Common entries of all items."""

    kind: ClassVar[ItemKind]

    id: Id  # unique identifier, printed as a barcode on the label
    due: date | None = None  # expiry date
    certificate: str = ""  # number; empty without one
    certified: date | None = None  # date of the certificate
    note: str = ""
    is_retired: bool = False

    def is_overdue(self, today: date) -> bool:
        """Return whether its due date is over."""
        return self.due is not None and today > self.due


class LedFile(Struct, frozen=True):
    """The LED file of a pen: path, hash, and the units if it states none."""

    path: str
    sha256: Digest
    units: str = ""

    @property
    def name(self) -> str:
        """Name of the file without its folder."""
        return Path(self.path).name


class ListedPen(Item, frozen=True, kw_only=True, tag="pen"):
    """A pen, by its serial number."""

    kind: ClassVar[ItemKind] = ItemKind.PEN

    led_file: LedFile | None = None  # None until one was opened for the pen
    # 1/K, where its LED file states none; None for the default of the station
    expansion: Annotated[float, Meta(ge=0, le=LARGEST_EXPANSION)] | None = None


class ListedCone(Item, frozen=True, kw_only=True, tag="cone"):
    """A cone."""

    kind: ClassVar[ItemKind] = ItemKind.CONE


class ListedCamera(Item, frozen=True, kw_only=True, tag="camera"):
    """A camera, by its serial number, with the certificate of its intrinsics."""

    kind: ClassVar[ItemKind] = ItemKind.CAMERA


class ListedReference(Item, frozen=True, kw_only=True, tag="reference"):
    """A ring, length bar, sphere or plate, found by its certified value."""

    kind: ClassVar[ItemKind] = ItemKind.REFERENCE

    certified_mm: Size | None = None
    shape: ArtefactKind | None = None  # None if it is not measured by its plan
    uncertainty_mm: Size = 0.0  # U (k = 2) of the certificate
    side: Side = Side.CENTRE  # that the ball touches
    expansion_ppm: Annotated[float, Meta(ge=0, le=1e6 * LARGEST_EXPANSION)] = 0.0

    @property
    def artefact(self) -> Artefact | None:
        """The artefact that a plan measures; None without shape or value."""
        if self.shape is None or not self.certified_mm:
            return None
        return Artefact(
            self.shape,
            self.certified_mm,
            self.uncertainty_mm,
            self.side,
            expansion=self.expansion_ppm,
        )


class ListedTip(Item, frozen=True, kw_only=True, tag="tip"):
    """A tip, on whatever pen."""

    kind: ClassVar[ItemKind] = ItemKind.TIP

    ball_diameter_mm: Annotated[float, Meta(gt=0, le=LARGEST_BALL)] | None = None
    nominal_tip_mm: Vector | None = None  # pen frame; None: the LED file's
    # Since the current tip; None for no limit but the uncertainty of the change
    max_change_mm: Annotated[float, Meta(gt=0, le=LARGEST_CHANGE)] | None = None
    # `DueRule` of its own; None: the station's
    max_days: Annotated[int, Meta(ge=1, le=MOST_DAYS)] | None = None
    bending: MeasuredBending | None = None  # by its last press test

    @property
    def nominal_tip(self) -> FloatArray | None:
        """Its centre by design, (3,), pen frame, mm."""
        point = self.nominal_tip_mm
        return None if point is None else np.array(point, dtype=np.float64)

    def rule(self, usual: DueRule) -> DueRule:
        """Return the calibration interval, its own or the default."""
        return DueRule(self.max_days or usual.max_days)


AnyItem: TypeAlias = ListedPen | ListedTip | ListedCone | ListedCamera | ListedReference

MADE: Mapping[ItemKind, Callable[..., AnyItem]] = {
    each.kind: each
    for each in (ListedPen, ListedTip, ListedCone, ListedCamera, ListedReference)
}


class LibraryChange(Struct, frozen=True, kw_only=True):
    """One change, as its file holds it, with the supervisor who signed, if any."""

    format: int
    at: ZonedTime
    item: AnyItem
    station: str = ""
    operator: str = ""
    supervisor: str = ""
    reason: str = ""

    def __post_init__(self) -> None:
        require_usual(self.at)


@dataclass(frozen=True)
class Library:
    """The present state of all items, retired ones too, by id in order of creation."""

    pens: Mapping[str, ListedPen] = field(default_factory=dict)
    tips: Mapping[str, ListedTip] = field(default_factory=dict)
    cones: Mapping[str, ListedCone] = field(default_factory=dict)
    cameras: Mapping[str, ListedCamera] = field(default_factory=dict)
    references: Mapping[str, ListedReference] = field(default_factory=dict)

    def items(self, kind: ItemKind) -> Mapping[str, AnyItem]:
        """Return the items of a kind by their ids."""
        of_kind: dict[ItemKind, Mapping[str, AnyItem]] = {
            ItemKind.PEN: self.pens,
            ItemKind.TIP: self.tips,
            ItemKind.CONE: self.cones,
            ItemKind.CAMERA: self.cameras,
            ItemKind.REFERENCE: self.references,
        }
        return of_kind[kind]

    def item(self, kind: ItemKind, name: str) -> AnyItem | None:
        """Return an item by its id, if it is in the library; see `same_name`."""
        items = self.items(kind)
        same = name if name in items else same_name(name, items)
        return None if same is None else items[same]

    def tip(self, name: str) -> ListedTip | None:
        """Return a tip, as `item`."""
        found = self.item(ItemKind.TIP, name)
        return found if isinstance(found, ListedTip) else None

    def has_retired(self, tip: str) -> bool:
        """Return whether a tip is in the library and retired."""
        listed = self.tip(tip)
        return listed is not None and listed.is_retired

    def rule_of(self, tip: str, usual: DueRule) -> DueRule:
        """Return the calibration interval of a tip."""
        listed = self.tip(tip)
        return usual if listed is None else listed.rule(usual)

    def bending_of(self, tip: str, day: date) -> Bending:
        """Return the bending of a tip on a day: by its press test, or assumed."""
        listed = self.tips.get(tip)
        return bending_on(day, None if listed is None else listed.bending)

    def pen_of_leds(self, sha256: str) -> ListedPen | None:
        """Return the pen with which an LED file of this hash is stored."""
        for pen in self.pens.values():
            if pen.led_file is not None and pen.led_file.sha256 == sha256:
                return pen
        return None


def read_library(data: Path) -> Library:
    """Return the library of a data folder; empty where there is none.

    Raises `FileError` if it was changed: an older limit must not count again in
    silence.
    """
    found: dict[ItemKind, dict[str, Any]] = {kind: {} for kind in ItemKind}
    for _, change in library_changes(data):
        found[change.item.kind][change.item.id] = change.item
    return Library(*found.values())  # whose fields are in the order of the kinds


def item_entries(item: AnyItem) -> dict[str, Plain]:
    """Return an item as the settings of an entry have it: plain values by their names.

    What is not known of it is left out.
    """
    entries: dict[str, Plain] = {"item": item.kind.value}
    for name, value in to_builtins(item).items():
        if name == "type" or value is None:
            continue
        if name == "bending":
            value = f"{value['bending_mm']!r} {value['expanded_uncertainty_mm']!r}"
        elif isinstance(value, dict):  # a file
            value = value.get("place") or f"{value['path']} {value['sha256']}"
        is_vector = isinstance(value, list | tuple)
        entries[name] = " ".join(map(repr, value)) if is_vector else value
    return entries


def library_changes(data: Path) -> Iterator[tuple[Path, LibraryChange]]:
    """Yield the changes of a library with their files, the oldest first."""
    entered, present = entered_files(data), read_supervision(data).key
    files = library_files(data)
    entered.require_all(data / LIBRARY)
    for file in files:
        counted = entered.counted(file, read_bytes(file, WHAT, MEGABYTE))
        if counted is not None:
            change = read_change(file)
            counted.require_approved(present)
            yield file, change


def library_files(data: Path) -> tuple[Path, ...]:
    """Return the files of all changes, the oldest first."""
    return tuple(reversed(numbered_files(data / LIBRARY)))


def read_change(file: Path) -> LibraryChange:
    """Return the change that a file holds, whether it counts or not.

    Raises `FileError` if it is damaged, or of a later version of the program.
    """
    try:
        return parse_stored(read_bytes(file, WHAT, MEGABYTE), LibraryChange)
    except LaterFormatError as error:
        raise FileError("library.later-version", file=file) from error
    except DamagedError as error:
        raise FileError("library.damaged", file=file) from error


class TipStatus(StrEnum):
    """Whether an item may be used for measuring."""

    VALID = "valid"
    OVERDUE = "overdue"
    UNCALIBRATED = "not calibrated"
    RETIRED = "retired"


@dataclass(frozen=True)
class CurrentResult:
    """A current tip: since when, until when by its age, largest U (k = 2), mm."""

    calibrated: datetime
    due: datetime
    is_due: bool
    uncertainty: float | None = None
    grade: Grade | None = None


@dataclass(frozen=True)
class StationStatus:
    """Status of all tips, pens and cones of a station."""

    library: Library = field(default_factory=Library)
    # Real tips by pen.
    in_force: Mapping[tuple[str, str], CurrentResult] = field(default_factory=dict)
    now: datetime | None = None  # None where nothing was read yet

    def of_tip(self, pen: str, tip: str) -> TipStatus | None:
        """Return the status of a tip of a pen; None while unknown."""
        if self.now is None or not (pen and tip):
            return None
        listed = self.library.tip(tip)
        if self.library.has_retired(tip):
            return TipStatus.RETIRED
        found = self.current(pen, tip)
        if found is None:
            return TipStatus.UNCALIBRATED
        is_over = listed is not None and listed.is_overdue(self._today(self.now))
        return TipStatus.OVERDUE if is_over or found.is_due else TipStatus.VALID

    def current(self, pen: str, tip: str) -> CurrentResult | None:
        """Return the current result of a pen and a tip, however they are typed."""
        return self._by_name.get((folded_name(pen), folded_name(tip)))

    @cached_property
    def _by_name(self) -> Mapping[tuple[str, str], CurrentResult]:
        return {
            (folded_name(pen), folded_name(tip)): each
            for (pen, tip), each in self.in_force.items()
        }

    def overdue(self, pen: str, tip: str) -> Message | None:
        """Return the message that a calibration has expired; None if it has not."""
        due = self.due(pen, tip)
        is_over = self.of_tip(pen, tip) is TipStatus.OVERDUE
        if (
            self.now is None
            or due is None
            or not is_over
            or due > self._today(self.now)
        ):
            return None  # due by a clock that was set back
        return message("doubt.calibration-overdue", due=f"{due:%Y-%m-%d}")

    def of_item(self, kind: ItemKind, name: str) -> TipStatus | None:
        """Return the status of a pen, a cone or the ball of a tip.

        None of one that is not in the library.
        """
        item: Item | None = self.library.item(kind, name)
        if item is None or self.now is None:
            return None
        if item.is_retired:
            return TipStatus.RETIRED
        is_over = item.is_overdue(self._today(self.now))
        return TipStatus.OVERDUE if is_over else TipStatus.VALID

    def pens_of(self, tip: str) -> tuple[str, ...]:
        """Return the pens with a current tip."""
        folded = folded_name(tip)
        return tuple(p for p, each in self.in_force if folded_name(each) == folded)

    def due(self, pen: str, tip: str) -> date | None:
        """Return the last day of validity of a current tip."""
        found = self.current(pen, tip)
        days = [] if found is None else [self._today(found.due)]
        listed = self.library.tip(tip)
        if listed is not None and listed.due is not None:
            days.append(listed.due)
        return min(days, default=None)

    @staticmethod
    def _today(moment: datetime) -> date:
        return local_time(moment).date()
