"""Make random small faults in the core, and list those that no test notices.

    nice .venv/bin/python -m benchmarks.mutation_testing estimation verification

One process at a time; no file of the repository is changed: a child process gets the
mutated module from memory. First each test is run once to see which functions it calls
(``--calls`` keeps that in a file for the next time). A mutant is then given to the
tests that call its function, the fastest first, until one fails or ``--seconds`` of the
processor are spent; those that are left survive. The seed settles which mutants are
tried.
"""

import argparse
import ast
import copy
import importlib.abc
import importlib.machinery
import importlib.util
import json
import os
import random
import resource
import signal
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from types import CodeType, FrameType, ModuleType
from typing import Any, TypeAlias

import pytest
from typing_extensions import override

ROOT = Path(__file__).resolve().parents[1]
CORE = ROOT / "core"
TESTS = ROOT / "tests"
# The tests that prove a package.
PROVED_BY = {
    "estimation": (
        "core/estimation", "core/record", "test_command_line.py", "test_rig_command.py",
    ),
    "measure": (
        "core/extensions/measure", "core/archive", "test_verify_command.py",
    ),
    "boards": ("core/extensions/boards", "test_camera_commands.py"),
    "detection": ("core/detection", "core/live"),
}  # fmt: skip
# Imported once, in the process that all tests are run in children of.
PRELOADED = ("numpy", "scipy.special", "scipy.linalg", "scipy.optimize", "cv2", "yaml",
             "msgspec", "sqlalchemy")  # fmt: skip
# The tests of the core need no Qt, which crashes where functions are watched.
OPTIONS = (
    *("-q", "--slow", "-p", "no:cacheprovider", "-p", "no:pytest-qt"),
    *("-o", "addopts=--import-mode=importlib"),
    *("-o", "python_files=test_*.py"),  # pytest imports press_test.py itself otherwise
    *("-W", "ignore::pytest.PytestConfigWarning"),  # of the options of pytest-qt
)
OTHER_OPERATORS: Mapping[type[ast.AST], type[ast.AST]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.Mod: ast.Mult, ast.Pow: ast.Mult,
    ast.And: ast.Or, ast.Or: ast.And,
    ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
    ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
OF_BOUNDARY = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}
OF_ORDER = {ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt}
OTHER_FUNCTIONS = {
    "min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum",
    "any": "all", "all": "any", "argmin": "argmax", "argmax": "argmin",
}  # fmt: skip
WORDS_AND_TYPES = {"message", "TypeVar", "NewType"}
# Arguments that guard against a bug, or change how fast numpy is and no value.
NOT_MUTATED = {"strict", "allow_nan", "optimize", "full_matrices"}

Edit: TypeAlias = Callable[[ast.AST], None]
Key: TypeAlias = tuple[str, str]  # of a function: file below core, its name in there


@dataclass(frozen=True)
class Mutant:
    """A fault: what one node of a module becomes.

    Attributes
    ----------
    file : str
        Below `CORE`.
    index : int
        Of the node, as `ast.walk` has it.
    variant : int
        Which of its mutations.
    function : str
        That it stands in, with its class; empty of none.
    """

    file: str
    index: int
    variant: int
    function: str
    line: int
    before: str
    after: str


def edits_of(node: ast.AST) -> list[Edit]:
    """Return the mutations of a node, each as what is done to it."""
    if isinstance(node, ast.BinOp | ast.BoolOp | ast.AugAssign):
        other = OTHER_OPERATORS.get(type(node.op))
        if other is None:
            return []
        return [lambda n: setattr(n, "op", other())]
    if isinstance(node, ast.Compare) and len(node.ops) == 1:
        kind = type(node.ops[0])
        counts = any(map(_is_count, (node.left, *node.comparators)))
        changed = (OF_BOUNDARY if counts else OF_ORDER).get(kind)
        other = changed or OTHER_OPERATORS.get(kind)
        return [] if other is None else [lambda n: setattr(n, "ops", [other()])]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return [lambda n: setattr(n, "op", ast.UAdd())]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        twice = ast.UnaryOp(ast.Not(), copy.deepcopy(node.operand))
        return [lambda n: setattr(n, "operand", twice)]
    if isinstance(node, ast.Constant):
        value = _other_constant(node.value)
        return [] if value is None else [lambda n: setattr(n, "value", value)]
    if isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Load):
        field = "id" if isinstance(node, ast.Name) else "attr"
        name = OTHER_FUNCTIONS.get(getattr(node, field))
        return [] if name is None else [lambda n: setattr(n, field, name)]
    if isinstance(node, ast.If | ast.IfExp | ast.While) and isinstance(
        node.test, ast.Name | ast.Attribute | ast.Call
    ):
        test = ast.UnaryOp(ast.Not(), copy.deepcopy(node.test))
        return [lambda n: setattr(n, "test", test)]
    if isinstance(node, ast.Return) and isinstance(node.value, ast.Tuple):
        parts = [copy.deepcopy(each) for each in node.value.elts]
        swapped = ast.Tuple([*parts[1:2], *parts[:1], *parts[2:]], ast.Load())
        return [lambda n: setattr(n, "value", swapped)] if len(parts) > 1 else []
    return []


def _is_count(node: ast.AST) -> bool:
    """Return whether a value is likely a whole number, where equality happens."""
    if isinstance(node, ast.Constant):
        return isinstance(node.value, int) and node.value != 0
    name = ast.unparse(node)
    return name.startswith(("n_", "len(", "self.n_")) or ".n_" in name


def _other_constant(value: object) -> object:
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return value + 1
    if isinstance(value, float):
        return 2 * value if value else 1.0
    return None


def mutants_in(file: str) -> Iterator[Mutant]:
    """Return all mutants of a module."""
    tree = ast.parse((CORE / file).read_text(encoding="utf-8"))
    indices = {id(node): index for index, node in enumerate(ast.walk(tree))}
    for node, function in _mutable(tree):
        for variant, edit in enumerate(edits_of(node)):
            other = copy.deepcopy(node)
            edit(other)
            line = getattr(node, "lineno", 0)
            texts = [_first_line(ast.unparse(each)) for each in (node, other)]
            yield Mutant(file, indices[id(node)], variant, function, line, *texts)


def _first_line(text: str) -> str:
    return text.partition("\n")[0][:100]


def _mutable(
    node: ast.AST, within: str = "", function: str = ""
) -> Iterator[tuple[ast.AST, str]]:
    """Return the nodes that do something, each with its function."""
    if isinstance(node, ast.FunctionDef):
        function = function or f"{within}{node.name}"
        defaults = [*node.args.defaults, *filter(None, node.args.kw_defaults)]
        children: list[ast.AST] = [*defaults, *node.body]
    elif isinstance(node, ast.ClassDef):
        within += f"{node.name}."
        children = list(node.body)
    elif isinstance(node, ast.AnnAssign):
        children = [] if node.value is None else [node.value]
    elif _does_nothing(node):
        children = []
    else:
        children = list(ast.iter_child_nodes(node))
        if isinstance(node, ast.Call) and ast.unparse(node.func).endswith(".reshape"):
            # To numpy, -2 means the same as -1.
            children = [each for each in children if ast.unparse(each) != "-1"]
        yield node, function
    for child in children:
        yield from _mutable(child, within, function)


def _does_nothing(node: ast.AST) -> bool:
    """Return whether it gives but text or a type, or guards against a bug."""
    if isinstance(node, ast.Call):
        function = ast.unparse(node.func)
        return function in WORDS_AND_TYPES or function.startswith("_logger.")
    if isinstance(node, ast.keyword):
        return node.arg in NOT_MUTATED
    return isinstance(node, ast.Raise | ast.Assert | ast.JoinedStr)


def mutated(mutant: Mutant) -> ast.Module:
    """Return a module with its fault."""
    tree = ast.parse((CORE / mutant.file).read_text(encoding="utf-8"))
    node = list(ast.walk(tree))[mutant.index]
    edits_of(node)[mutant.variant](node)
    return ast.fix_missing_locations(tree)


class FaultyImport(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Imports one module with a fault."""

    def __init__(self, mutant: Mutant) -> None:
        self._mutant = mutant
        parts = Path(mutant.file).with_suffix("").parts
        self._is_package = parts[-1] == "__init__"
        self._name = ".".join(parts[:-1] if self._is_package else parts)

    @override
    def find_spec(
        self,
        fullname: str,
        path: Sequence[str] | None,
        target: ModuleType | None = None,
    ) -> importlib.machinery.ModuleSpec | None:
        if fullname != self._name:
            return None
        return importlib.util.spec_from_file_location(
            fullname, CORE / self._mutant.file, loader=self
        )

    @override
    def exec_module(self, module: ModuleType) -> None:
        file = str(CORE / self._mutant.file)
        exec(compile(mutated(self._mutant), file, "exec"), vars(module))


class CallWatch:
    """A plugin of pytest that notes which functions of the core each test calls.

    What a fixture calls when it is set up counts for every test that uses it.
    """

    def __init__(self) -> None:
        self.calls: dict[str, list[Key]] = {}
        self.seconds: dict[str, float] = {}
        self.failed: list[str] = []
        self._codes: set[CodeType] = set()
        self._of_fixtures: dict[str, set[CodeType]] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note which tests fail without any fault."""
        if report.failed:
            self.failed.append(report.nodeid)

    def _profile(self, frame: FrameType, event: str, argument: object) -> None:
        if event == "call":
            self._codes.add(frame.f_code)

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any) -> Generator[None, object, object]:
        """Note what a fixture calls."""
        before, self._codes = self._codes, set()
        try:
            return (yield)
        finally:
            self._of_fixtures.setdefault(fixturedef.argname, set()).update(self._codes)
            self._codes |= before

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: Any) -> Generator[None, object, object]:
        """Note what a test calls, and how long it takes."""
        self._codes, began = set(), time.process_time()
        threading.setprofile(self._profile)
        sys.setprofile(self._profile)
        try:
            return (yield)
        finally:
            sys.setprofile(None)
            threading.setprofile(None)
            fixtures = (
                self._of_fixtures.get(name, set()) for name in item.fixturenames
            )
            codes = self._codes.union(*fixtures)
            self.calls[item.nodeid] = sorted(set(filter(None, map(_key_of, codes))))
            self.seconds[item.nodeid] = time.process_time() - began


def _key_of(code: CodeType) -> Key | None:
    file = code.co_filename
    prefix = f"{CORE}{os.sep}"
    is_ours = file.startswith(prefix)
    name = code.co_qualname.partition(".<locals>")[0]
    return (file.removeprefix(prefix), name) if is_ours else None


@dataclass(frozen=True)
class Calls:
    """What tests call, and how long each takes, s."""

    of_tests: Mapping[str, Sequence[Key]]
    seconds: Mapping[str, float]

    def tests_for(self, mutant: Mutant, seconds: float) -> list[str]:
        """Return the tests that may notice a fault: of all figures, then the fastest.

        Beside those that call its function, these are the others of their files: what
        a file makes once may be noticed by any of its tests.
        """
        wanted = {(mutant.file, mutant.function)}
        callers = [
            test
            for test, keys in self.of_tests.items()
            if any(
                key in wanted or (not mutant.function and key[0] == mutant.file)
                for key in keys
            )
        ]
        files = {_file_of(test) for test in callers}
        others = {test for test in self.of_tests if _file_of(test) in files}
        chosen: list[str] = []
        spent = 0.0
        for tests in (set(callers), others - set(callers)):
            for test in sorted(tests, key=self.seconds.__getitem__):
                if spent + self.seconds[test] <= seconds or not chosen:
                    spent += self.seconds[test]
                    chosen.append(test)
        return chosen


def _file_of(test: str) -> str:
    return test.partition("::")[0]


def in_child(run: Callable[[], int], seconds: float) -> int | None:
    """Return the exit status of a function in a child process; None if it hung."""
    pid = os.fork()
    if pid == 0:
        os.setpgid(0, 0)
        with Path(os.devnull).open("w") as nowhere:
            os.dup2(nowhere.fileno(), 1)
            os.dup2(nowhere.fileno(), 2)
        limit = int(seconds) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
        os._exit(run())
    deadline = time.monotonic() + 20 * seconds  # of a loaded machine
    done = status = 0
    while not done and time.monotonic() < deadline:
        time.sleep(0.02)
        done, status = os.waitpid(pid, os.WNOHANG)
    with suppress(ProcessLookupError):  # what it started goes with it
        os.killpg(pid, signal.SIGKILL)
    if not done:
        os.waitpid(pid, 0)
        return None
    return os.waitstatus_to_exitcode(status)


def run_tests(tests: Sequence[str], *options: str, plugin: object = None) -> int:
    """Run tests in this process, and return the exit status of pytest."""
    with TemporaryDirectory(prefix="lightpen-mutants-") as folder:
        words = (*OPTIONS, "--basetemp", f"{folder}/t", *options)
        plugins = [] if plugin is None else [plugin]
        return int(pytest.main([*words, *tests], plugins=plugins))


def watch_calls(tests: Sequence[str], place: Path) -> None:
    """Write what tests call; those that fail without any fault are left out."""

    def watch() -> int:
        seen = CallWatch()
        status = run_tests(tests, plugin=seen)
        for test in seen.failed:
            seen.calls.pop(test, None)
        place.write_text(json.dumps([seen.calls, seen.seconds, seen.failed]))
        return status

    in_child(watch, 3600.0)
    if not place.exists():
        sys.exit("The tests cannot be run. Run them by ./run test.")


def read_calls(place: Path) -> Calls:
    """Read what tests call, and tell which of them failed."""
    calls, seconds, failed = json.loads(place.read_text())
    for test in failed:
        print(f"left out, as it fails without any fault: {test}")
    keys = {test: [(file, name) for file, name in each] for test, each in calls.items()}
    return Calls(keys, seconds)


def is_noticed(
    mutant: Mutant, calls: Calls, seconds: float, *, has_fault: bool = True
) -> bool:
    """Return whether a test fails, or hangs, with a fault, or without as a control."""
    tests = calls.tests_for(mutant, seconds)
    if not tests:
        return False

    def run() -> int:
        if has_fault:
            sys.meta_path.insert(0, FaultyImport(mutant))
        return run_tests(tests, "-x")

    status = in_child(run, 3 * seconds + 20)
    # Also where the fault keeps conftest.py from being imported.
    if status == pytest.ExitCode.USAGE_ERROR and in_child(
        lambda: run_tests(tests, "--collect-only"), 3 * seconds + 20
    ):
        sys.exit("Tests were moved or removed since --calls was written. Delete it.")
    return status != 0


def description(mutant: Mutant) -> str:
    """Return a fault in words."""
    return f"{mutant.file}:{mutant.line}: {mutant.before}  ->  {mutant.after}"


def main() -> None:
    """Try mutants, and print those that survive."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("packages", nargs="+", choices=PROVED_BY)
    parser.add_argument("--mutants", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--calls", type=Path, metavar="FILE.json")
    parser.add_argument(
        "--again",
        type=Path,
        metavar="FILE",
        help="only those that FILE, printed by an earlier run, lists",
    )
    parser.add_argument(
        "--control",
        action="store_true",
        help="run the tests without the faults: all mutants should survive",
    )
    options = parser.parse_args()
    os.chdir(ROOT)
    sys.path[:0] = [str(CORE), str(ROOT)]
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    for name in PRELOADED:
        importlib.import_module(name)

    names = dict.fromkeys(n for each in options.packages for n in PROVED_BY[each])
    tests = [str(TESTS.relative_to(ROOT) / name) for name in names]
    with TemporaryDirectory(prefix="lightpen-calls-") as folder:
        place = options.calls or Path(folder) / "calls.json"
        if not place.exists():
            watch_calls(tests, place)
        calls = read_calls(place)
    files = sorted(
        str(path.relative_to(CORE))
        for package in options.packages
        for root in ("lightpen", "lightpen_extensions")
        for path in (CORE / root / package).rglob("*.py")
    )
    mutants = [mutant for file in files for mutant in mutants_in(file)]
    n_all = len(mutants)
    random.Random(options.seed).shuffle(mutants)
    if options.again is not None:
        listed = options.again.read_text()
        mutants = [mutant for mutant in mutants if description(mutant) in listed]
    mutants = mutants[: options.mutants]
    n_survivors: Counter[str] = Counter()
    for n_tried, mutant in enumerate(mutants, 1):
        package = mutant.file.split("/")[1]
        if is_noticed(mutant, calls, options.seconds, has_fault=not options.control):
            continue
        n_survivors[package] += 1
        print(f"{n_tried}: {description(mutant)}", flush=True)
    n = sum(n_survivors.values())
    print(f"{n} of {len(mutants)} mutants ({n_all} there are) survive: {n_survivors}")


if __name__ == "__main__":
    main()
