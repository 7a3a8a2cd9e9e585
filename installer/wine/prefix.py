"""Windows on Linux: a Wine prefix that Windows' Python, NumPy and Qt run in.

Debian's Wine 8 lacks some functions of Windows, or has them otherwise: four small
libraries stand in for them. They are for builds and tests; none is installed.
"""

import os
import subprocess
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from getpass import getuser
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Self

import pefile
from installer.launchers import ToolMissingError, tool
from installer.places import cache

HERE = Path(__file__).resolve().parent
WINE = ("/usr/lib/wine/wine64", "/usr/lib/wine/wine", "wine64", "wine")
SERVER = ("/usr/lib/wine/wineserver64", "/usr/lib/wine/wineserver", "wineserver")
BUILTIN = (
    "/usr/lib/x86_64-linux-gnu/wine/x86_64-windows/ucrtbase.dll",
    "/usr/lib64/wine/x86_64-windows/ucrtbase.dll",
)
OVERRIDES = r"HKCU\Software\Wine\DllOverrides"
BARE = ("mscms", "icuuc", "bcryptprimitives")  # of no library of C
MARK = b"Wine builtin DLL"
# That Wine links to the real home folder.
LINKS = (
    "Desktop",
    "Documents",
    "Downloads",
    "Music",
    "Pictures",
    "Videos",
    "Templates",
)
COMPLEX = (
    *("cabs", "cacos", "cacosh", "carg", "casin", "casinh", "catan", "catanh", "ccos"),
    *("ccosh", "cexp", "cimag", "clog", "conj", "cpow", "cproj", "creal", "csin"),
    *("csinh", "csqrt", "ctan", "ctanh"),
)
CHINESE = "zh_CN.UTF-8"
LONGEST = 1800.0  # s


class WineError(Exception):
    """A Windows program failed."""


@dataclass(frozen=True)
class CommandResult:
    """How a Windows program ended."""

    words: tuple[str, ...]
    status: int
    output: str
    seconds: float

    def require_success(self) -> Self:
        """Return itself.

        Raises
        ------
        WineError
            The program failed.
        """
        if self.status:
            raise WineError(
                f"{' '.join(self.words)} ended with {self.status}:\n{self.output}"
            )
        return self


@dataclass(frozen=True)
class Prefix:
    """A Windows of its own in a folder.

    Attributes
    ----------
    user : str
        Name of the folder of the user's files.
    display : str
        X server for programs with windows; none unless given.
    locales : Path or None
        Folder with the locale `CHINESE`, in whose language Windows then is.
    """

    folder: Path
    user: str = field(default_factory=getuser)
    display: str = ""
    locales: Path | None = None

    @classmethod
    def for_builds(cls) -> Self:
        """Return the one in the user's cache, made if need be."""
        sources = [Path(__file__), *sorted(HERE.glob("*.c"))]
        contents = b"".join(path.read_bytes() for path in sources)
        state = sha256(contents).hexdigest()[:12]
        folder = cache() / f"prefix-{state}"
        if not folder.exists():
            with TemporaryDirectory(prefix="prefix-", dir=cache()) as name:
                prefix = cls(Path(name) / "made")
                prefix.make()
                with suppress(OSError):  # another build was faster
                    prefix.folder.rename(folder)
        return cls(folder)

    @property
    def drive(self) -> Path:
        r"""Return the folder that is ``C:\``."""
        return self.folder / "drive_c"

    @property
    def home(self) -> Path:
        """Return the user's folder."""
        return self.drive / "users" / self.user

    def windows_path(self, path: Path) -> str:
        """Return the path of a file or folder as its programs see it."""
        if path.is_relative_to(self.drive):
            return "C:\\" + str(path.relative_to(self.drive)).replace("/", "\\")
        return "Z:" + str(path.absolute()).replace("/", "\\")

    def make(self) -> None:
        """Set the Windows up, with what Debian's Wine lacks.

        Raises
        ------
        ToolMissingError
            Wine or the compiler for Windows is not installed.
        """
        builtin = next((Path(p) for p in BUILTIN if Path(p).exists()), None)
        if builtin is None:
            raise ToolMissingError(
                "Wine is not installed. On Debian: apt-get install wine64."
            )
        self.folder.mkdir(parents=True)
        self.run(["wineboot", "-i"]).require_success()
        self.run(["winecfg", "-v", "win10"])
        for library in ("ucrtbase", *BARE):
            self._override(library, "native,builtin")
        self._override("winemenubuilder.exe", "")  # writes into the real home folder
        self.await_end()
        for name in LINKS:
            if (self.home / name).is_symlink():
                (self.home / name).unlink()
                (self.home / name).mkdir()
        self._stand_in(builtin)
        self.await_end()

    def start(
        self, words: Sequence[str], folder: Path | None = None
    ) -> subprocess.Popen[bytes]:
        """Start a program, and return at once."""
        return subprocess.Popen(
            [tool(*WINE), *words],
            cwd=folder,
            env=self._environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,  # Python ends at once where it is a plain file
            stderr=subprocess.STDOUT,
        )

    def run(
        self,
        words: Sequence[str],
        *,
        folder: Path | None = None,
        timeout_s: float = LONGEST,
    ) -> CommandResult:
        """Run a program to its end."""
        began = time.monotonic()
        process = self.start(words, folder)
        try:
            output, _ = process.communicate(timeout=timeout_s)
        except subprocess.TimeoutExpired:
            process.kill()
            raise
        return CommandResult(
            tuple(words),
            process.returncode,
            output.decode("utf-8", errors="replace"),
            time.monotonic() - began,
        )

    def await_end(self) -> None:
        """Wait until all programs have ended and the registry is on the disk."""
        subprocess.run(
            [tool(*SERVER), "-w"], env=self._environment(), check=True, timeout=LONGEST
        )

    def end_all(self) -> None:
        """End all programs at once."""
        subprocess.run([tool(*SERVER), "-k"], env=self._environment(), check=False)

    def _environment(self) -> dict[str, str]:
        environment = {
            name: value
            for name, value in os.environ.items()
            if name not in ("DISPLAY", "WAYLAND_DISPLAY")
        }
        return environment | {
            "WINEPREFIX": str(self.folder),
            "WINEARCH": "win64",
            "WINEDEBUG": "-all",
            "LIGHTPEN_NO_DIALOG": "1",
            **self._language(),
            **({"DISPLAY": self.display} if self.display else {}),
        }

    def _language(self) -> dict[str, str]:
        if self.locales is not None:
            return {"LC_ALL": CHINESE, "LOCPATH": str(self.locales)}
        return {"LC_ALL": "C.UTF-8"}  # or no letters of other languages in names

    def _override(self, library: str, order: str) -> None:
        words = ["reg", "add", OVERRIDES, "/v", library, "/d", order, "/f"]
        self.run(words).require_success()

    def _stand_in(self, builtin: Path) -> None:
        """Put the four libraries into the system's folder."""
        system = self.drive / "windows" / "system32"
        renamed = bytearray(builtin.read_bytes())
        mark = renamed.find(MARK)
        # Without the mark Wine loads it under its new name, like any library.
        renamed[mark : mark + len(MARK)] = bytes(len(MARK))
        for name in ("ucrtbase", "ucrtwine", *BARE):
            (system / f"{name}.dll").unlink(missing_ok=True)
        (system / "ucrtwine.dll").write_bytes(renamed)
        exports = self.folder / "ucrtbase.def"
        exports.write_text(_exports(builtin), encoding="ascii")
        sources: list[str | Path] = ["complex.c", "locking.c", exports]
        _compile(system / "ucrtbase.dll", sources, "-O2", "-static-libgcc")
        bare = ("-Os", "-nostdlib", "-e", "DllMainCRTStartup")
        for name in BARE:
            sources = [f"{name}.c", "-ladvapi32"]
            _compile(system / f"{name}.dll", sources, *bare)


def _exports(builtin: Path) -> str:
    """Return what the C runtime exports, some functions from our own."""
    own = {"_locking", *(name + kind for name in COMPLEX for kind in ("", "f", "l"))}
    names = [
        symbol.name.decode("ascii")
        for symbol in pefile.PE(str(builtin)).DIRECTORY_ENTRY_EXPORT.symbols
        if symbol.name
    ]
    lines = [
        f'  "{name}" = ' + (f"s_{name}" if name in own else f"ucrtwine.{name}")
        for name in names
    ]
    return "\n".join(["LIBRARY ucrtbase.dll", "EXPORTS", *lines, ""])


def _compile(library: Path, sources: Sequence[str | Path], *options: str) -> None:
    gcc = tool("x86_64-w64-mingw32-gcc")
    words = [gcc, "-shared", *options, "-o", library, *sources]
    subprocess.run(words, cwd=HERE, check=True)
