"""What the walks through the whole wizard do alike."""

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from subprocess import CompletedProcess
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import Qt

from lightpen.arrays import FloatArray
from lightpen.model.names import Origin
from lightpen.record.results.results import Result

if TYPE_CHECKING:
    from tests.app.conftest import Walker

Run = Callable[..., CompletedProcess[str]]
NAMES = {
    "Station": "Hall 2",
    "Operator": "Ann",
    "Pen serial number": "LP-04",
    "Probe tip": "T-10",
    "Cone": "C-1",
}
FEW = {
    "Max. expanded uncertainty U (k = 2)": "0.02",
    "Min. images": "20",
    "Max. images": "150",
}


@dataclass(frozen=True)
class ReadOut:
    """The tip and its U (k = 2) as they are shown, x y z each, mm."""

    numbers: tuple[str, ...]

    @property
    def tip(self) -> FloatArray:
        return np.array(self.numbers[:3], dtype=np.float64)

    @property
    def u(self) -> FloatArray:
        return np.array(self.numbers[3:], dtype=np.float64)


def set_up(walker: "Walker") -> None:
    """Come from the first view to all fields of a station."""
    walker.until(lambda: bool(walker.workbench.selection.preparation.names.station))
    walker.tab_to("Set up my station")
    walker.press(Qt.Key.Key_Return)
    walker.tab_to("More")
    walker.press(Qt.Key.Key_Return)


def watch_the_swing(walker: "Walker") -> None:
    """See a swing go by itself from the seat to a good verdict."""
    n_inputs = walker.n_inputs
    walker.until_tells("Starts in ")
    walker.until_says("Tilt RIGHT")
    walker.until(lambda: bool(re.search(r"\d+ of about \d+ images", page_text(walker))))
    walker.until_says("CAPTURING")
    walker.until_tells("10 of 10 LEDs, ")
    assert walker.main_button().isEnabled()
    walker.until_says("PASS")
    assert walker.main_button().text() == "Review"
    assert walker.steps()["Swing"] == "now"
    assert walker.n_inputs == n_inputs


def page_text(walker: "Walker") -> str:
    """All that the window says."""
    return "\n".join(walker.texts())


def read_out(walker: "Walker") -> ReadOut:
    """The tip that is shown in the review."""
    words = page_text(walker)
    tip = re.findall(r"^[xyz] = (\S+) mm$", words, re.MULTILINE)
    u = re.findall(r"^\u00b1 (\S+) mm$", words, re.MULTILINE)
    assert len(tip) == len(u) == 3
    return ReadOut((*tip, *u))


def result_on_disk(walker: "Walker") -> Result:
    """The only result there is, which is in force."""
    archive, folder = walker.workbench.run.archive, walker.workbench.folder
    assert len(list(folder.rglob("results/*.json"))) == 1
    is_simulated = walker.workbench.selection.preparation.origin is Origin.SIMULATED
    pen, tip = NAMES["Pen serial number"], NAMES["Probe tip"]
    result = archive.in_force(pen, tip, is_simulated=is_simulated)
    assert result is not None
    return result


def calibrated(lightpen: Run, record: Path) -> list[float]:
    """The tip that the command line makes of a record."""
    file = record.parent / "calibration.json"
    outcome = lightpen("calibrate", record, "--json", file)
    assert outcome.returncode == 0, outcome.stderr
    tip: list[float] = json.loads(file.read_text(encoding="utf-8"))["tip_pen_mm"]
    return tip
