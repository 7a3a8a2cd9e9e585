"""Which files of the wheels are installed: those that Lightpen can come to use.

Qt alone is half of all; its parts for other kinds of programs, development files and
the tests of libraries are left out. Each rule names what it drops.
"""

import re
from fnmatch import fnmatchcase

from lightpen_resources import languages

QT_MODULES = {*("Core", "Gui", "PrintSupport", "Svg", "Widgets")}
QT_PLUGINS = ("iconengines/*", "imageformats/*", "platforms/*", "styles/*")
QT_TRANSLATIONS = tuple(f"qtbase_{language}.qm" for language in languages())
DROPPED = (
    # To develop and test.
    "*.pyi", "*.pxd", "*.pyx", "*.c", "*.h", "*.hpp", "*.lib", "*.a", "*.cmake",
    "*/tests/*", "*/translations/*.ts",
    "PySide6/*.exe", "PySide6/doc/*", "PySide6/glue/*", "PySide6/include/*",
    "PySide6/lib/*", "PySide6/metatypes/*", "PySide6/qml/*", "PySide6/resources/*",
    "PySide6/scripts/*", "PySide6/typesystems/*",
    "PySide6/opengl32sw.dll",  # draws OpenGL in software; nothing here uses OpenGL
    "pyqtgraph/opengl/*",
    "PySide6/pyside6qml*", "PySide6/plugins/platforms/qdirect2d.dll",
    "PySide6/plugins/imageformats/qpdf.dll", "PySide6/plugins/imageformats/qtiff.dll",
    # Of the C++ runtime, what nothing here loads.
    "*/concrt140.dll", "*/vcamp140.dll", "*/vccorlib140.dll",
    "*/vcomp140.dll",
    "harvesters/test/*", "genicam/*.cti",  # a simulated camera
    "numpy/f2py/src/*", "numpy/_pyinstaller/*", "scipy/conftest.py",
    "*/_test_*.pyd", "numpy/*_tests.*.pyd", "numpy/_core/_simd.*",
    "sqlalchemy/testing/*",
    # Parts of libraries that nothing here imports.
    "pyqtgraph/colors/maps/*", "pyqtgraph/console/*", "pyqtgraph/dockarea/*",
    "pyqtgraph/examples/*", "pyqtgraph/flowchart/*", "pyqtgraph/icons/peegee/*.png",
    "sqlalchemy/dialects/mssql/*", "sqlalchemy/dialects/mysql/*",
    "sqlalchemy/dialects/oracle/*", "sqlalchemy/orm/*",
    "scipy/special/cython_special*",
    "cffi/*", "pycparser/*",  # compile bindings; those here are compiled
    "PySide6/plugins/imageformats/qgif.dll", "PySide6/plugins/imageformats/qicns.dll",
    "PySide6/plugins/imageformats/qtga.dll", "PySide6/plugins/imageformats/qwbmp.dll",
    "PySide6/plugins/imageformats/qwebp.dll",
    # Without FFmpeg OpenCV reads videos of Motion JPEG: lightpen.formats.video_process.
    "cv2/opencv_videoio_ffmpeg*.dll",
    "cv2/data/*.xml",  # to find faces
    "cv2/LICENSE*",  # a copy of that beside the metadata
    "*/LicenseRef-Qt-Commercial.txt",  # Qt is used under the LGPL
    "*.dist-info/RECORD",  # lists what is no longer there
    "platformdirs-*.dist-info/sboms/*",  # lists its tools of development
)  # fmt: skip
# Sub-packages of scipy that are imported, and those that they import.
SCIPY = {
    *(
        "_external",
        "_lib",
        "constants",
        "fft",
        "linalg",
        "optimize",
        "sparse",
        "spatial",
        "special",
    )
}
KEPT = ("numpy/testing/*",)


def is_kept(name: str) -> bool:
    """Return whether a file of a wheel is installed.

    Parameters
    ----------
    name : str
        Its path in the folder of packages, with slashes.
    """
    if (module := re.match(r"PySide6/Qt6?(\w+)\.(dll|pyd)$", name)) is not None:
        return module[1] in QT_MODULES
    if (package := re.match(r"scipy/(\w+)/", name)) is not None:
        return package[1] in SCIPY and not _fits(name, DROPPED)
    if name.startswith("PySide6/plugins/") and not _fits(
        name.removeprefix("PySide6/plugins/"), QT_PLUGINS
    ):
        return False
    if name.startswith("PySide6/translations/"):
        return name.rpartition("/")[2] in QT_TRANSLATIONS
    return _fits(name, KEPT) or not _fits(name, DROPPED)


def _fits(name: str, patterns: tuple[str, ...]) -> bool:
    return any(fnmatchcase(name, pattern) for pattern in patterns)
