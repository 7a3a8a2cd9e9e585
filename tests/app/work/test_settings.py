"""Choices outlive the program; a damaged file gives the defaults."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from lightpen.cameras.protocol import CameraSettings, Region, TriggerMode
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import SourceChoice
from lightpen_app.look.theme import Appearance
from lightpen_app.work.settings import (
    Preferences,
    Settings,
    Station,
    StoredCamera,
    settings_file,
)
from lightpen_resources import languages

STATION = Station(
    Names("", "Zoë, 王 / \\ %", "LP-04", ball_diameter=3.0005),
    nominal_tip=(1.761, -137.5, 0.02),
    camera=StoredCamera(
        SourceChoice("folder", producer="/opt/vendor/producer.cti"),
        mask=((101.25, 0.1, 12.0), (1e-3, 700.0, 1 / 3)),
    ),
    extensions={"measure": {"n_frames": 12}, "later": {"any": [1, None]}},
)
ANN = Station(Names(operator="Ann"))
CAMERA = CameraSettings(850.0, 6.0, 20.0, "Mono12", Region(8, 0, 640, 480), None, 1500)
PREFERENCES = Preferences(
    language="zh_CN", appearance=Appearance.LIGHT, muted=True, distance_m=4.0
)


HOLDER = """
import sys, time
from pathlib import Path
from lightpen.formats.part_files import folder_locked

with folder_locked(Path(sys.argv[1]), 0.0) as is_alone:
    print("held" if is_alone else "taken", flush=True)
    time.sleep(600)
"""
TIMEOUT = 60.0  # s
RUBBISH = [
    bytes(range(256)) * 8,
    b"{",
    b"[]",
    b'{"stations": []}',
    b'{"a": {"b": NaN}}',
    b"[" * 100_000,
]


def write(file: Path, content: object) -> None:
    file.parent.mkdir(parents=True)
    file.write_text(json.dumps(content))


def reopened(settings: Settings) -> Settings:
    assert settings.await_saved(TIMEOUT)
    return Settings(settings.file)


@pytest.mark.parametrize(
    "name",
    ["Hall 3/2", "a, b", "General", "%", "王 Ä", "[x]", "a=b;c", "w" * 200, "@x", "5"],
)
def test_the_last_station_survives_whatever_its_name(
    settings: Settings, name: str
) -> None:
    assert settings.last().station == ""
    settings.set_station(name, Station(Names(operator=name)))
    settings.set_last(station=name)

    again = reopened(settings)

    assert again.last().station == name
    assert again.stations() == (name,)
    assert again.station(name).names.operator == name


def test_a_station_needs_a_name(settings: Settings) -> None:
    with pytest.raises(ValueError, match="must not be empty"):
        settings.set_station("", Station())


@pytest.mark.parametrize(
    "entries",
    [
        {"distance_m": "near"},
        {"distance_m": "nan"},
        {"distance_m": None},
        {"distance_m": [3.0]},
        {"language": "tlh"},
        {"muted": "loud"},
        {"muted": {"a": 1}},
    ],
)
def test_a_value_that_makes_no_sense_gives_the_default(
    settings: Settings, entries: dict[str, object]
) -> None:
    write(settings.file, {"preferences": entries | {"appearance": "dark"}})

    preferences = Settings(settings.file).preferences()

    assert preferences.distance_m == 3.0
    assert preferences.language in languages()
    assert not preferences.muted
    assert preferences.appearance is Appearance.DARK


@pytest.mark.parametrize("content", RUBBISH)
def test_a_damaged_file_gives_the_defaults_is_reported_and_kept(
    settings: Settings, content: bytes
) -> None:
    settings.file.parent.mkdir()
    settings.file.write_bytes(content)

    again = Settings(settings.file)

    assert again.station("any") == Station()
    assert "are damaged and were renamed to lightpen.json.damaged." in str(again.fault)
    aside = settings.file.with_name("lightpen.json.damaged")
    assert aside.read_bytes() == content


def test_a_file_damaged_meanwhile_costs_nothing_that_is_known(
    settings: Settings, qtbot: QtBot
) -> None:
    settings.set_station("Hall 3", STATION)
    assert settings.await_saved(TIMEOUT)
    settings.file.write_bytes(b"{")

    with qtbot.waitSignal(settings.failed) as reported:
        settings.set_last(station="Hall 3")

    assert ". Restore them from a copy, or enter the settings again." in str(
        reported.args[0]
    )
    assert reopened(settings).station("Hall 3") == STATION


def test_a_pipe_in_place_of_the_file_is_reported_and_waited_for_by_nobody(
    settings: Settings, qtbot: QtBot
) -> None:
    settings.file.parent.mkdir()
    os.mkfifo(settings.file)

    again = Settings(settings.file)
    with qtbot.waitSignal(again.failed):
        again.set_last(station="Hall 3")

    assert "is a pipe or a device" in str(again.fault)
    assert again.last().station == "Hall 3"
    assert again.await_saved(TIMEOUT)


def test_two_windows_keep_what_each_has_changed(settings: Settings) -> None:
    other = Settings(settings.file)
    settings.set_station("Hall 3", STATION)
    settings.set_last(station="Hall 3")
    assert settings.await_saved(TIMEOUT)
    other.set_station("Hall 4", ANN)
    other.set_preferences(PREFERENCES)

    again = reopened(other)

    assert again.stations() == ("Hall 3", "Hall 4")
    assert again.station("Hall 3") == STATION
    assert again.last().station == "Hall 3"
    assert again.preferences() == PREFERENCES


@pytest.mark.skipif(sys.platform == "win32", reason="needs locks of folders")
def test_a_stopped_program_that_holds_the_settings_keeps_nobody_from_saving(
    settings: Settings, qtbot: QtBot
) -> None:
    settings.file.parent.mkdir()
    words = [sys.executable, "-c", HOLDER, str(settings.file.parent)]
    with subprocess.Popen(words, stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == b"held\n"
        holder.send_signal(signal.SIGSTOP)

        with qtbot.waitSignal(settings.failed) as reported:
            settings.set_station("Hall 3", STATION)
            is_waited_for = settings.file.exists()

        assert not is_waited_for
        assert "s. End that program if it hangs; it may overwrite the settings." in str(
            reported.args[0]
        )
        assert reopened(settings).station("Hall 3") == STATION
        holder.kill()


def test_what_is_set_many_times_in_a_row_is_on_the_disk_as_it_was_last(
    settings: Settings,
) -> None:
    for n in range(20):
        settings.set_station("Hall 3", replace(STATION, names=Names(pen=f"LP-{n}")))
        settings.set_last(station=f"Hall {n}")
    assert settings.await_saved(TIMEOUT)

    again = Settings(settings.file)
    assert (again.station("Hall 3").names.pen, again.last().station) == (
        "LP-19",
        "Hall 19",
    )


def test_what_could_not_be_saved_is_tried_again_and_taken_back(
    tmp_path: Path, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lightpen_app.work.settings.AGAIN_MS", 50)
    (tmp_path / "file").write_text("not a folder")
    settings = Settings(tmp_path / "file" / "lightpen.json")
    reported: list[object] = []
    settings.failed.connect(reported.append)
    with qtbot.waitSignal(settings.failed):
        settings.set_preferences(PREFERENCES)

    with qtbot.waitSignal(settings.recovered) as withdrawn:
        (tmp_path / "file").unlink()

    assert withdrawn.args == reported
    assert reopened(settings).preferences() == PREFERENCES


def test_the_file_belongs_to_the_user(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", "/somewhere/else")

    assert settings_file().name == "lightpen.json"
    assert settings_file().parent.name == "lightpen"


def test_cameras_are_remembered_by_their_serial_numbers(
    settings: Settings, tmp_path: Path
) -> None:
    other = CameraSettings(exposure_us=400.0, trigger=TriggerMode.SOFTWARE)
    settings.set_camera("21877692", CAMERA)
    settings.set_camera("LP01", other)
    assert settings.await_saved(TIMEOUT)

    assert Settings(settings.file).cameras() == {"21877692": CAMERA, "LP01": other}


@pytest.mark.parametrize(
    "region",
    ["1 2 3 4", {"x": 1}, [1, 2, 3, 4], {"x": 1.5, "y": 0, "width": 5, "height": 5}],
)
def test_a_region_that_makes_no_sense_is_passed_over(
    settings: Settings, region: object
) -> None:
    settings.set_camera("LP01", CAMERA)
    assert settings.await_saved(TIMEOUT)
    content = json.loads(settings.file.read_text())
    content["cameras"]["LP01"]["region"] = region
    settings.file.write_text(json.dumps(content))

    assert Settings(settings.file).cameras()["LP01"] == replace(CAMERA, region=None)
