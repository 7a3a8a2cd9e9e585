"""Changes of the tip library: checked, approved if necessary, and stored."""

from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
from msgspec import structs

from lightpen.errors import NameTakenError, UsageError
from lightpen.formats.own_json import FORMAT, json_bytes, with_checksum
from lightpen.messages import Message, message, printable
from lightpen.model.limits import MOST_DAYS
from lightpen.record.library.entered_files import (
    make_folder,
    newest_number,
    numbered_file,
    write_counted,
)
from lightpen.record.library.supervision import (
    Signature,
    read_supervision,
    require_supervisor,
)
from lightpen.record.library.tip_library import (
    KIND_WORDS,
    LARGEST_BALL,
    LARGEST_CHANGE,
    LIBRARY,
    LONGEST_ID,
    AnyItem,
    Item,
    Library,
    LibraryChange,
    ListedTip,
    read_library,
)

LARGEST_PLACE = 10_000.0  # mm
SEPARATORS = set("/\\")  # of folders


@dataclass(frozen=True)
class Author:
    """Author of a change of the library."""

    station: str = ""
    operator: str = ""
    reason: str = ""  # may be empty
    signature: Signature | None = None  # of a supervisor, if a password is set


def add_item(data: Path, item: AnyItem, by: Author, now: datetime) -> Library:
    """Add an item, and return the library with it.

    Raises `UsageError` if its id is in use or no id, or an entry makes no sense, and
    `AcceptanceError` if there is a password and no supervisor has signed.
    """
    item = _sensible(item)
    while True:
        number = newest_number(data / LIBRARY) + 1
        there = read_library(data).item(item.kind, item.id)
        if there is not None:
            raise UsageError(_in_use(there))
        with suppress(NameTakenError):  # another program changed the library meanwhile
            return _keep(data, number, item, by, now)


def change_item(
    data: Path, item: AnyItem, by: Author, now: datetime, before: AnyItem | None = None
) -> Library:
    """Put another version of an item in its place, and return the library.

    An unchanged item is not stored again. ``before`` is the item as it was shown while
    it was edited. Raises `UsageError` if it is not in the library, an entry makes no
    sense, or it was changed since it was shown; see also `add_item`.
    """
    item = _sensible(item)
    while True:
        number = newest_number(data / LIBRARY) + 1
        library = read_library(data)
        there = library.item(item.kind, item.id)
        if there is None:
            kind, name = KIND_WORDS[item.kind], printable(item.id)
            raise UsageError("library.no-such-item", kind=kind, id=name)
        if there == item:
            return library
        if before is not None and there != before:
            raise UsageError(
                "library.changed-meanwhile",
                kind=KIND_WORDS[item.kind],
                id=printable(item.id),
            )
        with suppress(NameTakenError):  # another program changed the library meanwhile
            return _keep(data, number, item, by, now)


def _keep(data: Path, number: int, item: AnyItem, by: Author, now: datetime) -> Library:
    """Keep a change as the file of a number; `NameTakenError` if there is another."""
    supervisor, key = "", None
    supervision = read_supervision(data)
    if supervision.is_guarded:
        signature = by.signature or Signature("", "")
        key = require_supervisor(supervision, signature)
        supervisor = signature.name.strip()
    change = LibraryChange(
        format=FORMAT,
        at=now,
        item=item,
        station=by.station,
        operator=by.operator,
        supervisor=supervisor,
        reason=by.reason.strip(),
    )
    file = numbered_file(data / LIBRARY, number)
    make_folder(file.parent)
    write_counted(data, file, with_checksum(json_bytes(change)) + b"\n", key)
    return read_library(data)


def _sensible(item: AnyItem) -> AnyItem:
    """Return an item as stored; reject implausible values."""
    name = item.id.strip()
    is_id = name and name.isprintable() and not set(name) & SEPARATORS
    if not (is_id and len(name) <= LONGEST_ID):
        raise UsageError(
            "library.bad-id", id=printable(name[: 2 * LONGEST_ID]), most=LONGEST_ID
        )
    words = {"note": item.note.strip(), "certificate": item.certificate.strip()}
    item = structs.replace(item, id=name, **words)
    return _sensible_tip(item) if isinstance(item, ListedTip) else item


def _sensible_tip(tip: ListedTip) -> ListedTip:
    ball, change = tip.ball_diameter_mm, tip.max_change_mm
    if ball is not None and not 0 < ball <= LARGEST_BALL:
        raise UsageError("library.absurd-ball", diameter=ball, most=LARGEST_BALL)
    if change is not None and not 0 < change <= LARGEST_CHANGE:
        raise UsageError("library.absurd-change", limit=change, most=LARGEST_CHANGE)
    if tip.max_days is not None and not 1 <= tip.max_days <= MOST_DAYS:
        raise UsageError("library.absurd-count", count=tip.max_days, most=MOST_DAYS)
    nominal = tip.nominal_tip_mm
    if nominal is not None and not np.abs(nominal).max() <= LARGEST_PLACE:
        raise UsageError(
            "library.absurd-nominal", tip=printable(tip.id), most=LARGEST_PLACE
        )
    return tip


def _in_use(there: Item) -> Message:
    kind, name = KIND_WORDS[there.kind], printable(there.id)
    if there.is_retired:
        return message("library.id-of-retired", kind=kind, id=name)
    return message("library.id-in-use", kind=kind, id=name)
