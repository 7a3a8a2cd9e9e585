"""The GUI sees the newest image and nothing of a closed camera."""

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QObject, QSize
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot
from tests.faulty_camera import FaultyCamera, scene_of
from typing_extensions import override

from lightpen.cameras.protocol import (
    CameraSettings,
    Connection,
    FaultRaised,
    Frame,
    FramesSkipped,
    ProcessingKeepsUp,
)
from lightpen.cameras.replay import ReplayCamera
from lightpen.formats.decoding import encode_png
from lightpen.live.sources import SourceEnvironment
from lightpen.record.swings.reading import open_record
from lightpen.swing.preparation import Preparation
from lightpen.swing.swing_recorder import read_resumable
from lightpen_app.work.job import Notifications
from lightpen_app.work.live_view import DisplayedImage, LiveView
from lightpen_app.work.swing_run import SwingRun
from lightpen_extensions.simulator.hand import SimulatedOperator

TIMEOUT = 60.0  # s until a test gives up
SIGNALS = (*("image_shown", "connection_changed", "settings_applied"),)
N_IMAGES = 20  # of the record that is resumed


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
def view(run: SwingRun, notifications: Notifications) -> Iterator[LiveView]:
    view = LiveView(run, notifications)
    yield view
    view.close()
    view.await_closed()


@pytest.fixture
def diary(view: LiveView) -> Diary:
    return Diary(view)


@pytest.fixture
def stage(
    view: LiveView, around: SourceEnvironment, tmp_path: Path, qtbot: QtBot
) -> "Stage":
    return Stage(view, around, tmp_path, qtbot)


class Stage:
    """The simulated pen before a live view."""

    def __init__(
        self, view: LiveView, around: SourceEnvironment, folder: Path, qtbot: QtBot
    ) -> None:
        self.view, self.folder, self.qtbot = view, folder, qtbot
        self.around = around

    def open(self, camera: FaultyCamera | ReplayCamera | None = None) -> None:
        """Show a camera; a simulated operator follows the swing."""
        self.view.open([camera or self.camera()], CameraSettings(), self.around.clock)
        self.view.set_following(True)

    def camera(self) -> FaultyCamera:
        clock = self.around.clock
        operator = SimulatedOperator(clock, seated=True)
        return FaultyCamera(scene_of(self.around), clock, operator)

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
    view: LiveView, stage: Stage, prepared: Preparation, qtbot: QtBot
) -> None:
    view.set_region(prepared.region)
    with qtbot.waitSignal(view.image_shown) as shown:
        stage.open()
    (image,) = shown.args

    assert isinstance(image, DisplayedImage)
    assert image.size == QSize(1224, 1024)
    assert image.half.shape == (512, 612)
    assert image.seen.detection is not None


def test_a_gui_that_was_busy_is_shown_the_newest_image_only(
    *,
    run: SwingRun,
    view: LiveView,
    stage: Stage,
    diary: Diary,
    qtbot: QtBot,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    looked_at: list[int] = []
    take = run.runner.process_image

    def note_and_take(frame: Frame, *seen: Any) -> None:
        looked_at.append(frame.seq)
        take(frame, *seen)

    monkeypatch.setattr(run.runner, "process_image", note_and_take)
    with qtbot.waitSignal(view.image_shown):
        stage.open()
    n_shown, n_before = len(diary.of("image_shown")), len(looked_at)
    stage.hold_up_until(lambda: len(looked_at) >= n_before + 6)
    newest = looked_at[-2]  # the last may not be there yet
    QApplication.processEvents()
    new = diary.of("image_shown")[n_shown:]

    assert len(new) <= 2
    assert new[0].seen.frame.seq >= newest


def test_the_connection_is_reported_as_it_changes(
    view: LiveView, stage: Stage, diary: Diary, qtbot: QtBot
) -> None:
    assert (view.is_open, view.connection) == (False, Connection.CLOSED)
    stage.open()
    qtbot.waitUntil(lambda: view.connection is Connection.STREAMING)
    assert view.is_open
    assert view.caps is not None
    stage.close()

    assert diary.of("connection_changed") == [
        *(Connection.OPENING, Connection.STREAMING, Connection.CLOSED)
    ]
    assert not view.is_open
    assert view.caps is None
    assert view.operator is None
    assert view.stats.delivered == 0


def test_images_that_are_skipped_are_counted_in_the_status_line_alone(
    view: LiveView, stage: Stage, notifications: Notifications, qtbot: QtBot
) -> None:
    with qtbot.waitSignal(view.image_shown):
        stage.open(stage.camera())
    skipped = FramesSkipped("camera.too-slow", n_missed=7, n_offered=20)
    shown: list[str] = []
    notifications.status_changed.connect(shown.append)
    notifications.raised.connect(lambda text, _: pytest.fail(text))

    view._on_event_received(FaultRaised(skipped), 0)
    view._on_event_received(ProcessingKeepsUp(), 0)

    assert shown[0].startswith("Processing cannot keep up: 7 of 20 images skipped.")
    assert shown[1:] == [""]


def test_a_lost_camera_is_reported_and_comes_back(
    view: LiveView,
    stage: Stage,
    diary: Diary,
    notifications: Notifications,
    qtbot: QtBot,
) -> None:
    camera = stage.camera()
    with qtbot.waitSignal(view.image_shown):
        stage.open(camera)
    with qtbot.waitSignal(notifications.raised) as raised:
        camera.unplug()
    assert raised.args is not None
    assert "no longer responds (unplugged)." in raised.args[0]
    assert view.why_no_images == raised.args[0]
    qtbot.waitUntil(lambda: view.connection is Connection.LOST)
    camera.plug_in()
    with qtbot.waitSignal(notifications.withdrawn) as withdrawn:
        qtbot.waitUntil(lambda: view.connection is Connection.STREAMING)
    assert withdrawn.args == [raised.args[0]]
    assert not view.why_no_images
    with qtbot.waitSignal(view.image_shown):
        pass

    assert diary.of("failed") == []


# Closing


class StubbornCamera(FaultyCamera):
    """Takes its time to close."""

    may_close = threading.Event()

    @override
    def close(self) -> None:
        self.may_close.wait(TIMEOUT)
        super().close()


def test_closing_does_not_wait_for_the_device(
    view: LiveView, stage: Stage, qtbot: QtBot
) -> None:
    camera = StubbornCamera(scene_of(stage.around), stage.around.clock)
    with qtbot.waitSignal(view.image_shown):
        stage.open(camera)
    view.close()
    assert view.connection is Connection.CLOSED
    with qtbot.waitSignal(view.image_shown):
        stage.open()
    assert not view.await_closed(0.05)
    camera.may_close.set()
    assert view.await_closed()


def test_nothing_is_reported_a_closed_camera(
    view: LiveView, stage: Stage, diary: Diary, qtbot: QtBot
) -> None:
    for _ in range(4):
        stage.open()
        stage.hold_up(3)  # all of it waits
        view.close()
        reported = len(diary.entries)
        view.await_closed()
        QApplication.processEvents()

        assert len(diary.entries) == reported


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
    view.set_exposure(1.0)
    view.set_gain(1.0)
    view.set_following(True)

    assert diary.entries == []


# A swing


def n_kept(run: SwingRun) -> int:
    state = run.runner.status.state
    return 0 if state is None else state.n_kept


def test_a_swing_is_captured_though_the_gui_is_busy(
    run: SwingRun, stage: Stage, interrupted: Path
) -> None:
    resumable = read_resumable(interrupted)
    run.runner.ask(lambda workflow: workflow.continue_swing(resumable))
    stage.open()
    stage.hold_up_until(lambda: n_kept(run) > N_IMAGES + 2)

    assert len(open_record(interrupted).images) >= N_IMAGES + 2


def test_the_operator_follows_the_swing_until_his_camera_is_closed(
    run: SwingRun, view: LiveView, stage: Stage
) -> None:
    assert run.follower is None
    stage.open()
    assert run.follower is not None
    view.set_following(False)
    assert run.follower is None

    view.set_following(True)
    stage.close()
    assert run.follower is None


def test_nobody_follows_before_a_recording(
    run: SwingRun, stage: Stage, tmp_path: Path
) -> None:
    stage.open()
    stage.open(ReplayCamera(str(tmp_path), loops=True, clock=stage.around.clock))

    assert run.follower is None
