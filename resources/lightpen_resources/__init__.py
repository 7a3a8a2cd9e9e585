"""Data files of the desktop application."""

from pathlib import Path

RESOURCES = Path(__file__).parent
TRANSLATIONS = RESOURCES / "translations"
SOURCE_LANGUAGE = "en"  # of the texts in the program


def languages() -> tuple[str, ...]:
    """Return the languages that there are translations of, such as ``zh_CN``."""
    files = TRANSLATIONS.glob("lightpen_*.qm")
    found = {file.stem.removeprefix("lightpen_") for file in files}
    return (SOURCE_LANGUAGE, *sorted(found - {SOURCE_LANGUAGE}))
