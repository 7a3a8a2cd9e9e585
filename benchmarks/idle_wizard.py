"""Let the wizard be idle, and print how busy it keeps a processor core.

Usage: python benchmarks/idle_wizard.py SECONDS

One line of JSON: by the name of each page, and of those that are minimised, the share
of one core that the process takes while the pen rests and nobody touches anything.
"""

import json
import os
import sys
import tempfile
import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the program does

import numpy as np
from PySide6.QtCore import QEventLoop, QTimer

from lightpen.model.origin import Origin
from lightpen.record.folder_archive import RECORDS, FolderArchive
from lightpen.record.names import Names
from lightpen.record.results import Result
from lightpen_app.application import Wizard, make_application
from lightpen_app.wizard_pages import make_pages
from lightpen_app.work.settings import Settings, Station

NAMES = Names("Bench", "Ann", "SIM-1", "T-1", "C-1", 10.0)
PAGES = ("start", "camera", "leds", "swing", "verify", "history")
MINIMISED = ("camera", "verify")
TIP_PEN = [-1.3179, -90.4102, -23.8551]
SETTLING_S = 4.0  # until what was begun on a page has ended


def main() -> int:
    """Measure, print, and return the exit status."""
    seconds = float(sys.argv[1])
    application = make_application(sys.argv[:1])
    with tempfile.TemporaryDirectory() as folder:
        _put_in_force(Path(folder))
        settings = Settings(Path(folder) / "lightpen.json")
        settings.set_station(NAMES.station, Station("Ann", "SIM-1", "T-1", "C-1"))
        settings.set_last_station(NAMES.station)
        wizard = Wizard(application, make_pages, settings, Path(folder))
        wizard.window.show()
        wizard.workbench.start()
        _until(lambda: not wizard.workbench.preparation.camera_lacks())
        shares = {}
        for name in PAGES:
            wizard.window.go_to(_index(wizard, name))
            assert wizard.window.page().key == name
            shares[name] = _share(seconds)
        for name in MINIMISED:
            wizard.window.showNormal()
            wizard.window.go_to(_index(wizard, name))
            wizard.window.showMinimized()
            shares[f"{name}, minimised"] = _share(seconds)
        wizard.window.close_unasked()
    print(json.dumps(shares))
    return 0


def _put_in_force(folder: Path) -> None:
    """Store a tip that can be verified."""
    FolderArchive(folder).store(
        Result(
            names=NAMES,
            accepted=datetime.now().astimezone(),
            grade="pass",
            record=folder / RECORDS / "none",
            images=(),
            calibration={
                "tip_pen_mm": TIP_PEN,
                "expanded_uncertainty_mm": [0.001, 0.002, 0.002],
                "cone_cam_mm": [0.0, 0.0, 1000.0],
                "covariance": np.diag(6 * [0.001**2]).tolist(),
            },
            origin=Origin.SIMULATED,
        )
    )


def _index(wizard: Wizard, key: str) -> int:
    pages = wizard.window.pages()
    return [page.key for page in pages].index(key)


def _share(seconds: float) -> float:
    """Return the share of a core that is taken while events are waited for."""
    _run(SETTLING_S)
    before = time.process_time()
    _run(seconds)
    return (time.process_time() - before) / seconds


def _run(seconds: float) -> None:
    loop = QEventLoop()  # the application itself would close its windows at the end
    QTimer.singleShot(round(1000 * seconds), loop.quit)
    loop.exec()


def _until(condition: Callable[[], bool]) -> None:
    while not condition():
        _run(0.05)


if __name__ == "__main__":
    sys.exit(main())
