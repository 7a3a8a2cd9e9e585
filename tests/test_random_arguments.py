"""No command ends in a traceback, whatever words it is given."""

from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from lightpen.cli import COMMANDS

# These wait for poses or write whole sets of images; their options are tried elsewhere.
LONG = {"stream", "simulate", "repeatability"}
NAMES = sorted({name for name, _, _ in COMMANDS} - LONG)
ACTIONS = {
    "archive": ["check", "list", "export", "import", "deliver"],
    "tips": ["list", "add", "change", "retire", "return", "spin"],
}
WORDS = st.sampled_from(
    [
        *("--data", "--since", "--until", "--most", "--kind", "--csv", "--json"),
        *("--camera", "--pen", "--centers", "--tip", "--station", "--units"),
        *("--limit", "--due", "--ball", "--nominal", "--axis", "--reason"),
        *("0001-01-01", "9999-12-31", "1970-01-01", "2026-02-30"),
        *("-1", "0", "1e309", "nan", "inf", "99999999999999999999", "1.5", "-0.0"),
        *("", " ", ".", "..", "/dev/null", "/dev/zero", "nowhere", "a\x00b", "\udcff"),
        *("tip", "pen", "cone", "T-1", "a/b", "笔", "=1+1", "verification", "limits"),
    ]
)
TEXTS = st.text(max_size=12)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("random")


def tried(
    lightpen: Callable[..., CompletedProcess[str]], place: Path, words: list[str]
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        done = lightpen(*words)
    assert done.returncode in (0, 1, 2, 3, 4)
    assert "Traceback" not in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name", [*NAMES, *ACTIONS])
@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_no_words_make_a_command_crash(
    lightpen: Callable[..., CompletedProcess[str]],
    place: Path,
    name: str,
    data: st.DataObject,
) -> None:
    action = data.draw(st.sampled_from(ACTIONS[name])) if name in ACTIONS else ""
    words = data.draw(st.lists(WORDS | TEXTS, max_size=6))
    tried(lightpen, place, [name, *filter(None, [action]), *words])


@given(words=st.lists(WORDS | TEXTS, max_size=4))
@example(words=["--since", "0001-01-01"])
@example(words=["--until", "9999-12-31"])
@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_no_words_make_the_list_of_an_archive_crash(
    lightpen: Callable[..., CompletedProcess[str]], data: Path, words: list[str]
) -> None:
    tried(lightpen, data.parent, ["archive", "list", "--data", str(data), *words])


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data folder with an archive of one entry."""
    from tests.core.archive.conftest import accepted

    from lightpen.archive.chains import append, own_chain
    from lightpen.archive.database import open_file

    folder = tmp_path_factory.mktemp("archive") / "data"
    database = open_file(folder / "archive.sqlite")
    append(database, own_chain(database), *accepted(1))
    database.close()
    return folder
