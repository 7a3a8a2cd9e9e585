"""A fault is reported until its cause is gone, and logged."""

import logging
from enum import Enum, auto

import pytest

from lightpen.errors import LightpenError
from lightpen.messages import Message, message
from lightpen.runners import FaultReporter

FULL = message("system.full")
OTHER = message("swing.bug")


class Cause(Enum):
    DISK = auto()
    CAMERA = auto()


class Listener:
    def __init__(self) -> None:
        self.reported: list[Message] = []
        self.over: list[Message] = []

    def on_fault(self, message: Message) -> None:
        self.reported.append(message)

    def on_fault_cleared(self, message: Message) -> None:
        self.over.append(message)


@pytest.fixture
def listener() -> Listener:
    return Listener()


@pytest.fixture
def faults(listener: Listener) -> FaultReporter:
    return FaultReporter(listener)


def test_a_fault_is_over_once(faults: FaultReporter, listener: Listener) -> None:
    faults.report(FULL)
    assert faults.is_any
    faults.end()
    faults.end()

    assert not faults.is_any
    assert (listener.reported, listener.over) == ([FULL], [FULL])


def test_what_fails_is_reported_and_what_does_not_is_not(
    faults: FaultReporter, listener: Listener
) -> None:
    def fail() -> None:
        raise LightpenError(FULL)

    faults.trying(lambda: None)
    faults.trying(fail)

    assert listener.reported == [FULL]


def test_a_fault_ends_with_its_own_cause_only(
    faults: FaultReporter, listener: Listener
) -> None:
    faults.report(FULL, Cause.DISK)
    faults.end_of(Cause.CAMERA)
    assert faults.is_any
    faults.end_of(Cause.DISK)
    assert not faults.is_any

    faults.report(OTHER)
    faults.end_of(Cause.DISK)  # of the fault before
    assert faults.is_any


def test_faults_are_logged_as_they_come_and_go(
    faults: FaultReporter, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "lightpen")

    faults.report(FULL)
    faults.end()

    assert [(each.levelname, each.message) for each in caplog.records] == [
        ("WARNING", f"fault raised: system.full: {FULL}"),
        ("INFO", "fault cleared: system.full"),
    ]
