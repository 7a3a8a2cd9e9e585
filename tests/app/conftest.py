"""Fixtures of the application's tests: its own look, whatever the machine has."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import QLocale
from PySide6.QtWidgets import QApplication

from lightpen_app.languages import LanguageSwitch
from lightpen_app.settings import Settings
from lightpen_app.theme import DARK, apply_theme, load_fonts, style_sheet

# No windows on the desk of whoever runs the tests; set it to see them.
os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")


@pytest.fixture(scope="session")
def dressed(qapp: QApplication) -> QApplication:
    QApplication.setStyle("Fusion")
    load_fonts()
    return qapp


@pytest.fixture(autouse=True)
def look(dressed: QApplication) -> Iterator[None]:
    """Every test begins dark and in English."""
    before = QLocale()
    if dressed.styleSheet() != style_sheet(DARK):
        apply_theme(dressed, DARK)
    yield
    for switch in dressed.findChildren(LanguageSwitch):
        switch.remove()
        switch.deleteLater()
    QLocale.setDefault(before)


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(tmp_path / "config" / "lightpen.ini")
