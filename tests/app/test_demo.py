"""`lightpen --demo` plays a calibration by itself; `lightpen` alone needs a screen."""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess
from typing import TYPE_CHECKING

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from lightpen.model.limits import SwingLimits
from lightpen_app.work.settings import Settings, Station
from lightpen_app_extensions.simulator import demo as demo_module
from lightpen_app_extensions.simulator.demo import NAMES, Demo
from lightpen_extensions.simulator.scenes import Scene

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard

Run = Callable[..., CompletedProcess[str]]
NO_SCREEN = {"DISPLAY": "", "WAYLAND_DISPLAY": "", "QT_QPA_PLATFORM": ""}
NO_LOCALE = {"LC_ALL": "C", "LANG": "C", "LANGUAGE": ""}
MOST_MEMORY = 1_500_000 * 1024  # bytes of addresses, as `ulimit -v 1500000` leaves
LONGEST_S = 400  # on a machine that does other things besides
JOINT = re.compile(r"^ *joint +(\S+) +(\S+) +(\S+)$", re.MULTILINE)


@pytest.fixture
def newcomer(script: Run, tmp_path: Path) -> Run:
    """Return a function that runs the program for somebody who has no settings yet."""
    homes = {name: str(tmp_path) for name in ("XDG_CONFIG_HOME", "XDG_DATA_HOME")}

    def run(
        *arguments: str, before: Callable[[], None] | None = None
    ) -> CompletedProcess[str]:
        surroundings = NO_SCREEN | NO_LOCALE | homes
        return script(
            *arguments, environment=surroundings, before=before, timeout=LONGEST_S
        )

    return run


def keep_within_memory() -> None:
    """Leave the process about to start no more than `MOST_MEMORY`."""
    import resource  # not on Windows

    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))


@pytest.mark.slow
def test_the_demo_plays_without_a_screen_in_1_5_gb_and_prints_the_tip(
    newcomer: Run, tmp_path: Path
) -> None:
    outcome = newcomer("--demo", before=keep_within_memory if os.name != "nt" else None)

    assert outcome.returncode == 0, outcome.stderr
    assert outcome.stdout.count("Demo: ") == 5  # one for each step
    assert outcome.stdout.endswith("Tip accepted. Demo data is not saved.\n")
    tip = [float(number) for number in JOINT.findall(outcome.stdout)[0]]
    assert np.linalg.norm(np.array(tip) - Scene().tip_pen) <= 0.005
    assert list(tmp_path.rglob("*")) == []  # nothing of it is kept


FAILING = """
import sys
from lightpen_program.__main__ import main
from lightpen_app_extensions.simulator.demo import Demo
def has_failed(self):
    state = self._workbench.run.status.state
    return state is not None and state.n_kept > 3
Demo._has_failed = has_failed
sys.argv = ["lightpen", "--demo"]
sys.exit(main())
"""


@pytest.mark.slow
def test_an_unseen_demo_that_fails_asks_nobody_before_it_closes(tmp_path: Path) -> None:
    homes = {name: str(tmp_path) for name in ("XDG_CONFIG_HOME", "XDG_DATA_HOME")}
    outcome = subprocess.run(
        [sys.executable, "-c", FAILING],
        env=os.environ | NO_SCREEN | homes,
        capture_output=True,
        text=True,
        timeout=LONGEST_S,
        check=False,
    )

    assert outcome.returncode == 1, outcome.stderr
    assert "Demo ended:" in outcome.stdout


@pytest.mark.slow
def test_the_window_is_refused_in_a_sentence_without_a_screen(newcomer: Run) -> None:
    outcome = newcomer()

    assert outcome.returncode == 2
    assert outcome.stdout == ""
    assert "No display is available for the window." in outcome.stderr
    assert "Traceback" not in outcome.stderr


@pytest.mark.slow
def test_a_demo_whose_swing_is_not_good_enough_ends_all_the_same(
    open_wizard: "OpenWizard", settings: Settings, qtbot: QtBot
) -> None:
    hopeless = Station(limits=SwingLimits(1e-6, 10, 12))
    settings.set_station(NAMES.station, hopeless)
    settings.set_last(station=NAMES.station)
    walker = open_wizard()
    demo = Demo(walker.window, walker.workbench, is_watched=False)

    with qtbot.waitSignal(demo.ended):
        demo.start()

    assert walker.workbench.run.status.result is None
    assert "Demo ended: no tip to accept." in walker.window.words()


@pytest.mark.slow
def test_a_demo_that_is_watched_measures_the_plate_without_a_hand(
    open_wizard: "OpenWizard", qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    from tests.verifying import found_by

    from lightpen_app_extensions.measure.service import MeasureService
    from lightpen_extensions.measure.probing_operator import plate_plan
    from lightpen_extensions.measure.tasks.part import PART

    monkeypatch.setattr(demo_module, "WATCHED_S", 0.1)
    walker = open_wizard()
    demo = Demo(walker.window, walker.workbench, walker.services)
    (measure,) = (s for s in walker.services if isinstance(s, MeasureService))

    with qtbot.waitSignal(demo.ended, timeout=1000 * LONGEST_S):
        demo.start()

    assert demo.is_accepted
    assert walker.title() == "Measure"
    walker.until_says("Part measured")
    found = found_by(measure.measuring.status.state, PART)
    assert found.missing == ()
    assert len(found.part.results) == len(plate_plan().characteristics)


@pytest.mark.slow
def test_a_demo_goes_on_after_somebody_looked_at_another_step(
    open_wizard: "OpenWizard",
) -> None:
    walker = open_wizard()
    demo = Demo(walker.window, walker.workbench, is_watched=False)
    reported: list[str] = []
    demo.message_sent.connect(reported.append)
    walker.click_step("History")
    demo.start()

    walker.until(lambda: bool(reported))
    assert reported[0].startswith("Demo: enter station, pen, tip and cone.")
    demo.deleteLater()
