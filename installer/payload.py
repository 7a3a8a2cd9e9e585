"""The folder that is installed, put together file by file and always the same."""

import os
import re
import shutil
import zipfile
from collections.abc import Iterable
from hashlib import sha256
from pathlib import Path

from installer.binaries import file_version
from installer.places import INSTALLER
from installer.pruning import is_kept

PACKAGES = "runtime/Lib/site-packages"
# The C++ runtime that is loaded first must be the newest that anything was linked with.
CPP_RUNTIME = ("vcruntime140.dll", "vcruntime140_1.dll", "msvcp140.dll")
CPP_BRINGERS = ("PySide6", "shiboken6")
OPENSSL = ("libcrypto", "libssl")
OPENGL = ("QtOpenGL", "QtOpenGLWidgets")
FILE_LIST = "files.sha256"
# Without a commit, as in an unpacked source archive: the first day that ZIP can state.
EARLIEST = 315_532_800  # s, 1980-01-01


def unpack_wheels(wheels: Iterable[Path], packages: Path) -> None:
    """Put what is used of each wheel into the folder of packages."""
    for wheel in wheels:
        with zipfile.ZipFile(wheel) as files:
            for entry in files.infolist():
                name = place_of(entry.filename)
                if entry.is_dir() or name is None or not is_kept(name):
                    continue
                path = packages / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(files.read(entry))


def place_of(name: str) -> str | None:
    """Return where a file of a wheel belongs among packages; None if not there."""
    data = re.match(r"[^/]+\.data/([^/]+)/(.+)", name)
    if data is None:
        return name
    return data[2] if data[1] in ("purelib", "platlib") else None


def promote_cpp_runtime(folder: Path) -> None:
    """Let the runtime have the newest C++ library that anything brings along."""
    for name in CPP_RUNTIME:
        own = folder / "runtime" / name
        places = [own, *(folder / PACKAGES / each / name for each in CPP_BRINGERS)]
        newest = max(filter(Path.exists, places), key=file_version)
        if newest != own:
            shutil.copyfile(newest, own)


def promote_openssl(folder: Path) -> None:
    """Let the runtime have the OpenSSL of libpq, which is newer; one copy is packed.

    Its libssl is made to ask for the other library by the name that the runtime uses.
    """
    libraries = folder / PACKAGES / "psycopg_binary.libs"
    ((crypto,), (ssl,)) = (libraries.glob(f"{name}-3-*.dll") for name in OPENSSL)
    shutil.copyfile(crypto, folder / "runtime" / "libcrypto-3.dll")
    asked = crypto.name.encode() + b"\0"
    content = ssl.read_bytes()
    if content.count(asked) != 1:
        raise ValueError(f"{ssl.name} does not import {crypto.name} once.")
    content = content.replace(asked, b"libcrypto-3.dll".ljust(len(asked), b"\0"))
    (folder / "runtime" / "libssl-3.dll").write_bytes(content)


def add_own(folder: Path) -> None:
    """Add what the launchers run, and what stands in for Qt's OpenGL."""
    places: dict[str, tuple[str, ...]] = {
        "start.py": ("start.py",),
        "compiled_modules.py": ("runtime/{}",),
    }
    places["without_opengl.py"] = tuple(f"{PACKAGES}/PySide6/{n}.py" for n in OPENGL)
    for name, copies in places.items():
        for copy in copies:
            shutil.copyfile(INSTALLER / "windows" / name, folder / copy.format(name))


def write_file_list(folder: Path) -> None:
    """Write the digest of every file, as ``sha256sum`` does, for the self-test."""
    digests = {
        path.relative_to(folder).as_posix(): sha256(path.read_bytes()).hexdigest()
        for path in all_files(folder)
        if path.name != FILE_LIST
    }
    text = "".join(f"{digest}  {name}\n" for name, digest in digests.items())
    (folder / FILE_LIST).write_text(text, encoding="utf-8", newline="")


def all_files(folder: Path) -> list[Path]:
    """Return the files of a folder and of those in it, always in the same order."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return sorted(files, key=lambda path: path.relative_to(folder).as_posix())


def set_times(folder: Path, moment: int) -> None:
    """Give every file and folder the same time, s since 1970."""
    for path in [folder, *folder.rglob("*")]:
        os.utime(path, (moment, moment))
