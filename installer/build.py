"""Build ``Lightpen-<version>-setup.exe``: ``python installer/build.py``.

Puts a Windows CPython, the wheels of requirements.lock and the program itself together
in a folder, always the same byte for byte, and packs it with NSIS. Nothing is run at
installation but the installer. See installer/README.md.
"""

import argparse
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from time import monotonic

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from installer import runtime
from installer.binaries import missing_exports, unmet_needs
from installer.bundled import EXTRAS
from installer.bytecode import compile_modules
from installer.downloads import PIP, download_runtime, download_wheels
from installer.launchers import (
    ToolMissingError,
    build_launchers,
    icon,
    numbers_of,
    order_of,
    tool,
)
from installer.libraries import find_libraries
from installer.licences import Part, licence_text, parts_of, unlicensed
from installer.locked import Pin, windows_pins
from installer.payload import (
    EARLIEST,
    PACKAGES,
    add_own,
    all_files,
    promote_cpp_runtime,
    promote_openssl,
    set_times,
    unpack_wheels,
    write_file_list,
)
from installer.places import INSTALLER, IS_WINDOWS, ROOT
from installer.runtime import RuntimeFileError
from installer.sbom import BundledPart, bill_of_materials, cpe
from installer.signatures import is_signed, unsigned
from packaging.utils import canonicalize_name

from lightpen import __version__

KILOBYTE = 1024
PYTHON_MAKER = "Python Software Foundation"


class BuildError(Exception):
    """What was put together is not fit to be installed."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Build, and return the exit status."""
    options = _parser().parse_args(arguments)
    began = monotonic()
    try:
        setup = build(
            options.out.absolute(), options.version, options.sign, options.fast
        )
    except (
        BuildError,
        LookupError,  # as of a library that is no longer where it was
        RuntimeFileError,
        ToolMissingError,
        subprocess.CalledProcessError,  # as of a command that cannot sign
    ) as error:
        print(f"build.py: {error}", file=sys.stderr)
        return 1
    megabytes = setup.stat().st_size / 1e6
    print(f"{setup}: {megabytes:.1f} MB in {monotonic() - began:.0f} s")
    return 0


def build(out: Path, version: str = "", sign: str = "", fast: bool = False) -> Path:
    """Build the installer into a folder, and return its file.

    Parameters
    ----------
    version : str
        That of the program unless given, as the tests of upgrades do.
    sign : str
        Command that signs the file whose path is put after it; none leaves them
        unsigned.
    fast : bool
        Do not compress.

    Raises
    ------
    BuildError, RuntimeFileError, ToolMissingError
        It cannot be built.
    """
    version = version or __version__
    moment = commit_time()
    out.mkdir(parents=True, exist_ok=True)
    folder, work = out / "payload", out / "work"
    for each in (folder, work):
        shutil.rmtree(each, ignore_errors=True)
    work.mkdir()

    distribution = download_runtime()
    pins = shipped_pins()
    wheels = download_wheels(pins)
    own = build_wheel(work, moment)
    _say("Putting the files together")
    runtime.unpack(distribution, folder / "runtime")
    unpack_wheels([*wheels, own], folder / PACKAGES)
    promote_cpp_runtime(folder)
    promote_openssl(folder)
    add_own(folder)
    build_launchers(folder, version)
    if sign:
        _say("Signing")
        for path in unsigned(folder):
            sign_file(sign, path)
    _say("Compiling the modules")
    compile_modules(folder)
    parts = parts_of(folder / PACKAGES, _runtime_part(folder))
    _require_fit(folder, parts, pins)
    text = licence_text(parts)
    (folder / "LICENCES.txt").write_text(text, encoding="utf-8-sig", newline="\r\n")
    bill = bill_of_materials(
        version, _components(folder, distribution, pins, wheels, parts), moment
    )
    (folder / "sbom.cdx.json").write_bytes(bill)
    (out / f"Lightpen-{version}.cdx.json").write_bytes(bill)
    write_file_list(folder)
    set_times(folder, moment)
    _say("Packing")
    setup = out / f"Lightpen-{version}-setup.exe"
    pack(folder, work, setup, version, fast, sign)
    return setup


def shipped_pins() -> tuple[Pin, ...]:
    """Return what is bundled: all that the program needs, and four of its extras.

    An installed program cannot be added to, and without them it would have no
    industrial camera, no archive on a server, no LEDs from a workbook, and nobody could
    follow the pen. They are tested with the versions of requirements-dev.lock.
    """
    program, development = (
        windows_pins((ROOT / name).read_text("utf-8"), runtime.VERSION)
        for name in ("requirements.lock", "requirements-dev.lock")
    )
    extra = (pin for pin in development if pin.name in EXTRAS)
    return (*program, *extra)


def commit_time() -> int:
    """Return when the commit was made, s since 1970; it stands for all times."""
    given = os.environ.get("SOURCE_DATE_EPOCH")
    if given:
        return int(given)
    outcome = subprocess.run(
        ["git", "log", "-1", "--format=%ct"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    return int(outcome.stdout) if outcome.returncode == 0 else EARLIEST


def build_wheel(work: Path, moment: int) -> Path:
    """Build the wheel of the program, and return its file."""
    _say("Building the wheel")
    subprocess.run(
        [*PIP, "wheel", "--quiet", "--no-deps", "--wheel-dir", work, ROOT],
        env=os.environ | {"SOURCE_DATE_EPOCH": str(moment)},
        check=True,
    )
    (wheel,) = work.glob("*.whl")
    return wheel


def sign_file(sign: str, path: Path) -> None:
    """Have a file signed by a command.

    Raises
    ------
    BuildError
        It still bears no signature.
    """
    subprocess.run(f'{sign} "{path}"', shell=True, check=True)
    if not is_signed(path):
        raise BuildError(f"{path} bears no signature after: {sign}")


def pack(
    folder: Path, work: Path, setup: Path, version: str, stored: bool, sign: str = ""
) -> None:
    """Pack the folder into the installer.

    Parameters
    ----------
    work : Path
        Folder for what is only needed meanwhile.
    setup : Path
        File to write.
    stored : bool
        The files are not compressed, which is quicker.
    """
    ico = work / "lightpen.ico"
    ico.write_bytes(icon())
    size = sum(path.stat().st_size for path in all_files(folder)) // KILOBYTE
    defined = {
        "VERSION": version,
        "ORDER": order_of(version),
        "NUMBERS": numbers_of(version).replace(",", "."),
        "PAYLOAD": str(folder),
        "OUTFILE": str(setup),
        "ICON": str(ico),
        "SIZE_KB": str(size),
        "SLASH": os.sep,
        **({"SIGN": sign} if sign else {}),
        # Debian's NSIS makes installers of 64 bits, which run where Wine has no 32.
        **({} if IS_WINDOWS else {"TARGET": "amd64-unicode"}),
        **({"STORED": ""} if stored else {}),
    }
    options = [f"-D{name}={value}" for name, value in defined.items()]
    script = INSTALLER / "windows" / "lightpen.nsi"
    makensis = tool("makensis", r"C:\Program Files (x86)\NSIS\makensis.exe")
    subprocess.run([makensis, "-V2", "-WX", *options, script], check=True)


def _require_fit(folder: Path, parts: Sequence[Part], pins: Sequence[Pin]) -> None:
    """Refuse what would not run on a bare Windows, or lacks a licence."""
    faults = [*unmet_needs(folder), *missing_exports(folder)]
    faults += [f"{name} brings no licence." for name in unlicensed(parts)]
    there = {canonicalize_name(part.name) for part in parts}
    faults += [
        f"{pin.name} is missing."
        for pin in pins
        if canonicalize_name(pin.name) not in there
    ]
    if faults:
        raise BuildError("\n".join(faults))


def _runtime_part(folder: Path) -> Part:
    licence = folder / "runtime" / "LICENSE.txt"
    return Part("CPython", runtime.VERSION, "PSF-2.0", PYTHON_MAKER, (licence,))


def _components(
    folder: Path,
    distribution: Path,
    pins: Sequence[Pin],
    wheels: Sequence[Path],
    parts: Sequence[Part],
) -> list[BundledPart]:
    found = {canonicalize_name(part.name): part for part in parts}
    files = {canonicalize_name(path.name.split("-")[0]): path for path in wheels}
    python = BundledPart(
        "CPython",
        runtime.VERSION,
        distribution.name,
        _digest(distribution),
        f"pkg:generic/python@{runtime.VERSION}",
        "PSF-2.0",
        PYTHON_MAKER,
        cpe("python:python", runtime.VERSION),
    )
    packages = [
        BundledPart(
            pin.name,
            pin.version,
            files[name].name,
            _digest(files[name]),
            f"pkg:pypi/{name}@{pin.version}",
            found[name].licence,
            found[name].supplier,
            cpe(f"{name}:{name}", pin.version),
        )
        for pin in pins
        for name in [canonicalize_name(pin.name)]
    ]
    libraries = [
        BundledPart(
            each.library.name,
            each.version,
            each.path.relative_to(folder).as_posix(),
            _digest(each.path),
            f"pkg:generic/{each.library.product.split(':')[1]}@{each.version}",
            each.library.licence,
            each.library.supplier,
            cpe(each.library.product, each.version),
        )
        for each in find_libraries(folder)
    ]
    return [python, *packages, *libraries]


def _digest(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Build the Windows installer.")
    parser.add_argument(
        "--out", type=Path, default=ROOT / "dist" / "windows", metavar="FOLDER"
    )
    parser.add_argument(
        "--fast", action="store_true", help="do not compress, for tests"
    )
    parser.add_argument(
        "--version",
        default="",
        help="other than that of the program, for tests of upgrades",
    )
    parser.add_argument(
        "--sign",
        default=os.environ.get("LIGHTPEN_SIGN", ""),
        metavar="COMMAND",
        help="signs the file whose path is put after it (LIGHTPEN_SIGN)",
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
