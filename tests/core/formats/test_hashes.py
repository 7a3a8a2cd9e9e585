from hashlib import sha256
from pathlib import Path

import pytest

from lightpen.errors import FileError
from lightpen.formats.opened_files import all_hashed


@pytest.mark.parametrize("n_files", [0, 1, 7])
def test_files_are_hashed_in_their_order(tmp_path: Path, n_files: int) -> None:
    paths = [tmp_path / f"{i}.png" for i in range(n_files)]
    for path in paths:
        path.write_text(path.name)

    hashed = all_hashed(paths)

    assert [file.path for file in hashed] == paths
    contents = [path.name.encode() for path in paths]
    assert [f.sha256 for f in hashed] == [sha256(c).hexdigest() for c in contents]


def test_a_file_that_has_gone_is_reported(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"gone\.png cannot be read"):
        all_hashed([tmp_path / "gone.png"])
