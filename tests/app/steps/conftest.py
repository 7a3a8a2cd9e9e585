"""Fixtures of the tests of single steps."""

from collections.abc import Callable
from typing import TypeVar

import pytest
from PySide6.QtCore import QCoreApplication, Qt, QThreadPool
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QComboBox, QLabel, QPushButton, QWidget
from pytestqt.qtbot import QtBot

from lightpen_app.look.words import unbroken
from lightpen_app.widgets.image_view import ImageView, Marker
from lightpen_app.widgets.page import Page
from lightpen_app.widgets.state_banner import StateBanner
from lightpen_extensions.simulator.hand import TrackingMotion

W = TypeVar("W", bound=QWidget)

QUICK_ARM = TrackingMotion(gain=12.0, lag=0.0325, top_speed=3000.0)


@pytest.fixture(autouse=True)
def quick_arm(monkeypatch: pytest.MonkeyPatch) -> None:
    """The simulated pen comes within a few images; a person needs 2.5 s for it."""
    monkeypatch.setattr("lightpen_extensions.simulator.hand.ARM", QUICK_ARM)


class Seen:
    """What an operator finds on a page, by the words on it."""

    def __init__(self, page: Page, qtbot: QtBot) -> None:
        self.page = page
        self.qtbot = qtbot

    @property
    def words(self) -> str:
        """All that is written on the page, blanks alike."""
        labels = self.page.findChildren(QLabel)
        parts = [unbroken(label.text()) for label in labels if label.isVisible()]
        for banner in self.page.findChildren(StateBanner):
            parts += [banner.value().word, banner.value().detail]
        parts.append(self.child(ImageView).accessibleDescription())
        return "\n".join(parts).replace("\N{NO-BREAK SPACE}", " ")

    @property
    def markers(self) -> tuple[Marker, ...]:
        return self.child(ImageView).markers()

    def child(self, kind: type[W]) -> W:
        """Return the only, or the first, widget of a kind."""
        widget = self.page.findChild(kind)
        assert isinstance(widget, kind)
        return widget

    def named(self, name: str) -> QWidget:
        """Return the visible control of that name or on which it is written."""
        for each in self.page.findChildren(QWidget):
            written = each.text() if isinstance(each, QPushButton) else ""
            if each.isVisible() and name in (written, each.accessibleName()):
                return each
        raise AssertionError(f"No {name} on the page, but:\n{self.words}")

    def shows(self, name: str) -> bool:
        """Whether there is a button on which this is written, to be seen."""
        buttons = self.page.findChildren(QPushButton)
        return any(each.isVisible() and each.text() == name for each in buttons)

    def click(self, name: str) -> None:
        QTest.mouseClick(self.named(name), Qt.MouseButton.LeftButton)

    def enter(self, name: str, text: str) -> None:
        """Type into a field and press Enter, and see what comes of it."""
        field = self.named(name)
        field.setFocus()
        QTest.keySequence(field, "Ctrl+A")
        QTest.keyClicks(field, text)
        QTest.keyClick(field, Qt.Key.Key_Return)
        self.settle()

    def settle(self) -> None:
        """Let jobs end: they read and write the files."""
        QThreadPool.globalInstance().waitForDone()
        QCoreApplication.processEvents()

    def choose(self, choice: str) -> None:
        """Choose by the keyboard."""
        combo = self.child(QComboBox)
        combo.setFocus()
        is_below = combo.findText(choice) > combo.currentIndex()
        QTest.keyClick(combo, Qt.Key.Key_Down if is_below else Qt.Key.Key_Up)
        assert combo.currentText() == choice

    def wait(self, words: str) -> None:
        """Wait until it is written on the page."""

        def is_written() -> None:
            assert words in self.words, self.words

        self.qtbot.waitUntil(is_written)

    def until(self, condition: Callable[[], object]) -> None:
        self.qtbot.waitUntil(lambda: bool(condition()))


See = Callable[[Page], Seen]


@pytest.fixture
def see(qtbot: QtBot) -> See:
    """Return a function that looks at a page as an operator does."""
    return lambda page: Seen(page, qtbot)
