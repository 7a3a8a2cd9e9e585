"""Which files of the wheels are installed."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from installer.payload import place_of
from installer.pruning import is_kept


@pytest.mark.parametrize(
    "name",
    [
        "PySide6/QtWidgets.pyd",
        "PySide6/Qt6Svg.dll",
        "PySide6/plugins/platforms/qwindows.dll",
        "PySide6/plugins/platforms/qoffscreen.dll",
        "PySide6/translations/qtbase_zh_CN.qm",
        "PySide6/msvcp140.dll",
        "numpy/testing/__init__.py",
        "numpy/f2py/__init__.py",  # scipy imports all of numpy
        "scipy/special/_ufuncs.pyd",
        "scipy.libs/libscipy_openblas-48c358d1.dll",
        "numpy-2.5.5.dist-info/METADATA",
        "numpy-2.5.5.dist-info/licenses/LICENSE.txt",
        "lightpen_resources/fonts/LightpenSansSC-Regular.ttf",
    ],
)
def test_what_the_program_can_come_to_use_is_installed(name: str) -> None:
    assert is_kept(name)


@pytest.mark.parametrize(
    "name",
    [
        "PySide6/Qt6Quick.dll",
        "PySide6/QtQml.pyd",
        "PySide6/qml/QtQuick/qmldir",
        "PySide6/opengl32sw.dll",
        "pyqtgraph/opengl/GLViewWidget.py",
        "pyqtgraph/colors/maps/CET-C1.csv",
        "PySide6/QtOpenGL.pyd",  # for which windows/without_opengl.py stands in
        "PySide6/Qt6OpenGL.dll",
        "cv2/opencv_videoio_ffmpeg500_64.dll",  # OpenCV itself reads Motion JPEG
        "PySide6/designer.exe",
        "PySide6/plugins/sqldrivers/qsqlite.dll",
        "PySide6/translations/qtbase_es.qm",
        "PySide6/QtCore.pyi",
        "numpy/_core/tests/test_umath.py",
        "scipy/stats/__init__.py",
        "scipy/special/tests/test_basic.py",
        "numpy-2.5.5.dist-info/RECORD",
    ],
)
def test_what_it_never_uses_is_left_out(name: str) -> None:
    assert not is_kept(name)


def test_the_data_of_a_wheel_go_where_they_belong_or_nowhere() -> None:
    assert place_of("tqdm-4.0.data/purelib/tqdm/a.py") == "tqdm/a.py"
    assert place_of("tqdm-4.0.data/scripts/tqdm") is None
    assert place_of("tqdm/a.py") == "tqdm/a.py"


SOURCES = Path(__file__).parents[2]
IMPORTING = """
import sys
from importlib.abc import MetaPathFinder
from pathlib import Path
import numpy
from installer.pruning import is_kept

PACKAGES = Path(numpy.__file__).parents[1]
MISSING, *STATEMENTS = sys.argv[1:]

class Pruned(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        place = name.replace(".", "/")
        for file in (f"{place}/__init__.py", f"{place}.py"):
            is_there = (PACKAGES / file).exists()
            if is_there and (name == MISSING or not is_kept(file)):
                raise ModuleNotFoundError(name, name=name)
        return None

sys.meta_path.insert(0, Pruned())
for statement in STATEMENTS:
    exec(statement)
"""


def import_scipy_as_installed(without: str = "") -> int:
    """Return how a process ends that imports all of scipy that the program does."""
    pattern = re.compile(r"^ *(from scipy[.\w]* import [\w, ]+)$", re.MULTILINE)
    statements = {
        statement
        for root in ("core", "app")
        for file in (SOURCES / root).rglob("*.py")
        for statement in pattern.findall(file.read_text(encoding="utf-8"))
    }
    assert statements
    arguments = [sys.executable, "-c", IMPORTING, without, *sorted(statements)]
    return subprocess.run(arguments, cwd=SOURCES, check=False).returncode


@pytest.mark.slow
def test_what_is_installed_of_scipy_is_all_that_its_imports_need() -> None:
    assert import_scipy_as_installed() == 0
    assert import_scipy_as_installed(without="scipy.special._basic") != 0
