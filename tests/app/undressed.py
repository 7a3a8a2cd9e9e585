"""Pages made as the program makes them: before the application has its style sheet."""

from collections.abc import Iterator
from contextlib import contextmanager

from PySide6.QtWidgets import QApplication


@contextmanager
def undressed() -> Iterator[None]:
    """Take the style sheet away until the widgets that are made meanwhile are whole.

    Under it Qt styles all of a widget whenever it gets a parent.
    """
    application = QApplication.instance()
    assert isinstance(application, QApplication)
    sheet = application.styleSheet()
    application.setStyleSheet("")
    try:
        yield
    finally:
        application.setStyleSheet(sheet)
