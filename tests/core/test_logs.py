"""The log goes to a file of limited size, and stops nobody."""

import logging
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from lightpen import logs
from lightpen.logs import (
    LEVEL_VARIABLE,
    N_OLD_FILES,
    N_RECENT,
    end_log,
    log_file,
    log_level,
    recent_lines,
    running_log,
    write_log_to,
)

logger = logging.getLogger("lightpen.tests")
LINE = re.compile(
    r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}[+-]\d\d:\d\d INFO \d+ MainThread "
    r"lightpen\.tests: a swing of 60 images"
)
# Appends its lines to the log of a data folder, as another process of the program.
WRITER = """
import logging, sys
from pathlib import Path
from lightpen import logs
from lightpen.logs import running_log, write_log_to

logs.MAX_BYTES = 20_000
with running_log(logging.INFO):
    write_log_to(Path(sys.argv[1]))
    for number in range(300):
        logging.getLogger("lightpen").info("%s %d", sys.argv[2], number)
"""
ODD_NAMES = """
import logging, os, sys
from pathlib import Path
from lightpen.logs import running_log, write_log_to

with running_log(logging.INFO):
    write_log_to(Path(sys.argv[1]))
    names = ("灯笔.csv", os.fsdecode(b"\\xff.csv"))
    logging.getLogger("lightpen").info("read: %s and %s", *names)
"""


@pytest.fixture
def no_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(LEVEL_VARIABLE, raising=False)


@pytest.fixture
def log(tmp_path: Path) -> Iterator[Path]:
    """A running log; return its file, which `end_log` completes."""
    with running_log(logging.INFO):
        write_log_to(tmp_path)
        yield log_file(tmp_path)


def text_of(log: Path) -> str:
    end_log()
    return log.read_text(encoding="utf-8")


def test_a_line_has_time_level_process_thread_and_logger(log: Path) -> None:
    logger.info("a swing of %d images", 60)

    assert LINE.fullmatch(text_of(log).rstrip("\n"))


def test_lines_below_the_level_are_left_out(log: Path) -> None:
    logger.debug("not this")
    logger.info("but this")

    assert "not this" not in recent_lines()[0]
    assert text_of(log).count("\n") == 1


def test_other_libraries_are_heard_from_warnings_on(log: Path) -> None:
    logging.getLogger("sqlalchemy").info("not this")
    logging.getLogger("sqlalchemy").warning("but this")

    assert "but this" in text_of(log)
    assert "not this" not in text_of(log)


def test_a_name_that_is_no_text_is_logged_all_the_same(tmp_path: Path) -> None:
    # In a process of its own, as pytest has what is logged sent between processes.
    program = [sys.executable, "-c", ODD_NAMES, str(tmp_path)]
    outcome = subprocess.run(program, capture_output=True, check=True, timeout=120)

    assert outcome.stderr == b""
    text = log_file(tmp_path).read_text(encoding="utf-8")
    assert r"read: 灯笔.csv and \udcff.csv" in text


def test_the_last_lines_stay_in_memory(log: Path) -> None:
    for number in range(N_RECENT + 10):
        logger.info("line %d", number)
    end_log()

    assert len(recent_lines()) == N_RECENT
    assert recent_lines()[-1].endswith(f"line {N_RECENT + 9}")


def test_an_exception_that_ends_the_program_is_logged(tmp_path: Path) -> None:
    def program() -> None:
        with running_log(logging.INFO):
            write_log_to(tmp_path)
            raise ZeroDivisionError("a bug")

    with pytest.raises(ZeroDivisionError):
        program()

    assert "CRITICAL" in recent_lines()[-1]
    assert "ZeroDivisionError: a bug" in text_of(log_file(tmp_path))


def test_nothing_is_logged_after_the_end(log: Path) -> None:
    end_log()
    logger.info("too late")

    assert recent_lines() == ()
    assert not log.exists()
    assert not logger.isEnabledFor(logging.INFO)


def test_a_log_within_a_log_changes_nothing(log: Path) -> None:
    with running_log(logging.ERROR):
        logger.info("inner")
    logger.info("outer")

    assert text_of(log).count("\n") == 2


def test_a_full_file_is_put_aside_and_the_oldest_removed(
    log: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(logs, "MAX_BYTES", 1000)
    end_log()
    with running_log(logging.INFO):
        write_log_to(tmp_path)
        for number in range(1000):
            logger.info("line %d", number)

    files = sorted(path.name for path in log.parent.iterdir())
    assert files == [
        "lightpen.log", *(f"lightpen.log.{n + 1}" for n in range(N_OLD_FILES))
    ]  # fmt: skip
    assert all(path.stat().st_size <= 1000 for path in log.parent.iterdir())
    last = [(log.parent / name).read_text().split()[-1] for name in files]
    assert sorted(map(int, last), reverse=True) == list(map(int, last))
    assert last[0] == "999"


def test_a_file_that_cannot_be_put_aside_is_gone_on_with(
    log: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """As on Windows while another program has it open."""

    def held(path: Path, target: Path | str) -> Path:
        raise PermissionError(13, "held", str(path))

    end_log()
    monkeypatch.setattr(logs, "MAX_BYTES", 1000)
    monkeypatch.setattr(Path, "replace", held)
    with running_log(logging.INFO):
        write_log_to(tmp_path)
        for number in range(100):
            logger.info("line %d", number)

    assert [path.name for path in log.parent.iterdir()] == ["lightpen.log"]
    assert len(log.read_text().splitlines()) == 100


@pytest.mark.slow
def test_several_processes_share_a_log(tmp_path: Path) -> None:
    names = ("one", "two", "three")
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", WRITER, str(tmp_path), name],
            stderr=subprocess.PIPE,
            encoding="utf-8",
        )
        for name in names
    ]
    said = [process.communicate(timeout=120)[1] for process in processes]

    assert said == ["", "", ""]
    files = list(log_file(tmp_path).parent.iterdir())
    lines = "".join(path.read_text() for path in files).splitlines()
    assert all(re.search(r" lightpen: (one|two|three) \d+$", line) for line in lines)
    newest = [line.split()[-2:] for line in lines if line.endswith(" 299")]
    assert sorted(name for name, _ in newest) == sorted(names)


@pytest.mark.parametrize("is_verbose", [False, True])
def test_a_folder_that_cannot_be_written_stops_nobody(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], is_verbose: bool
) -> None:
    (tmp_path / "logs").write_text("a file where the folder belongs")

    with running_log(logging.INFO, is_verbose=is_verbose):
        write_log_to(tmp_path)
        logger.info("one")
        logger.info("two")

    said = [line for line in recent_lines() if "cannot be written" in line]
    assert len(said) == 1
    assert str(log_file(tmp_path)) in said[0]
    assert capsys.readouterr().err.count("cannot be written") == is_verbose


def test_verbose_prints_the_lines_on_standard_error(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with running_log(logging.INFO, is_verbose=True):
        logger.info("said")

    captured = capsys.readouterr()
    assert captured.err.endswith("lightpen.tests: said\n")
    assert captured.out == ""


@pytest.mark.parametrize(
    ("option", "variable", "level"),
    [
        (None, None, logging.INFO),
        (None, "", logging.INFO),
        (None, "Warning", logging.WARNING),
        ("debug", "error", logging.DEBUG),
    ],
)
def test_the_option_comes_before_the_variable(
    monkeypatch: pytest.MonkeyPatch,
    no_variable: None,
    option: str | None,
    variable: str | None,
    level: int,
) -> None:
    if variable is not None:
        monkeypatch.setenv(LEVEL_VARIABLE, variable)

    assert log_level(option) == level
