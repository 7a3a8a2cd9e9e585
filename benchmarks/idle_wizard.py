"""Let the wizard be idle, and print how busy it keeps a processor core.

Usage: python benchmarks/idle_wizard.py SECONDS

One line of JSON: by the name of each page, and of those that are minimised, the share
of one core that the process takes while the pen rests and nobody touches anything. The
swing has begun by then; what is verified is the tip of another, swung in between. While
that one captures, the share is taken with the window shown, then minimised.
"""

import json
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the program does

from PySide6.QtCore import QEventLoop, QTimer

from lightpen.model.limits import SwingLimits
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import SourceChoice
from lightpen_app.application import Wizard, make_application
from lightpen_app.work.settings import Settings, Station, StoredCamera
from lightpen_app_extensions.measure.service import MeasureService
from lightpen_program.extensions import faces

NAMES = Names("Bench", "Ann", "SIM-1", "T-1", "C-1", 10.0)
PAGES = ("start", "camera", "leds", "swing")
LATER_PAGES = ("verify", "history")  # with a tip in force
MINIMISED = ("camera", "verify")
# Until all that was begun has ended, and the pen rests for long.
SETTLING_S = 15.0
MANY = SwingLimits(min_images=290, max_images=300)  # so that the capture lasts
CAPTURING_S = 12.0


def main() -> int:
    """Measure, print, and return the exit status."""
    seconds = float(sys.argv[1])
    application = make_application(sys.argv[:1])
    with tempfile.TemporaryDirectory() as folder:
        settings = Settings(Path(folder) / "lightpen.json")
        settings.set_station(
            NAMES.station,
            Station(
                Names("", "Ann", "SIM-1", "T-1", "C-1"),
                camera=StoredCamera(SourceChoice()),
                limits=MANY,
            ),
        )
        settings.set_last(station=NAMES.station)
        wizard = Wizard(application, faces(), settings, Path(folder))
        wizard.show()
        _until(
            lambda: not wizard.workbench.selection.preparation.camera_missing_inputs()
        )
        shares = {name: _share_of(wizard, name, seconds) for name in PAGES}
        shares |= _put_in_force(wizard)
        shares |= {name: _share_of(wizard, name, seconds) for name in LATER_PAGES}
        for name in MINIMISED:
            wizard.window.showNormal()
            wizard.window.go_to(_index(wizard, name))
            wizard.window.showMinimized()
            shares[f"{name}, minimised"] = _share(seconds)
        wizard.window.close_unasked()
    print(json.dumps(shares))
    return 0


def _put_in_force(wizard: Wizard) -> dict[str, float]:
    """Let the simulated operator swing, accept the tip, return shares of capturing."""
    run, live = wizard.workbench.run, wizard.workbench.live
    assert live.operator is not None
    live.operator.seat()
    live.set_following(True)
    _until(lambda: run.status.state is not None and run.status.state.n_kept > 0)
    shares = {"swing, capturing": _share(CAPTURING_S, 1.0)}
    wizard.window.showMinimized()
    shares["swing, capturing, minimised"] = _share(CAPTURING_S, 1.0)
    assert run.status.assessment is None  # it still captures
    wizard.window.showNormal()
    _until(lambda: run.status.assessment is not None)
    live.set_following(False)
    run.runner.ask(
        lambda workflow: workflow.solving.accept(
            "It is measured how idle the wizard is."
        )
    )
    _until(lambda: run.status.result is not None)
    return shares


def _share_of(wizard: Wizard, name: str, seconds: float) -> float:
    """Return the share of a core that a page takes on which nothing happens."""
    wizard.window.go_to(_index(wizard, name))
    assert wizard.window.page().key == name
    share = _share(seconds)
    touching = (
        each.verification.status.is_touching
        for each in wizard.services
        if isinstance(each, MeasureService)
    )
    assert name != "verify" or any(touching)
    return share


def _index(wizard: Wizard, key: str) -> int:
    pages = wizard.window.pages()
    return [page.key for page in pages].index(key)


def _share(seconds: float, settling: float = SETTLING_S) -> float:
    """Return the share of a core that is taken while events are waited for."""
    _run(settling)
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
