"""The licences of all that is installed: shown by the installer, and installed."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from email.message import Message
from email.parser import HeaderParser
from pathlib import Path

from installer.places import INSTALLER
from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

HEAD = """\
Lightpen is distributed under the MIT licence, its fonts under the OFL 1.1. With it are
installed the programs and libraries below, each under its own licence. Qt, PySide6,
shiboken6 and psycopg are used under the LGPL 3: they are separate files in
runtime\\Lib\\site-packages, which you may replace by versions of your own.

Source of the LGPL parts: for three years from the day you received this program, the
lightpen developers give anyone who asks, at the cost of sending it, the complete source
of the versions named below. Their makers offer it, too: Qt at download.qt.io, PySide6
and shiboken6 at code.qt.io, psycopg at pypi.org.
"""
RULE = "=" * 78
# Qt for Python names the LGPL and leaves its text out; it refers to that of the GPL.
LGPL = ("LGPL-3.0.txt", "GPL-3.0.txt")
ADDED = {
    "PySide6_Essentials": (*LGPL, "Qt-attributions.txt"),
    "shiboken6": LGPL,
    "psycopg-binary": ("PostgreSQL.txt",),  # of libpq
}
# As SPDX writes what some makers write otherwise.
SPDX = {
    "Apache 2.0": "Apache-2.0",
    "Apache Software License V2.0": "Apache-2.0",
    "BSD License": "BSD-3-Clause",  # colorama
    "MIT License": "MIT",  # jaraco.classes
}
# What these state there is no name of a licence.
SPDX_OF = {"scipy": "BSD-3-Clause"}
LICENCE = "License :: "  # of the classifiers of PyPI
NAMES = re.compile("(licen[cs]e|copying|notice|authors|ofl)", re.IGNORECASE)


@dataclass(frozen=True)
class Part:
    """Something that is installed.

    Attributes
    ----------
    licence : str
        Expression of SPDX.
    supplier : str
        Who makes it.
    texts : tuple of Path
        Files that hold it.
    """

    name: str
    version: str
    licence: str
    supplier: str
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
        supplier=_supplier(metadata),
        texts=tuple(texts),
    )


def _licence(metadata: Message) -> str:
    classifiers = metadata.get_all("Classifier", [])
    classified = [c.rpartition(" :: ")[2] for c in classifiers if c.startswith(LICENCE)]
    stated = metadata.get("License-Expression") or metadata.get("License")
    line = (stated or ", ".join(classified) or "NOASSERTION").strip().splitlines()[0]
    named = SPDX_OF.get(metadata["Name"]) or SPDX.get(line, line)
    try:
        return canonicalize_license_expression(named)
    except InvalidLicenseExpression:
        return "NOASSERTION"


def _supplier(metadata: Message) -> str:
    for kind in ("Author", "Author-Email", "Maintainer", "Maintainer-Email"):
        if name := re.sub(r"\s*<[^>]*>", "", metadata.get(kind) or "").strip(' "'):
            return name
    return "NOASSERTION"


def _read(path: Path) -> str:
    return path.read_bytes().decode("utf-8", errors="replace").replace("\r\n", "\n")
