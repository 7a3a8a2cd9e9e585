"""Compile the modules of all packages into one file, with the Python that runs this.

Run in the folder that is installed. What is not compiled here says so and is left out.
The sources of libraries are not installed.
"""

import ast
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
# numpy.ma makes docstrings from theirs.
WITH_DOCSTRINGS = "numpy/_core/numeric.py", "numpy/_core/fromnumeric.py"
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
    """Return what Python would write as the compiled form, without docstrings."""
    tree = ast.parse(path.read_bytes())
    if source not in WITH_DOCSTRINGS:
        remove_docstrings(tree)
    code = compile(tree, f"site-packages/{source}", "exec", dont_inherit=True)
    return importlib.util.MAGIC_NUMBER + UNCHECKED_HASH + marshal.dumps(code)


def remove_docstrings(tree: ast.Module) -> None:
    """Remove those of a module and of its classes and functions."""
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    for node in ast.walk(tree):
        if isinstance(node, kinds) and ast.get_docstring(node, clean=False) is not None:
            place = ast.copy_location(ast.Pass(), node.body[0])
            node.body[:1] = [] if node.body[1:] else [place]


if __name__ == "__main__":
    sys.exit(main())
