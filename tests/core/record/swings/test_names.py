"""The folder of a record tells when and what, and is never one that is there."""

import os
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime
from pathlib import Path

import pytest

from lightpen.formats.files import is_reserved
from lightpen.record.swings.header import Names, not_reserved
from lightpen.record.swings.writing import make_record_folder

NOW = datetime(2026, 8, 14, 9, 5, 3)


def test_a_folder_is_named_by_the_time_the_pen_and_the_tip(tmp_path: Path) -> None:
    folder = make_record_folder(tmp_path, Names(pen="LP-04", tip="T-10"), NOW)

    assert folder == tmp_path / "20260814-090503_LP-04_T-10"


def test_names_that_are_missing_are_left_out(tmp_path: Path) -> None:
    assert make_record_folder(tmp_path, Names(), NOW).name == "20260814-090503"
    assert make_record_folder(tmp_path, Names(tip="T"), NOW).name == "20260814-090503_T"


def test_a_folder_that_is_there_is_passed_over(tmp_path: Path) -> None:
    names = Names(pen="LP-04")
    for _ in range(3):
        make_record_folder(tmp_path, names, NOW)

    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "20260814-090503_LP-04",
        "20260814-090503_LP-04-2",
        "20260814-090503_LP-04-3",
    ]


def test_those_who_begin_in_the_same_second_have_each_a_folder(tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as threads:
        folders = list(
            threads.map(lambda _: make_record_folder(tmp_path, Names(), NOW), range(40))
        )

    assert len(set(folders)) == 40
    assert all(folder.is_dir() for folder in folders)


@pytest.mark.skipif(os.name == "nt", reason="links take a right of their own there")
def test_a_link_to_nowhere_is_passed_over_too(tmp_path: Path) -> None:
    (tmp_path / "20260814-090503").symlink_to(tmp_path / "gone")

    assert make_record_folder(tmp_path, Names(), NOW).name == "20260814-090503-2"


@pytest.mark.parametrize(
    "name",
    ["a/b\\c:d*?", "../..", "量具 7", "T" * 300, "针" * 300, ".", "\x00", "\udce4"],
)
def test_whatever_the_names_the_folder_can_be_made(tmp_path: Path, name: str) -> None:
    folder = make_record_folder(tmp_path, Names(pen=name, tip=name), NOW)

    assert folder.parent == tmp_path
    assert len(folder.name.encode()) < 250
    assert not folder.name.endswith(".")  # which Windows would leave out


def test_no_name_is_a_device_of_windows() -> None:
    for name in ("nul.x", "CON", "com1.tar.gz", "lpt9", "Aux.json"):
        assert is_reserved(name)
        assert not is_reserved(not_reserved(name))
    for name in ("null.x", "com10", "T-10", "console.log"):
        assert not_reserved(name) == name
