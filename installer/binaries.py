"""Version resources and imports of Windows programs and libraries."""

from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pefile

FIXED_VERSION = b"\xbd\x04\xef\xfe"  # VS_FIXEDFILEINFO
AMD64 = 0x8664
# In the runtime, by newer ones that packages bring.
REPLACED = (
    *("vcruntime140.dll", "vcruntime140_1.dll", "msvcp140.dll"),
    *("libcrypto-3.dll", "libssl-3.dll"),
)
SUFFIXES = {".dll", ".exe", ".pyd"}
# Of Windows 10 1809 and later.
API_SETS = ("api-ms-win-core-", "api-ms-win-crt-", "api-ms-win-shcore-")
OF_WINDOWS = {
    *("advapi32", "authz", "bcrypt", "bcryptprimitives", "comctl32", "comdlg32"),
    *("crypt32", "d3d11", "d3d12", "d3d9", "dnsapi", "dwmapi", "dwrite", "dxgi"),
    *("gdi32", "icuuc", "imm32"),
    *("iphlpapi", "kernel32", "mf", "mfplat", "mfreadwrite", "mpr", "mscms", "msvcrt"),
    *("ncrypt", "netapi32", "ntdll", "ole32", "oleaut32", "propsys", "rpcrt4"),
    *("secur32", "setupapi", "shell32", "shlwapi", "uiautomationcore", "user32"),
    *(
        "userenv",
        "uxtheme",
        "version",
        "winhttp",
        "winmm",
        "ws2_32",
        "wsock32",
        "wtsapi32",
    ),
    *("cfgmgr32", "dbghelp", "psapi", "winspool.drv", "avicap32", "gdiplus", "d2d1"),
}


def file_version(path: Path) -> tuple[int, int, int, int]:
    """Return the version in a library's resources; zeros if it states none."""
    data = path.read_bytes()
    start = data.find(FIXED_VERSION)
    if start < 0:
        return 0, 0, 0, 0
    high = int.from_bytes(data[start + 8 : start + 12], "little")
    low = int.from_bytes(data[start + 12 : start + 16], "little")
    return high >> 16, high & 0xFFFF, low >> 16, low & 0xFFFF


def unmet_needs(folder: Path) -> list[str]:
    """Return what the programs and libraries of a folder lack, in sentences.

    Each library that one imports must be in the same folder, in ``runtime``, in a
    folder that its package adds to the search, or part of Windows: a computer without
    the Visual C++ redistributables has nothing else.
    """
    binaries = [path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES]
    folders = defaultdict(set)
    for path in binaries:
        folders[path.name.lower()].add(path.parent)
    unmet = []
    for path in sorted(binaries):
        searched = {path.parent, folder / "runtime", *_added_folders(binaries)}
        image = pefile.PE(str(path), fast_load=True)
        if image.FILE_HEADER.Machine != AMD64:
            unmet.append(f"{path.relative_to(folder)} is not for 64-bit Windows.")
        unmet += [
            f"{path.relative_to(folder)} needs {library}."
            for library in _imports(image)
            if not _is_of_windows(library) and not folders[library] & searched
        ]
        image.close()
    return unmet


def missing_exports(folder: Path) -> list[str]:
    """Return what is asked of libraries that were replaced and is not in them."""
    has = {name: _exported_symbols(folder / "runtime" / name) for name in REPLACED}
    return [
        f"{path.relative_to(folder)} needs {symbol.decode()} of {name}."
        for path in sorted(folder.rglob("*"))
        if path.suffix.lower() in SUFFIXES
        for name, symbols in _imported_symbols(path).items()
        for symbol in sorted(symbols - has.get(name, symbols))
    ]


def _added_folders(binaries: list[Path]) -> set[Path]:
    """Return the folders that packages add to those that Windows looks through."""
    added = {path.parent for path in binaries}
    return {
        each
        for each in added
        if each.name.endswith(".libs") or each.name in ("PySide6", "shiboken6", "cv2")
    }


def _imports(image: pefile.PE) -> Iterator[str]:
    kinds = ("IMAGE_DIRECTORY_ENTRY_IMPORT", "IMAGE_DIRECTORY_ENTRY_DELAY_IMPORT")
    image.parse_data_directories([pefile.DIRECTORY_ENTRY[kind] for kind in kinds])
    for kind in ("DIRECTORY_ENTRY_IMPORT", "DIRECTORY_ENTRY_DELAY_IMPORT"):
        for entry in getattr(image, kind, ()):
            yield entry.dll.decode("ascii").lower()


def _exported_symbols(path: Path) -> set[bytes]:
    image = pefile.PE(str(path))
    found = {symbol.name for symbol in image.DIRECTORY_ENTRY_EXPORT.symbols}
    image.close()
    return found


def _imported_symbols(path: Path) -> dict[str, set[bytes]]:
    """Return the names that a library imports, by the other library."""
    image = pefile.PE(str(path), fast_load=True)
    kind = pefile.DIRECTORY_ENTRY["IMAGE_DIRECTORY_ENTRY_IMPORT"]
    image.parse_data_directories([kind])
    found = {
        entry.dll.decode("ascii").lower(): {
            symbol.name for symbol in entry.imports if symbol.name
        }
        for entry in getattr(image, "DIRECTORY_ENTRY_IMPORT", ())
    }
    image.close()
    return found


def _is_of_windows(library: str) -> bool:
    return library.startswith(API_SETS) or library.removesuffix(".dll") in OF_WINDOWS
