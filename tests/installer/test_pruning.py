"""Which files of the wheels are installed."""

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
        "cv2/opencv_videoio_ffmpeg500_64.dll",  # recorded videos are read by it
        "numpy/testing/__init__.py",
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
        "PySide6/designer.exe",
        "PySide6/plugins/sqldrivers/qsqlite.dll",
        "PySide6/translations/qtbase_es.qm",
        "PySide6/QtCore.pyi",
        "numpy/_core/tests/test_umath.py",
        "numpy-2.5.5.dist-info/RECORD",
    ],
)
def test_what_it_never_uses_is_left_out(name: str) -> None:
    assert not is_kept(name)


def test_the_data_of_a_wheel_go_where_they_belong_or_nowhere() -> None:
    assert place_of("tqdm-4.0.data/purelib/tqdm/a.py") == "tqdm/a.py"
    assert place_of("tqdm-4.0.data/scripts/tqdm") is None
    assert place_of("tqdm/a.py") == "tqdm/a.py"
