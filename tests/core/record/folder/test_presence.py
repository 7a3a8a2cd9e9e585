"""Windows of the program that use one data folder know of each other."""

import subprocess
import sys
from pathlib import Path

from lightpen.record.folder import WINDOWS, Presence

OTHER = """
import sys, time
from pathlib import Path
from lightpen.record.folder import Presence
presence = Presence(Path(sys.argv[1]))
print(presence.count_others(), flush=True)
time.sleep(600)
"""


def test_two_windows_count_each_other_until_one_leaves(tmp_path: Path) -> None:
    one, other = Presence(tmp_path), Presence(tmp_path)
    assert one.count_others() == 0
    assert other.count_others() == one.count_others() == 1

    other.leave()
    assert one.count_others() == 0
    one.leave()
    assert list((tmp_path / WINDOWS).iterdir()) == []


def test_one_that_was_killed_is_not_counted_and_its_file_removed(
    tmp_path: Path,
) -> None:
    one = Presence(tmp_path)
    with subprocess.Popen(
        [sys.executable, "-c", OTHER, str(tmp_path)], stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "0\n"
        assert one.count_others() == 1
        other.kill()
        other.wait()
    assert one.count_others() == 0
    assert len(list((tmp_path / WINDOWS).iterdir())) == 1
    one.leave()


def test_one_whose_file_was_removed_before_it_was_locked_is_counted_again(
    tmp_path: Path,
) -> None:
    one, other = Presence(tmp_path), Presence(tmp_path)
    assert one.count_others() == 0
    (file,) = (tmp_path / WINDOWS).iterdir()
    file.unlink()
    assert other.count_others() == 0

    assert one.count_others() == other.count_others() == 1
    one.leave()
    other.leave()


def test_where_nothing_can_be_written_nobody_is_known(tmp_path: Path) -> None:
    (tmp_path / WINDOWS).touch()

    assert Presence(tmp_path).count_others() == 0
