"""That no test passes in which the thread of the windows touches a file of the user."""

import os
from pathlib import Path
from threading import Thread

from tests.app.disk import APP, disk_watch


def test_a_file_that_the_windows_thread_touches_is_noticed(tmp_path: Path) -> None:
    (tmp_path / "listed").mkdir()
    code = compile("os.listdir(path)", f"{APP}steps/page.py", "exec")
    exec(code, {"os": os, "path": tmp_path / "listed"})

    (seen,) = disk_watch().take()
    assert seen == f"os.listdir {tmp_path / 'listed'} by steps/page.py:1"


def test_what_another_thread_and_what_a_test_touches_is_not(tmp_path: Path) -> None:
    code = compile("path.write_text('')", f"{APP}steps/page.py", "exec")
    thread = Thread(target=exec, args=(code, {"path": tmp_path / "other"}))
    thread.start()
    thread.join()
    (tmp_path / "own").write_text("")

    assert (tmp_path / "other").exists()
    assert disk_watch().take() == []
