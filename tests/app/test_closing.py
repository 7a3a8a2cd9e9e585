"""Closing the window ends in time, whatever is under way, and loses nothing."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import QThreadPool
from pytestqt.qtbot import QtBot
from tests.faulty_camera import scene_of
from typing_extensions import override

from lightpen.cameras.protocol import CameraSettings
from lightpen.record.swings.interrupted import find_unfinished
from lightpen.record.swings.reading import Record, open_record
from lightpen.record.swings.solving import Solution, solve_record
from lightpen.record.swings.writing import RecordWriter
from lightpen.swing.swing_recorder import read_resumable
from lightpen_app.application import END_SIGNALS, EndSignals
from lightpen_app.work.job import Report
from lightpen_app.work.workbench import Workbench
from lightpen_extensions.simulator.camera import SimulatedCamera
from lightpen_extensions.simulator.hand import SimulatedOperator

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard

TIMEOUT = 60_000  # ms until a test gives up
SOON = 3.0  # s that is given to what does not end, in place of `CLOSING_TIME`
# s beyond: a stuck camera that is waited for before the rest takes longer, 2 s.
AT_ONCE = 1.8
N_TRIES = 2  # of which other programs hold up one, at most, for so long
N_IMAGES = 20  # of the record that is resumed

STUCK = """
import sys, time
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication
from lightpen_app.application import run
from lightpen_app.work.job import Job
from lightpen_app.work.workbench import Workbench
from lightpen_app.face import Service
from tests.faulty_camera import scene_of

Workbench.shut_down.__defaults__ = (float(sys.argv.pop()),)

def close():
    Job(lambda report: time.sleep(600)).start()
    print("closing", flush=True)
    QApplication.closeAllWindows()

def face(workbench):
    QTimer.singleShot(500, close)
    return Service(workbench)

sys.exit(run([face], None))
"""

# A signal that whoever started the tests ignores would be ignored by the program, too.
HEEDFUL = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
"""

SWINGING = """
import shutil
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication, QMessageBox
from lightpen.swing.swing_recorder import read_resumable
from lightpen_app.application import run
from lightpen_app.face import Service

def tell(folder, asks):
    if asks and not isinstance(QApplication.activeModalWidget(), QMessageBox):
        return QTimer.singleShot(50, lambda: tell(folder, asks))
    print(folder, flush=True)

def swing(workbench):
    folder = workbench.run.records_folder / "interrupted"
    shutil.copytree(sys.argv[1], folder)
    resumable = read_resumable(folder)
    workbench.run.runner.ask(lambda workflow: workflow.continue_swing(resumable))
    await_swing(workbench, folder)

def await_swing(workbench, folder):
    if not workbench.run.status.is_capturing:
        return QTimer.singleShot(20, lambda: await_swing(workbench, folder))
    tell_it = lambda: tell(folder, sys.argv[2])
    QTimer.singleShot(100, tell_it)
    if sys.argv[2]:
        QApplication.closeAllWindows()

def face(workbench):
    QTimer.singleShot(500, lambda: swing(workbench))
    return Service(workbench)

sys.exit(run([face], None))
"""


class Stuck:
    """A computation, a camera or a disk from which no call comes back until the end."""

    def __init__(self) -> None:
        self.is_reached, self.may_end = Event(), Event()

    def wait(self) -> None:
        self.is_reached.set()
        self.may_end.wait(TIMEOUT / 1000)


@pytest.fixture
def stuck(workbench: Workbench) -> Iterator[Stuck]:
    stuck = Stuck()
    yield stuck
    stuck.may_end.set()
    workbench.shut_down()
    assert QThreadPool.globalInstance().waitForDone(TIMEOUT)


@pytest.fixture
def interrupted(workbench: Workbench, swung: Callable[..., Path]) -> Path:
    """An interrupted swing among the records of the workbench."""
    folder = workbench.run.records_folder / "interrupted"
    shutil.copytree(swung(), folder)
    return folder


class StuckCamera(SimulatedCamera):
    """A camera that does not come back from being closed."""

    stuck: Stuck

    @override
    def close(self) -> None:
        self.stuck.wait()
        super().close()


def swing_before(workbench: Workbench, stuck: Stuck) -> None:
    """Swing before a camera that will not close."""
    around = workbench.around
    camera = StuckCamera(
        scene_of(around), around.clock, SimulatedOperator(around.clock, seated=True)
    )
    camera.stuck = stuck
    workbench.live.open([camera], CameraSettings(), around.clock)
    workbench.live.set_following(True)


def n_kept(workbench: Workbench) -> int:
    state = workbench.run.status.state
    return 0 if state is None else state.n_kept


@contextmanager
def started(
    program: str, folder: Path, *arguments: str
) -> Iterator["subprocess.Popen[str]"]:
    """Run a program that keeps all that is its own in a folder."""
    names = ("XDG_CONFIG_HOME", "XDG_DATA_HOME", "HOME", "TMPDIR")
    environment = os.environ | dict.fromkeys(names, str(folder))
    with subprocess.Popen(
        [sys.executable, "-c", HEEDFUL + program, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment | {"QT_QPA_PLATFORM": "offscreen"},
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def said(process: "subprocess.Popen[str]") -> str:
    """Return the next line that a program prints."""
    assert process.stdout is not None
    return process.stdout.readline().strip()


def assert_closes_soon(workbench: Workbench) -> None:
    """Assert that all that does not end is given `SOON` together."""
    for _ in range(N_TRIES):
        began = time.monotonic()
        assert not workbench.shut_down(SOON)
        if time.monotonic() - began < SOON + AT_ONCE:
            return
    pytest.fail("What does not end is waited for one after the other.")


def assert_whole(folder: Path, n_images: int) -> None:
    """Assert that an interrupted swing has all its images and can be gone on with."""
    (record,) = find_unfinished(folder.parent).interrupted
    assert record.folder == folder
    assert len(record.images) >= n_images
    assert read_resumable(folder).state.n_kept == len(record.used_images)


@pytest.mark.slow
def test_closing_waits_for_all_that_is_under_way_together(
    workbench: Workbench,
    stuck: Stuck,
    interrupted: Path,
    qtbot: QtBot,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def solve(record: Record, report: Report) -> Solution:
        stuck.wait()
        return solve_record(record, report)

    monkeypatch.setattr("lightpen.swing.solving.solve_record", solve)
    swing_before(workbench, stuck)
    resumable = read_resumable(interrupted)
    workbench.run.runner.ask(lambda workflow: workflow.continue_swing(resumable))
    qtbot.waitUntil(lambda: n_kept(workbench) >= N_IMAGES + 2)
    workbench.run.runner.ask(lambda workflow: workflow.finish())
    qtbot.waitUntil(stuck.is_reached.is_set)

    assert_closes_soon(workbench)
    assert_whole(interrupted, N_IMAGES + 2)


@pytest.mark.slow
def test_closing_while_the_disk_does_not_answer_keeps_what_was_acknowledged(
    workbench: Workbench,
    stuck: Stuck,
    interrupted: Path,
    qtbot: QtBot,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    around, append = workbench.around, RecordWriter.append
    camera = SimulatedCamera(
        scene_of(around), around.clock, SimulatedOperator(around.clock, seated=True)
    )
    workbench.live.open([camera], CameraSettings(), around.clock)
    workbench.live.set_following(True)
    resumable = read_resumable(interrupted)
    workbench.run.runner.ask(lambda workflow: workflow.continue_swing(resumable))
    qtbot.waitUntil(lambda: n_kept(workbench) >= N_IMAGES + 2)

    def write(writer: RecordWriter, *image: object) -> int:
        stuck.wait()
        return append(writer, *image)  # type: ignore[arg-type]

    monkeypatch.setattr(RecordWriter, "append", write)
    qtbot.waitUntil(stuck.is_reached.is_set)
    n_acknowledged = n_kept(workbench)

    assert_closes_soon(workbench)
    assert len(open_record(interrupted).images) >= n_acknowledged
    stuck.may_end.set()
    assert workbench.shut_down(TIMEOUT / 1000)
    assert_whole(interrupted, n_acknowledged)


@pytest.mark.slow
def test_the_window_closes_in_time_and_the_swing_is_offered_again(
    open_wizard: "OpenWizard",
    swung: Callable[..., Path],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stuck = Stuck()

    def solve(record: Record, report: Report) -> Solution:
        stuck.wait()
        return solve_record(record, report)

    walker = open_wizard()
    run = walker.workbench.run
    folder = run.records_folder / "interrupted"
    shutil.copytree(swung(), folder)
    with monkeypatch.context() as slow:
        slow.setattr("lightpen.swing.solving.solve_record", solve)
        resumable = read_resumable(folder)
        run.runner.ask(lambda workflow: workflow.continue_swing(resumable))
        run.runner.ask(lambda workflow: workflow.finish())
        walker.until(stuck.is_reached.is_set)

    began = time.monotonic()
    with walker.answering() as asked, monkeypatch.context() as soon:
        soon.setattr(Workbench.shut_down, "__defaults__", (SOON,))
        walker.window.close()
    took = time.monotonic() - began
    stuck.may_end.set()

    assert "Swing not finished." in asked[0]
    assert took < TIMEOUT / 2000  # the computation goes on twice as long
    assert_whole(folder, N_IMAGES)
    again = open_wizard()
    again.until_says("Interrupted: 1")
    again.click("Resume")
    again.until_shows("Swing")
    assert n_kept(again.workbench) == N_IMAGES


@pytest.mark.slow
def test_the_process_ends_though_a_job_does_not(tmp_path: Path) -> None:
    folders = ("XDG_CONFIG_HOME", "XDG_DATA_HOME", "HOME", "APPDATA", "LOCALAPPDATA")
    environment = dict.fromkeys(folders, str(tmp_path))
    with subprocess.Popen(
        [sys.executable, "-c", STUCK, str(SOON)],
        stdout=subprocess.PIPE,
        env=os.environ | environment | {"QT_QPA_PLATFORM": "offscreen"},
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"closing\n"
        try:
            status = process.wait(TIMEOUT / 1000)
        finally:
            process.kill()

    assert status == 0


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows sends no such signals")
@pytest.mark.parametrize(
    ("number", "asks"), [(signal.SIGINT, ""), (signal.SIGTERM, "asks")]
)
def test_a_signal_closes_the_window_unasked_and_the_swing_is_offered_again(
    tmp_path: Path, swung: Callable[..., Path], number: signal.Signals, asks: str
) -> None:
    with started(SWINGING, tmp_path, str(swung()), asks) as process:
        folder = Path(said(process))
        process.send_signal(number)
        words = process.communicate(timeout=TIMEOUT / 1000)[1]

    assert process.returncode == 128 + number
    assert "Traceback" not in words
    assert_whole(folder, N_IMAGES)


def test_signals_are_left_to_whoever_heard_them_before(qtbot: QtBot) -> None:
    before = [signal.getsignal(number) for number in END_SIGNALS]
    with EndSignals() as signals:
        with qtbot.waitSignal(signals.came) as came:
            signal.raise_signal(signal.SIGTERM)
        assert came.args == [signal.SIGTERM]

    assert [signal.getsignal(number) for number in END_SIGNALS] == before


def test_a_signal_that_is_ignored_stays_so() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with EndSignals():
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)
