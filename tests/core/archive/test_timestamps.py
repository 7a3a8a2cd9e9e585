"""Timestamps by the authority of OpenSSL are verified, and forged ones found."""

import subprocess
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from shutil import copy, which
from urllib.request import urlopen

import pytest
from msgspec import structs
from rfc3161_client import HashAlgorithm, TimestampRequestBuilder
from sqlalchemy import delete, update
from tests.core.archive.conftest import Station, accepted
from tests.timestamp_authority import Tsa, running_tsa

from lightpen.archive.chains.entries import NOTHING_BEFORE
from lightpen.archive.chains.growth import append
from lightpen.archive.checks.check import ArchiveCheckResult, check_archive
from lightpen.archive.checks.timestamps import (
    TIMESTAMPS,
    Authority,
    request_timestamp,
    with_timestamps,
)
from lightpen.archive.store.tables import CHAINS, ENTRIES, RECORDS
from lightpen.cli import main
from lightpen.errors import ArchiveError, FileError
from lightpen.formats import machine_settings

pytestmark = pytest.mark.skipif(which("openssl") is None, reason="needs OpenSSL")


@pytest.fixture(scope="module")
def tsa(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tsa]:
    with running_tsa(tmp_path_factory.mktemp("tsa") / "one") as made:
        yield made


@pytest.fixture(scope="module")
def other(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tsa]:
    with running_tsa(tmp_path_factory.mktemp("tsa") / "other") as made:
        yield made


@pytest.fixture(autouse=True)
def _no_settings(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    none = tmp_path / "machine.json"
    monkeypatch.setattr(machine_settings, "machine_file", lambda: none)
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")


def folder_of(station: Station) -> Path:
    assert station.database.file is not None
    return station.database.file.parent


def check(station: Station, root: Path | None) -> ArchiveCheckResult:
    data = folder_of(station)
    checked = check_archive(station.database)
    return with_timestamps(checked, station.database, data, root)


def findings(station: Station, root: Path | None) -> str:
    return "\n".join(map(str, check(station, root).findings))


def test_the_last_entry_is_timestamped_once_and_its_timestamp_verified(
    station: Station, tsa: Tsa
) -> None:
    station.enter(3)
    before = datetime.now(UTC) - timedelta(seconds=1)
    stamped = request_timestamp(station.database, folder_of(station), tsa.by)

    assert stamped.number == 3
    assert before <= stamped.at <= datetime.now(UTC)
    for pinned in (tsa.root, tsa.own):
        checked = check(station, pinned)
        assert (checked.findings, checked.notes) == ((), ())
        assert checked.n_timestamps == 1
    with pytest.raises(ArchiveError, match="has a timestamp already"):
        request_timestamp(station.database, folder_of(station), tsa.by)


def test_openssl_verifies_the_file_by_the_hash_of_the_entry(
    station: Station, tsa: Tsa
) -> None:
    entry = station.enter(2)[-1]
    stamped = request_timestamp(station.database, folder_of(station), tsa.by)
    words = ["openssl", "ts", "-verify", "-CAfile", str(tsa.root)]
    words += ["-in", str(stamped.file), "-digest", entry.sha256]

    done = subprocess.run(words, capture_output=True)
    assert done.stdout == b"Verification: OK\n"


def test_entries_after_the_last_timestamp_are_noted(station: Station, tsa: Tsa) -> None:
    station.enter(1)
    request_timestamp(station.database, folder_of(station), tsa.by)
    station.enter(2, first=1)

    checked = check(station, tsa.root)
    assert checked.findings == ()
    assert "Entries after entry 1 without a timestamp: 2" in str(checked.notes[0])


def test_without_the_certificate_signatures_are_said_not_to_be_verified(
    station: Station, tsa: Tsa
) -> None:
    station.enter(1)
    request_timestamp(station.database, folder_of(station), tsa.by)

    checked = check(station, None)
    assert checked.findings == ()
    assert "signature that was not verified: 1" in str(checked.notes[0])


def test_a_timestamp_copied_from_another_entry_is_found(
    station: Station, tsa: Tsa
) -> None:
    station.enter(2)
    file = request_timestamp(station.database, folder_of(station), tsa.by).file
    copy(file, file.with_name(file.name.replace("-2.", "-1.")))

    assert "is not of entry 1 of chain" in findings(station, tsa.root)
    assert "is not of entry 1 of chain" in findings(station, None)


def test_a_timestamp_of_another_authority_is_found(
    station: Station, tsa: Tsa, other: Tsa, tmp_path: Path
) -> None:
    station.enter(1)
    request_timestamp(station.database, folder_of(station), other.by)

    for pinned in (tsa.root, tsa.own):
        assert "not signed by the time stamping authority" in findings(station, pinned)
    both = tmp_path / "both.pem"  # the root is known, but the signer another one
    both.write_bytes(other.root.read_bytes() + tsa.own.read_bytes())
    assert "not signed by the time stamping authority" in findings(station, both)


def test_an_answer_of_another_authority_is_not_stored(
    station: Station, tsa: Tsa, other: Tsa
) -> None:
    station.enter(1)

    with pytest.raises(ArchiveError, match="not signed by the certificate"):
        request_timestamp(
            station.database, folder_of(station), Authority(tsa.address, other.root)
        )
    assert not (folder_of(station) / TIMESTAMPS).exists()


def test_a_changed_timestamp_is_found(station: Station, tsa: Tsa) -> None:
    station.enter(1)
    file = request_timestamp(station.database, folder_of(station), tsa.by).file
    sound = file.read_bytes()
    signature = bytearray(sound)
    signature[-5] ^= 1  # of the signature, which comes last
    for content in (bytes(signature), sound[:-1], b"\x30\x00"):
        file.write_bytes(content)
        assert "is damaged" in findings(station, tsa.root)


def test_entries_written_anew_with_the_key_of_the_station_are_found(
    station: Station, tsa: Tsa
) -> None:
    station.enter(2)
    request_timestamp(station.database, folder_of(station), tsa.by)
    with station.database.writing() as connection:
        connection.execute(delete(ENTRIES))
        connection.execute(delete(RECORDS))
        nothing = {"number": 0, "sha256": NOTHING_BEFORE}
        connection.execute(update(CHAINS).values(nothing))
    station.enter(1, first=5)
    assert "is of entry 2 of chain" in findings(station, tsa.root)
    assert "which is missing" in findings(station, tsa.root)
    station.enter(1, first=6)

    assert check_archive(station.database).findings == ()
    assert "is not of entry 2 of chain" in findings(station, tsa.root)


def test_a_clock_that_is_ahead_is_reported_and_an_earlier_timestamp_found(
    station: Station, tsa: Tsa
) -> None:
    event, record = accepted(1)
    event = structs.replace(event, at=datetime.now(UTC) + timedelta(hours=1))
    entry = append(station.database, station.chain, event, record)
    assert entry is not None
    data = folder_of(station)
    with pytest.raises(ArchiveError, match="clock of the station is ahead"):
        request_timestamp(station.database, data, tsa.by)
    assert not (data / TIMESTAMPS).exists()

    query = TimestampRequestBuilder().data(entry.text.encode())
    asked = query.hash_algorithm(HashAlgorithm.SHA256).build().as_bytes()
    (data / TIMESTAMPS).mkdir()
    file = data / TIMESTAMPS / f"{station.chain}-1.tsr"
    with urlopen(tsa.address, asked) as answer:  # as another program would ask
        file.write_bytes(answer.read())
    assert "is earlier than its entry 1" in findings(station, tsa.root)


@pytest.mark.parametrize("address", ["http://127.0.0.1:1", "file:///etc/passwd", ""])
def test_an_authority_that_does_not_answer_is_reported(
    station: Station, tsa: Tsa, address: str
) -> None:
    station.enter(1)

    with pytest.raises(ArchiveError, match="gave no timestamp"):
        request_timestamp(
            station.database, folder_of(station), Authority(address, tsa.root)
        )


def test_a_file_without_a_root_certificate_is_refused(
    station: Station, tsa: Tsa, tmp_path: Path
) -> None:
    station.enter(1)
    for content in (b"no certificate", tsa.own.with_name("signer.pem").read_bytes()):
        file = tmp_path / "file.pem"
        file.write_bytes(content)
        with pytest.raises(FileError, match="has no root certificate"):
            request_timestamp(
                station.database, folder_of(station), Authority(tsa.address, file)
            )


def test_the_command_asks_the_authority_that_is_set_for_the_computer_and_checks(
    station: Station, tsa: Tsa, capsys: pytest.CaptureFixture[str]
) -> None:
    station.enter(1)
    data = str(folder_of(station))
    assert main(["archive", "timestamp", "--data", data]) == 2
    assert "No time stamping authority is set" in capsys.readouterr().err
    machine_settings.machine_file().write_text(
        f'{{"timestamp_authority": "{tsa.address}", '
        f'"timestamp_certificate": "{tsa.root.as_posix()}"}}'
    )
    assert main(["archive", "timestamp", "--data", data]) == 0
    assert "Entry 1 existed at 20" in capsys.readouterr().out
    assert main(["archive", "check", "--data", data]) == 0
    assert "timestamps: 1." in capsys.readouterr().out
