"""Every step looks as it did when it was last looked at, and has room on small screens.

`python docs/screens.py` draws the pictures anew after a wanted change. The smallest
screen is one of 1280 x 800 at 150 %, which leaves 853 x 533, with a title bar.
"""

import importlib.util
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from PySide6.QtCore import QSize
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication, QLabel, QTabWidget
from tests.app.room import SizeClass, room_of

from lightpen.record.swings.header import Names
from lightpen_app.widgets.fitting import FRAME
from lightpen_resources import languages

pytestmark = pytest.mark.slow  # it swings, solves and draws all steps

ROOT = Path(__file__).parents[2]
DIFFERENT = ROOT / "screens-different"


def load_screens() -> ModuleType:
    spec = importlib.util.spec_from_file_location("screens", ROOT / "docs/screens.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


SCREENS = load_screens()
NAMES = [
    look.file_name(step)
    for step in SCREENS.STEPS
    for look in SCREENS.published_looks(step)
]
LEAST = QSize(853, 533) - FRAME  # 1280 x 800 at 150 %
LOW = QSize(1270, 640)
SVGA = QSize(800, 600) - FRAME
SIZES = (SVGA, LEAST, LOW, QSize(1280, 800))
PROBING = "verify", "measure"  # seen also with all results, or after a few points
OTHERWISE = " otherwise"
KEYS = [
    (step, str(language), size.width())
    for step in (*SCREENS.STEPS, *(step + OTHERWISE for step in PROBING))
    for language in languages()
    for size in SIZES
]

Key = tuple[str, str, int]


@dataclass(frozen=True)
class Seen:
    """What is seen of all steps.

    Attributes
    ----------
    pictures : dict
        By the names of their files.
    rooms : dict
        By step, language and width of the window; one for each tab.
    """

    pictures: dict[str, QImage]
    rooms: dict[Key, list[SizeClass]]


@pytest.fixture(scope="module")
def seen(dressed: QApplication) -> Iterator[Seen]:
    seen = Seen({}, {})
    dressed.setStyleSheet("")  # which the wizard gives it
    with SCREENS.anywhere():
        stage = SCREENS.Stage(dressed)
        for step in SCREENS.walk(stage, SCREENS.published_looks):
            seen.pictures.update(SCREENS.draw(stage, step, SCREENS.published_looks))
            seen.rooms.update(rooms_of(stage, step))
            if step in PROBING:
                stage.show_otherwise(step)
                others = {
                    (step + OTHERWISE, *key): rooms
                    for (_, *key), rooms in rooms_of(stage, step)
                }
                seen.rooms.update(others)
        yield seen
        stage.close()


def rooms_of(stage: Any, step: str) -> Iterator[tuple[Key, list[SizeClass]]]:
    """Yield what room the step that is shown has in each language and width.

    In the appearance that it was drawn in last: to change it takes long.
    """
    window = stage.wizard.window
    appearance = SCREENS.published_looks(step)[-1].appearance

    def room() -> SizeClass:
        return room_of(window)

    for language in languages():
        for size in SIZES:
            with stage.unpainted():
                stage.set_look(SCREENS.Look(language, appearance, size))
                rooms = [stage.still(room)]
                for tabs in window.page().findChildren(QTabWidget):
                    for index in range(tabs.count()):
                        tabs.setCurrentIndex(index)
                        rooms.append(stage.still(room))
            yield (step, str(language), size.width()), rooms


@pytest.fixture
def pictures(seen: Seen) -> dict[str, QImage]:
    return seen.pictures


@pytest.mark.parametrize("name", NAMES)
def test_a_step_looks_as_it_did(pictures: dict[str, QImage], name: str) -> None:
    expected = QImage(str(SCREENS.FOLDER / name))
    difference = SCREENS.compare(pictures[name], expected)

    if difference.is_seen:
        DIFFERENT.mkdir(exist_ok=True)
        pictures[name].save(str(DIFFERENT / name))
        difference.picture.save(str(DIFFERENT / f"difference-{name}"))
        pytest.fail(
            f"{name}: {100 * difference.share:.1f} % of the pixels of a square differ; "
            f"see {DIFFERENT}"
        )


def test_no_step_needs_more_room_than_a_small_screen_has(
    pictures: dict[str, QImage],
) -> None:
    smallest = SCREENS.SIZES[0]
    small = f"{smallest.width()}x{smallest.height()}"
    sizes = {name: picture.size() for name, picture in pictures.items()}
    too_large = [n for n, size in sizes.items() if small in n and size != smallest]
    assert too_large == []


@pytest.mark.parametrize("key", KEYS, ids=lambda key: "-".join(map(str, key)))
def test_a_step_has_room_in_a_small_window(seen: Seen, key: Key) -> None:
    (size,) = (each for each in SIZES if each.width() == key[2])
    for room in seen.rooms[key]:
        assert room.size == size
        assert room.lack == QSize(0, 0)
        assert room.sideways == ()


@pytest.mark.parametrize("key", KEYS, ids=lambda key: "-".join(map(str, key)))
def test_no_words_of_a_step_are_clipped(seen: Seen, key: Key) -> None:
    for room in seen.rooms[key]:
        assert room.clipped == ()


@pytest.mark.parametrize("language", languages())
def test_nothing_is_scrolled_amid_probing_nor_at_its_result(
    seen: Seen, language: str
) -> None:
    for step in PROBING:
        for each in (step, step + OTHERWISE):
            for width in (1280, LEAST.width()):
                figure, *_ = seen.rooms[each, language, width]
                assert "PageScroll" not in figure.downwards


@pytest.mark.parametrize("language", languages())
def test_in_a_low_window_the_images_of_the_review_are_not_scrolled(
    seen: Seen, language: str
) -> None:
    images = seen.rooms["review", language, LOW.width()][2]

    assert images.downwards == ()


@pytest.mark.parametrize("language", languages())
def test_all_leds_of_a_pen_are_seen_at_once(seen: Seen, language: str) -> None:
    (room,) = seen.rooms["leds", language, 1280]

    assert "LedTable" not in room.downwards


def test_the_tabs_of_the_review_are_all_looked_at(seen: Seen) -> None:
    assert len(seen.rooms["review", "en", LEAST.width()]) == 1 + 5
    assert len(seen.rooms["review", "en", 1280]) == 1 + 5


def test_long_names_leave_every_step_its_width(
    dressed: QApplication, monkeypatch: pytest.MonkeyPatch
) -> None:
    station, operator, pen, tip, cone = (190 * letter for letter in "MWnoH")
    long = Names(station, operator, pen, tip, cone, 10.0)
    monkeypatch.setattr(SCREENS, "NAMES", long)
    dressed.setStyleSheet("")
    found = {}
    with SCREENS.anywhere():
        stage = SCREENS.Stage(dressed)
        for step in SCREENS.walk(stage, SCREENS.published_looks):
            appearance = SCREENS.published_looks(step)[-1].appearance
            stage.set_look(SCREENS.Look("en", appearance, SVGA))
            room = stage.still(lambda: room_of(stage.wizard.window))
            if room.sideways or room.clipped:
                found[step] = room.sideways, room.clipped
        labels = stage.wizard.window.findChildren(QLabel)
        named = [label for label in labels if long.tip in label.toolTip()]
        stage.close()

    assert found == {}
    assert named  # its whole name is in a tool tip
