"""Limits, verifications and calibrated cameras are entered, too, each once."""

import json
from collections.abc import Iterator
from contextlib import closing
from datetime import datetime
from pathlib import Path

import pytest
from tests.core.archive.conftest import NOON
from tests.entering import entries_of, records_in

from lightpen.archive.chains import Event, Kind
from lightpen.archive.checks import check_archive
from lightpen.archive.logbook import Logbook
from lightpen.archive.store import look_into
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.opened_files import InputFile
from lightpen.formats.own_json import record_bytes
from lightpen.messages import message
from lightpen.model.limits import StationLimits
from lightpen.model.names import Origin
from lightpen.record.folder import (
    VERIFICATIONS,
    CalibratedCamera,
    TrialOutcome,
    keep_camera_calibration,
)
from lightpen.record.library.entered_files import ARCHIVE, add_numbered
from lightpen.record.library.supervision import Signature, save_limits, set_password
from lightpen.record.results.result_folder import SIMULATED
from lightpen.record.swings.header import Names

NAMES = Names("Hall 2", "Ann")
EVE = Signature("Eve", "correct horse")
HASH = "ab" * 32


@pytest.fixture
def logbook(tmp_path: Path) -> Iterator[Logbook]:
    book = Logbook(tmp_path)
    yield book
    book.database.close()


def events(logbook: Logbook) -> list[Event]:
    assert logbook.enter_owed() == ()
    found = entries_of(logbook.database, logbook.chain)
    return [each.entry.event for each in found]


def keep(data: Path, grade: Grade, folder: str = VERIFICATIONS) -> Path:
    """Keep a verification as the step Verify does."""
    from lightpen_extensions.comparisons.assessment import (
        VerificationAssessment,
        verification_record,
    )

    reported = message("file.image")
    record = verification_record(
        "circle",
        {"station": "Hall 2", "operator": "Ann", "pen": "LP-04", "tip": "T-10"}
        | {"origin": Origin.SIMULATED if SIMULATED in folder else Origin.LIVE},
        VerificationAssessment(grade, reported, reported),
        {"radius": 0.01},
        {"images": [{"file": "7", "sha256": HASH}]},
    )
    return add_numbered(data, data / folder, record_bytes(record))


def found_by(data: Path) -> list[str]:
    with closing(look_into(data / ARCHIVE)) as database:
        return [each.code for each in check_archive(database, data).findings]


def test_a_verification_is_entered_with_who_what_and_the_hash_of_each_image(
    tmp_path: Path, logbook: Logbook
) -> None:
    keep(tmp_path, Grade.PASS)
    (event,) = events(logbook)

    assert (event.kind, event.outcome) == (Kind.VERIFICATION, TrialOutcome.ACCEPTED)
    assert (event.grade, event.origin) == ("pass", Origin.LIVE)
    assert event.names == Names("Hall 2", "Ann", "LP-04", "T-10")
    assert event.settings == {"verified": "circle", "max_radius_mm": 0.01}
    assert event.why is not None
    assert event.why.text == "image"
    (record,) = records_in(logbook.database).values()
    assert json.loads(record)["inputs"]["images"][0]["sha256"] == HASH


def test_a_verification_that_did_not_pass_is_refused(
    tmp_path: Path, logbook: Logbook
) -> None:
    keep(tmp_path, Grade.REPEAT)

    (refused,) = events(logbook)
    assert (refused.outcome, refused.grade) == (TrialOutcome.REFUSED, "repeat")


def test_a_verification_of_a_simulated_pen_is_entered_as_practice(
    tmp_path: Path, logbook: Logbook
) -> None:
    keep(tmp_path, Grade.PASS, f"{SIMULATED}/{VERIFICATIONS}")

    (event,) = events(logbook)
    assert event.is_simulated


def test_the_calibration_of_a_camera_is_entered(
    tmp_path: Path, logbook: Logbook
) -> None:
    camera = CalibratedCamera(
        *("chessboard:7x5:20", "21538392", Origin.LIVE),
        images={"1": HASH},
        found={},
        camera_file=InputFile(Path("camera.yaml"), HASH),
    )
    keep_camera_calibration(tmp_path, camera, NAMES, NOON)

    (event,) = events(logbook)
    assert (event.kind, event.at) == (Kind.CAMERA, NOON)
    assert event.settings == {"board": "chessboard:7x5:20", "camera": "21538392"}
    assert (event.names.station, event.names.operator) == ("Hall 2", "Ann")
    (record,) = records_in(logbook.database).values()
    assert json.loads(record)["inputs"]["images"] == [{"file": "1", "sha256": HASH}]


def test_a_change_of_limits_and_of_the_password_is_entered_with_who_and_when(
    tmp_path: Path, logbook: Logbook
) -> None:
    save_limits(tmp_path, "Hall 2", StationLimits(), EVE, "", NOON)

    password, limits = events(logbook)
    assert {password.kind, limits.kind} == {Kind.LIMITS}
    assert password.settings["changes_password"] is True
    assert set(password.settings) == {*("changes_password", "supervisor_key")}
    assert (limits.names.operator, limits.names.station) == ("Eve", "Hall 2")
    assert limits.at == NOON
    assert limits.settings["max_radius_mm"] == StationLimits().verification.radius
    assert "argon2" not in str(password)


def test_each_is_entered_once(tmp_path: Path, logbook: Logbook) -> None:
    keep(tmp_path, Grade.PASS)
    save_limits(tmp_path, "Hall 2", StationLimits(), EVE, "", NOON)
    for _ in range(2):
        assert len(events(logbook)) == 3


def test_one_that_is_changed_later_is_found_and_one_before_stays_owed(
    tmp_path: Path, logbook: Logbook
) -> None:
    file = keep(tmp_path, Grade.PASS)
    whole = file.read_bytes()
    file.write_bytes(whole.replace(b"0.01", b"0.09"))
    (fault,) = logbook.enter_owed()
    assert fault.code == "verification.damaged"

    file.write_bytes(whole)
    assert len(events(logbook)) == 1
    assert found_by(tmp_path) == []
    file.write_bytes(whole.replace(b"0.01", b"0.09"))
    assert found_by(tmp_path) == ["archive.vouched-changed"]


def test_an_absurd_time_is_not_entered(tmp_path: Path, logbook: Logbook) -> None:
    record = {
        "program": {"name": "lightpen", "version": "1"},
        "created": datetime(1, 1, 1).isoformat(),
        "verification": "circle",
    }
    add_numbered(tmp_path, tmp_path / VERIFICATIONS, record_bytes(record))

    (fault,) = logbook.enter_owed()
    assert fault.code == "verification.damaged"


def test_verifications_need_no_signature_of_a_supervisor(
    tmp_path: Path, logbook: Logbook
) -> None:
    keep(tmp_path, Grade.PASS)
    set_password(tmp_path, EVE, EVE.password, NOON)

    kinds = {event.kind for event in events(logbook)}
    assert kinds == {Kind.LIMITS, Kind.VERIFICATION}
