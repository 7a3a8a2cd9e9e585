"""Bring the translations up to date: ``python resources/update_translations.py``.

Collects the texts of the application into translations/*.ts, to be translated there by
hand or with Qt Linguist, and compiles these to the .qm files that the program loads.
English holds plural forms only. Run cut_fonts.py afterwards if new characters came in.
"""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TRANSLATIONS = ROOT / "resources" / "lightpen_resources" / "translations"
APPLICATION = ROOT / "app" / "lightpen_app"
OPTIONS = {
    "lightpen_zh_CN.ts": [],
    "lightpen_en.ts": ["-pluralonly"],
}


def main() -> None:
    """Update and compile every translation."""
    for name, options in OPTIONS.items():
        collect(TRANSLATIONS / name, APPLICATION, options)
        compile_ts(TRANSLATIONS / name, TRANSLATIONS)


def collect(ts_file: Path, folder: Path, options: Sequence[str] = ()) -> None:
    """Add the texts of a folder of Python files to a translation."""
    sources = sorted(map(str, folder.rglob("*.py")))
    # Line numbers would change the file with every edit of the program.
    fixed = ["-locations", "none", "-no-obsolete", "-source-language", "en"]
    language = ts_file.stem.partition("_")[2]
    target = ["-target-language", language, "-ts", str(ts_file)]
    _run("lupdate", *fixed, *options, *sources, *target)


def compile_ts(ts_file: Path, folder: Path) -> Path:
    """Compile a translation into a folder and return the .qm file."""
    qm_file = folder / ts_file.with_suffix(".qm").name
    _run("lrelease", "-silent", str(ts_file), "-qm", str(qm_file))
    return qm_file


def _run(tool: str, *arguments: str) -> None:
    program = Path(sys.executable).with_name(f"pyside6-{tool}")
    subprocess.run([program, *arguments], check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main()
