"""What the smaller widgets say, by word and sign as well as by colour."""

import pytest
from PySide6.QtCore import QPoint, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QGuiApplication, QImage, QPainter, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from lightpen.detection.inspection import Exposure
from lightpen_app.look.signs import Sign, draw_sign
from lightpen_app.look.theme import DARK, TextSize, Tone
from lightpen_app.look.words import BREAK, breakable, unbroken
from lightpen_app.shell.page_area import NoticeBar
from lightpen_app.steps.camera.exposure_panel import ExposurePanel
from lightpen_app.widgets.fields import ChoiceField
from lightpen_app.widgets.fitting import FittedText
from lightpen_app.widgets.operator_view import (
    DISTANCES_M,
    LEAST_SHARE,
    OperatorValue,
    OperatorView,
    other_screen,
)
from lightpen_app.widgets.posture_dial import DialValue
from lightpen_app.widgets.state_banner import (
    SignLabel,
    State,
    StateBanner,
    StatusMessage,
)
from lightpen_app.work.workbench import Workbench


@pytest.mark.parametrize(
    ("peaks", "words"),
    [
        ((), "No LED detected"),
        ((0.5, 0.7, 0.9), "OK: 3 LEDs"),
        ((0.5, 0.2, 0.1), "Too dark: 2 of 3 LEDs"),
        ((0.1, 1.0, 0.5), "Saturated: 1 of 3 LEDs"),
    ],
)
def test_the_exposure_is_judged_in_words(
    qtbot: QtBot, workbench: Workbench, peaks: tuple[float, ...], words: str
) -> None:
    bar = ExposurePanel(workbench.live)
    qtbot.addWidget(bar)

    bar.set_value(Exposure(peaks))

    assert bar.verdict().text == words


def test_what_may_be_no_led_is_not_called_one(
    qtbot: QtBot, workbench: Workbench
) -> None:
    bar = ExposurePanel(workbench.live)
    qtbot.addWidget(bar)

    bar.set_value(Exposure((0.5, 0.2), are_leds=False))

    assert bar.verdict().text == "Too dark: 1 of 2 spots"


def draw(sign: Sign) -> bytes:
    image = QImage(48, 48, QImage.Format.Format_Grayscale8)
    image.fill(0)
    painter = QPainter(image)
    draw_sign(painter, QRectF(0, 0, 48, 48), sign, QColor("white"))
    painter.end()
    return bytes(image.constBits())


def test_no_two_signs_look_alike() -> None:
    drawn = {sign: draw(sign) for sign in Sign}

    assert len(set(drawn.values())) == len(Sign)
    assert [sign for sign, data in drawn.items() if not any(data)] == [Sign.NONE]


def test_a_state_has_word_sign_and_colour(qtbot: QtBot) -> None:
    banner = StateBanner(TextSize.DISPLAY)
    qtbot.addWidget(banner)
    banner.resize(600, banner.sizeHint().height())
    banner.show()

    banner.set_value(State("PAUSED", "The pen was lifted.", Sign.PAUSE, Tone.WARN))
    image = banner.grab().toImage()

    assert banner.accessibleName() == "PAUSED"
    assert banner.accessibleDescription() == "The pen was lifted."
    assert image.pixelColor(300, 4).name() == DARK.warn
    sign = {image.pixelColor(x, banner.height() // 2).name() for x in range(16, 64)}
    assert {DARK.warn, DARK.on_warn} <= sign


def test_long_words_shrink_until_they_fit(qtbot: QtBot) -> None:
    text = FittedText(86)
    qtbot.addWidget(text)
    text.resize(600, 120)

    text.set_text("Tilt right")
    short = text.size_px()
    text.set_text("Lean the pen much further towards the camera and to your right")
    long = text.size_px()

    assert short == 86
    assert 20 < long < 60


def test_a_notice_hides_once_it_is_read(qtbot: QtBot) -> None:
    notice = NoticeBar()
    qtbot.addWidget(notice)

    notice.show_text("The file holds no LED.")
    assert notice.isVisible()
    notice.clear()

    assert notice.text() == ""
    assert not notice.isVisible()


def test_a_closed_notice_shows_the_one_before_unless_its_cause_has_ended(
    qtbot: QtBot,
) -> None:
    notice = NoticeBar()
    qtbot.addWidget(notice)
    for text in ("The disk is full.", "No camera.", "The server is away."):
        notice.show_text(text)

    notice.drop("No camera.")
    assert notice.text() == "The server is away."
    notice.clear()
    assert notice.text() == "The disk is full."
    notice.clear()
    assert not notice.isVisible()


@pytest.mark.parametrize("key", [Qt.Key.Key_PageUp, Qt.Key.Key_PageDown])
def test_the_keys_of_the_steps_change_no_choice(qtbot: QtBot, key: Qt.Key) -> None:
    field = ChoiceField()
    qtbot.addWidget(field)
    field.addItems(["mm", "m", "inch"])
    field.setCurrentIndex(1)
    field.show()

    QTest.keyClick(field, key)

    assert field.currentIndex() == 1


def test_the_wheel_over_a_choice_changes_nothing(qtbot: QtBot) -> None:
    field = ChoiceField()
    qtbot.addWidget(field)
    field.addItems(["mm", "m"])
    field.show()

    middle = QPointF(field.rect().center())
    down = QWheelEvent(
        middle,
        field.mapToGlobal(middle),
        QPoint(),
        QPoint(0, -120),
        Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier,
        Qt.ScrollPhase.NoScrollPhase,
        False,
    )
    QApplication.sendEvent(field, down)

    assert field.currentText() == "mm"


@pytest.fixture
def view(qtbot: QtBot) -> OperatorView:
    view = OperatorView()
    qtbot.addWidget(view)
    view.resize(1920, 1080)
    return view


def size_of(view: OperatorView, text: str) -> float:
    """Return the size at which a text is drawn, px."""
    sizes = {each.text(): each.size_px() for each in view.findChildren(FittedText)}
    return sizes[text]


def test_letters_of_the_operator_view_grow_with_the_distance(
    view: OperatorView,
) -> None:
    sizes = []
    for distance in DISTANCES_M:
        view.set_distance_m(distance)
        sizes.append(view.letters())

    assert sizes == sorted(set(sizes))
    assert sizes[-1] == pytest.approx(6 * sizes[0], rel=0.02)


@pytest.mark.parametrize("distance", DISTANCES_M)
def test_an_instruction_has_the_size_that_the_distance_asks_for(
    view: OperatorView, distance: float
) -> None:
    view.set_distance_m(distance)
    view.set_value(
        OperatorValue(
            instruction="Tilt RIGHT",
            hint="Further down.",
            state=State("CAPTURING", "All 10 LEDs are seen.", Sign.RECORD, Tone.GOOD),
            count="184 / 300",
            fraction=0.6,
            dial=DialValue(),
        )
    )
    view.show()

    assert size_of(view, "Tilt RIGHT") >= view.letters()


@pytest.mark.parametrize("dial", [DialValue(), None])
@pytest.mark.parametrize("distance", DISTANCES_M)
def test_the_count_is_read_on_a_small_screen_too(
    view: OperatorView, distance: float, dial: DialValue | None
) -> None:
    view.resize(960, 540)
    view.set_distance_m(distance)
    view.set_value(
        OperatorValue(
            instruction="Tilt right",
            hint="Large tilt. Keep the tip pressed in.",
            state=State("CAPTURING", "10 of 10 LEDs.", Sign.RECORD, Tone.GOOD),
            count="60 of about 240 images",
            fraction=0.2,
            dial=dial,
        )
    )
    view.show()

    assert size_of(view, "60 of about 240 images") >= LEAST_SHARE * view.height()


def test_the_operator_view_fits_every_screen_at_every_distance(
    view: OperatorView,
) -> None:
    view.set_value(OperatorValue(instruction="Tilt right", dial=DialValue()))

    for distance in DISTANCES_M:
        view.set_distance_m(distance)
        view.resize(1280, 720)
        least = view.minimumSizeHint()
        assert least.width() <= 1280
        assert least.height() <= 720


def test_what_there_is_no_value_for_is_not_drawn(view: OperatorView) -> None:
    view.set_value(OperatorValue(instruction="Hold the pen in view"))
    view.show()
    before = view.grab().toImage()

    view.set_value(OperatorValue(instruction="Hold the pen in view", fraction=0.5))

    assert view.grab().toImage() != before


def test_the_operator_view_takes_another_screen_only_if_there_is_one() -> None:
    (screen,) = QGuiApplication.screens()

    assert other_screen(screen, [screen]) is screen
    second = object()
    assert other_screen(screen, [screen, second]) is second  # type: ignore[list-item]


LONG_WORDS = (
    'It begins with "led,x_mm,y_mm,z_mm\\n1,0.00023,-0.00035,-3.1,0.0021,-12.5".',
    "/home/operator/calibration/stations/hall_2/camera_left_intrinsics.yaml",
    "x" * 200,
)


@pytest.mark.parametrize("text", LONG_WORDS)
def test_a_message_with_a_long_word_needs_no_wide_place(
    qtbot: QtBot, text: str
) -> None:
    label = SignLabel()
    qtbot.addWidget(label)

    label.set_value(StatusMessage(text))

    assert label.minimumSizeHint().width() < 280
    assert label.value().text == label.accessibleName() == text


@pytest.mark.parametrize("text", LONG_WORDS)
def test_a_text_that_may_be_parted_is_the_same_text(text: str) -> None:
    assert breakable(text) != text
    assert unbroken(breakable(text)) == text


def test_words_of_a_usual_length_are_not_parted() -> None:
    assert BREAK not in breakable("Open the intrinsics file camera.yaml, 0.25 px.")


def test_a_new_state_is_announced_once_it_is_seen(qtbot: QtBot) -> None:
    banner = StateBanner()
    qtbot.addWidget(banner)
    said: list[str] = []
    banner.announced.connect(said.append)

    banner.set_value(State("WAITING", "Show the pen."))
    QApplication.processEvents()
    assert said == []
    banner.show()
    qtbot.waitUntil(lambda: said == ["WAITING. Show the pen."])

    banner.set_value(State("WAITING", "10 of 10 LEDs"))
    banner.set_value(State("COMPUTING"))  # in passing
    banner.set_value(State("PASS", "U (k = 2) of the tip is 0.002 mm."))
    qtbot.waitUntil(lambda: len(said) > 1)
    QApplication.processEvents()

    assert said[1:] == ["PASS. U (k = 2) of the tip is 0.002 mm."]


def test_of_two_banners_with_the_same_words_one_speaks(qtbot: QtBot) -> None:
    banner = StateBanner(speaks=False)
    qtbot.addWidget(banner)
    said: list[str] = []
    banner.announced.connect(said.append)

    banner.set_value(State("WAITING", "Show the pen."))
    banner.show()
    QApplication.processEvents()

    assert said == []


def test_words_stay_large_enough_to_be_read(qtbot: QtBot) -> None:
    text = FittedText(18, least=15)
    qtbot.addWidget(text)
    text.resize(300, 24)
    text.show()

    text.set_text("No swing can be recorded here: the folder cannot be written. " * 3)

    assert text.minimumHeight() > 60
    text.resize(300, text.minimumHeight())
    assert text.size_px() >= 15


LONG = "More images hardly help, as the LED centres are off alike. " * 5


def test_a_banner_grows_for_a_long_sentence_so_that_it_can_be_read(
    qtbot: QtBot,
) -> None:
    banner, holder = StateBanner(TextSize.TITLE), QWidget()
    qtbot.addWidget(holder)
    layout = QVBoxLayout(holder)
    layout.addWidget(banner)
    layout.addStretch(1)
    holder.resize(600, 500)
    holder.show()
    banner.set_value(State("REPEAT", "The cone moved.", Sign.CROSS, Tone.BAD))
    qtbot.waitUntil(lambda: banner.height() == banner.sizeHint().height())
    short = banner.height()

    banner.set_value(State("REPEAT", LONG, Sign.CROSS, Tone.BAD))
    qtbot.waitUntil(lambda: banner.height() > short)
    banner.set_value(State("REPEAT", "The cone moved.", Sign.CROSS, Tone.BAD))
    qtbot.waitUntil(lambda: banner.height() == short)
