"""Run the wizard through swing after swing and print what it cost, as JSON.

Usage: python benchmarks/soak_wizard.py SECONDS

The window is 1920 x 1080 on Qt's offscreen platform, on the step Swing, with all plots
live. The simulated camera sends 2448 x 2048 images 20 times a second and its operator
follows the arrow; a swing ends at 300 images, is solved, and the next begins.
"""

import json
import os
import sys
import tempfile
import time
from array import array
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QEvent, QObject, Qt, QTimer
from PySide6.QtWidgets import QApplication
from typing_extensions import override

from lightpen.formats.decoding import keep_freed_memory
from lightpen.model.limits import SwingLimits
from lightpen.record.swings.header import Names
from lightpen.swing.capture.state import Phase, SwingState
from lightpen_app.application import Wizard, make_application
from lightpen_app.work.settings import Preferences, Settings
from lightpen_program.extensions import faces

TIMER_MS = 10
SAMPLE_MS = 1000
NAMES = Names("Bench", "Bench", "SIM-1", "T-1", "C-1", 10.0)
# Never reached, so that each swing goes on to its last image.
LIMITS = SwingLimits(min_images=300, max_images=300)


class Soak(QObject):
    """Drives the wizard and takes the figures."""

    def __init__(self, wizard: Wizard, seconds: float) -> None:
        super().__init__(wizard.window)
        self._wizard = wizard
        self._seconds = seconds
        self._start = 0.0
        self._last_tick = 0.0
        self._lateness = array("f")
        self._memory: list[tuple[float, float]] = []
        self._n_paints: dict[int, int] = {}
        self._n_swings = 0
        self._seen: SwingState | None = None
        self._plots: list[pg.PlotWidget] = []
        self._ticker = QTimer(self)
        self._ticker.setTimerType(Qt.TimerType.PreciseTimer)
        self._ticker.setInterval(TIMER_MS)
        self._sampler = QTimer(self)
        self._sampler.setInterval(SAMPLE_MS)

        # Connections
        self._ticker.timeout.connect(self._on_tick)
        self._sampler.timeout.connect(self._on_sample)

    def start(self) -> None:
        """Go to the swing and begin to measure."""
        window = self._wizard.window
        while window.page().key != "swing":
            before = window.page().key
            window.press_main()
            if window.page().key == before:
                QTimer.singleShot(100, self.start)
                return
        self._wizard.workbench.live.set_following(True)
        operator = self._wizard.workbench.live.operator
        assert operator is not None
        operator.seat()
        self._plots = [p for p in window.findChildren(pg.PlotWidget) if p.isVisible()]
        for plot in self._plots:
            plot.viewport().installEventFilter(self)
        self._start = self._last_tick = time.perf_counter()
        self._stats = self._wizard.workbench.live.stats
        self._ticker.start()
        self._sampler.start()

    def figures(self) -> dict[str, object]:
        """Return what was measured."""
        elapsed = time.perf_counter() - self._start
        stats = self._wizard.workbench.live.stats.since(self._stats)
        return {
            "seconds": elapsed,
            "images": stats.delivered - stats.skipped,
            "lost": stats.missed + stats.skipped,
            "lateness_ms": [
                float(np.percentile(self._lateness, share)) for share in (50, 99, 100)
            ],
            "n_plots": len(self._plots),
            "plots_hz": min(self._n_paints.values(), default=0) / elapsed,
            "memory_mb": max(size for _, size in self._memory),
            "memory_minutes_mb": [
                max(size for at, size in self._memory if at // 60 == minute)
                for minute in range(int(self._memory[-1][0] // 60))
            ],
            "swings": self._n_swings,
        }

    @override
    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.Paint:
            key = id(watched)
            self._n_paints[key] = self._n_paints.get(key, 0) + 1
        return False

    def _on_tick(self) -> None:
        now = time.perf_counter()
        self._lateness.append(max(1000 * (now - self._last_tick) - TIMER_MS, 0.0))
        self._last_tick = now
        self._begin_next()

    def _on_sample(self) -> None:
        elapsed = time.perf_counter() - self._start
        self._memory.append((elapsed, memory_mb()))
        if elapsed >= self._seconds:
            self._ticker.stop()
            self._sampler.stop()
            QApplication.exit()

    def _begin_next(self) -> None:
        """Begin the next swing, once when the one before is solved."""
        run = self._wizard.workbench.run
        state = run.status.state
        if state is self._seen:
            return
        self._seen = state
        if state is not None and state.phase is Phase.VERDICT:
            self._n_swings += 1
            run.runner.ask(lambda workflow: workflow.discard())
            chosen = self._wizard.workbench.selection.preparation
            run.runner.ask(lambda workflow: workflow.begin(chosen))


def memory_mb() -> float:
    """Return the memory of this process that is in use, MB."""
    text = Path("/proc/self/status").read_text(encoding="ascii")
    (line,) = [line for line in text.splitlines() if line.startswith("VmRSS")]
    return int(line.split()[1]) / 1024


def main() -> int:
    """Run, print the figures, and return the exit status."""
    keep_freed_memory()  # as the program does
    application = make_application(sys.argv[:1])
    with tempfile.TemporaryDirectory() as folder:
        settings = Settings(Path(folder) / "lightpen.json")
        settings.set_preferences(Preferences(muted=True))
        wizard = Wizard(application, faces(), settings, Path(folder))
        wizard.window.resize(1920, 1080)
        wizard.show()
        workbench = wizard.workbench
        workbench.selection.set_preparation(
            replace(workbench.selection.preparation, names=NAMES, limits=LIMITS)
        )
        soak = Soak(wizard, float(sys.argv[1]))
        QTimer.singleShot(0, soak.start)
        application.exec()
        print(json.dumps(soak.figures()))
        workbench.run.runner.ask(lambda workflow: workflow.abandon())
        wizard.window.close_unasked()
    return 0


if __name__ == "__main__":
    sys.exit(main())
