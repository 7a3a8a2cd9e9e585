"""`run.py` sets up an environment once, completely, and only its own."""

import importlib.util
import subprocess
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

import pytest


def load_run() -> ModuleType:
    path = Path(__file__).parents[1] / "run.py"
    spec = importlib.util.spec_from_file_location("lightpen_run", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


run = load_run()


class Machine:
    """Stands in for `subprocess`: notes commands and makes the files of a venv."""

    def __init__(self, root: Path) -> None:
        self.environment = run.Environment(root)
        self.commands: list[str] = []
        self.fails_at = "nothing"

    def run(
        self, command: Sequence[str], **_: object
    ) -> subprocess.CompletedProcess[str]:
        text = " ".join(command)
        self.commands.append(text)
        if "-m venv" in text:
            python = Path(self.environment.program("python"))
            python.parent.mkdir()
            python.touch()
        return subprocess.CompletedProcess(command, int(self.fails_at in text))

    def commands_of_set_up(self, group: str) -> list[str]:
        self.commands.clear()
        self.environment.set_up(group)
        return self.commands


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Machine:
    root = tmp_path / "Müller & Söhne"
    root.mkdir()
    for name in ("pyproject.toml", run.SETUP, *run.LOCKS["development"]):
        (root / name).write_text("[project]", encoding="utf-8")
    machine = Machine(root)
    monkeypatch.setattr(run.subprocess, "run", machine.run)
    return machine


def test_a_first_set_up_makes_the_environment_and_installs(machine: Machine) -> None:
    commands = machine.commands_of_set_up("program")

    assert "-m venv" in commands[0]
    assert commands[-1].endswith("--editable .")


def test_what_is_up_to_date_is_left_alone(machine: Machine) -> None:
    machine.environment.set_up("program")

    assert machine.commands_of_set_up("program") == []


def test_tests_add_to_the_environment_of_the_program(machine: Machine) -> None:
    machine.environment.set_up("program")
    commands = machine.commands_of_set_up("development")

    assert not any("-m venv" in command for command in commands)
    assert "--requirement requirements-dev.lock" in commands[-2]


def test_all_that_is_installed_is_what_the_lock_files_hold(machine: Machine) -> None:
    commands = machine.commands_of_set_up("program")

    setup, program, own = commands[-3:]
    hashed = "--require-hashes --no-compile --requirement"
    assert setup.endswith(f"{hashed} requirements-setup.lock")
    assert program.endswith(f"{hashed} requirements.lock")
    assert "--no-deps --no-build-isolation" in own  # built by what was just installed


@pytest.mark.parametrize(
    "changed", ["pyproject.toml", "requirements.lock", "requirements-setup.lock"]
)
def test_a_changed_file_is_installed_into_the_same_environment(
    machine: Machine, changed: str
) -> None:
    machine.environment.set_up("program")
    (machine.environment.root / changed).write_text("[x]", encoding="utf-8")
    commands = machine.commands_of_set_up("program")

    assert not any("-m venv" in command for command in commands)
    assert commands[-1].endswith("--editable .")


def test_an_environment_cut_off_halfway_is_made_anew(machine: Machine) -> None:
    machine.fails_at = "--editable"
    with pytest.raises(run.SetupError, match="messages above say why"):
        machine.environment.set_up("program")
    machine.fails_at = "nothing"

    assert "-m venv" in machine.commands_of_set_up("program")[0]


def test_an_environment_that_was_moved_is_made_anew(machine: Machine) -> None:
    machine.environment.set_up("program")
    root = machine.environment.root
    root.rename(root.with_name("elsewhere"))
    machine.environment = run.Environment(root.with_name("elsewhere"))

    assert "-m venv" in machine.commands_of_set_up("program")[0]


def test_an_environment_without_its_python_is_made_anew(machine: Machine) -> None:
    machine.environment.set_up("program")
    Path(machine.environment.program("python")).unlink()

    assert "-m venv" in machine.commands_of_set_up("program")[0]


def test_a_folder_that_somebody_else_made_is_kept_and_refused(machine: Machine) -> None:
    theirs = machine.environment.folder / "theirs"
    theirs.parent.mkdir()
    theirs.touch()

    with pytest.raises(run.SetupError, match="was not made by this command"):
        machine.environment.set_up("program")
    assert theirs.exists()


def test_source_paths_of_the_installation_hold_no_umlaut(machine: Machine) -> None:
    machine.environment.set_up("program")
    packages = machine.environment.folder / "lib" / "python3.11" / "site-packages"
    packages.mkdir(parents=True)
    path = packages / "_editable_impl_lightpen.pth"
    core = machine.environment.root / "core"
    core.mkdir()
    path.write_text(f"{core}\n", encoding="utf-8")
    machine.environment.set_up("development")

    written = path.read_text(encoding="ascii")
    assert (packages / written).resolve() == core.resolve()


@pytest.mark.parametrize(
    ("arguments", "status"), [(["help"], 0), ([], 2), (["dmeo"], 2)]
)
def test_anything_but_a_command_shows_the_usage(
    arguments: list[str], status: int, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run.main(arguments) == status
    assert "Usage:" in capsys.readouterr().err
