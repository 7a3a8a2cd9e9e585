"""Traceability of a result: the certificates of its equipment."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lightpen.record.library.tip_library import AnyItem, ItemKind, Library
from lightpen.record.swings.names import Names

SAME = 1e-6  # mm, between the certified values of library and verification


@dataclass(frozen=True)
class TracedItem:
    """An item that a result was measured with; None if it is not in the library."""

    kind: ItemKind
    id: str
    item: AnyItem | None


def traced_items(
    library: Library,
    names: Names,
    cameras: Sequence[str] = (),
    certified: Collection[float] = (),
) -> tuple[TracedItem, ...]:
    """Return pen, tip, cone, cameras and references of a result.

    The cameras are found by their serial numbers, references by the certified values,
    mm, that the result was compared with.
    """
    used = [
        (ItemKind.CAMERA, tuple(cameras)),
        *((ItemKind.PEN, (names.pen,)), (ItemKind.TIP, (names.tip,))),
        (ItemKind.CONE, (names.cone,)),
        (ItemKind.REFERENCE, tuple(_references(library, certified))),
    ]
    return tuple(
        TracedItem(kind, name, library.item(kind, name))
        for kind, ids in used
        for name in ids
        if name
    )


def certified_values(record: Mapping[str, Any]) -> tuple[float, ...]:
    """Return the certified values in the record of a verification, mm."""
    return tuple(
        each["nominal"]
        for each in record.get("characteristics", ())
        if each.get("certified_expanded_uncertainty") is not None and each["nominal"]
    )


def _references(library: Library, certified: Collection[float]) -> Iterator[str]:
    for each in library.references.values():
        value = each.certified_mm
        if value is None or each.is_retired:
            continue
        if any(abs(value - other) <= SAME for other in certified):
            yield each.id
