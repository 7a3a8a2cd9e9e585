"""The licences of all that is installed: shown by the installer, and installed."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from email.message import Message
from email.parser import HeaderParser
from pathlib import Path

from installer.places import INSTALLER

HEAD = """\
Lightpen is distributed under the MIT licence. With it are installed the programs and
libraries below, each under its own licence. Qt and PySide6 are used under the LGPL 3:
they are separate files in runtime\\Lib\\site-packages\\PySide6, which you may replace
by versions of your own. So is FFmpeg, under the LGPL 2.1, in cv2 beside it.
"""
RULE = "=" * 78
# Qt for Python names the LGPL and leaves its text out; it refers to that of the GPL.
LGPL = ("LGPL-3.0.txt", "GPL-3.0.txt")
ADDED = {"PySide6_Essentials": LGPL, "shiboken6": LGPL}
LICENCE = "License :: "  # of the classifiers of PyPI
NAMES = re.compile("(licen[cs]e|copying|notice|authors)", re.IGNORECASE)


@dataclass(frozen=True)
class Part:
    """Something that is installed.

    Attributes
    ----------
    licence : str
        As its makers name it.
    texts : tuple of Path
        Files that hold it.
    """

    name: str
    version: str
    licence: str
    texts: tuple[Path, ...]


def parts_of(packages: Path, runtime: Part) -> tuple[Part, ...]:
    """Return the runtime and the distributions in a folder of packages, by name."""
    folders = packages.glob("*.dist-info")
    found = [_part(folder) for folder in folders]
    return (runtime, *sorted(found, key=lambda part: part.name.lower()))


def unlicensed(parts: Iterable[Part]) -> list[str]:
    """Return the names of parts that bring no licence of their own."""
    return [part.name for part in parts if not part.texts]


def licence_text(parts: Iterable[Part]) -> str:
    """Return all licences, one after the other."""
    sections = [HEAD]
    for part in parts:
        sections.append(f"{RULE}\n{part.name} {part.version}: {part.licence}\n{RULE}\n")
        sections += [_read(path) for path in part.texts]
    return "\n".join(sections)


def _part(folder: Path) -> Part:
    metadata = HeaderParser().parsestr(
        (folder / "METADATA").read_text(encoding="utf-8")
    )
    files = (path for path in folder.rglob("*") if path.is_file())
    texts = sorted(path for path in files if NAMES.match(path.name))
    # Of the libraries that are in those of the package.
    texts += sorted((folder.parent / metadata["Name"] / "licenses").glob("*.txt"))
    texts += [INSTALLER / "texts" / name for name in ADDED.get(metadata["Name"], ())]
    return Part(
        name=metadata["Name"],
        version=metadata["Version"],
        licence=_licence(metadata),
        texts=tuple(texts),
    )


def _licence(metadata: Message) -> str:
    classifiers = metadata.get_all("Classifier", [])
    classified = [c.rpartition(" :: ")[2] for c in classifiers if c.startswith(LICENCE)]
    stated = metadata.get("License-Expression") or metadata.get("License")
    return (stated or ", ".join(classified) or "see below").strip().splitlines()[0]


def _read(path: Path) -> str:
    return path.read_bytes().decode("utf-8", errors="replace").replace("\r\n", "\n")
