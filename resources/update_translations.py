"""Bring the translations up to date: ``python resources/update_translations.py``.

Collects the texts of the application and the sentences of the core into
translations/*.ts, to be translated there by hand or with Qt Linguist, and compiles
these to the .qm files that the program loads. English holds plural forms only. Run
cut_fonts.py afterwards if new characters came in.
"""

import ast
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TRANSLATIONS = ROOT / "resources" / "lightpen_resources" / "translations"
APPLICATION = ROOT / "app" / "lightpen_app"
CORE = ROOT / "core" / "lightpen"
COMMAND_LINE = (CORE / "cli.py", *(CORE / "commands").glob("*.py"))  # speaks English
CORE_CONTEXT = "core"
OPTIONS = {
    "lightpen_zh_CN.ts": [],
    "lightpen_en.ts": ["-pluralonly"],
}


def main() -> None:
    """Update and compile every translation."""
    for name, options in OPTIONS.items():
        collect(TRANSLATIONS / name, APPLICATION, CORE, options)
        compile_ts(TRANSLATIONS / name, TRANSLATIONS)


def collect(
    ts_file: Path, application: Path, core: Path, options: Sequence[str] = ()
) -> None:
    """Add the texts of an application and its core to a translation."""
    sources = sorted(application.rglob("*.py"))
    # Line numbers would change the file with every edit of the program.
    fixed = ["-locations", "none", "-no-obsolete", "-source-language", "en"]
    language = ts_file.stem.partition("_")[2]
    target = ["-target-language", language, "-ts", str(ts_file)]
    with tempfile.TemporaryDirectory() as scratch:
        marked = Path(scratch) / "core.py"
        marked.write_text(_marked([*sources, *core.rglob("*.py")]), "utf-8")
        _run("lupdate", *fixed, *options, *map(str, [*sources, marked]), *target)


def templates(source: str) -> Iterator[str]:
    """Return the templates of the sentences in Python text."""
    if "sentence(" not in source:
        return
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Call(
                func=ast.Name(id="sentence"),
                args=[_, ast.Constant(value=str() as text)],
            ):
                yield text


def compile_ts(ts_file: Path, folder: Path) -> Path:
    """Compile a translation into a folder and return the .qm file."""
    qm_file = folder / ts_file.with_suffix(".qm").name
    _run("lrelease", "-silent", str(ts_file), "-qm", str(qm_file))
    return qm_file


def _marked(sources: Iterable[Path]) -> str:
    """Return Python text in which lupdate finds the templates of sentences."""
    found = {
        text
        for path in sources
        if path not in COMMAND_LINE
        for text in templates(path.read_text("utf-8"))
    }
    return "".join(
        f"QCoreApplication.translate({CORE_CONTEXT!r}, {text!r})\n"
        for text in sorted(found)
    )


def _run(tool: str, *arguments: str) -> None:
    program = Path(sys.executable).with_name(f"pyside6-{tool}")
    subprocess.run([program, *arguments], check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main()
