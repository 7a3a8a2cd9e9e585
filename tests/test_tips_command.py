"""What ``lightpen tips`` keeps and prints, and the exit status it ends with."""

import json
import shutil
from collections.abc import Callable
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from subprocess import CompletedProcess

from lightpen.archive.chains import Kind, entries_of
from lightpen.archive.growth import own_chain
from lightpen.archive.logbook import Logbook
from lightpen.archive.store import open_file
from lightpen.record.library.entered_files import ARCHIVE
from lightpen.record.library.supervision import LIMITS_FOLDER, Signature, set_password

Run = Callable[..., CompletedProcess[str]]
NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)
EVE = Signature("Eve", "correct horse")


def test_a_tip_is_added_changed_retired_and_listed(
    lightpen: Run, tmp_path: Path
) -> None:
    where = ("--data", tmp_path / "data", "--operator", "Ann")
    tip = ("tip", "T-10", *where)
    added = lightpen(
        *("tips", "add", *tip, "--ball-diameter", "10", "--nominal", "0", "1.5"),
        *("-150", "--max-change", "0.02", "--max-days", "7"),
    )
    assert added.stdout == "tip  T-10  10 mm  not calibrated\n", added.stderr

    lightpen("tips", "change", *tip, "--max-change", "none", "--due", "2031-05-01")
    lightpen("tips", "add", "cone", "C-1", *where, "--note", "by the door")
    lightpen("tips", "retire", "cone", "C-1", *where, "--reason", "chipped")

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
    dated = ("--certificate", "K-17", "--certified", "2026-03-01")
    lightpen(
        "tips",
        "add",
        "reference",
        "R-1",
        *where,
        *dated,
        "--value",
        "31.7512",
        *("--shape", "ring", "--value-uncertainty", "0.0005"),
    )
    lightpen("tips", "add", "camera", "CAM-7", *where, *dated)
    refused = lightpen("tips", "change", "camera", "CAM-7", *where, "--value", "3")
    lightpen("tips", "change", "camera", "CAM-7", *where, "--certified", "none")

    camera, reference = json.loads(lightpen("tips", "list", *where, "--json").stdout)
    assert "Only a reference has a certified value" in refused.stderr
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
        (("add", "tip", "T-1", "--ball-diameter", "0"), "diameter 0 mm is not valid"),
        (("add", "cone", "C-1", "--ball-diameter", "5"), "Only a tip has a ball"),
        (("add", "tip", "T-1", "--nominal", "0", "1"), "takes three numbers"),
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
