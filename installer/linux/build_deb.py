"""Build the package for the Debian that this runs on: ``python3 build_deb.py``.

Needs ``python3-venv`` and ``dpkg-dev`` and no environment of the project. The package
holds the program and the libraries of requirements.lock and of the extras that the
Windows installer has, too, each checked by its hash, in ``/opt/lightpen``, for the
Python of this Debian. Its wheels are for one version of Python, so each Debian has a
package of its own.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from installer.bundled import extra_requirements
from installer.linux.menu_entry import write_menu_entry
from installer.places import ROOT

PLACE = Path("opt/lightpen")
# Of the wheels, what the program never uses.
DROPPED = (
    *("PySide6/Qt/qml", "PySide6/Qt/metatypes", "PySide6/include"),
    *("PySide6/typesystems", "PySide6/doc", "PySide6/glue", "PySide6/scripts"),
    *("PySide6/*.pyi", "PySide6/Qt/lib/libQt6Quick*", "PySide6/Qt/lib/libQt6Qml*"),
    *("PySide6/QtQ[mu]*", "PySide6/assistant*", "PySide6/designer", "PySide6/qml*"),
    *("PySide6/linguist", "PySide6/l[ru]*", "PySide6/libpyside6qml*"),
    "PySide6/Qt/lib/libQt6Designer*",
)
CONTROL = """\
Package: lightpen
Version: {version}
Architecture: amd64
Maintainer: The lightpen developers
Depends: {depends}
Section: science
Priority: optional
Installed-Size: {kilobytes}
Description: calibration of the probe tip of a light pen
 Lightpen observes a hand-held pen with LEDs by one or more cameras and computes the
 centre of its probe tip with its uncertainty, by a wizard and by command.
"""


def main() -> int:
    """Build, and return the exit status."""
    parser = argparse.ArgumentParser(description="Build the package for this Debian.")
    parser.add_argument(
        "--out", type=Path, default=ROOT / "dist" / "linux", metavar="FOLDER"
    )
    out = parser.parse_args().out.absolute()
    out.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as name:
        work = Path(name)
        tree = work / "tree"
        install_program(work, tree)
        add_menu_entry(tree)
        print(pack(tree, out))
    return 0


def install_program(work: Path, tree: Path) -> None:
    """Put the program and its libraries into a tree, for the Python that runs this."""
    tools, target = work / "tools", tree / PLACE
    run(sys.executable, "-m", "venv", tools)
    # Named by links and by no path of the build, so that it can be moved.
    run(sys.executable, "-m", "venv", "--without-pip", "--symlinks", target)
    pip = (tools / "bin" / "python", "-m", "pip", "--disable-pip-version-check")
    run(*pip, "wheel", "--quiet", "--no-deps", "--wheel-dir", work, ROOT)
    into = (*pip, "--python", target / "bin" / "python", "install", "--quiet")
    extras = work / "extras.txt"
    lock = (ROOT / "requirements-dev.lock").read_text("utf-8")
    extras.write_text(extra_requirements(lock), "utf-8")
    locked = ("--requirement", ROOT / "requirements.lock", "--requirement", extras)
    run(*into, "--no-compile", "--no-deps", "--require-hashes", *locked)
    run(*into, "--no-compile", "--no-deps", *work.glob("lightpen-*.whl"))
    for name in ("pyvenv.cfg", "bin/lightpen"):
        mend(target / name, str(target), f"/{PLACE}")
    for path in (target / "bin").iterdir():
        if not path.name.startswith(("python", "lightpen")):
            path.unlink()
    (packages,) = target.glob("lib/python3.*/site-packages")
    for pattern in DROPPED:
        for path in packages.glob(pattern):
            shutil.rmtree(path) if path.is_dir() else path.unlink()
    compiling = (sys.executable, "-m", "compileall", "-q", "-s", tree, "-p", "/")
    run(*compiling, "--invalidation-mode", "unchecked-hash", packages)


def mend(file: Path, old: str, new: str) -> None:
    """Replace the folder of the build in a file."""
    file.write_text(file.read_text("utf-8").replace(old, new), "utf-8")


def add_menu_entry(tree: Path) -> None:
    """Add the command, the menu entry, the icon and the type of swings."""
    launcher = tree / "usr" / "bin" / "lightpen"
    launcher.parent.mkdir(parents=True)
    launcher.symlink_to(f"/{PLACE}/bin/lightpen")
    share = tree / "usr" / "share"
    write_menu_entry(share, Path("/usr/bin/lightpen"))
    documents = share / "doc" / "lightpen"
    documents.mkdir(parents=True)
    shutil.copy(ROOT / "LICENSE", documents / "copyright")


def pack(tree: Path, out: Path) -> Path:
    """Pack a tree, and return the file of the package."""
    about = (ROOT / "core" / "lightpen" / "__init__.py").read_text("utf-8")
    (version,) = re.findall(r'^__version__ = "(.+)"$', about, re.MULTILINE)
    released = dict(
        line.split("=", 1)
        for line in Path("/etc/os-release").read_text("utf-8").splitlines()
    )
    system = released["ID"] + released["VERSION_ID"].strip('"')
    version = re.sub("(a|b|rc)", r"~\\1", version) + f"+{system}"
    files = [path for path in tree.rglob("*") if path.is_file()]
    control = tree / "DEBIAN" / "control"
    control.parent.mkdir()
    control.write_text(
        CONTROL.format(
            version=version,
            depends=", ".join([python_range(), *libraries()]),
            kilobytes=sum(path.stat().st_size for path in files) // 1024,
        ),
        "utf-8",
    )
    package = out / f"lightpen_{version}_amd64.deb"
    run("dpkg-deb", "--root-owner-group", "-Zzstd", "--build", tree, package)
    return package


def python_range() -> str:
    """Return the dependency on the Python that the wheels are for.

    GenICam loads its library, which the program of Python itself does without.
    """
    major, minor = sys.version_info[:2]
    exact = f"python3 (>= {major}.{minor}), python3 (<< {major}.{minor + 1})"
    return f"{exact}, libpython{major}.{minor}"


def libraries() -> list[str]:
    """Return the packages of the system's libraries, as the script `run` lists them."""
    text = (ROOT / "run").read_text("utf-8")
    listed = re.findall(r"^ {4}lib[\w.+-]+=([\w.+-]+)$", text, re.MULTILINE)
    if not listed:
        raise SystemExit("The script run lists no libraries any more.")
    return listed


def run(*words: object, env: "dict[str, str] | None" = None) -> None:
    """Run a program, and end if it fails."""
    environment = None if env is None else os.environ | env
    subprocess.run([str(word) for word in words], check=True, env=environment)


if __name__ == "__main__":
    sys.exit(main())
