"""The data folder is shown and can be chosen."""

from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog
from tests.app.walks import set_up

from lightpen_app.work.settings import Preferences, Settings, data_folder

if TYPE_CHECKING:
    from tests.app.conftest import Walker


@pytest.mark.slow
@pytest.mark.qt_log_ignore(
    "^This plugin does not support (raise|grabbing)", extend=True
)
@pytest.mark.parametrize("way", ["options", "button"])
def test_the_data_folder_is_shown_and_chosen(
    walker: "Walker", settings: Settings, tmp_path: Path, way: str
) -> None:
    set_up(walker)
    shown = [text.replace("\u200b", "") for text in walker.texts()]
    assert str(walker.workbench.folder) in shown

    if way == "options":
        walker.press(Qt.Key.Key_F10)
        walker.choose("Data folder...")
    else:
        walker.click("Choose another data folder")
    (dialog,) = walker.window.findChildren(QFileDialog)
    other = tmp_path / "elsewhere"
    other.mkdir()
    dialog.fileSelected.emit(str(other))
    dialog.close()

    walker.until_tells("From the next start, swings and results are saved in")
    assert data_folder(settings.preferences()) == other
    assert walker.workbench.folder != other


def test_without_a_choice_the_data_folder_is_the_usual_one() -> None:
    assert data_folder(Preferences()).name == "lightpen"
