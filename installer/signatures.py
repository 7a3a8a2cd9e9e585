"""Signatures of programs and libraries for Windows (Authenticode)."""

import re
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path

import pefile
from installer.binaries import SUFFIXES
from installer.launchers import tool
from installer.places import IS_WINDOWS

DIGESTS = re.compile(r"^(?:Current|Calculated) message digest *: ([0-9A-F]+)", re.M)
SUBJECT = re.compile(r"^\t*Subject: .*?/?O=([^/\n]+)", re.M)
# Who signs what others bring; their roots are in Windows, not here.
OTHERS = ("python software foundation", "microsoft corporation", "the qt company")
STATUS = "(Get-AuthenticodeSignature -LiteralPath '{}').Status"


def binaries(folder: Path) -> list[Path]:
    """Return the programs and libraries in a folder, in the order of their paths."""
    return sorted(p for p in folder.rglob("*") if p.suffix.lower() in SUFFIXES)


def is_signed(path: Path) -> bool:
    """Return whether a file bears a signature, right or wrong."""
    image = pefile.PE(str(path), fast_load=True)
    kind = pefile.DIRECTORY_ENTRY["IMAGE_DIRECTORY_ENTRY_SECURITY"]
    size: int = image.OPTIONAL_HEADER.DATA_DIRECTORY[kind].Size
    image.close()
    return size > 0


def unsigned(folder: Path) -> list[Path]:
    """Return the programs and libraries in a folder that bear no signature."""
    return [path for path in binaries(folder) if not is_signed(path)]


def wrongly_signed(paths: Iterable[Path], authority: Path | None) -> Iterator[Path]:
    """Yield the files whose signature is missing, wrong, or of someone unknown.

    On Windows each must be trusted there. Elsewhere a signature must go back to the
    authority or, as of Qt and Python, fit the file and name one of them.

    Parameters
    ----------
    authority : Path or None
        File of the certificate that ours go back to.
    """
    for path in paths:
        if not (_is_trusted(path) if IS_WINDOWS else _is_right(path, authority)):
            yield path


def _is_trusted(path: Path) -> bool:
    words = ["powershell", "-NoProfile", "-Command"]
    words.append(STATUS.format(str(path).replace("'", "''")))
    found = subprocess.run(words, capture_output=True, text=True, check=False)
    return found.stdout.strip() == "Valid"


def _is_right(path: Path, authority: Path | None) -> bool:
    ca = [] if authority is None else ["-CAfile", str(authority)]
    words = [tool("osslsigncode"), "verify", *ca, str(path)]
    found = subprocess.run(words, capture_output=True, text=True, check=False)
    if found.returncode == 0:
        return True
    digests = DIGESTS.findall(found.stdout)
    fits = bool(digests) and digests[::2] == digests[1::2]
    maker = SUBJECT.search(found.stdout)
    return fits and maker is not None and maker[1].casefold().startswith(OTHERS)
