"""No command ends in a traceback, whatever words it is given."""

import argparse
from collections.abc import Callable, Iterator
from pathlib import Path
from subprocess import CompletedProcess

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from lightpen.cli import _parser
from lightpen_extensions.plant.server import SERVER
from lightpen_program.extensions import EXTENSIONS

_, COMMANDS = _parser([], None, EXTENSIONS)
NAMES = sorted(COMMANDS)
# After all others, so that nothing long is done.
LAST = {"simulate": ["--images", "1", "--binning", "4"]}
WORDS = st.sampled_from(
    [
        *("0001-01-01", "9999-12-31", "1970-01-01", "2026-02-30", "1x1", "0x9"),
        *("-1", "0", "1e309", "nan", "inf", "99999999999999999999", "1.5", "-0.0"),
        *("", " ", ".", "..", "/dev/null", "/dev/zero", "nowhere", "a\x00b", "\udcff"),
        *("tip", "pen", "cone", "T-1", "a/b", "笔", "=1+1", "verification", "limits"),
        *("text.csv", "tree.json", "chessboard:3x3:1"),
    ]
)
TEXTS = st.text(max_size=12)
SERVERS = ("", "nowhere", "\udcff", "sqlite:///x", "postgresql://x@127.0.0.1:1/x")
QUICK = settings(
    max_examples=8, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def options_of(
    parser: argparse.ArgumentParser, words: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...], list[str]]]:
    """Yield each command below a parser with the names and values of its options."""
    options, is_leaf = [], True
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            is_leaf = False
            for name, below in action.choices.items():
                yield from options_of(below, (*words, name))
        elif not isinstance(action, argparse._HelpAction):
            options += [*action.option_strings, *map(str, action.choices or ())]
    if is_leaf:
        yield words, options


def every_command() -> dict[tuple[str, ...], list[str]]:
    found = dict[tuple[str, ...], list[str]]()
    for name in NAMES:
        parser, commands = _parser([name], None, EXTENSIONS)
        assert isinstance(commands, dict), parser
        found.update(options_of(commands[name], (name,)))
    return found


EVERY = every_command()


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("random")
    (folder / "text.csv").write_text("frame,led,x_px,y_px\n0,1,1,1\n", "utf-8")
    (folder / "tree.json").write_text('{"program": {"name": "x"}}', "utf-8")
    return folder


def tried(
    lightpen: Callable[..., CompletedProcess[str]],
    place: Path,
    words: list[str],
    server: str = "",
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        patch.setenv(SERVER, server)
        patch.setenv("LIGHTPEN_PASSWORD", "correct horse")
        done = lightpen(*words)
    assert done.returncode in (0, 1, 2, 3, 4)
    assert "Traceback" not in done.stderr


def test_the_commands_are_those_of_the_program() -> None:
    for command in ("discover", "measure", "archive fetch", "verify circle"):
        assert tuple(command.split()) in EVERY


@pytest.mark.slow
@pytest.mark.parametrize("command", EVERY, ids=" ".join)
@QUICK
@given(data=st.data())
def test_no_words_make_a_command_crash(
    lightpen: Callable[..., CompletedProcess[str]],
    place: Path,
    command: tuple[str, ...],
    data: st.DataObject,
) -> None:
    words = data.draw(
        st.lists(st.sampled_from(EVERY[command]) | WORDS | TEXTS, max_size=8)
    )
    server = data.draw(st.sampled_from(SERVERS))
    tried(lightpen, place, [*command, *words, *LAST.get(command[0], ())], server)


@QUICK
@given(words=st.lists(WORDS | TEXTS, max_size=4))
@example(words=["--most", "0"])
def test_no_words_make_the_list_of_an_archive_crash(
    lightpen: Callable[..., CompletedProcess[str]], data: Path, words: list[str]
) -> None:
    tried(lightpen, data.parent, ["archive", "list", "--data", str(data), *words])


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data folder with an archive of one entry."""
    from tests.core.archive.conftest import accepted

    from lightpen.archive.chains import append, own_chain
    from lightpen.archive.store import open_file

    folder = tmp_path_factory.mktemp("archive") / "data"
    database = open_file(folder / "archive.sqlite")
    append(database, own_chain(database), *accepted(1))
    database.close()
    return folder
