"""Prove the files of a Windows runtime before they are pinned.

``python installer/prove_runtime.py ROOTS.pem SOURCES...``. Each program and library
must bear a valid, time-stamped signature of the Python Software Foundation or of
Microsoft, and each module of the library must be what a source compiles to whose digest
the signed catalogue ``python.cat`` lists. ROOTS.pem holds the certificates that Windows
trusts; SOURCES are folders and ZIP archives with the standard library of the same
version, which need not be trusted: the catalogue tells which text is the right one.

Prints what is not proven; `installer.runtime` must leave that out.
"""

import argparse
import io
import re
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from installer import runtime
from installer.downloads import download_runtime
from installer.launchers import tool
from installer.places import INSTALLER
from installer.wine.prefix import Prefix

SIGNERS = ("O=Python Software Foundation", "O=Microsoft Corporation")
CATALOGUE = "python.cat"


def main(arguments: Sequence[str] | None = None) -> int:
    """Prove what can be proven; the exit status is 1 if a signature is not valid."""
    options = _parser().parse_args(arguments)
    with TemporaryDirectory() as name:
        folder = Path(name)
        _unpack(download_runtime(), folder)
        names = sorted(path.name for path in folder.iterdir())
        binaries = [n for n in names if n.endswith((".dll", ".exe", ".pyd", ".cat"))]
        unsigned = [n for n in binaries if not is_signed(folder / n, options.roots)]
        print(*unsigned, sep="\n")
        print(f"{len(binaries) - len(unsigned)} of {len(binaries)} files are signed.")
        prefix = Prefix.for_builds()
        words: list[Path] = [
            folder / "python.exe",
            INSTALLER / "windows" / "compare_modules.py",
            *(folder / runtime.LIBRARY, folder / CATALOGUE),
            *(source.absolute() for source in options.sources),
        ]
        outcome = prefix.run([prefix.windows_path(word) for word in words])
        print(outcome.output)
    return 1 if unsigned else 0


def is_signed(path: Path, roots: Path) -> bool:
    """Return whether a file bears a valid signature of those who may sign it."""
    trusted = ["-CAfile", str(roots), "-TSA-CAfile", str(roots)]
    outcome = subprocess.run(
        [tool("osslsigncode"), "verify", "-ignore-crl", *trusted, "-in", str(path)],
        capture_output=True,
        text=True,
        check=False,
    )
    stamps = re.findall("Timestamp Server Signature verification: (.*)", outcome.stdout)
    is_stamped = bool(stamps) and set(stamps) == {"ok"}
    is_known = any(signer in outcome.stdout for signer in SIGNERS)
    return outcome.returncode == 0 and is_stamped and is_known


def _unpack(distribution: Path, folder: Path) -> None:
    """Unpack all of the runtime, also what is not pinned."""
    with tarfile.open(distribution) as outer:
        inner = outer.extractfile(runtime.ARCHIVE)
        if inner is None:
            raise runtime.RuntimeFileError(f"{distribution} lacks {runtime.ARCHIVE}.")
        files = zipfile.ZipFile(io.BytesIO(inner.read()))
    for entry in files.infolist():
        if not entry.is_dir():
            (folder / Path(entry.filename).name).write_bytes(files.read(entry))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Prove the files of a runtime.")
    parser.add_argument("roots", type=Path, metavar="ROOTS.pem")
    parser.add_argument("sources", type=Path, nargs="+", metavar="SOURCES")
    return parser


if __name__ == "__main__":
    sys.exit(main())
