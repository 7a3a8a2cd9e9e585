"""The live image: small LEDs stay visible, the newest image wins, marks sit right."""

from collections.abc import Sequence

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, QSize, Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from lightpen.arrays import Image
from lightpen_app.look.figures import pooled
from lightpen_app.look.theme import DARK, Tone
from lightpen_app.widgets.image_view import MAX_ZOOM, ImageView, Marker
from lightpen_app.work.live_view import Mailbox

WIDTH, HEIGHT = 2448, 2048


@pytest.fixture
def view(qtbot: QtBot) -> ImageView:
    view = ImageView()
    qtbot.addWidget(view)
    view.resize(WIDTH // 4, HEIGHT // 4)
    view.show()
    return view


def dark_image() -> np.ndarray[tuple[int, int], np.dtype[np.uint8]]:
    return np.zeros((HEIGHT, WIDTH), np.uint8)


def show(view: ImageView, image: Image, markers: Sequence[Marker] = ()) -> None:
    view.set_half(pooled(image), QSize(image.shape[1], image.shape[0]), markers)


def test_the_brightest_of_four_pixels_is_kept() -> None:
    image = np.array([[1, 2, 9, 0], [3, 4, 0, 0], [7, 7, 0, 0]], np.uint8)

    np.testing.assert_array_equal(pooled(image), [[4, 9]])


def test_twelve_bits_are_shown_as_eight() -> None:
    image = np.array([[4095, 16], [0, 0]], np.uint16)

    assert pooled(image, bits=12).dtype == np.uint8
    assert pooled(image, bits=12)[0, 0] == 255


@pytest.mark.parametrize("part", [4, 6, 11])
def test_an_led_of_one_pixel_stays_visible(view: ImageView, part: int) -> None:
    view.resize(WIDTH // part, HEIGHT // part)
    image = dark_image()
    image[800, 1200] = 255
    show(view, image)

    place = view.place_of(1200, 800).toPoint()
    shown = view.grab().toImage()
    near = [
        shown.pixelColor(place + QPoint(dx, dy)).lightness()
        for dx in (-1, 0, 1)
        for dy in (-1, 0, 1)
    ]

    assert max(near) > 50


@pytest.mark.parametrize("part", [3, 2, 1])
def test_an_image_has_no_seams(view: ImageView, part: int) -> None:
    view.resize(WIDTH // part, HEIGHT // part)
    image = np.repeat(np.arange(HEIGHT, dtype=np.uint32) // 9, WIDTH)
    pixels = image.astype(np.uint8).reshape(HEIGHT, WIDTH)
    show(view, pixels)

    shown = view.grab().toImage()
    inside = range(5, shown.height() - 5)
    column = [shown.pixelColor(50, y).lightness() for y in inside]

    assert set(np.diff(column)) <= {0, 1}
    assert column[0] < 5
    assert column[-1] > (HEIGHT - 1) // 9 - 5


def test_a_ring_is_drawn_about_its_place(view: ImageView) -> None:
    show(view, dark_image(), [Marker(1200, 800, 40, tone=Tone.GOOD)])

    shown = view.grab().toImage()
    right = (view.place_of(1240, 800)).toPoint()
    color = shown.pixelColor(right)

    assert color.green() > 100
    assert color.green() > color.red()
    assert shown.pixelColor(view.place_of(1200, 800).toPoint()).lightness() < 20


def test_rings_of_doubt_are_dashed_besides_their_colour(view: ImageView) -> None:
    def drawn(tone: Tone) -> int:
        show(view, dark_image(), [Marker(1200, 1000, 400, tone=tone)])
        image = view.grab().toImage()
        ring = (
            view.place_of(
                1200 + 400 * np.cos(angle), 1000 + 400 * np.sin(angle)
            ).toPoint()
            for angle in np.linspace(0, 2 * np.pi, 400)
        )
        bright = 0.6 * DARK.tone(tone).lightness()
        return sum(image.pixelColor(place).lightness() > bright for place in ring)

    whole, dashed = drawn(Tone.GOOD), drawn(Tone.BAD)

    assert 0.4 < dashed / whole < 0.8


def test_what_is_left_out_is_crossed(view: ImageView) -> None:
    marker = Marker(1200, 1000, 200, tone=Tone.QUIET, crossed=True)
    show(view, dark_image(), [marker])

    shown = view.grab().toImage()
    for x in (1100, 1200, 1300):
        on_stroke = shown.pixelColor(view.place_of(x, x - 200).toPoint())
        assert on_stroke.lightness() > 80


@pytest.mark.parametrize(
    ("angle", "dx", "dy"), [(0.0, 1, 0), (np.pi / 2, 0, 1), (np.pi, -1, 0)]
)
def test_a_label_stands_where_it_is_reported(
    view: ImageView, angle: float, dx: int, dy: int
) -> None:
    show(view, dark_image(), [Marker(1200, 1000, 1, "8", label_angle=angle)])
    drawn = view.grab().toImage()
    middle = view.place_of(1200, 1000).toPoint() + QPoint(14 * dx, 14 * dy)
    lit = [
        drawn.pixelColor(middle + QPoint(x, y)).lightness() > 60
        for x in range(-3, 4)
        for y in range(-3, 4)
    ]

    assert sum(lit) > 10


def test_a_label_covers_no_other_ring(view: ImageView) -> None:
    beside = Marker(1256, 1000, 16)  # where the label would stand

    show(view, dark_image(), [Marker(1200, 1000, 1, "8", label_angle=0), beside])

    drawn = view.grab().toImage()
    middle = view.place_of(1256, 1000).toPoint()
    inside = [QPoint(x, y) for x in range(-2, 3) for y in range(-2, 3)]
    assert all(drawn.pixelColor(middle + each).lightness() < 30 for each in inside)


def test_pixels_and_places_agree_at_every_enlargement(view: ImageView) -> None:
    show(view, dark_image())
    for zoom in (1.0, 3.0, MAX_ZOOM):
        view.set_zoom(zoom)
        pixel = view.pixel_at(view.place_of(1000.25, 700.5))
        assert (pixel.x(), pixel.y()) == pytest.approx((1000.25, 700.5), abs=1e-6)


def test_the_corner_of_the_image_is_half_a_pixel_before_its_first_centre(
    view: ImageView,
) -> None:
    show(view, dark_image())

    assert view.place_of(-0.5, -0.5) == QPointF(0, 0)


def test_a_drag_moves_the_image(view: ImageView) -> None:
    show(view, dark_image())
    view.set_zoom(4.0)
    before = view.place_of(1000, 1000)

    QTest.mousePress(view, Qt.MouseButton.LeftButton, pos=QPoint(300, 200))
    QTest.mouseMove(view, QPoint(340, 230))
    QTest.mouseRelease(view, Qt.MouseButton.LeftButton, pos=QPoint(340, 230))

    moved = view.place_of(1000, 1000) - before
    assert (moved.x(), moved.y()) == pytest.approx((40, 30))


def test_keys_enlarge_move_and_show_all_again(view: ImageView) -> None:
    show(view, dark_image())
    QTest.keyClick(view, Qt.Key.Key_Plus)
    before = view.place_of(1000, 1000).x()
    QTest.keyClick(view, Qt.Key.Key_Right)

    assert view._zoom > 1
    assert view.place_of(1000, 1000).x() < before
    QTest.keyClick(view, Qt.Key.Key_0)
    assert view._zoom == 1
    assert view.place_of(-0.5, -0.5) == QPointF(0, 0)


def test_without_an_image_it_says_why(view: ImageView) -> None:
    view.set_message("The camera is not connected.")

    assert view.accessibleDescription() == "The camera is not connected."
    grabbed = view.grab().toImage()
    colors = {
        grabbed.pixelColor(x, y).name()
        for x in range(0, grabbed.width(), 2)
        for y in range(grabbed.height() // 2 - 12, grabbed.height() // 2 + 12)
    }
    assert DARK.muted in colors


def test_a_mailbox_holds_the_newest_and_rings_once(qtbot: QtBot) -> None:
    mailbox = Mailbox()
    rings: list[None] = []
    mailbox.ready.connect(lambda: rings.append(None))

    for value in ("first", "second", "third"):
        mailbox.put(value)

    assert len(rings) == 1
    assert mailbox.take() == "third"
    assert mailbox.take() is None
    mailbox.put("fourth")
    assert len(rings) == 2
