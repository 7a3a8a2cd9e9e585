"""What is seen of a swing is the larger, the more room it has."""

import pytest
from PySide6.QtCore import QPoint
from PySide6.QtGui import QFontMetricsF
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from lightpen_app.look.theme import font
from lightpen_app.steps.swing.view import SwingView
from lightpen_app.widgets.fitting import FittedText, PageScroll
from lightpen_app.widgets.image_view import ImageView
from lightpen_app.widgets.operator_view import OperatorValue
from lightpen_app.widgets.state_banner import StateBanner

COUNT = "60 of about 80 images"
INSTRUCTION = "Tilt right"


def test_dial_and_image_grow_with_the_screen(qtbot: QtBot) -> None:
    face = SwingView()
    qtbot.addWidget(face)
    face.set_value(OperatorValue(instruction=INSTRUCTION, count=COUNT, fraction=0.4))
    face.show()

    def sizes(width: int, height: int) -> tuple[float, float]:
        face.resize(width, height)
        QApplication.processEvents()
        image = face.findChild(ImageView)
        assert isinstance(image, ImageView)
        dial = min(face.dial.width(), face.dial.height())
        return (dial, min(image.width(), image.height()))

    small, large, larger = sizes(976, 580), sizes(1616, 830), sizes(3536, 1900)

    for one, other in ((small, large), (large, larger)):
        assert one[0] < other[0], (small, large, larger)
        assert one[1] < other[1], (small, large, larger)


@pytest.mark.parametrize(
    "size",
    [(1616, 830), (976, 580), (968, 461), (669, 297)],
    ids=["large", "usual", "below a notice", "150 %"],
)
def test_dial_count_and_state_are_seen_whole_at_once(
    dressed: QApplication, qtbot: QtBot, size: tuple[int, int]
) -> None:
    face = SwingView()
    qtbot.addWidget(face)
    face.set_value(OperatorValue(instruction=INSTRUCTION, count=COUNT, fraction=0.4))
    face.swapped.show()
    face.resize(*size)
    face.show()
    dressed.processEvents()
    (scroll,) = face.findChildren(PageScroll)
    height = scroll.viewport().height()
    banners = [each for each in face.findChildren(StateBanner) if each.isVisible()]

    for each in (face.dial, *banners):
        assert each.mapTo(scroll.viewport(), QPoint(0, each.height())).y() <= height
    (count,) = (each for each in face.findChildren(FittedText) if each.text() == COUNT)
    letters = QFontMetricsF(font(count.size_px(), bold=True))
    assert letters.horizontalAdvance(COUNT) <= count.width() + 1
