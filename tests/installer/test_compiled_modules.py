"""The compiled modules of an installed program, in one file."""

import importlib
import marshal
import sys
from collections.abc import Iterator
from importlib.machinery import FrozenImporter
from importlib.util import MAGIC_NUMBER, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from installer.places import INSTALLER

UNCHECKED_HASH = (1).to_bytes(4, "little") + bytes(8)
SOURCE = "def name():\n    return '{}'\n"


def compiled(text: str) -> bytes:
    code = compile(text, "site-packages/of_test", "exec")
    return MAGIC_NUMBER + UNCHECKED_HASH + marshal.dumps(code)


@pytest.fixture
def runtime(tmp_path: Path) -> Path:
    """Packages whose compiled form says "compiled", and their sources "source"."""
    packages = tmp_path / "Lib" / "site-packages"
    for source in ("packed_a/__init__.py", "packed_a/模块.py", "packed_b.py"):
        path = packages / source
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(SOURCE.format("source"), encoding="utf-8")
    return tmp_path


@pytest.fixture
def modules(runtime: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """The module that reads the file, with a file written by it."""
    place = INSTALLER / "windows" / "compiled_modules.py"
    spec = spec_from_file_location("compiled_modules", place)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    packages = runtime / "Lib" / "site-packages"
    sources = sorted(packages.rglob("*.py"))
    module.write(
        runtime / "compiled_modules.bin",
        [
            (path.relative_to(packages).as_posix(), compiled(SOURCE.format("compiled")))
            for path in sources
        ],
    )
    monkeypatch.setattr(module, "FILE", runtime / "compiled_modules.bin")
    monkeypatch.setattr(sys, "path", [*sys.path, str(packages)])
    # A library may have added a finder behind that for folders.
    monkeypatch.setattr(sys, "meta_path", [*sys.meta_path, FrozenImporter])
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    yield module
    for name in [name for name in sys.modules if name.startswith("packed_")]:
        del sys.modules[name]
    importlib.invalidate_caches()


def imported(name: str) -> ModuleType:
    return importlib.import_module(name)


@pytest.mark.parametrize("name", ["packed_a", "packed_a.模块", "packed_b"])
def test_modules_come_from_their_compiled_form(modules: Any, name: str) -> None:
    modules.install()

    assert imported(name).name() == "compiled"


def test_a_package_keeps_its_folder_for_what_else_is_in_it(
    modules: Any, runtime: Path
) -> None:
    modules.install()
    folder = runtime / "Lib" / "site-packages" / "packed_a"

    package = imported("packed_a")

    assert list(package.__path__) == [str(folder)]
    assert package.__file__ == str(folder / "__init__.py")
    (folder / "not_packed.py").write_text(SOURCE.format("source"), encoding="utf-8")
    assert imported("packed_a.not_packed").name() == "source"


def test_a_trace_names_the_installed_source(modules: Any, runtime: Path) -> None:
    modules.install()
    source = runtime / "Lib" / "site-packages" / "packed_b.py"

    assert imported("packed_b").name.__code__.co_filename == str(source)


def test_a_damaged_module_is_compiled_from_its_source(
    modules: Any, runtime: Path
) -> None:
    file = runtime / "compiled_modules.bin"
    whole = file.read_bytes()
    file.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))  # of the last, packed_b
    modules.install()

    assert imported("packed_b").name() == "source"
    assert imported("packed_a").name() == "compiled"


@pytest.mark.parametrize("n_bytes", [0, 3, 20])
def test_without_an_index_all_are(modules: Any, runtime: Path, n_bytes: int) -> None:
    file = runtime / "compiled_modules.bin"
    file.write_bytes(file.read_bytes()[:n_bytes])
    modules.install()

    assert imported("packed_a.模块").name() == "source"


def test_neither_does_the_start_fail_without_the_file(
    modules: Any, runtime: Path
) -> None:
    (runtime / "compiled_modules.bin").unlink()
    modules.install()

    assert imported("packed_b").name() == "source"
