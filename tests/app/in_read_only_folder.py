"""What `test_read_only.py` runs in a name space of its own, where it may mount."""

import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtWidgets import QLabel

from lightpen.live.sources import SourceEnvironment
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import SourceChoice
from lightpen_app.look.theme import TextSize
from lightpen_app.work.settings import FilePaths, Settings, Station, StoredCamera

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard, Walker

WAY = "Choose the data folder at Set up station or in the options (F10)."


def test_a_read_only_data_folder_is_reported_with_the_way_to_another(
    settings: Settings,
    open_wizard: "OpenWizard",
    around: SourceEnvironment,
    tmp_path: Path,
) -> None:
    data = tmp_path / "data"
    data.mkdir()
    for words in (["--bind", str(data)], ["-o", "remount,ro,bind"]):
        subprocess.run(["mount", *words, str(data)], check=True)
    assert around.simulator is not None
    files = around.simulator.write_files(tmp_path / "files")
    assert files.camera_file is not None
    assert files.pen_file is not None
    settings.set_station(
        "Hall 2",
        Station(
            Names("", "Ann", "LP-04", "T-10", "C-1"),
            camera=StoredCamera(SourceChoice()),
            files=FilePaths(str(files.camera_file.path), str(files.pen_file.path)),
        ),
    )
    settings.set_last(station="Hall 2")

    walker = open_wizard()
    walker.until_tells("unable to open database file")
    walker.click("Close")
    walker.until_tells(f"The data folder {data} is not writable")
    walker.until_tells(WAY)
    walker.click("Close")
    walker.click("Set up station...")
    assert walker.offers("Choose another data folder")
    walker.click("Show the tips of this station")
    walker.until(lambda: walker.main_button().text().startswith("Swing "))
    walker.main_button().click()
    walker.until_shows("Swing")
    walker.until_says("No swing")
    walker.window.resize(940, 500)
    walker.until_tells("The disk is read-only.")
    assert min(letters(walker)) >= TextSize.SMALL


def letters(walker: "Walker") -> list[int]:
    """How large the letters are that are seen, px."""
    labels = (each for each in walker.seen() if isinstance(each, QLabel))
    return [each.fontInfo().pixelSize() for each in labels if each.text()]
