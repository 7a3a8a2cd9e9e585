"""Compile all modules below the current folder, with the Python that runs this."""

import py_compile
import sys
from pathlib import Path

UNCHECKED = py_compile.PycInvalidationMode.UNCHECKED_HASH


def main() -> int:
    """Compile, and return how many modules could not be."""
    n_failed = 0
    for path in sorted(Path("runtime", "Lib").rglob("*.py")):
        shown = path.relative_to("runtime", "Lib").as_posix()
        try:
            py_compile.compile(
                str(path), dfile=shown, doraise=True, invalidation_mode=UNCHECKED
            )
        except py_compile.PyCompileError as error:
            n_failed += 1
            print(error, file=sys.stderr)
    return n_failed


if __name__ == "__main__":
    sys.exit(main())
