"""What becomes of each swing of a runner is entered before it is reported."""

import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest
from tests.core.conftest import TIMEOUT, Station
from tests.entering import entries_of

from lightpen.archive.chains import Event, Kind, chain_names
from lightpen.archive.checks import check_archive
from lightpen.archive.lazy_logbook import LazyLogbook
from lightpen.archive.logbook import Logbook
from lightpen.archive.store import look_into
from lightpen.record.library.entered_files import ARCHIVE
from lightpen.record.swings.interrupted import discard_swing
from lightpen.swing.runner import SwingRunner


@pytest.fixture
def acceptable(interrupted: Path, rewrite_header: Callable[..., None]) -> Path:
    """An interrupted swing whose tip can be accepted with a reason."""
    rewrite_header(interrupted, limits={"max_uncertainty": 1.0})
    return interrupted


@pytest.fixture
def logging(station: Station) -> Iterator[Station]:
    """A station whose runner has a logbook."""
    bare, folder = station.runner, station.folder
    station.runner = SwingRunner(
        *(station.records, station.archive, station.witness),
        logbook=LazyLogbook(folder),
    )
    yield station
    station.runner.shut_down()
    assert station.runner.await_end(TIMEOUT)
    station.runner = bare


def entered(station: Station) -> list[Event]:
    with closing(look_into(station.folder / ARCHIVE)) as database:
        return [
            each.entry.event
            for chain in chain_names(database)
            for each in entries_of(database, chain)
        ]


def test_accepted_and_taken_back_tips_are_entered(
    logging: Station, acceptable: Path
) -> None:
    logging.go_on(acceptable)
    logging.solve()
    logging.accept()
    (accepted,) = entered(logging)
    assert (accepted.kind, accepted.reason) == (Kind.ACCEPTED, "It is seen to.")
    assert accepted.tip_pen_mm == tuple(logging.tip)

    result = logging.status.result
    assert result is not None
    logging.runner.ask(lambda workflow: workflow.solving.revoke(result, "Ben"))
    logging.wait_until(lambda: logging.status.revoked is not None)
    _, back = entered(logging)
    assert (back.kind, back.names.operator) == (Kind.REVOKED, "Ben")


def test_a_tip_that_is_not_accepted_is_entered_as_refused_with_its_verdict(
    logging: Station, interrupted: Path
) -> None:
    logging.go_on(interrupted)
    logging.solve()
    tip, verdict = logging.tip, logging.status.verdict
    logging.runner.ask(lambda workflow: workflow.discard())
    logging.wait_until(lambda: logging.status.record_folder is None)
    logging.see()

    (event,) = entered(logging)
    assert verdict is not None
    assert (event.kind, event.grade) == (Kind.REFUSED, verdict.grade)
    assert event.why is not None
    assert event.why.code == verdict.reason.code
    assert event.tip_pen_mm == tuple(tip)
    logging.runner.ask(lambda workflow: workflow.open_logbook())
    logging.see()
    assert len(entered(logging)) == 1


def test_what_the_files_tell_of_is_entered_at_the_start(
    logging: Station, interrupted: Path
) -> None:
    discard_swing(interrupted)
    Logbook(logging.folder).close()  # which makes what is looked into below
    logging.runner.ask(lambda workflow: workflow.open_logbook())
    deadline = time.monotonic() + TIMEOUT
    while not entered(logging):
        assert time.monotonic() < deadline
        time.sleep(0.02)

    (event,) = entered(logging)
    assert (event.kind, event.swing) == (Kind.ABANDONED, "records/interrupted")


def test_a_swing_without_a_tip_is_entered_as_abandoned(logging: Station) -> None:
    logging.begin()
    logging.keep(2)
    logging.runner.ask(lambda workflow: workflow.discard())
    logging.wait_until(lambda: logging.status.record_folder is None)
    logging.see()

    (event,) = entered(logging)
    assert (event.kind, event.tip_pen_mm) == (Kind.ABANDONED, None)
    with closing(look_into(logging.folder / ARCHIVE)) as database:
        checked = check_archive(database, logging.folder)
    assert (checked.n_files, checked.findings) == (4 + 2, ())


def test_no_tip_comes_into_force_while_the_archive_cannot_be_read(
    logging: Station, acceptable: Path
) -> None:
    (logging.folder / ARCHIVE).write_bytes(b"no database at all " * 50)
    logging.go_on(acceptable)
    logging.solve()
    logging.runner.ask(lambda workflow: workflow.solving.accept("It is seen to."))
    logging.wait_until(lambda: logging.witness.faults != [])

    assert any("not a database" in fault for fault in logging.witness.faults)
    assert logging.status.result is None
