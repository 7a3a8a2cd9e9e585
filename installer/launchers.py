"""The programs that the user starts: one with a window, one for the console."""

import shutil
import struct
import subprocess
from pathlib import Path
from string import Template
from tempfile import TemporaryDirectory

from installer.places import INSTALLER, ROOT
from packaging.version import Version
from PySide6.QtCore import QBuffer, QByteArray, Qt
from PySide6.QtGui import QImage, QPainter
from PySide6.QtSvg import QSvgRenderer

ICON = ROOT / "resources" / "lightpen_resources" / "icons" / "lightpen.svg"
ICON_SIZES = (16, 20, 24, 32, 40, 48, 64, 128, 256)  # px
WINDOW, CONSOLE = "Lightpen.exe", "bin/lightpen.exe"
PYTHON = "python313.dll"
PRERELEASES = {"a": 1000, "b": 2000, "rc": 3000}
RELEASE = 9000
COMPILERS = ("x86_64-w64-mingw32-", "")  # on Debian, and as MinGW calls them on Windows
LINKED = (
    *("-municode", "-static", "-s"),
    "-Wl,--dynamicbase,--nxcompat,--high-entropy-va,--no-insert-timestamp",
)


class ToolMissingError(Exception):
    """A program that the build needs is not installed."""


def tool(*names: str) -> str:
    """Return the first program that is there.

    Raises
    ------
    ToolMissingError
        There is none of them.
    """
    for name in names:
        if (found := shutil.which(name)) is not None:
            return found
    raise ToolMissingError(
        f"{names[0]} is not installed. On Debian: apt-get install nsis wine64 "
        "gcc-mingw-w64-x86-64-win32. On Windows, install NSIS and MinGW-w64."
    )


def build_launchers(folder: Path, version: str) -> None:
    """Compile both launchers into the folder that is installed."""
    with TemporaryDirectory() as name:
        work = Path(name)
        for source in ("launcher.c", "launcher.manifest"):
            shutil.copy(INSTALLER / "windows" / source, work)
        (work / "lightpen.ico").write_bytes(icon())
        _compile(work, folder / WINDOW, version, ["-mwindows"])
        _compile(work, folder / CONSOLE, version, ["-mconsole", "-DCONSOLE"])


def icon() -> bytes:
    """Return the icon of the program in the sizes that Windows shows."""
    pictures = [_png(size) for size in ICON_SIZES]
    head = struct.pack("<3H", 0, 1, len(pictures))
    place = len(head) + 16 * len(pictures)
    entries = []
    for size, picture in zip(ICON_SIZES, pictures, strict=True):
        side = size % 256  # 256 px is written as 0
        entries.append(
            struct.pack("<4B2H2I", side, side, 0, 0, 1, 32, len(picture), place)
        )
        place += len(picture)
    return b"".join([head, *entries, *pictures])


def numbers_of(version: str) -> str:
    """Return a version as the four numbers of Windows, without a candidate's."""
    return ",".join(map(str, [*Version(version).release, 0, 0, 0][:4]))


def order_of(version: str) -> str:
    """Return four numbers by which a release comes after its candidates."""
    parsed = Version(version)
    major, minor, patch = [*parsed.release, 0, 0][:3]
    kind, number = parsed.pre or (None, 0)
    last = RELEASE if kind is None else PRERELEASES[kind] + number
    return f"{major}.{minor}.{patch}.{last}"


def _png(size: int) -> bytes:
    image = QImage(size, size, QImage.Format.Format_ARGB32)
    image.fill(Qt.GlobalColor.transparent)
    painter = QPainter(image)
    QSvgRenderer(str(ICON)).render(painter)
    painter.end()
    data = QByteArray()
    buffer = QBuffer(data)
    buffer.open(QBuffer.OpenModeFlag.WriteOnly)
    # The stub of Qt wants bytes for the format, Qt itself a text.
    image.save(buffer, "PNG")  # type: ignore[call-overload]
    return bytes(data.data())


def _compile(work: Path, target: Path, version: str, options: list[str]) -> None:
    template = Template((INSTALLER / "windows" / "launcher.rc.in").read_text("utf-8"))
    resources = template.substitute(
        name=target.name, version=version, numbers=numbers_of(version)
    )
    (work / "launcher.rc").write_text(resources, encoding="utf-8")
    target.parent.mkdir(parents=True, exist_ok=True)
    windres = tool(*(f"{prefix}windres" for prefix in COMPILERS))
    gcc = tool(*(f"{prefix}gcc" for prefix in COMPILERS))
    coff = ["-c", "65001", "launcher.rc", "-O", "coff", "-o", "launcher.res"]
    subprocess.run([windres, *coff], cwd=work, check=True)
    words = [*options, *LINKED, f'-DPYTHON=L"{PYTHON}"', "-o", str(target.absolute())]
    subprocess.run(
        [gcc, "-O2", "-Wall", "-Werror", "launcher.c", "launcher.res", *words],
        cwd=work,
        check=True,
    )
