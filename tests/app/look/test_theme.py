"""The look: read on every ground, distinguished by the colour-blind."""

import re
import shutil
from dataclasses import fields
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QFont, QFontDatabase, QFontInfo
from PySide6.QtWidgets import QApplication, QLabel
from pytestqt.qtbot import QtBot

from lightpen.arrays import FloatArray
from lightpen_app.look.theme import (
    DARK,
    FAMILIES,
    LIGHT,
    Appearance,
    Colors,
    TextSize,
    Tone,
    apply_theme,
    colors_for,
    font,
    letters_for,
    scale_for,
    set_text_scale,
    style_sheet,
    text_label,
)
from lightpen_app.widgets.state_banner import StateBanner
from lightpen_program.self_test import CLASSES_WITH_FONTS
from lightpen_resources import RESOURCES

PALETTES = pytest.mark.parametrize("colors", [DARK, LIGHT], ids=["dark", "light"])
GROUNDS = ("window", "panel", "raised")
WORDS = ("text", "muted", "accent", "good", "warn", "bad")
PAIRS = [(word, ground) for word in WORDS for ground in GROUNDS] + [
    ("on_accent", "accent"),
    ("on_good", "good"),
    ("on_warn", "warn"),
    ("on_bad", "bad"),
    ("text", "partial"),
]
SHAPES = [("edge", ground) for ground in GROUNDS] + [
    ("pointer", "window"),
    ("pointer", "raised"),
    ("partial", "text"),
]
# G. M. Machado et al., "A physiologically-based model for simulation of color vision
# deficiency" (2009), severity 1.0; for linear RGB.
BLINDNESS = {
    "protan": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deutan": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
}
XYZ_FROM_RGB = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)
WHITE = XYZ_FROM_RGB.sum(axis=1)


def contrast(one: str, other: str) -> float:
    """Return the contrast of two colours, 1 to 21, as WCAG 2.2 defines it."""
    brighter, darker = sorted((_luminance(one), _luminance(other)), reverse=True)
    return (brighter + 0.05) / (darker + 0.05)


def _luminance(color: str) -> float:
    """Relative luminance of sRGB, 0 to 1."""
    return sum(
        weight * _linear(int(color[at : at + 2], 16) / 255)
        for weight, at in ((0.2126, 1), (0.7152, 3), (0.0722, 5))
    )


def _linear(value: float) -> float:
    """Return the light of an sRGB value; both 0 to 1."""
    return (
        value / 12.92 if value <= 0.04045 else float(((value + 0.055) / 1.055) ** 2.4)
    )


def poor_pairs(colors: Colors, pairs: list[tuple[str, str]], least: float) -> list[str]:
    return [
        f"{one} on {other}: {ratio:.2f}"
        for one, other in pairs
        if (ratio := contrast(getattr(colors, one), getattr(colors, other))) < least
    ]


def linear_rgb(color: str) -> FloatArray:
    value = np.array([int(color[at : at + 2], 16) / 255 for at in (1, 3, 5)])
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def lab(rgb: FloatArray) -> FloatArray:
    ratio = XYZ_FROM_RGB @ np.clip(rgb, 0, 1) / WHITE
    cube = np.where(ratio > 216 / 24389, np.cbrt(ratio), ratio * 841 / 108 + 4 / 29)
    return np.array(
        [116 * cube[1] - 16, 500 * (cube[0] - cube[1]), 200 * (cube[1] - cube[2])]
    )


def seen_distance(one: str, other: str, kind: str) -> float:
    """CIE 1976 distance of two colours as a colour-blind person sees them."""
    matrix = BLINDNESS[kind]
    difference = lab(matrix @ linear_rgb(one)) - lab(matrix @ linear_rgb(other))
    return float(np.linalg.norm(difference))


def test_contrast_is_that_of_the_standard() -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.005)


@PALETTES
def test_words_are_read_on_every_ground(colors: Colors) -> None:
    assert poor_pairs(colors, PAIRS, 4.5) == []


@PALETTES
def test_borders_and_pointers_are_seen_on_every_ground(colors: Colors) -> None:
    assert poor_pairs(colors, SHAPES, 3.0) == []


@PALETTES
@pytest.mark.parametrize("kind", BLINDNESS)
def test_states_differ_for_the_colour_blind(colors: Colors, kind: str) -> None:
    """A distance of 10 is seen at a glance; pure red and green keep 7 of 130."""
    states = [colors.good, colors.warn, colors.bad, colors.accent]

    distances = [seen_distance(a, b, kind) for a, b in combinations(states, 2)]

    assert min(distances) > 10


@PALETTES
def test_a_state_differs_from_plain_words_for_the_colour_blind(colors: Colors) -> None:
    for tone in (colors.good, colors.warn, colors.bad, colors.accent):
        assert seen_distance(tone, colors.text, "deutan") > 10


@PALETTES
def test_the_style_sheet_takes_every_colour_from_the_palette(colors: Colors) -> None:
    named = {getattr(colors, field.name) for field in fields(colors)}

    used = set(re.findall(r"#[0-9a-f]{6}\b", style_sheet(colors)))

    assert used <= named


def test_the_style_sheet_has_no_font_size_of_its_own() -> None:
    text = (RESOURCES / "style" / "lightpen.qss").read_text("utf-8")

    sizes = re.findall(r"font-size:\s*([^;]+);", text)

    assert sizes
    assert all(size.startswith("$size_") for size in sizes)


def test_icons_take_their_colours_from_the_palettes() -> None:
    named = {
        getattr(colors, each.name)
        for colors in (DARK, LIGHT)
        for each in fields(colors)
    }

    for path in sorted((RESOURCES / "icons").glob("*.svg")):
        used = set(re.findall(r"#[0-9a-f]{6}\b", path.read_text("utf-8")))
        assert used <= named, path.name


def test_every_icon_of_the_style_sheet_is_there() -> None:
    for colors in (DARK, LIGHT):
        for path in re.findall(r'url\("([^"]+)"\)', style_sheet(colors)):
            assert Path(path).is_file()


def test_the_style_sheet_is_understood_in_a_folder_with_blanks(
    qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "Jörg 王"
    shutil.copytree(RESOURCES, folder)
    monkeypatch.setattr("lightpen_app.look.theme.RESOURCES", folder)
    label = QLabel()
    qtbot.addWidget(label)

    label.setStyleSheet(style_sheet(DARK))
    label.show()

    assert str(folder.as_posix()) in label.styleSheet()
    assert label.grab().width() > 0  # what Qt warns of fails the test


def test_no_widget_brings_a_style_sheet_of_its_own() -> None:
    application = RESOURCES.parents[1] / "app" / "lightpen_app"
    others = [
        path.name
        for path in application.rglob("*.py")
        if "setStyleSheet" in path.read_text("utf-8") and path.name != "theme.py"
    ]

    assert others == []


@pytest.mark.parametrize(
    ("distance_m", "expected"), [(1, 29), (2, 58), (3, 86), (4, 115), (6, 173)]
)
def test_letters_grow_with_the_distance(distance_m: float, expected: int) -> None:
    """The published table is for a capital of 0.729 of the font size; ours is 0.714."""
    wide = expected * 0.729 / 0.714

    assert letters_for(distance_m, 91.8) == pytest.approx(wide, abs=1)


@pytest.mark.parametrize("family", FAMILIES)
def test_the_bundled_fonts_are_in_use(family: str) -> None:
    assert QFontDatabase.styles(family) == ["Bold", "Regular"]


@pytest.mark.parametrize("name", CLASSES_WITH_FONTS)
def test_a_theme_takes_fonts_of_the_platform_from_tables_lists_and_menus(
    qapp: QApplication, name: str
) -> None:
    # As Windows does; the stubs of PySide 6.11 want bytes, which the method refuses.
    QApplication.setFont(QFont("DejaVu Sans Mono", 8), name)  # type: ignore[arg-type]

    apply_theme(qapp, DARK)
    apply_theme(qapp, LIGHT)

    font_of_class = QApplication.font(name)  # type: ignore[call-overload]
    assert font_of_class.family() == FAMILIES[0]


def test_plain_and_bold_text_come_from_the_bundled_font() -> None:
    assert QFontInfo(font(TextSize.BODY)).family() == FAMILIES[0]
    assert QFontInfo(font(TextSize.BODY, bold=True)).weight() == 700


def test_the_licence_lies_beside_the_fonts() -> None:
    text = (RESOURCES / "fonts" / "OFL.txt").read_text("utf-8")

    assert "SIL OPEN FONT LICENSE Version 1.1" in text
    for path in (RESOURCES / "fonts").glob("*.ttf"):
        assert path.stem.partition("-")[0] in text


def test_the_theme_reaches_widgets_that_are_drawn_by_hand(
    qapp: QApplication, qtbot: QtBot
) -> None:
    banner = StateBanner()
    qtbot.addWidget(banner)
    banner.show()

    for colors in (LIGHT, DARK):
        apply_theme(qapp, colors)
        QApplication.processEvents()

        assert banner.grab().toImage().pixelColor(40, 4).name() == colors.raised


def test_the_choice_of_appearance_wins_over_the_system() -> None:
    dark_system = Qt.ColorScheme.Dark

    assert colors_for(Appearance.SYSTEM, dark_system) is DARK
    assert colors_for(Appearance.SYSTEM, Qt.ColorScheme.Unknown) is LIGHT
    assert colors_for(Appearance.LIGHT, dark_system) is LIGHT


def test_a_label_takes_size_and_tone_from_the_style_sheet() -> None:
    label = text_label(TextSize.TITLE, Tone.WARN)
    label.ensurePolished()

    assert label.font().pixelSize() == TextSize.TITLE
    assert label.palette().color(label.foregroundRole()).name() == DARK.warn


@pytest.mark.parametrize(
    ("points", "platform", "scale"),
    [(9, "win32", 1.0), (11.25, "win32", 1.25), (11, "linux", 1.0), (30, "linux", 1.4)],
)
def test_text_is_as_much_larger_as_that_of_the_system(
    points: float, platform: str, scale: float
) -> None:
    assert scale_for(points, platform) == scale


def test_larger_text_is_larger_everywhere(qapp: QApplication) -> None:
    set_text_scale(1.25)
    try:
        assert font(TextSize.DISPLAY).pixelSize() == 55
        assert "font-size: 19px" in style_sheet(DARK)  # the words of most controls
    finally:
        set_text_scale(1.0)
