"""Certificates are found by the names and values that a result states."""

from datetime import UTC, date, datetime
from pathlib import Path

from msgspec import structs
from tests.entering import retire_item

from lightpen.model.artefacts import Artefact, ArtefactKind
from lightpen.record.calibrations import certified_values, traced_items
from lightpen.record.library.library_changes import Author, add_item
from lightpen.record.library.tip_library import (
    ItemKind,
    ListedCamera,
    ListedReference,
    ListedTip,
    read_library,
)
from lightpen.record.swings.header import Names

NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)
BY = Author("Hall 2", "Ann")
RING = ListedReference(
    id="R-63",
    certified_mm=31.7512,
    certificate="K-17",
    certified=date(2025, 5, 2),
    due=date(2027, 5, 2),
)


def test_items_are_kept_with_their_certificates(tmp_path: Path) -> None:
    add_item(tmp_path, RING, BY, NOON)
    add_item(tmp_path, ListedCamera(id="CAM-7", certificate=" K-18 "), BY, NOON)

    library = read_library(tmp_path)
    assert library.references == {"R-63": RING}
    assert library.cameras["CAM-7"].certificate == "K-18"


def test_a_reference_with_its_shape_is_an_artefact_to_measure() -> None:
    ring = structs.replace(RING, shape=ArtefactKind.RING, uncertainty_mm=0.0005)

    assert RING.artefact is None
    assert ring.artefact == Artefact(ArtefactKind.RING, 31.7512, 0.0005)


def test_a_reference_is_found_by_its_certified_value_unless_retired(
    tmp_path: Path,
) -> None:
    record = {
        "characteristics": [
            {"nominal": 31.7512, "certified_expanded_uncertainty": 0.0005},
            {"nominal": 0.0, "certified_expanded_uncertainty": 0.0},
            {"nominal": 20.0, "certified_expanded_uncertainty": None},
        ]
    }
    assert certified_values(record) == (31.7512,)
    add_item(tmp_path, RING, BY, NOON)
    library = read_library(tmp_path)
    names, values = Names(pen="LP-04", tip="T-10"), certified_values(record)

    *_, reference = traced_items(library, names, certified=values)
    assert (reference.kind, reference.item) == (ItemKind.REFERENCE, RING)
    assert len(traced_items(library, names, certified=(31.75,))) == 2
    library = retire_item(tmp_path, ItemKind.REFERENCE, "R-63", BY, NOON)
    assert len(traced_items(library, names, certified=values)) == 2


def test_what_is_not_in_the_library_is_named_without_a_certificate(
    tmp_path: Path,
) -> None:
    tip = ListedTip(id="T-10", certificate="B-3")
    library = add_item(tmp_path, tip, BY, NOON)
    names = Names(pen="LP-04", tip="T-10", cone="C-1")

    found = traced_items(library, names, ("CAM-7", "CAM-8"))
    assert [(each.kind, each.id, each.item) for each in found] == [
        (ItemKind.CAMERA, "CAM-7", None),
        (ItemKind.CAMERA, "CAM-8", None),
        (ItemKind.PEN, "LP-04", None),
        (ItemKind.TIP, "T-10", tip),
        (ItemKind.CONE, "C-1", None),
    ]
