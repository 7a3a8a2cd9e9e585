"""Open the step History on a data folder, scroll through it, print the times as JSON.

``python benchmarks/history_step.py FOLDER``. It is open when its newest lines are
painted. Of each step of the scrolling counts how long the window answers nobody.
"""

import json
import os
import statistics
import sys
import tempfile
import time
from importlib import import_module
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

N_STEPS = 300
FRAME_S = 1 / 60  # between two steps
LONGEST_S = 60.0


def main(data: Path) -> int:
    """Open, scroll, print, and return the exit status."""
    from PySide6.QtWidgets import QApplication

    from lightpen_app.application import make_application
    from lightpen_app.look.theme import DARK, apply_theme, load_fonts
    from lightpen_app.steps.history.history_table import HistoryTable
    from lightpen_app.steps.history.page import HistoryPage
    from lightpen_app.widgets.trend_panel import TrendPanel
    from lightpen_app.work.settings import Settings
    from lightpen_app.work.workbench import Workbench

    import_module("lightpen_app.application")  # all pages are loaded by then
    application = make_application(sys.argv[:1])
    load_fonts()
    apply_theme(application, DARK)
    with tempfile.TemporaryDirectory() as folder:
        settings = Settings(Path(folder) / "lightpen.json")
        workbench = Workbench(settings, data)
        workbench.run.logbook.opened()  # as the program does when it starts
        page = HistoryPage(workbench)
        page.resize(1280, 800)

        start = time.perf_counter()
        page.show()
        page.entered()
        table = page.findChild(HistoryTable)
        assert isinstance(table, HistoryTable)
        while not table.model().rowCount() and time.perf_counter() < start + LONGEST_S:
            QApplication.processEvents()
        table.viewport().repaint()
        opened_s = time.perf_counter() - start

        trend = page.findChild(TrendPanel)
        assert isinstance(trend, TrendPanel)
        while not trend.plots() and time.perf_counter() < start + LONGEST_S:
            QApplication.processEvents()
        bar = table.verticalScrollBar()
        blocked = []
        for step in range(N_STEPS):
            bar.setValue(bar.maximum() if step % 2 else bar.maximum() // 2)
            began, longest = time.perf_counter(), 0.0
            while time.perf_counter() < began + FRAME_S:
                turn = time.perf_counter()
                QApplication.processEvents()
                longest = max(longest, time.perf_counter() - turn)
            blocked.append(longest)
        n_lines = table.model().rowCount()
        bar.setValue(bar.maximum())
        stopped = time.perf_counter()
        while (
            table.model().rowCount() == n_lines
            and time.perf_counter() < stopped + LONGEST_S
        ):
            QApplication.processEvents()
        reported = {
            "n_lines": table.model().rowCount(),
            "opened_ms": 1000 * opened_s,
            "blocked_ms": 1000 * statistics.quantiles(blocked, n=20)[-1],
            "longest_blocked_ms": 1000 * max(blocked),
            "last_read_ms": 1000 * (time.perf_counter() - stopped),
        }
        page.shut_down()
        workbench.shut_down()
    print(json.dumps(reported))
    return 0


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    sys.exit(main(Path(sys.argv[1])))
