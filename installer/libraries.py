"""The libraries inside the packages that are installed, as they say of themselves.

No metadata names them: their versions are read from their files.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from installer.binaries import file_version
from installer.payload import PACKAGES


@dataclass(frozen=True)
class Library:
    """A library that some file holds.

    Attributes
    ----------
    pattern : str
        Path of its files in the installed folder.
    licence : str
        Expression of SPDX.
    product : str
        Vendor and product as CPE names them.
    stated : bytes
        Pattern of its version in its file; that of Windows' resources unless given.
    stated_in : str
        Another file that states it.
    """

    name: str
    pattern: str
    supplier: str
    licence: str
    product: str
    stated: bytes = b""
    stated_in: str = ""


@dataclass(frozen=True)
class FoundLibrary:
    """A library in a file, with its version; empty if the file states none."""

    library: Library
    path: Path
    version: str


_OPENSSL = (
    *("OpenSSL Software Foundation", "Apache-2.0", "openssl:openssl"),
    rb"OpenSSL (\d+\.\d+\.\d+)",
)
_OPENBLAS = (
    *("OpenBLAS developers", "BSD-3-Clause", "openblas_project:openblas"),
    rb'"version": "(0\.\d+\.\d+)',  # and a date or a count
)
_MICROSOFT = ("Microsoft", "LicenseRef-Microsoft-Visual-C-Runtime")
LIBRARIES = (
    Library("OpenSSL", "runtime/libcrypto-3.dll", *_OPENSSL),
    Library("OpenSSL", f"{PACKAGES}/psycopg_binary.libs/libcrypto-*.dll", *_OPENSSL),
    Library("OpenSSL", f"{PACKAGES}/cryptography/hazmat/bindings/_rust.pyd", *_OPENSSL),
    Library(
        *("SQLite", "runtime/sqlite3.dll", "SQLite consortium", "blessing"),
        "sqlite:sqlite",
    ),
    Library(
        *("Expat", "runtime/pyexpat.pyd", "Expat maintainers", "MIT"),
        *("libexpat_project:libexpat", rb"expat_(\d+\.\d+\.\d+)"),
    ),
    Library(
        *("Qt", f"{PACKAGES}/PySide6/Qt6Core.dll", "The Qt Company"),
        *("LGPL-3.0-only", "qt:qt"),
    ),
    Library(
        "OpenBLAS",
        f"{PACKAGES}/numpy.libs/libscipy_openblas*.dll",
        *_OPENBLAS,
        f"{PACKAGES}/numpy/__config__.py",
    ),
    Library(
        "OpenBLAS",
        f"{PACKAGES}/scipy.libs/libscipy_openblas*.dll",
        *_OPENBLAS,
        f"{PACKAGES}/scipy/__config__.py",
    ),
    Library(
        *("libpq", f"{PACKAGES}/psycopg_binary.libs/libpq-*.dll"),
        *("PostgreSQL Global Development Group", "PostgreSQL"),
        "postgresql:postgresql",
    ),
    Library(
        *("Microsoft Visual C++ runtime", "runtime/vcruntime140.dll", *_MICROSOFT),
        "microsoft:visual_c++",
    ),
    Library(
        *("Microsoft Visual C++ runtime", f"{PACKAGES}/numpy.libs/msvcp140*.dll"),
        *(*_MICROSOFT, "microsoft:visual_c++"),
    ),
)


def find_libraries(folder: Path) -> Iterator[FoundLibrary]:
    """Yield the libraries in an installed folder.

    Raises
    ------
    LookupError
        There is no file of one, or it states no version.
    """
    for library in LIBRARIES:
        paths = sorted(folder.glob(library.pattern))
        if not paths:
            raise LookupError(f"No {library.pattern} holds {library.name}.")
        for path in paths:
            yield FoundLibrary(library, path, _version(folder, library, path))


def _version(folder: Path, library: Library, path: Path) -> str:
    if library.stated:
        file = folder / library.stated_in if library.stated_in else path
        found = re.search(library.stated, file.read_bytes())
        if found is not None:
            return found[1].decode("ascii")
    elif any(numbers := file_version(path)):
        if library.name == "libpq":  # 18.0.4 is release 18.4
            return f"{numbers[0]}.{numbers[2]}"
        return ".".join(map(str, numbers)).removesuffix(".0")
    raise LookupError(f"{path} states no version of {library.name}.")
