"""The actions of ``lightpen tips``."""

import argparse
import json
from contextlib import closing
from pathlib import Path
from typing import Any

from msgspec import ValidationError, convert, to_builtins

from lightpen.archive.logbook import Logbook, folder_statuses
from lightpen.commands.arguments import data_of, supervisor_signature
from lightpen.commands.console import Command, printing, shown
from lightpen.errors import ArchiveError, UsageError
from lightpen.local_time import local_now
from lightpen.messages import printable
from lightpen.model.limits import DueRule
from lightpen.record.library.library_changes import (
    Author,
    add_item,
    change_item,
    known_item,
)
from lightpen.record.library.tip_library import (
    KIND_WORDS,
    MADE,
    AnyItem,
    ItemKind,
    Library,
    ListedTip,
    StationStatus,
    read_library,
)

VECTOR = "nominal_tip_mm"
NOT_ENTERED = ("id", "led_file", "bending")  # stated otherwise


@printing
def _list(options: argparse.Namespace) -> None:
    data = data_of(options)
    library = read_library(data)
    found = _statuses(data, library, options.max_days)
    records = [
        _record(item, found)
        for kind in ItemKind
        for item in library.items(kind).values()
        if options.all or not item.is_retired
    ]
    if options.json:
        print(json.dumps(records, indent=1))
        return
    for record in records:
        print(shown(_line(record)))
    if not records:
        print(shown(f"Nothing is listed in the library of {data}."))


@printing
def _add(options: argparse.Namespace) -> None:
    item = _with_entries(MADE[ItemKind(options.kind)](id=options.id), options)
    _enter_and_print(
        options, item, add_item(data_of(options), item, _author(options), local_now())
    )


@printing
def _change(options: argparse.Namespace) -> None:
    data = data_of(options)
    there = known_item(read_library(data), ItemKind(options.kind), options.id)
    item = _with_entries(there, options)
    library = change_item(data, item, _author(options), local_now(), there)
    _enter_and_print(options, item, library)


ACTIONS: dict[str, Command] = {"list": _list, "add": _add, "change": _change}


def _with_entries(item: AnyItem, options: argparse.Namespace) -> AnyItem:
    """Return an item with the given entries, each as its field takes it."""
    entries: dict[str, Any] = to_builtins(item)
    known = [name for name in item.__struct_fields__ if name not in NOT_ENTERED]
    for word in options.set:
        name, _, text = word.partition("=")
        if name not in known:
            raise UsageError(
                "library.no-entry",
                entry=printable(name),
                kind=KIND_WORDS[item.kind],
                known=", ".join(known),
            )
        entries.pop(name)
        if text:
            entries[name] = text.split() if name == VECTOR else text
        try:
            item = convert(entries, type(item), strict=False)
        except ValidationError as error:
            raise UsageError(
                "library.bad-entry", entry=name, value=printable(text), why=str(error)
            ) from error
    return item


def _author(options: argparse.Namespace) -> Author:
    """Return the author of a change."""
    signature = supervisor_signature(options.supervisor)
    return Author(options.station, options.operator, options.reason, signature)


def _enter_and_print(
    options: argparse.Namespace, item: AnyItem, library: Library
) -> None:
    """Enter a change in the archive and print the new state."""
    data = data_of(options)
    try:
        with closing(Logbook(data)) as logbook:
            faults = logbook.enter_owed()
    except ArchiveError as error:  # it stays owed
        faults = (error.message,)
    for fault in faults:
        print(shown(f"It is not in the archive yet: {fault}"))
    kept = known_item(library, item.kind, item.id.strip())
    record = _record(kept, _statuses(data, library, None))
    print(json.dumps(record, indent=1) if options.json else shown(_line(record)))


def _statuses(data: Path, library: Library, max_days: int | None) -> StationStatus:
    rule = DueRule() if not max_days else DueRule(max_days)
    return folder_statuses(data, rule, library, local_now())


def _record(item: AnyItem, found: StationStatus) -> dict[str, Any]:
    """Return the entries of an item and its status."""
    entries: dict[str, Any] = {"kind": item.kind.value}
    entries |= {n: e for n, e in to_builtins(item).items() if n != "type"}
    standing = found.of_item(item.kind, item.id)
    entries["standing"] = "" if standing is None else standing.value
    if isinstance(item, ListedTip):
        entries["in_force"] = [
            {
                "pen": pen,
                "calibrated": found.in_force[pen, item.id].calibrated.isoformat(
                    timespec="seconds"
                ),
                "due": str(found.due(pen, item.id)),
                "standing": found.of_tip(pen, item.id),
            }
            for pen in found.pens_of(item.id)
        ]
        if standing == "valid" and not entries["in_force"]:
            entries["standing"] = "not calibrated"
    return entries


def _line(record: dict[str, Any]) -> str:
    words = [record["kind"], record["id"]]
    ball = record.get("ball_diameter_mm")
    words += [] if ball is None else [f"{ball:g} mm"]
    words += [record["standing"]]
    for each in record.get("in_force", ()):
        words.append(f"pen {each['pen']}: {each['standing']}, due {each['due']}")
    if record["due"] is not None:
        words.append(f"by {record['due']}")
    return "  ".join(filter(None, [*words, record["note"]]))
