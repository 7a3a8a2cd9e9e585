"""pyqtgraph draws without Qt's OpenGL, which the Windows installer leaves out."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

WINDOWS = Path(__file__).parents[2] / "installer" / "windows"
DRAWN = """
import sys
sys.path.insert(0, sys.argv[1])
import without_opengl
for name in ("QtOpenGL", "QtOpenGLWidgets"):
    sys.modules[f"PySide6.{name}"] = without_opengl
import pyqtgraph
application = pyqtgraph.mkQApp()
plot = pyqtgraph.PlotWidget()
plot.plot([1.0, 3.0, 2.0], pen="r")
plot.show()
image = plot.grab().toImage()
middle = image.height() // 2
colours = [image.pixelColor(x, middle) for x in range(image.width())]
assert any(colour.red() > colour.blue() + 100 for colour in colours)
"""


@pytest.mark.slow
def test_a_curve_is_drawn_without_opengl() -> None:
    words = [sys.executable, "-c", DRAWN, str(WINDOWS)]
    surroundings = os.environ | {"QT_QPA_PLATFORM": "offscreen"}
    assert subprocess.run(words, env=surroundings, check=False).returncode == 0
