"""The GUI sees the newest image, every event, and nothing of a closed camera."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QObject, QSize
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot
from typing_extensions import override

from lightpen.cameras.clock import SkippingClock
from lightpen.cameras.protocol import CameraSettings
from lightpen.cameras.replay import ReplayCamera
from lightpen.cameras.worker import Connection
from lightpen.detection.sighting import look
from lightpen.live.looking import Swinging
from lightpen.model.limits import SwingLimits
from lightpen.record.reading import open_record
from lightpen.record.writing import RecordWriter, encode_png
from lightpen.simulator.camera import SimulatedCamera
from lightpen.simulator.hand import Operator
from lightpen.simulator.scenes import Scene
from lightpen.swing.preparation import Preparation
from lightpen.swing.rules import advance
from lightpen.swing.state import (
    Happening,
    Pause,
    Phase,
    SwingEvent,
    SwingSetup,
    SwingState,
    start_swing,
)
from lightpen_app.work.live_view import LiveView, Shown
from lightpen_app.work.workbench import Workbench

TIMEOUT = 20.0  # s until a test gives up
SIGNALS = (
    *("image_shown", "swing_changed", "happened", "swing_left"),
    *("connection_changed", "settings_applied", "troubled", "failed"),
)
ENDLESS = SwingLimits(max_uncertainty=1e-9)


class Diary:
    """Writes down what a live view tells."""

    def __init__(self, view: LiveView) -> None:
        self.entries: list[tuple[str, Any]] = []
        for name in SIGNALS:
            getattr(view, name).connect(self._writer(name))

    def of(self, name: str) -> list[Any]:
        return [what for signal, what in self.entries if signal == name]

    def _writer(self, name: str) -> Callable[[object], None]:
        return lambda what: self.entries.append((name, what))


@pytest.fixture
def view() -> Iterator[LiveView]:
    view = LiveView()
    yield view
    view.abandon()
    view.close()
    view.await_closed()


@pytest.fixture
def diary(view: LiveView) -> Diary:
    return Diary(view)


@pytest.fixture(scope="session")
def seated(small_scene: Scene) -> SwingState:
    """A swing whose tip was found at rest, before the first image is kept."""
    setup = SwingSetup(small_scene.camera, small_scene.pen, ENDLESS)
    clock = SkippingClock()
    camera = SimulatedCamera(small_scene, clock, Operator(clock, seated=True))
    camera.open()
    camera.start()
    state = before = start_swing(setup)
    while state.phase is not Phase.CAPTURING:
        before = state
        sighting = look(camera.read(1.0).image, setup.camera, setup.pen)
        state = advance(setup, state, sighting, clock.now_ns() * 1e-9).state
    camera.close()
    return replace(before, phase=Phase.CAPTURING, recent=(), still_since=None)


@pytest.fixture
def stage(
    view: LiveView,
    workbench: Workbench,
    tmp_path: Path,
    seated: SwingState,
    qtbot: QtBot,
) -> "Stage":
    return Stage(view, workbench, tmp_path, seated, qtbot)


class Stage:
    """The simulated pen before a live view."""

    def __init__(
        self,
        view: LiveView,
        workbench: Workbench,
        folder: Path,
        seated: SwingState,
        qtbot: QtBot,
    ) -> None:
        self.view, self.folder, self.seated = view, folder, seated
        self.preparation: Preparation = replace(workbench.preparation, limits=ENDLESS)
        self.around = workbench.around
        self.qtbot = qtbot

    def open(self, camera: SimulatedCamera | ReplayCamera | None = None) -> None:
        """Show a camera; a simulated operator follows the swing."""
        self.view.open(camera or self.camera(), CameraSettings(), self.around.clock)
        self.view.set_following(True)

    def camera(self) -> SimulatedCamera:
        clock = self.around.clock
        operator = Operator(clock, seated=True)
        return SimulatedCamera(self.around.scene, clock, operator)

    def swinging(self, name: str = "swing") -> Swinging:
        """Return a swing with a record of its own; the tip is in the cone by now."""
        setup = self.preparation.swing_setup()
        writer = RecordWriter.create(self.folder / name, self.preparation.header())
        now = self.around.clock.now_ns() * 1e-9
        state = replace(self.seated, since=now, time=now, last_seen=now)
        return Swinging(setup, writer, state)

    def n_recorded(self, name: str = "swing") -> int:
        return len(open_record(self.folder / name).images)

    def wait_until_recorded(self, n_images: int, name: str = "swing") -> None:
        self.qtbot.waitUntil(
            lambda: self.n_recorded(name) >= n_images, timeout=int(TIMEOUT * 1000)
        )

    def hold_up(self, n_images: int) -> None:
        """Let the GUI do nothing while so many images come."""
        before = self.view.stats.delivered
        self.hold_up_until(lambda: self.view.stats.delivered >= before + n_images)

    def hold_up_until(self, is_so: Callable[[], bool]) -> None:
        """Let the GUI do nothing until something is so."""
        pause = threading.Event()
        for _ in range(int(TIMEOUT / 0.005)):
            if is_so():
                return
            pause.wait(0.005)
        pytest.fail("It never came to that.")

    def close(self) -> None:
        """Close the camera, and wait until nothing of it can come any more."""
        self.view.close()
        self.view.await_closed()
        QApplication.processEvents()


# Images and the camera


def test_an_image_is_shown_at_half_its_size_with_what_is_seen_in_it(
    view: LiveView, stage: Stage, qtbot: QtBot
) -> None:
    view.set_aim(stage.preparation.aim)
    with qtbot.waitSignal(view.image_shown) as shown:
        stage.open()
    (image,) = shown.args

    assert isinstance(image, Shown)
    assert image.size == QSize(1224, 1024)
    assert image.half.shape == (512, 612)
    assert image.seen.sighting is not None


def test_a_gui_that_was_busy_is_shown_the_newest_image_only(
    view: LiveView, stage: Stage, diary: Diary, qtbot: QtBot
) -> None:
    with qtbot.waitSignal(view.image_shown):
        stage.open()
    before = view.stats.delivered
    n_shown = len(diary.of("image_shown"))
    stage.hold_up(12)
    QApplication.processEvents()
    new = diary.of("image_shown")[n_shown:]

    assert len(new) <= 2
    assert new[0].seen.frame.seq >= before + 8


def test_the_connection_is_told_as_it_changes(
    view: LiveView, stage: Stage, diary: Diary, qtbot: QtBot
) -> None:
    assert (view.is_open, view.connection) == (False, Connection.CLOSED)
    stage.open()
    qtbot.waitUntil(lambda: view.connection is Connection.STREAMING)
    assert view.is_open
    assert view.caps is not None
    stage.close()

    assert diary.of("connection_changed") == [
        *(Connection.OPENING, Connection.STREAMING, Connection.CLOSED),
    ]
    assert not view.is_open
    assert view.caps is None
    assert view.operator is None
    assert view.stats.delivered == 0


def test_exposure_and_gain_are_told_when_they_are_in_force(
    view: LiveView, stage: Stage, qtbot: QtBot
) -> None:
    with qtbot.waitSignal(view.settings_applied):
        stage.open()
    with qtbot.waitSignal(
        view.settings_applied, check_params_cb=lambda s: s.exposure_us == 400
    ):
        view.set_exposure(400.0)
    with qtbot.waitSignal(
        view.settings_applied, check_params_cb=lambda s: s.gain_db == 6
    ):
        view.set_gain(6.0)


def test_a_camera_that_is_not_there_is_told_and_another_can_be_opened(
    view: LiveView, stage: Stage, qtbot: QtBot
) -> None:
    with qtbot.waitSignal(view.failed) as failed:
        stage.open(ReplayCamera(str(stage.folder / "nothing")))
    assert failed.args is not None
    assert "There is no folder, video or image at" in failed.args[0]
    assert view.operator is None
    view.set_following(True)  # nobody is there to follow

    with qtbot.waitSignal(view.image_shown):
        stage.open()


def test_a_lost_camera_is_told_and_comes_back(
    view: LiveView, stage: Stage, diary: Diary, qtbot: QtBot
) -> None:
    camera = stage.camera()
    with qtbot.waitSignal(view.image_shown):
        stage.open(camera)
    with qtbot.waitSignal(view.troubled) as troubled:
        camera.faults.unplug()
    assert troubled.args is not None
    assert "no longer answers. Check its cable" in troubled.args[0]
    qtbot.waitUntil(lambda: view.connection is Connection.LOST)
    camera.faults.plug_in()
    qtbot.waitUntil(lambda: view.connection is Connection.STREAMING)
    with qtbot.waitSignal(view.image_shown):
        pass

    assert diary.of("failed") == []


# Closing


class StubbornCamera(SimulatedCamera):
    """Takes its time to close."""

    may_close = threading.Event()

    @override
    def close(self) -> None:
        self.may_close.wait(TIMEOUT)
        super().close()


def test_closing_does_not_wait_for_the_device(
    view: LiveView, stage: Stage, qtbot: QtBot
) -> None:
    camera = StubbornCamera(stage.around.scene, stage.around.clock)
    with qtbot.waitSignal(view.image_shown):
        stage.open(camera)
    view.close()
    assert view.connection is Connection.CLOSED
    with qtbot.waitSignal(view.image_shown):
        stage.open()
    assert not view.await_closed(0.05)
    camera.may_close.set()
    assert view.await_closed()


def test_nothing_is_told_of_a_closed_camera(
    view: LiveView, stage: Stage, diary: Diary, qtbot: QtBot
) -> None:
    for _ in range(4):
        stage.open()
        stage.hold_up(3)  # all of it waits
        view.close()
        told = len(diary.entries)
        view.await_closed()
        QApplication.processEvents()

        assert len(diary.entries) == told


def test_after_another_camera_was_opened_only_its_images_are_shown(
    view: LiveView, stage: Stage, diary: Diary, tmp_path: Path, qtbot: QtBot
) -> None:
    (tmp_path / "1.png").write_bytes(encode_png(np.zeros((60, 80), np.uint8)))
    stage.open()
    stage.hold_up(3)
    stage.open(ReplayCamera(str(tmp_path), loops=True, clock=stage.around.clock))
    qtbot.waitUntil(lambda: len(diary.of("image_shown")) >= 3)

    assert {shown.size for shown in diary.of("image_shown")} == {QSize(80, 60)}


def test_cameras_that_were_closed_leave_nothing_behind(
    view: LiveView, stage: Stage, qtbot: QtBot
) -> None:
    with qtbot.waitSignal(view.image_shown):
        stage.open()
    n_objects = len(view.findChildren(QObject))
    for _ in range(3):
        with qtbot.waitSignal(view.image_shown):
            stage.open()
    view.await_closed()
    qtbot.waitUntil(lambda: len(view.findChildren(QObject)) == n_objects)


def test_closing_what_is_not_open_does_no_harm(view: LiveView, diary: Diary) -> None:
    view.close()
    view.await_closed()
    for wish in (view.pause, view.resume, view.finish, view.abandon):
        wish()
    view.set_exposure(1.0)

    assert diary.entries == []


# A swing


def test_every_event_comes_in_order_and_before_its_state(
    view: LiveView, stage: Stage, diary: Diary
) -> None:
    stage.open()
    view.swing(stage.swinging())
    stage.wait_until_recorded(2)
    n_before = stage.n_recorded()
    stage.hold_up_until(lambda: stage.n_recorded() >= n_before + 3)
    stage.wait_until_recorded(n_before + 4)
    view.finish()
    stage.qtbot.waitUntil(lambda: last_state(diary).phase is Phase.SOLVING)
    kept = [e.numbers[0] for e in diary.of("happened") if e.what is Happening.KEPT]
    n_recorded = stage.n_recorded()

    assert kept == list(range(1, n_recorded + 1))
    n_told = 0
    for name, what in diary.entries:
        if name == "happened" and what.what is Happening.KEPT:
            n_told += 1
        if name == "swing_changed":
            assert what.n_kept == n_told


def last_state(diary: Diary) -> SwingState:
    state: SwingState = diary.of("swing_changed")[-1]
    return state


def test_nothing_is_told_of_a_swing_once_another_began(
    view: LiveView, stage: Stage, diary: Diary
) -> None:
    stage.open()
    view.swing(stage.swinging())
    stage.wait_until_recorded(2)
    view.finish()
    stage.hold_up(10)  # its end is on its way
    view.swing(stage.swinging("other"))
    n_told = len(diary.entries)
    stage.wait_until_recorded(1, "other")
    states = [what for name, what in diary.entries[n_told:] if name == "swing_changed"]

    assert states[0].n_kept == 0
    assert Phase.SOLVING not in {state.phase for state in states}


def test_nothing_is_told_of_an_abandoned_swing(
    view: LiveView, stage: Stage, diary: Diary
) -> None:
    stage.open()
    view.swing(stage.swinging())
    stage.wait_until_recorded(2)
    stage.hold_up_until(lambda: stage.n_recorded() >= 4)
    view.abandon()
    n_told = len(diary.of("swing_changed")), len(diary.of("happened"))
    stage.hold_up(10)
    QApplication.processEvents()

    assert (len(diary.of("swing_changed")), len(diary.of("happened"))) == n_told
    assert open_record(stage.folder / "swing").verdict is None


def test_a_swing_waits_for_a_camera(
    view: LiveView, stage: Stage, diary: Diary, qtbot: QtBot
) -> None:
    view.swing(stage.swinging())
    view.pause()
    assert last_state(diary).pause is Pause.BY_USER
    view.resume()
    assert last_state(diary).phase is Phase.WAIT
    stage.open()
    stage.wait_until_recorded(1)


def test_a_swing_that_waits_for_a_camera_can_be_finished(
    view: LiveView, stage: Stage, diary: Diary
) -> None:
    swinging = stage.swinging()
    view.swing(swinging)
    view.finish()

    assert diary.of("happened") == [SwingEvent(Happening.CAPTURED)]
    assert last_state(diary).phase is Phase.SOLVING
    with pytest.raises(ValueError, match="closed file"):
        swinging.writer.conclude("pass")


def test_a_swing_that_waits_for_a_camera_can_be_abandoned(
    view: LiveView, stage: Stage, diary: Diary
) -> None:
    swinging = stage.swinging()
    view.swing(swinging)
    view.abandon()
    stage.open()
    stage.hold_up(5)
    QApplication.processEvents()

    assert diary.of("swing_changed") == []
    with pytest.raises(ValueError, match="closed file"):
        swinging.writer.conclude("pass")


def test_what_is_to_be_done_afterwards_is_done_without_a_camera_too(
    view: LiveView, stage: Stage
) -> None:
    done = threading.Event()
    view.abandon(done.set)

    assert done.is_set()


def test_a_swing_is_left_when_its_camera_is_closed(
    view: LiveView, stage: Stage, diary: Diary, qtbot: QtBot
) -> None:
    stage.open()
    swinging = stage.swinging()
    view.swing(swinging)
    stage.wait_until_recorded(3)
    with qtbot.waitSignal(view.swing_left) as left:
        view.close()
    assert left.args is not None
    (found,) = left.args

    assert found.setup is swinging.setup
    assert found.state.n_kept == stage.n_recorded()
    with pytest.raises(ValueError, match="closed file"):
        swinging.writer.conclude("pass")


def test_a_wish_between_two_cameras_is_not_for_a_swing_that_begins_then(
    view: LiveView, stage: Stage, diary: Diary
) -> None:
    stage.open()
    view.swing(stage.swinging())
    stage.wait_until_recorded(1)
    stage.open()
    view.finish()
    view.swing(stage.swinging("other"))
    stage.wait_until_recorded(2, "other")

    assert Phase.SOLVING not in {s.phase for s in diary.of("swing_changed")}


def test_a_swing_that_is_finished_is_not_left(
    view: LiveView, stage: Stage, diary: Diary
) -> None:
    stage.open()
    view.swing(stage.swinging())
    view.finish()
    stage.qtbot.waitUntil(lambda: len(diary.of("happened")) > 0)
    stage.close()

    assert diary.of("swing_left") == []
