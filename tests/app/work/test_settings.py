"""Choices outlive the program; a damaged file gives the defaults."""

from pathlib import Path

import pytest
from PySide6.QtCore import QRect
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from lightpen.errors import FileError
from lightpen_app.look.languages import Language
from lightpen_app.look.theme import Appearance
from lightpen_app.work.settings import Preferences, Settings, Station, settings_file

STATION = Station(
    operator="Zoë, 王 / \\ %",
    pen="LP-04",
    ball_diameter=3.0005,
    nominal_tip="1.761, -137.5, 0.02",
    source="folder",
    exposure_us=850.0,
)
PREFERENCES = Preferences(
    language=Language.CHINESE,
    appearance=Appearance.LIGHT,
    muted=True,
    distance_m=4.0,
)


def reopened(settings: Settings) -> Settings:
    settings.sync()
    return Settings(settings.file)


def test_preferences_survive_the_program(settings: Settings) -> None:
    settings.set_preferences(PREFERENCES)

    assert reopened(settings).preferences() == PREFERENCES


def test_each_station_remembers_its_own(settings: Settings) -> None:
    settings.set_station("Hall 3/2", STATION)
    settings.set_station("Hall\\4", Station(operator="Ann"))

    again = reopened(settings)

    assert again.stations() == ("Hall 3/2", "Hall\\4")
    assert again.station("Hall 3/2") == STATION
    assert again.station("Hall\\4").operator == "Ann"


def test_a_new_station_begins_with_the_simulated_pen(settings: Settings) -> None:
    assert settings.station("new") == Station()
    assert settings.station("new").source == "simulated"


@pytest.mark.parametrize(
    "name",
    ["Hall 3/2", "a, b", "General", "%", "王 Ä", "[x]", "a=b;c", "w" * 200, "@x", "5"],
)
def test_the_last_station_survives_whatever_its_name(
    settings: Settings, name: str
) -> None:
    assert settings.last_station() == ""
    settings.set_station(name, Station(operator=name))
    settings.set_last_station(name)

    again = reopened(settings)

    assert again.last_station() == name
    assert again.stations() == (name,)
    assert again.station(name).operator == name


def test_a_station_needs_a_name(settings: Settings) -> None:
    with pytest.raises(ValueError, match="must not be empty"):
        settings.set_station("", Station())


@pytest.mark.parametrize(
    "text",
    ["distance_m=near", "distance_m=nan", "language=tlh", "muted=1", "muted=a, b"],
)
def test_a_value_that_makes_no_sense_gives_the_default(
    settings: Settings, text: str
) -> None:
    settings.file.parent.mkdir()
    settings.file.write_text(f"[preferences]\n{text}\nappearance=dark\n")

    preferences = Settings(settings.file).preferences()

    assert preferences.distance_m == 3.0
    assert preferences.language in Language
    assert not preferences.muted
    assert preferences.appearance is Appearance.DARK


def test_a_file_of_rubbish_gives_the_defaults(settings: Settings) -> None:
    settings.file.parent.mkdir()
    settings.file.write_bytes(bytes(range(256)) * 8)

    assert Settings(settings.file).station("any") == Station()


def test_a_window_comes_back_where_it_was(qtbot: QtBot, settings: Settings) -> None:
    place = QRect(120, 80, 640, 400)
    windows = [QWidget(), QWidget()]
    for window in windows:
        qtbot.addWidget(window)
        window.setObjectName("main")
    windows[0].setGeometry(place)
    settings.save_geometry(windows[0])

    restored = reopened(settings).restore_geometry(windows[1])

    assert restored
    assert windows[1].geometry() == place


def test_settings_that_cannot_be_saved_are_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    settings = Settings(tmp_path / "file" / "lightpen.ini")

    with pytest.raises(FileError, match=r"cannot be saved: .*lightpen\.ini"):
        settings.set_preferences(Preferences())


def test_the_file_belongs_to_the_user(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", "/somewhere/else")

    assert settings_file().name == "lightpen.ini"
    assert settings_file().parent.name == "lightpen"
