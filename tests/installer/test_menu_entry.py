"""The menu entry that packages for Linux have."""

import configparser
import shutil
import subprocess
from pathlib import Path

import pytest
from installer.linux.menu_entry import write_menu_entry


def test_the_entry_opens_the_files_of_swings_with_this_program(tmp_path: Path) -> None:
    program = tmp_path / 'my "bin"' / "lightpen"

    write_menu_entry(tmp_path, program)

    parser = configparser.RawConfigParser()
    parser.read(tmp_path / "applications" / "lightpen.desktop", encoding="utf-8")
    entry = parser["Desktop Entry"]
    assert entry["TryExec"] == str(program)
    assert entry["Exec"].endswith('lightpen" open %f')
    assert entry["MimeType"] == "application/x-lightpen-swing;"
    types = (tmp_path / "mime" / "packages" / "lightpen.xml").read_text("utf-8")
    assert 'pattern="*.lightpen"' in types
    assert (tmp_path / "icons/hicolor/scalable/apps/lightpen.svg").is_file()


def test_the_entry_is_valid_by_the_standard(tmp_path: Path) -> None:
    checker = shutil.which("desktop-file-validate")
    if checker is None:
        pytest.skip("desktop-file-validate is not installed")
    write_menu_entry(tmp_path, tmp_path / "lightpen")

    file = tmp_path / "applications" / "lightpen.desktop"
    outcome = subprocess.run(
        [checker, str(file)], capture_output=True, text=True, check=False
    )

    assert outcome.stdout == ""
    assert outcome.returncode == 0
