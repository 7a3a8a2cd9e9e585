"""Stands in for PySide6.QtOpenGL and QtOpenGLWidgets, which take 11 MB.

pyqtgraph derives a widget from this class when it is imported. Nothing here draws by
OpenGL, so none is ever made.
"""

from PySide6.QtWidgets import QWidget


class QOpenGLWidget(QWidget):
    """A name to derive from."""
