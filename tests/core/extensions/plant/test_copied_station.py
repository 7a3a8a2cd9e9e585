"""Both copies of a data folder were used: what docs/archive.md says to do then."""

import shutil
from collections.abc import Callable
from contextlib import closing
from datetime import timedelta
from pathlib import Path
from subprocess import CompletedProcess

import pytest
from benchmarks.postgres_server import Postgres
from tests.core.archive.conftest import NOON

from lightpen.archive.logbook import Logbook
from lightpen.errors import FileError
from lightpen.record.library.library_changes import Author, add_item
from lightpen.record.library.signing import KEYS, key_folder
from lightpen.record.library.tip_library import ListedCone, ListedTip
from lightpen_extensions.plant.server import SERVER

Run = Callable[..., CompletedProcess[str]]
BY = Author("Hall 2", "Ann")
HOUR = timedelta(hours=1)


def enter(data: Path) -> None:
    with closing(Logbook(data)) as logbook:
        assert logbook.enter_owed() == ()


def test_one_copy_goes_on_and_the_other_begins_a_new_folder(
    postgres: Postgres, lightpen: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant = postgres.new_database()
    station, copy = tmp_path / "station", tmp_path / "copy"
    hall_2, hall_3 = (postgres.new_role(plant, "lightpen_station") for _ in "23")
    monkeypatch.setenv(SERVER, hall_2)
    add_item(station, ListedTip(id="T-1"), BY, NOON)
    enter(station)
    shutil.copytree(station, copy)
    copied_keys = shutil.copytree(key_folder(), tmp_path / "copied keys")
    add_item(station, ListedCone(id="C-0"), BY, NOON + HOUR)
    enter(station)
    assert lightpen("archive", "deliver", "--data", station).returncode == 0

    # In the same user account it does not go on; in another one it is found, and named.
    with pytest.raises(FileError, match="replaced by an older copy"):
        add_item(copy, ListedCone(id="C-1"), BY, NOON + HOUR)
    with monkeypatch.context() as other_account:
        other_account.setenv(KEYS, str(copied_keys))
        add_item(copy, ListedCone(id="C-1"), BY, NOON + HOUR)
        enter(copy)
        refused = lightpen("archive", "deliver", "--data", copy)
        assert refused.returncode == 2
        assert "a data folder was copied and both copies were used" in refused.stderr
        checked = lightpen("archive", "check", "--server", "--data", copy)
        assert checked.returncode == 1
        assert "Entry 2 of chain" in checked.stdout

    # The other copy stays as it is; its work goes on in a new folder, as a new station.
    new = tmp_path / "new"
    monkeypatch.setenv(SERVER, hall_3)
    add_item(new, ListedTip(id="T-1"), BY, NOON)
    assert lightpen("archive", "deliver", "--data", new).returncode == 0

    # Nobody is accused any more.
    for data, address in ((station, hall_2), (new, hall_3)):
        monkeypatch.setenv(SERVER, address)
        end = lightpen("archive", "check", "--server", "--data", data)
        assert (end.stdout.count("No change was found"), end.returncode) == (1, 0)
