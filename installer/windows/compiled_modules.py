"""The compiled modules of all packages, in one file that stands beside this one.

Windows is slow at finding files, and for each module Python would look for four. Here
all are found by their names in one index. The packages keep their folders, for what
else is in them: libraries, data and sources of Lightpen. A module of it that is not in
the file, or is damaged in it, is compiled from its source.
"""

import marshal
import mmap
import os
import sys
import zlib
from collections.abc import Iterable, Sequence
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from importlib.util import spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

FILE = Path(__file__).with_suffix(".bin")
PACKAGES = Path("Lib", "site-packages")
LENGTH = 4  # bytes of each number at the start of the file


class Compiled(NamedTuple):
    """Where a compiled module is.

    Attributes
    ----------
    source : str
        File below the folder of packages, with slashes.
    start, end : int
        Bytes of the module, counted from the end of the index.
    checksum : int
        Of these bytes, CRC-32.
    """

    source: str
    start: int
    end: int
    checksum: int


def install() -> None:
    """Let Python find the modules there; without the file it finds them as usual."""
    try:
        finder = Finder(FILE, FILE.parent / PACKAGES)
    except (OSError, ValueError, TypeError, EOFError):
        return  # damaged, which the self-test names
    sys.meta_path.insert(sys.meta_path.index(PathFinder), finder)


def write(file: Path, modules: Iterable[tuple[str, bytes]]) -> None:
    """Write the file.

    Parameters
    ----------
    modules : iterable of (str, bytes)
        The source below the folder of packages, and what Python would write as its
        compiled form.
    """
    index: dict[str, tuple[object, ...]] = {}
    packed = bytearray()
    for source, code in modules:
        name = source.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        start = len(packed)
        packed += code
        index[name] = tuple(Compiled(source, start, len(packed), zlib.crc32(code)))
    head = marshal.dumps(index)
    numbers = (number.to_bytes(LENGTH) for number in (len(head), zlib.crc32(head)))
    file.write_bytes(b"".join([*numbers, head, packed]))


class Finder:
    """Finds modules in the file.

    Parameters
    ----------
    packages : Path
        Folder that their sources are in.

    Raises
    ------
    OSError, ValueError
        The file cannot be read, or is damaged.
    """

    def __init__(self, file: Path, packages: Path) -> None:
        with file.open("rb") as opened:
            self._content = mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ)
        length, checksum = (
            int.from_bytes(self._content[start : start + LENGTH])
            for start in (0, LENGTH)
        )
        self._start = 2 * LENGTH + length
        head = self._content[2 * LENGTH : self._start]
        if zlib.crc32(head) != checksum:
            raise ValueError(f"{file} is damaged.")
        self._index = marshal.loads(head)
        self._packages = str(packages)

    def find_spec(
        self,
        name: str,
        path: Sequence[str] | None = None,
        target: ModuleType | None = None,
    ) -> ModuleSpec | None:
        """Return how a module is loaded; None if its compiled form is not here."""
        entry = self._index.get(name)
        if entry is None:
            return None
        compiled = Compiled(*entry)
        start, end = self._start + compiled.start, self._start + compiled.end
        code = self._content[start:end]
        if zlib.crc32(code) != compiled.checksum:
            return None
        source = f"{self._packages}{os.sep}{compiled.source.replace('/', os.sep)}"
        folder, _, last = source.rpartition(os.sep)
        within = [folder] if last == "__init__.py" else None
        loader = _Loader(name, source, code)
        return spec_from_file_location(
            name, source, loader=loader, submodule_search_locations=within
        )


class _Loader(SourceFileLoader):
    """Has the compiled form already, where Python would look for its file."""

    def __init__(self, name: str, source: str, code: bytes) -> None:
        super().__init__(name, source)
        self._code = code

    def path_stats(self, path: str) -> dict[str, float]:
        """Spare a look at the source, with which nothing is compared."""
        return {"mtime": 0, "size": 0}

    def get_data(self, path: str) -> bytes:
        """Return the compiled form, or else the content of a file."""
        return self._code if path.endswith(".pyc") else super().get_data(path)
