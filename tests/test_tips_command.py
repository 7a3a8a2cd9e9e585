"""What ``lightpen tips`` prints, and the exit status it ends with."""

import json
from collections.abc import Callable
from datetime import UTC, date, datetime
from pathlib import Path
from subprocess import CompletedProcess

from msgspec import structs

from lightpen.model.artefacts import ArtefactKind
from lightpen.record.library.library_changes import Author, add_item, change_item
from lightpen.record.library.tip_library import ListedCone, ListedReference, ListedTip

Run = Callable[..., CompletedProcess[str]]
NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)
ANN = Author(operator="Ann")


def test_items_are_listed_with_their_entries_and_status(
    lightpen: Run, tmp_path: Path
) -> None:
    data = tmp_path / "data"
    tip = ListedTip(
        id="T-10",
        ball_diameter_mm=10.0,
        nominal_tip_mm=(0.0, 1.5, -150.0),
        max_days=7,
        due=date(2031, 5, 1),
    )
    cone = ListedCone(id="C-1", note="by the door")
    ring = ListedReference(
        id="R-1", shape=ArtefactKind.RING, certified_mm=31.7512, certificate="K-17"
    )
    for item in (tip, cone, ring):
        add_item(data, item, ANN, NOON)
    change_item(data, structs.replace(cone, is_retired=True), ANN, NOON)

    listed = lightpen("tips", "list", "--data", data)
    assert "tip  T-10  10 mm  not calibrated  by 2031-05-01\n" in listed.stdout
    assert "C-1" not in listed.stdout
    everything = lightpen("tips", "list", "--data", data, "--all").stdout
    assert "cone  C-1  retired  by the door\n" in everything
    found = json.loads(lightpen("tips", "list", "--data", data, "--json").stdout)
    first, second = found
    assert first["nominal_tip_mm"] == [0, 1.5, -150]
    assert (first["due"], first["standing"]) == ("2031-05-01", "not calibrated")
    assert (second["shape"], second["certified_mm"]) == ("ring", 31.7512)
    assert second["certificate"] == "K-17"


def test_a_library_without_anything_is_named(lightpen: Run, tmp_path: Path) -> None:
    listed = lightpen("tips", "list", "--data", tmp_path / "elsewhere")

    assert listed.returncode == 0
    assert "Nothing is listed" in listed.stdout
    assert "elsewhere" in listed.stdout
