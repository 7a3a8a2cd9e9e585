"""What ``lightpen tips`` keeps and prints, and the exit status it ends with."""

import json
import shutil
from collections.abc import Callable
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from subprocess import CompletedProcess

from lightpen.archive.chains import Kind, own_chain
from lightpen.archive.logbook import Logbook
from lightpen.archive.store import open_file
from lightpen.record.library.entered_files import ARCHIVE
from lightpen.record.library.supervision import LIMITS_FOLDER, Signature, set_password
from lightpen_extensions.plant.copies import entries_of

Run = Callable[..., CompletedProcess[str]]
NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)
EVE = Signature("Eve", "correct horse")


def test_a_tip_is_added_changed_retired_and_listed(
    lightpen: Run, tmp_path: Path
) -> None:
    where = ("--data", tmp_path / "data", "--operator", "Ann")
    tip = ("tip", "T-10", *where)
    added = lightpen(
        *(
            "tips",
            "add",
            *tip,
            "--set",
            "ball_diameter_mm=10",
            "nominal_tip_mm=0 1.5 -150",
        ),
        *("max_change_mm=0.02", "max_days=7"),
    )
    assert added.stdout == "tip  T-10  10 mm  not calibrated\n", added.stderr

    lightpen("tips", "change", *tip, "--set", "max_change_mm=", "due=2031-05-01")
    lightpen("tips", "add", "cone", "C-1", *where, "--set", "note=by the door")
    retired = ("--set", "is_retired=true", "--reason", "chipped")
    lightpen("tips", "change", "cone", "C-1", *where, *retired)

    listed = lightpen("tips", "list", *where[:2], "--json")
    (record,) = json.loads(listed.stdout)
    assert record["nominal_tip_mm"] == [0, 1.5, -150]
    assert (record["max_change_mm"], record["max_days"]) == (None, 7)
    assert (record["due"], record["standing"]) == ("2031-05-01", "not calibrated")
    everything = lightpen("tips", "list", *where[:2], "--all").stdout
    assert "cone  C-1  retired  by the door\n" in everything

    with closing(open_file(tmp_path / "data" / ARCHIVE)) as database:
        events = [e.entry.event for e in entries_of(database, own_chain(database))]
    assert [event.kind for event in events] == 4 * [Kind.LIBRARY]
    assert {event.names.operator for event in events} == {"Ann"}
    assert events[-1].reason == "chipped"


def test_certificates_are_kept_and_only_references_have_a_value(
    lightpen: Run, tmp_path: Path
) -> None:
    where = ("--data", tmp_path / "data")
    dated = ("--set", "certificate=K-17", "certified=2026-03-01")
    ring = ("certified_mm=31.7512", "shape=ring", "uncertainty_mm=0.0005")
    lightpen("tips", "add", "reference", "R-1", *where, *dated, *ring)
    lightpen("tips", "add", "camera", "CAM-7", *where, *dated)
    camera = ("tips", "change", "camera", "CAM-7", *where)
    refused = lightpen(*camera, "--set", "certified_mm=3")
    lightpen(*camera, "--set", "certified=")

    camera, reference = json.loads(lightpen("tips", "list", *where, "--json").stdout)
    assert "'certified_mm' is not an entry of a camera" in refused.stderr
    assert (camera["certificate"], camera["certified"]) == ("K-17", None)
    assert (reference["certified"], reference["certified_mm"]) == (
        "2026-03-01",
        31.7512,
    )
    assert (reference["shape"], reference["uncertainty_mm"]) == ("ring", 0.0005)


def test_a_library_without_anything_is_named(lightpen: Run, tmp_path: Path) -> None:
    listed = lightpen("tips", "list", "--data", tmp_path / "elsewhere")

    assert listed.returncode == 0
    assert "Nothing is listed" in listed.stdout
    assert "elsewhere" in listed.stdout


def test_what_makes_no_sense_is_refused_and_nothing_is_kept(
    lightpen: Run, tmp_path: Path
) -> None:
    where = ("--data", tmp_path / "data")
    for words, reported in (
        (
            ("add", "tip", "T-1", "--set", "ball_diameter_mm=0"),
            "not a valid ball_diameter_mm",
        ),
        (
            ("add", "cone", "C-1", "--set", "ball_diameter_mm=5"),
            "not an entry of a cone",
        ),
        (
            ("add", "tip", "T-1", "--set", "nominal_tip_mm=0 1"),
            "not a valid nominal_tip_mm",
        ),
        (("add", "tip", "T-1", "--set", "due=soon"), "'soon' is not a valid due"),
        (("add", "pen", "LP", "--set", "id=other"), "not an entry of a pen"),
        (("change", "tip", "T-1"), "There is no tip T-1 in the library"),
    ):
        refused = lightpen("tips", *words, *where)
        assert refused.returncode == 2
        assert reported in refused.stderr
    assert not (tmp_path / "data" / "library").exists()


def test_a_copy_of_a_guarded_folder_without_its_limits_takes_no_change(
    lightpen: Run, tmp_path: Path
) -> None:
    data, copy = tmp_path / "data", tmp_path / "copy"
    set_password(data, EVE, EVE.password, NOON)
    with closing(Logbook(data)) as logbook:
        logbook.enter_owed()
    shutil.copytree(data, copy)
    shutil.rmtree(copy / LIMITS_FOLDER)

    refused = lightpen("tips", "add", "cone", "C-1", "--data", copy)
    assert refused.returncode != 0
    assert f"{LIMITS_FOLDER}/000001.json" in refused.stderr
    assert not (copy / "library").exists()
