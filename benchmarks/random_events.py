"""Random events on the whole wizard: exceptions, latency, memory, as JSON.

Usage: python benchmarks/random_events.py SECONDS [SEED]

The window is 1280 x 800 on Qt's offscreen platform. Two simulated cameras send
2448 x 2048 images 20 times a second, the simulated operator follows, and all plots are
live. Every 50 ms a click, a key, some text, a turn of the wheel or another step comes
at random; dialogs are closed after 2 s, as are menus. Where another source was chosen,
the two cameras are chosen again after 5 s.
"""

import gc
import json
import os
import random
import sys
import tempfile
import threading
import time
from array import array
from collections import Counter
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from benchmarks.soak_wizard import NAMES, memory_mb
from PySide6.QtCore import QObject, QPoint, QPointF, Qt, QTimer, qInstallMessageHandler
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QApplication,
    QComboBox,
    QFileDialog,
    QLineEdit,
    QWidget,
)

from lightpen.formats.decoding import keep_freed_memory
from lightpen.swing.preparation import N_CAMERAS, SourceChoice
from lightpen_app.application import SETTLED_MS, Wizard, make_application
from lightpen_app.work.settings import Preferences, Settings
from lightpen_program.extensions import faces

SEED = 24
TICK_MS, EVENT_MS, SAMPLE_MS = 10, 50, 1000
LONGEST_DIALOG_S = 2.0
LONGEST_WITHOUT = 5  # samples without an image, until the cameras are chosen again
# How long the window's thread has computed when its stack is noted; how often to look.
LONG_MS, SAMPLE_S = 40.0, 0.01
N_CALLERS, N_CAUSES = 9, 12
N_POINTS = 50
KEYS = (
    *(Qt.Key.Key_Tab, Qt.Key.Key_Return, Qt.Key.Key_Space, Qt.Key.Key_Escape),
    *(Qt.Key.Key_Left, Qt.Key.Key_Right, Qt.Key.Key_Up, Qt.Key.Key_Down),
    *(Qt.Key.Key_PageUp, Qt.Key.Key_PageDown, Qt.Key.Key_Delete, Qt.Key.Key_F5),
)
TEXTS = ("0", "-1", "12.5", "T-10", "\N{EURO SIGN}", "x" * 200, "1e300", "")
# Buttons that end the trial, or hand over to another program.
LEFT_ALONE = ("Quit", "Close", "Open folder", "Show in folder", "demo")


class RandomUser(QObject):
    """Acts at random, and takes the figures.

    Attributes
    ----------
    errors : list of str
        Reports of uncaught exceptions.
    """

    def __init__(self, wizard: Wizard, seconds: float, seed: int) -> None:
        super().__init__(wizard.window)
        self._wizard, self._seconds = wizard, seconds
        self._random = random.Random(seed)
        self._start = self._last_tick = time.perf_counter()
        self._lateness = array("f")
        self._memory: list[tuple[float, float]] = []
        self._dialog: tuple[QWidget, float] | None = None
        self._unqueued = array("f")
        self._last_queued = _queued_ms()
        self._busy = array("f")
        self._last_busy = time.thread_time()
        self._causes = Counter[str]()
        self._load = Load()
        self._n_delivered = self._n_images = self._n_without = 0
        self._n_events = 0
        self.errors: list[str] = []
        self._timers = [
            self._timer(TICK_MS, self._on_tick),
            self._timer(SAMPLE_MS, self._on_sample),
        ]
        QTimer.singleShot(EVENT_MS, self._on_event)
        self._timers[0].setTimerType(Qt.TimerType.PreciseTimer)
        threading.Thread(target=self._watch, daemon=True).start()

    def _timer(self, period_ms: int, action: object) -> QTimer:
        timer = QTimer(self)
        timer.setInterval(period_ms)
        timer.timeout.connect(action)
        timer.start()
        return timer

    def figures(self) -> dict[str, object]:
        """Return what was measured."""
        return {
            "seconds": time.perf_counter() - self._start,
            "events": self._n_events,
            "errors": len(self.errors),
            "images": self._n_images,  # of one camera
            "lateness_ms": _percentiles(self._lateness),
            # Without what other threads and programs kept from a processor core.
            "lateness_on_core_ms": _percentiles(self._unqueued),
            "thread_ms": _percentiles(self._busy),
            "cores_of_others": self._load.of_others(),
            "causes": dict(self._causes.most_common(N_CAUSES)),
            "memory_minutes_mb": _by_minute(self._memory),
        }

    def _on_tick(self) -> None:
        now = time.perf_counter()
        late = max(1000 * (now - self._last_tick) - TICK_MS, 0.0)
        self._lateness.append(late)
        queued = _queued_ms()
        self._unqueued.append(max(late - (queued - self._last_queued), 0.0))
        self._last_queued = queued
        self._last_tick = now
        busy = time.thread_time()
        self._busy.append(1000 * (busy - self._last_busy))
        self._last_busy = busy

    def _on_sample(self) -> None:
        elapsed = time.perf_counter() - self._start
        self._memory.append((elapsed, memory_mb()))
        live = self._wizard.workbench.live
        n_delivered = live.stats.delivered
        is_live = live.n_cameras == N_CAMERAS and n_delivered != self._n_delivered
        self._n_images += max(n_delivered - self._n_delivered, 0)
        self._n_delivered = n_delivered
        self._n_without = 0 if is_live else self._n_without + 1
        if self._n_without >= LONGEST_WITHOUT:
            self._n_without = 0
            choose_cameras(self._wizard)  # it chose another source
        live.set_following(self._random.random() < 0.9)
        if elapsed >= self._seconds:
            for timer in self._timers:
                timer.stop()
            _close_all(self._wizard.window)
            QApplication.exit()

    def _on_event(self) -> None:
        if time.perf_counter() - self._start >= self._seconds:
            return
        # Before it acts, as a dialog has an event loop of its own.
        QTimer.singleShot(EVENT_MS, self._on_event)
        root = QApplication.activePopupWidget() or QApplication.activeModalWidget()
        if root is None:
            self._dialog = None
            root = self._wizard.window
        elif self._dialog is None or self._dialog[0] is not root:
            self._dialog = root, time.perf_counter()
        if isinstance(root, QFileDialog) or self._is_open_too_long():
            self._dialog = None
            root.close()
            return
        self._n_events += 1
        self._act(root)

    def _is_open_too_long(self) -> bool:
        if self._dialog is None:
            return False
        return time.perf_counter() - self._dialog[1] > LONGEST_DIALOG_S

    def _act(self, root: QWidget) -> None:
        chance = self._random.random()
        if chance < 0.05 and root is self._wizard.window:
            root.go_to(self._random.randrange(len(root.steps())))
            return
        control = self._control_in(root)
        middle = control.rect().center()
        if chance < 0.6:
            QTest.mouseClick(control, Qt.MouseButton.LeftButton, pos=middle)
        elif chance < 0.8:
            QTest.keyClick(control, self._random.choice(KEYS))
        elif chance < 0.9 and isinstance(control, QLineEdit):
            control.setText(self._random.choice(TEXTS))
        else:
            turn = QPoint(0, self._random.choice((-120, 120)))
            spot = QPointF(middle)
            event = QWheelEvent(
                *(spot, control.mapToGlobal(spot), QPoint(), turn),
                *(Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier),
                *(Qt.ScrollPhase.NoScrollPhase, False),
            )
            QApplication.sendEvent(control, event)

    def _control_in(self, root: QWidget) -> QWidget:
        """Return what can be used at a random point; the window after many misses."""
        for _ in range(N_POINTS):
            x = self._random.randrange(max(root.width(), 1))
            found = root.childAt(x, self._random.randrange(max(root.height(), 1)))
            if found is not None and _is_usable(found):
                return found
        return root

    def _watch(self) -> None:
        """Note what the thread of the window computes for long without an event."""
        window = threading.main_thread().ident
        assert window is not None
        clock = time.pthread_getcpuclockid(window)
        while True:
            time.sleep(SAMPLE_S)
            if 1000 * (time.clock_gettime(clock) - self._last_busy) < LONG_MS:
                continue
            frame = sys._current_frames().get(window)
            names: list[str] = []
            while frame is not None and len(names) < N_CALLERS:
                code = frame.f_code
                names.append(f"{Path(code.co_filename).stem}.{code.co_name}")
                frame = frame.f_back
            self._causes[" < ".join(names)] += 1


class Load:
    """What the machine does beside this process, from now on."""

    def __init__(self) -> None:
        self._start = time.perf_counter()
        self._before = self._spent_s()

    def of_others(self) -> float:
        """Return how many processor cores other programs have taken on average."""
        return (self._spent_s() - self._before) / (time.perf_counter() - self._start)

    def _spent_s(self) -> float:
        fields = Path("/proc/stat").read_text(encoding="ascii").split("\n", 1)[0]
        user, nice, system = map(int, fields.split()[1:4])
        return (user + nice + system) / os.sysconf("SC_CLK_TCK") - time.process_time()


def choose_cameras(wizard: Wizard) -> None:
    """Choose two simulated cameras with their files."""
    selection = wizard.workbench.selection
    chosen = replace(selection.preparation, names=NAMES, source=SourceChoice())
    selection.set_preparation(chosen.with_second(SourceChoice()))
    wizard.workbench.files.use_samples()


def _is_usable(widget: QWidget) -> bool:
    if not widget.isVisible() or not widget.isEnabled():
        return False
    if isinstance(widget, QAbstractButton):
        return not any(word in widget.text() for word in LEFT_ALONE)
    return isinstance(widget, QLineEdit | QComboBox | QAbstractItemView) or (
        widget.focusPolicy() != Qt.FocusPolicy.NoFocus
    )


def _close_all(window: QWidget) -> None:
    for each in QApplication.topLevelWidgets():
        if each is not window:
            each.close()


def _queued_ms() -> float:
    """Return for how long this thread has waited for a processor core."""
    return int(Path("/proc/thread-self/schedstat").read_text().split()[1]) / 1e6


def _percentiles(values: "array[float]") -> list[float]:
    """Return the median, the 99th of a hundred, and the most."""
    return [float(np.percentile(values, share)) for share in (50, 99, 100)]


def _by_minute(memory: list[tuple[float, float]]) -> list[float]:
    """Return the median of each whole minute, MB; of a shorter trial that of all."""
    minutes = range(max(int(memory[-1][0] // 60), 1))
    sizes = ([size for at, size in memory if at // 60 == m] for m in minutes)
    return [round(float(np.median(found)), 1) for found in sizes if found]


def main() -> int:
    """Act, print the figures, and return the exit status."""
    keep_freed_memory()  # as the program does
    seconds = float(sys.argv[1])
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else SEED
    qInstallMessageHandler(lambda kind, context, text: None)  # hints of the platform
    application = make_application(sys.argv[:1])
    with tempfile.TemporaryDirectory(prefix="lightpen-events-") as folder:
        os.environ["LIGHTPEN_KEYS"] = str(Path(folder) / "keys")
        settings = Settings(Path(folder) / "lightpen.json")
        settings.set_preferences(Preferences(muted=True))
        wizard = Wizard(application, faces(), settings, Path(folder) / "data")
        wizard.crash_hook.install()
        wizard.window.resize(1280, 800)
        wizard.show()
        choose_cameras(wizard)
        QTimer.singleShot(SETTLED_MS, gc.freeze)
        user = RandomUser(wizard, seconds, seed)
        wizard.crash_hook.reported.connect(user.errors.append)
        application.exec()
        print(json.dumps(user.figures()))
        wizard.crash_hook.remove()
        wizard.workbench.run.runner.ask(lambda workflow: workflow.abandon())
        wizard.window.close_unasked()
    return 0


if __name__ == "__main__":
    sys.exit(main())
