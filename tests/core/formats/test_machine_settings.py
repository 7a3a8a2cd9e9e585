"""What an administrator has set for all users of a computer."""

import json
from pathlib import Path

import pytest

from lightpen.errors import FileError
from lightpen.formats.machine_settings import (
    MachineSettings,
    machine_file,
    machine_settings,
)
from lightpen.model.names import Laboratory
from lightpen_extensions.plant.server import SERVER, server_address

ADDRESS = "postgresql://archive.plant/lightpen"


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CONFIG_DIRS", str(tmp_path))
    path = machine_file()
    if not path.is_relative_to(tmp_path):
        pytest.skip("This system has one folder for the settings of all users.")
    path.parent.mkdir()
    return path


def test_without_the_file_nothing_is_set(file: Path) -> None:
    assert machine_settings() == MachineSettings()


def test_language_server_and_limits_are_read(file: Path) -> None:
    limits = {"max_uncertainty_mm": 0.02, "max_tip_mm": 0.05, "due_max_days": 14}
    content = {"language": "zh_CN", "archive_server": ADDRESS, "limits": limits}
    file.write_text(json.dumps(content))

    settings = machine_settings()

    assert settings.language == "zh_CN"
    assert settings.archive_server == ADDRESS
    of_station = settings.station_limits()
    assert of_station.swing.max_uncertainty == 0.02
    assert of_station.verification.tip == 0.05
    assert of_station.due.max_days == 14


def test_laboratory_and_procedure_are_read(file: Path) -> None:
    file.write_text('{"laboratory": {"name": "Works 2", "procedure": "WI-0815"}}')

    known = Laboratory(name="Works 2", procedure="WI-0815")
    assert machine_settings().laboratory == known


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ({"langauge": "en"}, "langauge"),
        ({"limits": {"max_uncertainty": 0.02}}, "'max_uncertainty'"),
        ({"limits": {"max_uncertainty_mm": 200}}, "max_uncertainty_mm is 200"),
        ({"limits": {"due_max_days": 0}}, "due_max_days is 0"),
        ({"language": 5}, "language"),
        ({"laboratory": {"procedures": "WI-0815"}}, "'procedures'"),
        ({"laboratory": {"country": "Germany"}}, "'Germany' is not a country code"),
        ({"laboratory": {"place": "moon"}}, "'moon' is none of: laboratory"),
        ({"laboratory": "Works 2"}, "laboratory"),
        ([], "object"),
    ],
)
def test_what_is_wrong_in_it_is_named(file: Path, content: object, named: str) -> None:
    file.write_text(json.dumps(content))

    with pytest.raises(FileError, match=named):
        machine_settings()


def test_the_variable_goes_before_the_server_of_the_computer(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(SERVER, raising=False)
    file.write_text(json.dumps({"archive_server": ADDRESS}))
    assert server_address() == ADDRESS

    monkeypatch.setenv(SERVER, "postgresql://own/lightpen")
    assert server_address() == "postgresql://own/lightpen"
