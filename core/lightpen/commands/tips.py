"""``lightpen tips``: the library of pens, tips and cones."""

import argparse
import json
from typing import Any

from msgspec import to_builtins

from lightpen.archive.logbook import folder_statuses
from lightpen.commands.arguments import add_data, data_of, whole_number
from lightpen.commands.console import printing, shown
from lightpen.local_time import local_now
from lightpen.model.limits import DueRule
from lightpen.record.library.tip_library import (
    AnyItem,
    ItemKind,
    ListedTip,
    StationStatus,
    read_library,
)


def add_tips(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen tips``."""
    parser.set_defaults(run=_list_items)
    actions = parser.add_subparsers(required=True, metavar="ACTION", dest="action")
    listed = actions.add_parser("list", help="list items and their calibration status")
    add_data(listed)
    listed.add_argument("--json", action="store_true", help="print JSON")
    listed.add_argument("--all", action="store_true", help="include retired items")
    listed.add_argument(
        "--max-days",
        type=whole_number,
        metavar="N",
        help="calibration interval in days for tips without their own (30)",
    )


@printing
def _list_items(options: argparse.Namespace) -> None:
    """Print the items of a library with their status."""
    data = data_of(options)
    library = read_library(data)
    rule = DueRule(options.max_days) if options.max_days else DueRule()
    found = folder_statuses(data, rule, library, local_now())
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
