"""Whether anything can be kept in the data folder."""

from pathlib import Path

import pytest

from lightpen.errors import FileError
from lightpen.record.folder import check_writable


def test_a_folder_is_made_and_nothing_is_left_in_it(tmp_path: Path) -> None:
    check_writable(tmp_path / "new" / "data")

    assert list((tmp_path / "new" / "data").iterdir()) == []


def test_where_nothing_can_be_kept_is_reported_with_the_reason(tmp_path: Path) -> None:
    (tmp_path / "file").touch()

    with pytest.raises(FileError, match=r"The data folder .* is not writable"):
        check_writable(tmp_path / "file" / "data")
