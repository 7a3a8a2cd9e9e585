"""The trial of an installer leaves an installation and data of the account alone."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from installer import check
from installer.trial import UNINSTALL, Trial
from installer.wine.prefix import CommandResult

SETUP = "Lightpen-1.0.0-setup.exe"


class Computer(SimpleNamespace):
    """A Windows whose registry may state an installation; notes what is run on it."""

    def __init__(self, folder: Path, stated: str = "") -> None:
        super().__init__(home=folder / "home", shared=folder, stated=stated)
        self.run_words: list[Sequence[str]] = []

    def run(self, words: Sequence[str], **_: object) -> CommandResult:
        self.run_words.append(words)
        is_stated = words[:2] == ["reg", "query"] and words[2] == self.stated
        output = "    DisplayName    REG_SZ    Lightpen\r\n" if is_stated else ""
        return CommandResult(tuple(words), 0 if is_stated else 1, output, 0.0)


def tried_on(computer: Computer, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return what is tried on a computer, by the check as it is started."""
    tried: list[str] = []

    @contextmanager
    def machine(_: str) -> Iterator[Computer]:
        yield computer

    monkeypatch.setattr(check, "fresh_machine", machine)
    for name in ("try_all", "try_quickly"):
        monkeypatch.setattr(check, name, lambda *_, name=name: tried.append(name))
    status = check.main([SETUP])
    assert status == (0 if tried else 1)
    return tried


@pytest.mark.parametrize(
    "place",
    [
        *("home/AppData/Local/lightpen", "home/AppData/Local/lightpen-keys"),
        *("home/AppData/Local/Programs/Lightpen", "Program Files/Lightpen"),
    ],
)
def test_data_keys_and_installations_keep_every_trial_away(
    place: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / place).mkdir(parents=True)
    computer = Computer(tmp_path)

    assert tried_on(computer, monkeypatch) == []

    assert str(tmp_path / place) in capsys.readouterr().err
    assert all(words[:2] == ["reg", "query"] for words in computer.run_words)


def test_so_does_an_installation_in_another_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    assert tried_on(Computer(tmp_path, UNINSTALL), monkeypatch) == []

    assert UNINSTALL in capsys.readouterr().err


def test_a_computer_without_them_is_tried(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert Trial(Computer(tmp_path), Path(SETUP)).remains() == []
    assert tried_on(Computer(tmp_path), monkeypatch) == ["try_all"]
