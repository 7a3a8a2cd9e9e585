"""The demo: a simulated operator uses the whole wizard."""

import os
import sys
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from PySide6.QtCore import (
    QMessageLogContext,
    QObject,
    QTimer,
    QtMsgType,
    Signal,
    qInstallMessageHandler,
)

from lightpen.cameras.pairing import MachineClock
from lightpen.cameras.protocol import CameraSettings
from lightpen.estimation.reports.verdict import Grade
from lightpen.live.sources import Simulator, SourceEnvironment
from lightpen.record.library.signing import KEYS
from lightpen.record.swings.header import Names
from lightpen.swing.capture.state import Phase
from lightpen.swing.preparation import SourceChoice
from lightpen_app.application import (
    EndSignals,
    Wizard,
    ended,
    has_display,
    make_application,
    shown_until_closed,
)
from lightpen_app.face import DemoStep, Service
from lightpen_app.faced import Face
from lightpen_app.look.theme import Tone
from lightpen_app.shell.main_window import MainWindow
from lightpen_app.work.settings import Settings, settings_file
from lightpen_app.work.swing_run import SwingRun
from lightpen_app.work.workbench import Workbench
from lightpen_extensions.simulator.camera import SkippingClock

NAMES = Names(
    station="Demo", operator="Demo", pen="SIM-1", tip="T-1", cone="C-1",
    ball_diameter=10.0,
)  # fmt: skip
TICK_MS = 100
WATCHED_S, UNWATCHED_S = 5.0, 0.1  # spent on each page, s
UNSEEN_FRAME_RATE = 8.0  # 1/s; of an unwatched demo, enough for a swing
LONGEST_S = 200.0  # on a page, s; a slow machine takes a minute for the swing


class Demo(QObject):
    """Leaves each page when its step is complete, swings the pen, shows extensions.

    A demo that is watched leaves time to read.
    """

    message_sent = Signal(str)  # progress, a sentence
    ended = Signal()  # the tip is accepted, or the swing failed

    def __init__(
        self,
        window: MainWindow,
        workbench: Workbench,
        services: Sequence[Service] = (),
        *,
        is_watched: bool = True,
    ) -> None:
        super().__init__(window)
        self._window = window
        self._workbench = workbench
        self._is_watched = is_watched
        pause_s = WATCHED_S if is_watched else UNWATCHED_S
        self._pause_ticks = round(1000 * pause_s / TICK_MS)
        self._key = ""
        self._n_ticks = 0
        self._is_accepted = False
        # Of extensions, still to be shown and shown now; for those who watch.
        steps = [step for each in services for step in each.demo_steps()]
        self._steps = deque(steps if is_watched else ())
        self._step: DemoStep | None = None

        # Widgets
        self._timer = QTimer(self, interval=TICK_MS)

        # Connections
        self._timer.timeout.connect(self._on_tick)
        self.message_sent.connect(self._show)

    @property
    def is_accepted(self) -> bool:
        """Whether its tip is accepted."""
        return self._is_accepted

    def start(self) -> None:
        """Begin on the page that is shown."""
        now = self._workbench.selection.preparation
        self._workbench.selection.set_preparation(
            replace(now, names=NAMES).with_source(SourceChoice())
        )
        self._workbench.files.use_samples()
        self._timer.start()

    def _on_tick(self) -> None:
        key = self._window.page().key
        if key != self._key:
            self._key, self._n_ticks = key, 0
            self._enter(key)
        self._n_ticks += 1
        if self._n_ticks < self._pause_ticks:
            return
        status = self._workbench.run.status
        if status.result is not None:
            self._is_accepted = True
            self._go_on_accepted(key)
        elif self._has_failed() or self._n_ticks * TICK_MS > 1000 * LONGEST_S:
            self._end(self.tr("Demo ended: no tip to accept."))
        elif key == "start":  # its main button skips steps that are complete
            self._window.advance()
        elif key != "swing" or status.solution is not None:
            self._window.press_main()

    def _go_on_accepted(self, key: str) -> None:
        """Show what extensions do with the tip, one after the other; then end."""
        step = self._step
        if step is not None and step.key == key and not step.is_done():
            return
        if self._steps and (step is None or step.key == key):
            self._step = self._steps.popleft()
            self._window.show_step(self._step.key)
        else:
            self._end(self._farewell())

    def _has_failed(self) -> bool:
        status = self._workbench.run.status
        if status.state is None or status.state.phase is not Phase.VERDICT:
            return False
        return status.verdict is None or status.verdict.grade is not Grade.PASS

    def _enter(self, key: str) -> None:
        words = {
            "start": self.tr("Demo: enter station, pen, tip and cone."),
            "camera": self.tr(
                "Demo: check exposure, focus and intrinsics of the simulated camera."
            ),
            "leds": self.tr("Demo: compare the LED file with the image."),
            "swing": self.tr(
                "Demo: the simulated operator seats the tip and follows the arrow. "
                "No key is needed up to the verdict."
            ),
            "review": self.tr("Demo: review the tip and its uncertainty."),
        }
        step = self._step
        if step is not None and key == step.key:
            words[key] = step.text
            step.begin()
        if key in words:  # else the user looks around
            self.message_sent.emit(words[key])
        operator = self._workbench.live.operator
        if operator is not None:
            operator.seat()
        if key == "swing":
            self._workbench.live.set_following(True)

    def _show(self, words: str) -> None:
        self._workbench.notifications.notify(self, words, Tone.ACTIVE)

    def _farewell(self) -> str:
        if not self._is_watched:
            return self.tr("Tip accepted. Demo data is not saved.")
        return self.tr(
            "Demo finished. You can look around; demo data is not saved. To "
            "calibrate a tip, start the program without the demo."
        )

    def _end(self, words: str) -> None:
        self._timer.stop()
        self.ended.emit()
        self.message_sent.emit(words)


def run_demo(faces: Sequence[Face], simulator: Simulator) -> int:
    """Play the demo with these extensions, and return the exit status.

    Without a display it is played unseen, in its own time that waits for a machine
    too slow for it; what happens is printed, and at the end the tip. Settings and
    records of the user are left alone.
    """
    is_seen = has_display() and os.environ.get("QT_QPA_PLATFORM") != "offscreen"
    clock = MachineClock() if is_seen else SkippingClock(rests=True)
    around = SourceEnvironment(simulator, clock)
    if not is_seen:
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
        qInstallMessageHandler(_print_but_hints)
    application = make_application(sys.argv)
    with (
        EndSignals(application) as signals,
        TemporaryDirectory(prefix="lightpen-demo-") as folder,
    ):
        os.environ[KEYS] = str(Path(folder) / "keys")
        settings = Settings(Path(folder) / "lightpen.json")
        settings.set_preferences(Settings(settings_file()).preferences())
        if not is_seen:
            slow = CameraSettings(frame_rate=UNSEEN_FRAME_RATE)
            settings.set_camera(simulator.serial, slow)
        wizard = Wizard(application, faces, settings, Path(folder), around)
        demo = Demo(
            wizard.window, wizard.workbench, wizard.services, is_watched=is_seen
        )
        if not is_seen:
            demo.message_sent.connect(partial(print, flush=True))
            demo.ended.connect(partial(_print_tip, wizard.workbench.run))
            demo.ended.connect(wizard.window.close_unasked)
        wizard.started.connect(demo.start)
        status = shown_until_closed(application, wizard, signals)
        if not is_seen and not demo.is_accepted:
            status = status or 1
    return ended(wizard, status)


def _print_but_hints(kind: QtMsgType, context: QMessageLogContext, text: str) -> None:
    """Forward Qt's messages, except geometry hints of hidden windows."""
    if "propagateSizeHints" not in text:
        print(text, file=sys.stderr)


def _print_tip(run: SwingRun) -> None:
    status = run.status
    if status.solution is not None and status.verdict is not None:
        from lightpen.estimation.reports.summary import calibration_text

        nominal = status.solution.source.pen.nominal_tip
        calibration = status.solution.calibration
        print("\n" + calibration_text(calibration, nominal, status.verdict))
