"""Bring the translations up to date: ``python resources/update_translations.py``.

Collects the texts of the application and the message catalogue of the core into
translations/*.ts, to be translated there by hand or with Qt Linguist, and compiles
these to the .qm files that the program loads. English holds plural forms only. Run
cut_fonts.py afterwards if new characters came in.
"""

import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import lightpen_extensions  # noqa: F401  # adds its messages
from lightpen.messages import TRANSLATED
from lightpen_resources import SOURCE_LANGUAGE, TRANSLATIONS

ROOT = Path(__file__).resolve().parents[1]
APPLICATIONS = ROOT / "app"
CORE_CONTEXT = "core"


def main() -> None:
    """Update and compile every translation."""
    for file in sorted(TRANSLATIONS.glob("lightpen_*.ts")):
        options = ["-pluralonly"] if file.stem.endswith(SOURCE_LANGUAGE) else []
        collect(file, APPLICATIONS, translated_templates(), options)
        compile_ts(file, TRANSLATIONS)


def collect(
    ts_file: Path,
    application: Path,
    templates: Iterable[str],
    options: Sequence[str] = (),
) -> None:
    """Add the texts of an application and templates of messages to a translation."""
    sources = sorted(application.rglob("*.py"))
    # Line numbers would change the file with every edit of the program.
    fixed = ["-locations", "none", "-no-obsolete", "-source-language", "en"]
    language = ts_file.stem.partition("_")[2]
    target = ["-target-language", language, "-ts", str(ts_file)]
    with tempfile.TemporaryDirectory() as scratch:
        marked = Path(scratch) / "core.py"
        marked.write_text("".join(map(_marked, sorted(set(templates)))), "utf-8")
        _run("lupdate", *fixed, *options, *map(str, [*sources, marked]), *target)


def translated_templates() -> Iterator[str]:
    """Return the templates of all messages that are shown in other languages."""
    yield from TRANSLATED.values()


def compile_ts(ts_file: Path, folder: Path) -> Path:
    """Compile a translation into a folder and return the .qm file."""
    qm_file = folder / ts_file.with_suffix(".qm").name
    _run("lrelease", "-silent", str(ts_file), "-qm", str(qm_file))
    return qm_file


def _marked(template: str) -> str:
    """Return Python text in which lupdate finds a template."""
    return f"QCoreApplication.translate({CORE_CONTEXT!r}, {template!r})\n"


def _run(tool: str, *arguments: str) -> None:
    program = Path(sys.executable).with_name(f"pyside6-{tool}")
    subprocess.run([program, *arguments], check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main()
