"""`lightpen --self-test` tries the program and writes what it found."""

import json
import sys
from hashlib import sha256
from pathlib import Path
from threading import Event

import pytest

from lightpen_program.self_test import FILE_LIST, Report, SelfTestError, damaged_files
from lightpen_program.self_test import test_program as run_self_test


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """Return the list of the files of an installed program."""
    lines = []
    for name in ("runtime/python.dll", "runtime/Lib/模块.py"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(name, encoding="utf-8")
        lines.append(f"{sha256(path.read_bytes()).hexdigest()}  {name}\n")
    files = tmp_path / FILE_LIST
    files.write_text("".join(lines), encoding="utf-8")
    return files


def test_files_as_they_were_built_are_not_reported(installed: Path) -> None:
    assert damaged_files(installed) == ()


def test_a_damaged_file_and_a_missing_one_are_named(installed: Path) -> None:
    (installed.parent / "runtime" / "python.dll").write_text("other")
    (installed.parent / "runtime" / "Lib" / "模块.py").unlink()

    assert damaged_files(installed) == ("runtime/python.dll", "runtime/Lib/模块.py")


def test_a_damaged_program_is_reported_before_anything_is_imported(
    installed: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (installed.parent / "runtime" / "python.dll").write_text("other")
    monkeypatch.setattr(sys, "prefix", str(installed.parent / "runtime"))
    report = tmp_path / "report.json"

    assert run_self_test(report) == 1

    written = json.loads(report.read_text(encoding="utf-8"))
    assert written["ok"] is False
    (check,) = written["checks"]
    assert check["name"] == "files"
    assert "runtime/python.dll" in check["found"]


def test_a_report_that_cannot_be_written_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_self_test(tmp_path / "missing" / "report.json") == 2
    assert "report.json cannot be written:" in capsys.readouterr().err


def test_what_a_check_breaks_on_is_in_the_report(tmp_path: Path) -> None:
    report = Report(tmp_path / "report.json")

    with pytest.raises(SelfTestError), report.check("fonts"):
        raise SelfTestError("The fonts have no 光.")
    report.is_complete = True
    report.write()

    written = json.loads(report.file.read_text(encoding="utf-8"))
    assert written["ok"] is False
    assert "The fonts have no 光." in written["checks"][0]["found"]


def test_a_report_that_is_cut_off_is_not_one_of_success(tmp_path: Path) -> None:
    report = Report(tmp_path / "report.json")
    with report.check("files"):
        pass

    assert not report.ok


def test_a_path_that_is_no_utf_8_is_in_the_report(tmp_path: Path) -> None:
    report = Report(tmp_path / "report.json")

    with report.check("path") as found:
        found.append("/home/\udcff")
    report.write()

    written = json.loads(report.file.read_text(encoding="utf-8"))
    assert written["checks"][0]["found"] == "/home/\udcff"


def test_a_test_that_hangs_reports_where(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given_up = Event()

    def hang(report: Report, *_: object) -> None:
        assert given_up.wait(60)

    monkeypatch.setattr("lightpen_program.self_test.LONGEST", 0.01)
    monkeypatch.setattr("lightpen_program.self_test._test_all", hang)
    monkeypatch.setattr("os._exit", lambda status: given_up.set())
    file = tmp_path / "report.json"

    assert run_self_test(file) == 1

    written = json.loads(file.read_text(encoding="utf-8"))
    assert any("in hang" in place for place in written["threads"]["MainThread"])
