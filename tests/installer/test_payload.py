"""The installed folder: the runtime, the list of files, their times."""

import io
import zipfile
from hashlib import sha256
from pathlib import Path

from installer import runtime
from installer.launchers import ICON_SIZES, icon, numbers_of, order_of
from installer.payload import all_files, set_times, write_file_list

from lightpen_program.self_test import FILE_LIST, damaged_files


def test_the_list_of_files_is_the_one_that_the_self_test_reads(tmp_path: Path) -> None:
    file = tmp_path / "runtime" / "模块 1.py"
    file.parent.mkdir()
    file.write_text("a")
    write_file_list(tmp_path)

    assert damaged_files(tmp_path / FILE_LIST) == ()
    file.write_text("b")
    assert damaged_files(tmp_path / FILE_LIST) == ("runtime/模块 1.py",)


def test_every_file_and_folder_gets_the_time_of_the_commit(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "b").touch()
    set_times(tmp_path, 1_700_000_000)

    times = {path.stat().st_mtime for path in [tmp_path, *tmp_path.rglob("*")]}
    assert times == {1_700_000_000}
    assert all_files(tmp_path) == [tmp_path / "a" / "b"]


def test_modules_that_are_not_proven_or_not_used_are_taken_out_of_the_library() -> None:
    library = io.BytesIO()
    with zipfile.ZipFile(library, "w") as files:
        for name in ("os.pyc", "_pydecimal.pyc", "xmlrpc/client.pyc"):
            files.writestr(name, name)

    once = runtime.reduced(library.getvalue())

    with zipfile.ZipFile(io.BytesIO(once)) as files:
        assert files.namelist() == ["os.pyc"]
    assert runtime.reduced(library.getvalue()) == once


def test_every_file_of_the_runtime_is_pinned_by_its_digest() -> None:
    pins = runtime.pinned_files()

    needed = {"python313.dll", "python313.zip", "sqlite3.dll", "vcruntime140.dll"}
    assert needed <= set(pins)
    assert all(len(digest) == len(sha256().hexdigest()) for digest in pins.values())


def test_a_version_is_written_as_the_four_numbers_of_windows() -> None:
    assert numbers_of("0.1.0") == "0,1,0,0"
    assert numbers_of("12.3") == "12,3,0,0"
    assert numbers_of("1.2.0rc3") == "1,2,0,0"


def test_a_release_comes_after_its_candidates_and_before_those_of_the_next() -> None:
    versions = ("1.1.0", "1.2.0a1", "1.2.0b1", "1.2.0rc1", "1.2.0rc2", "1.2.0", "1.2.1")
    orders = [tuple(map(int, order_of(version).split("."))) for version in versions]

    assert orders == sorted(set(orders))


def test_the_icon_has_every_size_and_is_always_the_same() -> None:
    data = icon()

    assert data[:6] == bytes([0, 0, 1, 0, len(ICON_SIZES), 0])
    assert data.count(b"\x89PNG") == len(ICON_SIZES)
    assert icon() == data
