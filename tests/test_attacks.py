"""Whoever may write to a data folder gets no tip into force, and hides nothing.

Each attack is carried out in a folder with a supervisor password, by somebody who can
write to it, but has neither password nor user account of the station. Afterwards the
program either refuses to go on, or all is in force as before; and what was removed or
changed is found by the check of the archive.
"""

import json
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, replace
from datetime import timedelta
from pathlib import Path

import pytest
from msgspec import structs
from tests.core.archive.conftest import NOON
from tests.core.archive.test_logbook import result
from tests.core.archive.test_station_events import keep
from tests.entering import enter_in, entries_of, retire_item

from lightpen.archive.chains import (
    ChainHead,
    FileHash,
    Kind,
    StoredEntry,
    chain_at_home,
    chain_head,
    chained,
    columns_of,
)
from lightpen.archive.checks import check_file
from lightpen.archive.logbook import Logbook
from lightpen.archive.store import look_into
from lightpen.errors import ArchiveError, FileError
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.files import sha256
from lightpen.formats.own_json import CHECKSUM, with_checksum
from lightpen.model.limits import StationLimits, SwingLimits
from lightpen.record.library import entered_files
from lightpen.record.library.entered_files import ARCHIVE
from lightpen.record.library.library_changes import Author, add_item
from lightpen.record.library.signing import (
    KEYS,
    STATION_FILE,
    entry_text,
    key_folder,
    make_station_key,
)
from lightpen.record.library.supervision import (
    Signature,
    read_supervision,
    save_limits,
    set_limits,
)
from lightpen.record.library.tip_library import ItemKind, ListedTip, read_library
from lightpen.record.results.result_folder import RECORDS, FolderArchive

EVE = Signature("Eve", "correct horse")
BY = Author("Hall 2", "Ann", signature=EVE)
LAX, STRICT = (StationLimits(SwingLimits(u)) for u in (5.0, 0.0005))
CHIPPED = "The cone was chipped, do not use."


@dataclass(frozen=True)
class Station:
    """A data folder, an older copy of it, and that of another station."""

    data: Path
    backup: Path
    other: Path


@dataclass(frozen=True)
class State:
    """What is in force in a data folder."""

    tip_mm: tuple[float, ...]
    limits: StationLimits
    is_retired: bool


def state_of(data: Path) -> State:
    found = FolderArchive(data).in_force("LP-04", "T-10")
    assert found is not None
    limits = read_supervision(data).limits_at("Hall 2", LAX)
    tip = found.calibration.tip_pen_mm
    return State(tuple(tip), limits, read_library(data).has_retired("T-11"))


BEFORE = State((0.0, 2.0, 3.0), STRICT, is_retired=True)


@pytest.fixture(scope="module")
def made(swung: Callable[..., Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A station, as `Station` names its folders, with the keys of its account."""
    folder = tmp_path_factory.mktemp("attacked")
    with pytest.MonkeyPatch.context() as account:
        account.setenv(KEYS, str(folder / "keys"))
        data = folder / "data"
        shutil.copytree(swung(), data / RECORDS / "swing")
        save_limits(data, "Hall 2", LAX, EVE, "", NOON)
        add_item(data, ListedTip(id="T-11"), BY, NOON)
        FolderArchive(data).store(result(data, 0))
        enter_in(data)
        FolderArchive(data).store(result(data, 1))
        keep(data, Grade.CHECK)
        enter_in(data)
        shutil.copytree(data, folder / "backup")
        set_limits(data, "Hall 2", STRICT, EVE, NOON)
        retire_item(data, ItemKind.TIP, "T-11", BY, NOON)
        later = NOON + timedelta(days=1)
        FolderArchive(data).revoke(result(data, 1), "Ann", later, "Bent.", EVE)
        with closing(Logbook(data)) as logbook:
            assert logbook.enter_owed() == ()
            (head, *_) = entries_of(logbook.database, logbook.chain)
            logbook.enter_note(head, CHIPPED, "Ann")
        account.setenv(KEYS, str(folder / "keys of another"))
        other = folder / "other"
        shutil.copytree(swung(), other / RECORDS / "swing")
        for n in range(4, 8):
            FolderArchive(other).store(result(other, n))
        enter_in(other)
    return folder


@pytest.fixture
def station(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Station:
    shutil.copytree(made, tmp_path / "plant")
    monkeypatch.setenv(KEYS, str(tmp_path / "plant" / "keys"))
    folders = (tmp_path / "plant" / name for name in ("data", "backup", "other"))
    station = Station(*folders)
    assert state_of(station.data) == BEFORE  # the account knows it at this place
    monkeypatch.setattr(entered_files, "_readings", {})  # another program then
    return station


def appended(file: Path, entries: str) -> None:
    """Add entries to a text after all others, and renew its checksum."""
    head, mark, rest = file.read_bytes().partition(CHECKSUM)
    _, _, end = rest.partition(b'"')
    body = with_checksum(head + b", " + entries.encode() + b"}")
    file.write_bytes(body.removesuffix(b"}") + end if mark else body)


def sql(data: Path, *statements: str) -> None:
    with closing(sqlite3.connect(data / ARCHIVE)) as connection, connection:
        for statement in statements:
            connection.executescript(statement)


def remove(*places: str) -> Callable[[Station], None]:
    def attack(station: Station) -> None:
        for place in places:
            path = station.data / place
            shutil.rmtree(path) if path.is_dir() else path.unlink()

    return attack


def put(source: str, target: str, of: str = "data") -> Callable[[Station], None]:
    """Return what copies a file or folder of a station's folder to a place."""

    def attack(station: Station) -> None:
        here, there = getattr(station, of) / source, station.data / target
        remove(target)(station) if there.exists() else None
        shutil.copytree(here, there) if here.is_dir() else shutil.copy(here, there)

    return attack


def add(place: str, entries: str) -> Callable[[Station], None]:
    return lambda station: appended(station.data / place, entries)


def change(*statements: str) -> Callable[[Station], None]:
    return lambda station: sql(station.data, *statements)


def all_of(*attacks: Callable[[Station], None]) -> Callable[[Station], None]:
    def attack(station: Station) -> None:
        for each in attacks:
            each(station)

    return attack


def written_on(station: Station, write: Callable[[StoredEntry], StoredEntry]) -> None:
    """Continue the chain by an entry after the last, signed by a key of one's own."""
    with closing(look_into(station.data / ARCHIVE)) as database:
        chain = chain_at_home(database)
        assert chain is not None
        *_, last = entries_of(database, chain)
        new = write(last)
    columns = columns_of(new)
    marks = ", ".join("?" * len(columns))
    with closing(sqlite3.connect(station.data / ARCHIVE)) as connection, connection:
        connection.execute(
            f"INSERT INTO archive_entries ({', '.join(columns)}) VALUES ({marks})",
            tuple(columns.values()),
        )


def signed_by_oneself(station: Station, *, introduces: bool) -> None:
    """Enter another station's result, signed by a key that nobody introduced."""
    put("results/000001.json", "results/000009.json", of="other")(station)
    with pytest.MonkeyPatch.context() as account:
        account.setenv(KEYS, str(station.data.parent / "keys of another"))
        key = make_station_key()

    def write(last: StoredEntry) -> StoredEntry:
        entry = last.entry
        file = station.data / "results" / "000009.json"
        head = ChainHead(entry.chain, entry.number, last.sha256, entry.since)
        event = structs.replace(
            entry.event,
            kind=Kind.LIMITS if introduces else Kind.ACCEPTED,
            result=FileHash("results/000009.json", sha256(file)),
            settings={"station_key": key.public} if introduces else {},
        )
        new = chained(head, event)
        signature = key.public + key.sign(entry_text(new.sha256))
        return replace(new, signature=signature)

    written_on(station, write)


def other_chain(station: Station) -> None:
    """Let the archive of another station be that of this one."""
    for name in (ARCHIVE, "results"):
        put(name, name, of="other")(station)


def other_folder(station: Station) -> None:
    """Let the whole folder be that of another station."""
    shutil.rmtree(station.data)
    shutil.copytree(station.other, station.data)


def other_folder_behind_a_link(station: Station) -> None:
    station.data.rename(station.data.with_name("real"))
    station.data.symlink_to(station.other, target_is_directory=True)


def as_link(station: Station) -> None:
    """Reach the folder by a link, without its limits."""
    remove("limits")(station)
    real = station.data.rename(station.data.with_name("real"))
    station.data.symlink_to(real, target_is_directory=True)


def edited_result(station: Station) -> None:
    file = station.data / "results" / "000001.json"
    head, mark, rest = file.read_bytes().partition(b'"calibration": ')
    whole = json.loads(rest.rstrip().removesuffix(b"}"))
    whole["tip_pen_mm"] = [9.0, 9.0, 9.0]
    file.write_bytes(head + mark + json.dumps(whole).encode() + b"\n}\n")


FORGED: dict[str, Callable[[Station], None]] = {
    # Keys after the others (H1)
    "a result says that it revokes another": add(
        "results/000001.json", '"takes_back": "000002"'
    ),
    "the revocation says that it revokes another": add(
        "results/000003.json", '"takes_back": "000001"'
    ),
    "a password file sets limits": add(
        "limits/000001.json", '"station": "Hall 2", "limits": {"max_tip_mm": 9.0}'
    ),
    "a change of the library brings a tip back": add(
        "library/000002.json", '"item": {"type": "tip", "id": "T-11"}'
    ),
    "a tip is another one": edited_result,
    # Files
    "the revocation is removed": remove("results/000003.json"),
    "the results are those of the backup": put("results", "results", of="backup"),
    "the newest limits are removed": remove("limits/000003.json"),
    "all limits are removed": remove("limits"),
    "the limits are those of the backup": put("limits", "limits", of="backup"),
    "the retirement is removed": remove("library/000002.json"),
    "the library is that of the backup": put("library", "library", of="backup"),
    "a result is put in place of the revocation": put(
        "results/000002.json", "results/000003.json"
    ),
    # The archive
    "the archive is removed (H3)": remove(ARCHIVE),
    "the archive is that of the backup": put(ARCHIVE, ARCHIVE, of="backup"),
    "the folder is the backup (M1)": all_of(
        *(put(name, name, of="backup") for name in (ARCHIVE, "results", "limits")),
        put("library", "library", of="backup"),
    ),
    "the archive and its results are another station's": other_chain,
    "the folder is another station's": other_folder,
    "the folder leads to another station's": other_folder_behind_a_link,
    "the archive is removed with the name of its chain": remove(ARCHIVE, STATION_FILE),
    "the archive is not one": lambda station: sql(
        station.data, "DROP TABLE archive_entries"
    ),
    "the last number is moved (H2)": change(
        "UPDATE archive_entries SET number = number + 1 WHERE number ="
        " (SELECT max(number) FROM archive_entries)"
    ),
    "the entry of the revocation is removed": all_of(
        change("DELETE FROM archive_entries WHERE kind = 'revoked'"),
        remove("results/000003.json"),
    ),
    "the revocation is hidden from searches": all_of(
        change("UPDATE archive_entries SET result = '' WHERE kind = 'revoked'"),
        remove("results/000003.json"),
    ),
    "the entry of the revocation is reworded": change(
        "UPDATE archive_entries SET text = replace(text, 'revoked', 'note')"
        " WHERE kind = 'revoked'"
    ),
    "two entries change places": change(
        "UPDATE archive_entries SET number = 99 WHERE number = 3;"
        "UPDATE archive_entries SET number = 3 WHERE number = 4;"
        "UPDATE archive_entries SET number = 4 WHERE number = 99"
    ),
    "the last entries are removed": change(
        "DELETE FROM archive_entries WHERE number > 6"
    ),
    "an entry is added with a key of one's own": lambda station: signed_by_oneself(
        station, introduces=False
    ),
    "a key of one's own is introduced": lambda station: signed_by_oneself(
        station, introduces=True
    ),
    "the folder is reached by a link, without limits (M2)": as_link,
}
PASSED_OVER: dict[str, Callable[[Station], None]] = {
    "an older result once more": put("results/000002.json", "results/000004.json"),
    "a result of another station": put(
        "results/000001.json", "results/000004.json", of="other"
    ),
    "a result of a number with a zero more": put(
        "results/000002.json", "results/0000004.json"
    ),
    "older limits once more": put("limits/000002.json", "limits/000004.json"),
    "an older state of a tip once more": put(
        "library/000001.json", "library/000003.json"
    ),
    "a verification of another tip": put(
        "verifications/000001.json", "verifications/000002.json"
    ),
}
FOUND: dict[str, Callable[[Station], None]] = {
    "a comment is removed": change("DELETE FROM archive_entries WHERE kind = 'note'"),
    "a comment is reworded": change(
        "UPDATE archive_entries SET text = replace(text, 'chipped', 'mended')"
    ),
    "a verification is removed": remove("verifications/000001.json"),
    "a verification says accepted (H1)": add(
        "verifications/000001.json", '"outcome": "accepted"'
    ),
    "a record is reworded": change(
        "UPDATE archive_records SET text = replace(text, '0.1', '0.2')"
    ),
    "a record is removed": change(
        "DELETE FROM archive_records WHERE sha256 ="
        " (SELECT max(sha256) FROM archive_records)"
    ),
    "a searched column is changed": change(
        "UPDATE archive_entries SET tip = 'T-12' WHERE kind = 'accepted'"
    ),
}


def test_before_any_attack_all_is_in_force_and_nothing_is_found(
    station: Station,
) -> None:
    assert state_of(station.data) == BEFORE
    checked = check_file(station.data / ARCHIVE, station.data, lambda _: None)
    assert (checked.findings, checked.notes) == ((), ())


def started(data: Path) -> None:
    """Start and end the program, which enters what it owes."""
    try:
        with closing(Logbook(data)) as logbook:
            logbook.enter_owed()
    except ArchiveError:
        return


def findings(data: Path) -> tuple[str, ...]:
    try:
        checked = check_file(data / ARCHIVE, data, lambda _: None)
    except ArchiveError as error:
        return (error.message.code,)
    return tuple(each.code for each in checked.findings)


@pytest.mark.timeout(60)
@pytest.mark.parametrize("attack", FORGED)
def test_nothing_is_accepted_after_it_and_it_is_found(
    station: Station, attack: str
) -> None:
    FORGED[attack](station)
    started(station.data)
    with pytest.raises(FileError):
        state_of(station.data)
    assert findings(station.data)


@pytest.mark.timeout(60)
@pytest.mark.parametrize("attack", PASSED_OVER)
def test_a_file_that_is_added_is_not_entered_and_changes_nothing(
    station: Station, attack: str
) -> None:
    PASSED_OVER[attack](station)
    started(station.data)
    assert state_of(station.data) == BEFORE
    checked = check_file(station.data / ARCHIVE, station.data, lambda _: None)
    assert checked.findings == ()
    assert [each.code for each in checked.notes] == ["archive.file-not-entered"]


@pytest.mark.timeout(60)
@pytest.mark.parametrize("attack", FOUND)
def test_what_is_hidden_is_found(station: Station, attack: str) -> None:
    FOUND[attack](station)
    started(station.data)
    assert findings(station.data)


def test_a_result_that_a_backup_accepts_in_another_account_counts_nowhere_else(
    station: Station, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = key_folder()
    with monkeypatch.context() as account:
        account.setenv(KEYS, str(tmp_path / "other account"))
        FolderArchive(station.backup).store(result(station.backup, 5))
    assert key_folder() == own
    put("results/000003.json", "results/000004.json", of="backup")(station)
    started(station.data)
    assert state_of(station.data) == BEFORE


def test_a_trigger_that_removes_what_is_entered_is_found(station: Station) -> None:
    sql(
        station.data,
        "CREATE TRIGGER gone AFTER INSERT ON archive_entries BEGIN"
        " DELETE FROM archive_entries WHERE number = NEW.number - 1; END",
    )
    FolderArchive(station.data).store(result(station.data, 5))
    started(station.data)
    with pytest.raises(FileError):
        state_of(station.data)
    assert findings(station.data)


def test_the_head_is_that_of_the_chain(station: Station) -> None:
    with closing(Logbook(station.data)) as logbook:
        head = chain_head(logbook.database, logbook.chain)
    memory = json.loads((key_folder() / f"head-{logbook.chain}.json").read_bytes())
    assert (memory["number"], memory["sha256"]) == (head.number, head.sha256)
