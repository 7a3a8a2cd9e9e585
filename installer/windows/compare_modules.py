"""Compare compiled modules with what this very Python compiles their sources to.

``compare_modules.py LIBRARY.zip CATALOGUE SOURCES...``: prints each module whose
source is in none of SOURCES with a digest that the catalogue lists, or compiles to
another one.
"""

import marshal
import sys
import zipfile
from collections.abc import Hashable, Iterator
from hashlib import sha1, sha256
from pathlib import Path
from types import CodeType

ATTRIBUTES = (
    *("co_argcount", "co_cellvars", "co_code", "co_consts", "co_exceptiontable"),
    *("co_filename", "co_firstlineno", "co_flags", "co_freevars", "co_kwonlyargcount"),
    *("co_linetable", "co_name", "co_names", "co_posonlyargcount", "co_qualname"),
    *("co_stacksize", "co_varnames"),
)
HEAD = 16  # bytes before the code
OPTIMISATIONS = (0, 1, 2)


def main() -> int:
    """Compare, and return how many modules are not proven."""
    library, catalogue, *sources = map(Path, sys.argv[1:])
    listed = catalogue.read_bytes()
    unproven = []
    with zipfile.ZipFile(library) as modules:
        names = [name for name in modules.namelist() if name.endswith(".pyc")]
        for name in names:
            code = marshal.loads(modules.read(name)[HEAD:])
            texts = texts_of(name.removesuffix("c"), sources)
            proven = (text for text in texts if is_listed(text, listed))
            if not any(compiles_to(text, code) for text in proven):
                unproven.append(name)
    print(*unproven, sep="\n")
    print(f"{len(names) - len(unproven)} of {len(names)} modules are proven.")
    return len(unproven)


def texts_of(name: str, sources: list[Path]) -> Iterator[bytes]:
    """Yield what sources hold under a name, with the line ends of both systems."""
    for source in sources:
        if source.is_dir():
            found = source / name
            text = found.read_bytes() if found.is_file() else None
        else:
            with zipfile.ZipFile(source) as files:
                text = files.read(name) if name in files.namelist() else None
        if text is not None:
            unix = text.replace(b"\r\n", b"\n")
            yield from (unix, unix.replace(b"\n", b"\r\n"))


def is_listed(text: bytes, catalogue: bytes) -> bool:
    """Return whether the signed catalogue lists a source; it leaves out empty ones."""
    digests = (sha256(text).digest(), sha1(text).digest())
    return not text or any(digest in catalogue for digest in digests)


def compiles_to(text: bytes, code: CodeType) -> bool:
    """Return whether a source gives this code, at whatever optimisation."""
    return any(
        identity(
            compile(text, code.co_filename, "exec", dont_inherit=True, optimize=level)
        )
        == identity(code)
        for level in OPTIMISATIONS
    )


def identity(value: object) -> Hashable:
    """Return what two equal constants or codes have in common, and no others."""
    if isinstance(value, CodeType):
        return tuple(identity(getattr(value, name)) for name in ATTRIBUTES)
    if isinstance(value, tuple):
        return ("tuple", *map(identity, value))
    if isinstance(value, frozenset):
        return "frozenset", frozenset(map(identity, value))
    return type(value).__name__, repr(value)


if __name__ == "__main__":
    sys.exit(main())
