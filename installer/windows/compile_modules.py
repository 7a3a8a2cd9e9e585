"""Compile the modules of all packages into one file, with the Python that runs this.

Run in the folder that is installed. What is not compiled here says so and is left out.
"""

import py_compile
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import compiled_modules

UNCHECKED = py_compile.PycInvalidationMode.UNCHECKED_HASH
# It takes itself out of the modules and imports its library by the same name, which is
# found because it puts a folder first on the path.
FOUND_BY_PATH = {"cv2/__init__.py"}


def main() -> int:
    """Compile, and return how many modules could not be."""
    packages = Path("runtime") / compiled_modules.PACKAGES
    n_failed = 0
    compiled: list[tuple[str, bytes]] = []
    with TemporaryDirectory() as name:
        target = Path(name) / "module.pyc"
        for path in sorted(packages.rglob("*.py")):
            source = path.relative_to(packages).as_posix()
            if source in FOUND_BY_PATH:
                continue
            try:
                py_compile.compile(
                    *(str(path), str(target), f"site-packages/{source}"),
                    doraise=True,
                    invalidation_mode=UNCHECKED,
                )
            except py_compile.PyCompileError as error:
                n_failed += 1
                print(error, file=sys.stderr)
            else:
                compiled.append((source, target.read_bytes()))
    compiled_modules.write(compiled_modules.FILE, compiled)
    return n_failed


if __name__ == "__main__":
    sys.exit(main())
