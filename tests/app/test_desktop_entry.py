"""`lightpen --install-desktop-entry` and its counterpart on a Linux desktop."""

import configparser
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from lightpen.errors import UsageError
from lightpen_app.desktop_entry import install_entry, remove_entry

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="desktop entries are of Linux"
)


@pytest.fixture
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    data = tmp_path / "data of Jörg"
    monkeypatch.setenv("XDG_DATA_HOME", str(data))
    monkeypatch.setattr(sys, "argv", [str(tmp_path / 'my "bin"' / "lightpen")])
    return data


def files(folder: Path) -> list[str]:
    found = (path for path in folder.rglob("*") if path.is_file())
    return sorted(str(path.relative_to(folder)) for path in found)


def entry_of(data: Path) -> configparser.SectionProxy:
    parser = configparser.RawConfigParser()
    parser.read(data / "applications" / "lightpen.desktop", encoding="utf-8")
    return parser["Desktop Entry"]


def test_the_entry_opens_the_files_of_swings_with_this_program(data: Path) -> None:
    assert install_entry() == 0

    entry = entry_of(data)
    program = sys.argv[0]
    assert entry["TryExec"] == program
    assert entry["Exec"].endswith('lightpen" open %f')
    assert entry["MimeType"] == "application/x-lightpen-swing;"
    types = (data / "mime" / "packages" / "lightpen.xml").read_text(encoding="utf-8")
    assert 'pattern="*.lightpen"' in types
    assert (data / "icons/hicolor/scalable/apps/lightpen.svg").is_file()


def test_the_entry_is_written_where_the_libraries_of_qt_are_missing(data: Path) -> None:
    code = (
        "import sys; sys.modules['PySide6'] = None;"
        "from lightpen_app.desktop_entry import install_entry; install_entry()"
    )

    subprocess.run([sys.executable, "-c", code], check=True)

    assert (data / "applications" / "lightpen.desktop").is_file()


def test_the_entry_is_valid_by_the_standard(data: Path) -> None:
    checker = shutil.which("desktop-file-validate")
    if checker is None:
        pytest.skip("desktop-file-validate is not installed")
    install_entry()

    file = data / "applications" / "lightpen.desktop"
    outcome = subprocess.run(
        [checker, str(file)], capture_output=True, text=True, check=False
    )

    assert outcome.stdout == ""
    assert outcome.returncode == 0


def test_nothing_of_the_entry_is_left_when_it_is_removed(data: Path) -> None:
    before = data / "applications" / "other.desktop"
    before.parent.mkdir(parents=True)
    before.touch()
    install_entry()

    assert remove_entry() == 0

    lists = {"mimeinfo.cache"}  # which the desktop keeps itself
    left = {name for name in files(data) if not name.startswith("mime/")} - {
        f"applications/{name}" for name in lists
    }
    assert left == {"applications/other.desktop"}
    assert not (data / "mime" / "packages" / "lightpen.xml").exists()


def test_removing_what_is_not_there_is_no_error(data: Path) -> None:
    assert remove_entry() == 0


def test_another_system_is_referred_to_its_installer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sys, "platform", "win32")

    with pytest.raises(UsageError, match="Desktop entries exist on Linux only"):
        install_entry()
