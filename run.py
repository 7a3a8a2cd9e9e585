"""Run Lightpen from its source folder, in a Python environment of its own.

Started by `run` (Linux) and `run.ps1` (Windows), which find the Python. The first
run fills the folder .venv, later ones use it as it is; nothing outside the source
folder is changed. Uses the standard library only, as nothing else is there yet.
"""

import contextlib
import hashlib
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

USAGE = """\
Usage: {run} COMMAND

  demo             watch a simulated operator calibrate a tip
  test             run the test suite, on all processor cores
  test ARGS        run pytest with ARGS, in one process: {run} test -x -k pivot
  check            check style, types and the order of imports
  bench [ARGS]     measure every figure of speed and accuracy; try: {run} bench --help
  lightpen [ARGS]  run the program itself; try: {run} lightpen --help
  lock             renew the lock files: the newest versions that pyproject.toml allows

Each command first sets up whatever it needs."""

ROOT = Path(__file__).resolve().parent
SETUP = "requirements-setup.lock"  # pip, and what builds the program
# All tests of a file in one process: what they share is made once. Many tests wait for
# a camera or a clock: a process more than there are cores.
PARALLEL = (
    *("--numprocesses", str(1 + (os.cpu_count() or 1))),
    *("--dist", "loadfile", "--no-loadscope-reorder"),
    *("--max-worker-restart", "1"),  # a test that ends its process is run again
)
CHECKS = (
    ("ruff", "check"),
    ("ruff", "format", "--check"),
    ("mypy",),
    ("lint-imports", "--no-cache"),
)
LOCKS = {
    "program": ("requirements.lock",),
    "development": ("requirements.lock", "requirements-dev.lock"),
}
# One lock file for all systems and all Pythons from the oldest that is supported.
COMPILE = (
    *("uv", "pip", "compile", "--upgrade", "--universal", "--python-version", "3.11"),
    *("--generate-hashes", "--no-header", "--quiet"),
)
COMPILED = {
    "requirements.lock": ("pyproject.toml",),
    "requirements-dev.lock": ("--group", "dev", "--constraint", "requirements.lock"),
    SETUP: ("--group", "setup", "--constraint", "requirements-dev.lock"),
}


class SetupError(Exception):
    """The environment cannot be set up; the text tells the user what to do."""


@dataclass(frozen=True)
class Environment:
    """A virtual environment that knows how far its set-up has come.

    Its record file says what was installed for which Python, folder, pyproject.toml
    and lock files, or "unfinished" while anything is being installed.

    Parameters
    ----------
    root : Path
        The source folder; it is installed in editable form, into its folder .venv.
    """

    root: Path

    @property
    def folder(self) -> Path:
        """Where the environment is."""
        return self.root / ".venv"

    def program(self, name: str) -> str:
        """Return the path of a program of the environment."""
        if os.name == "nt":
            return str(self.folder / "Scripts" / f"{name}.exe")
        return str(self.folder / "bin" / name)

    def set_up(self, group: str) -> None:
        """Install a group of LOCKS unless it is there and up to date."""
        try:
            with _locked(self.root / "pyproject.toml"):
                self._bring_up_to_date(group)
        except OSError as error:
            raise SetupError(
                f"The folder {self.folder} cannot be set up: {error}. Make sure that "
                "it is yours to write and that the disk is not full, or delete it; "
                "then run the same command again."
            ) from error

    def _bring_up_to_date(self, group: str) -> None:
        base, project = self._base(), self._project()
        recorded = self._recorded()
        if recorded[:2] == [base, project] and group in recorded[2:]:
            return
        if recorded[:1] != [base]:
            self._create()
        self._install(group)
        # The development group contains the program.
        self._write_record([base, project, *{"program": None, group: None}])

    def _base(self) -> str:
        """Name what an environment does not outlive: its Python and its place."""
        version = ".".join(map(str, sys.version_info[:2]))
        return f"Python {version} ({sys.platform}) in {str(self.folder)!a}"

    def _project(self) -> str:
        found = hashlib.sha256()
        for name in ("pyproject.toml", SETUP, *LOCKS["development"]):
            found.update((self.root / name).read_bytes())
        return f"pyproject.toml and locks {found.hexdigest()}"

    @property
    def _record(self) -> Path:
        return self.folder / "lightpen-set-up"

    def _recorded(self) -> list[str]:
        if not self.folder.exists() or not any(self.folder.iterdir()):
            return []
        if not self._record.is_file():
            raise SetupError(
                f"The folder {self.folder} was not made by this command. Delete it "
                "or move it away, then run the same command again."
            )
        if not Path(self.program("python")).exists():
            return []
        return self._record.read_text(encoding="ascii").splitlines()

    def _write_record(self, lines: Sequence[str]) -> None:
        draft = self._record.with_suffix(".new")
        draft.write_text("\n".join(lines), encoding="ascii")
        draft.replace(self._record)

    def _create(self) -> None:
        say(f"Making a Python environment in {self.folder}")
        if self.folder.exists():
            shutil.rmtree(self.folder)
        self.folder.mkdir()
        self._write_record(["unfinished"])
        # An activated environment must not become the base of its own successor.
        python = getattr(sys, "_base_executable", sys.executable)
        self._call([python, "-I", "-m", "venv", str(self.folder)])

    def _install(self, group: str) -> None:
        say("Installing Python packages; the first time this takes a few minutes.")
        self._write_record(["unfinished"])
        quiet = [] if sys.stderr.isatty() else ["--quiet"]
        pip = [self.program("python"), "-m", "pip", "install", *quiet]
        # Compiling all modules takes a third of the time; few of them are ever used.
        hashed = [*pip, "--require-hashes", "--no-compile"]
        locks = [word for name in LOCKS[group] for word in ("--requirement", name)]
        self._call([*hashed, "--requirement", SETUP])
        self._call([*hashed, *locks])
        self._call([*pip, "--no-deps", "--no-build-isolation", "--editable", "."])
        self._make_source_paths_relative()

    def _make_source_paths_relative(self) -> None:
        # Python < 3.13 reads .pth files in the locale's encoding, so that source
        # folders with an umlaut in their path are not found on Windows.
        for path in self.folder.glob("**/site-packages/*lightpen.pth"):
            folders = path.read_text(encoding="utf-8").splitlines()
            relative = [
                os.path.relpath(path.parent / folder, path.parent) for folder in folders
            ]
            path.write_text("\n".join(relative), encoding="ascii")

    def _call(self, command: Sequence[str]) -> None:
        status = subprocess.run(
            command, cwd=self.root, stdout=sys.stderr, check=False
        ).returncode
        if status != 0:
            raise SetupError(
                "The Python environment could not be set up; the messages above say "
                "why. It needs an internet connection (or the package index that pip "
                "is configured for). Put that right, then run the same command again."
            )


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Let one set-up run at a time, where the system has such locks."""
    with path.open("rb") as file:
        if sys.platform != "win32":
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def say(text: str) -> None:
    """Tell the user what happens; standard output belongs to the program."""
    print(text, file=sys.stderr, flush=True)


def _ignore_foreign_settings() -> None:
    """Keep the user's settings for other Pythons away from this one.

    Compiled modules are kept: without them the program starts half as fast.
    """
    for name in ("PYTHONHOME", "PYTHONPATH", "PYTHONDONTWRITEBYTECODE"):
        os.environ.pop(name, None)
    os.environ["PIP_USER"] = "0"


def become(command: Sequence[str]) -> NoReturn:
    """End as another program, so that its signals and exit status are ours."""
    if os.name == "nt":
        sys.exit(subprocess.run(command, check=False).returncode)
    os.execv(command[0], list(command))


def check(environment: Environment) -> int:
    """Run every check even if an earlier one fails."""
    status = 0
    for name, *arguments in CHECKS:
        say(f"$ {' '.join((name, *arguments))}")
        command = [environment.program(name), *arguments]
        status |= subprocess.run(command, cwd=ROOT, check=False).returncode
    return status


def lock(environment: Environment) -> int:
    """Renew the lock files, that of the program first."""
    for name, of in COMPILED.items():
        program, *words = COMPILE
        command = [environment.program(program), *words, *of, "--output-file", name]
        status = subprocess.run(command, cwd=ROOT, check=False).returncode
        if status != 0:
            return status
    return 0


def main(arguments: Sequence[str]) -> int:
    """Do the command; return its exit status."""
    environment = Environment(ROOT)
    match arguments:
        case ["demo"]:
            environment.set_up("program")
            say("A simulated operator calibrates a tip; it takes a minute.")
            become([environment.program("lightpen"), "--demo"])
        case ["lightpen", *options]:
            environment.set_up("program")
            become([environment.program("lightpen"), *options])
        case ["check"]:
            environment.set_up("development")
            return check(environment)
        case ["lock"]:
            environment.set_up("development")
            return lock(environment)
        case ["bench", *options]:
            environment.set_up("development")  # with the programs it compares to
            os.chdir(ROOT)
            become([environment.program("python"), "benchmarks/run.py", *options])
        case ["test", *options]:
            environment.set_up("development")
            os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
            os.chdir(ROOT)
            # A debugger, the output as it comes and an end at the first failure need
            # one process; and for a few tests others are not worth their start.
            words = options if set(options) - {"--slow"} else [*PARALLEL, *options]
            become([environment.program("python"), "-m", "pytest", *words])
        case _:
            run = r".\run.ps1" if os.name == "nt" else "./run"
            say(USAGE.format(run=run))
            return 0 if arguments in (["help"], ["-h"], ["--help"]) else 2


if __name__ == "__main__":
    _ignore_foreign_settings()
    try:
        sys.exit(main(sys.argv[1:]))
    except SetupError as error:
        say(str(error))
        sys.exit(1)
    except KeyboardInterrupt:
        say("Stopped. The same command goes on from here.")
        sys.exit(130)
