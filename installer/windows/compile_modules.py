"""Compile the modules of all packages into one file, with the Python that runs this.

Run in the folder that is installed. What is not compiled here says so and is left out.
The sources of libraries are not installed.
"""

import importlib.util
import marshal
import sys
from pathlib import Path

import compiled_modules

UNCHECKED_HASH = (1).to_bytes(4, "little") + bytes(8)
# It reads its files by path, takes itself out of the modules and imports its library by
# the same name, which is found because it puts a folder first on the path.
FOUND_BY_PATH = "cv2/"
OURS = "lightpen"
CONFIGURATION = "__config__.py"  # states the version of OpenBLAS


def main() -> int:
    """Compile, and return how many modules could not be."""
    packages = Path("runtime") / compiled_modules.PACKAGES
    n_failed = 0
    compiled: list[tuple[str, bytes]] = []
    for path in sorted(packages.rglob("*.py")):
        source = path.relative_to(packages).as_posix()
        if source.startswith(FOUND_BY_PATH):
            continue
        try:
            code = compiled_form(path, source)
        except (SyntaxError, ValueError) as error:
            n_failed += 1
            print(path, error, file=sys.stderr)
            continue
        compiled.append((source, code))
        if not source.startswith(OURS) and path.name != CONFIGURATION:
            path.unlink()
    compiled_modules.write(compiled_modules.FILE, compiled)
    return n_failed


def compiled_form(path: Path, source: str) -> bytes:
    """Return what Python would write as the compiled form of a module."""
    code = compile(
        path.read_bytes(), f"site-packages/{source}", "exec", dont_inherit=True
    )
    return importlib.util.MAGIC_NUMBER + UNCHECKED_HASH + marshal.dumps(code)


if __name__ == "__main__":
    sys.exit(main())
