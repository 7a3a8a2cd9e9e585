"""The look: two palettes, one type scale, one spacing grid, one style sheet.

Custom painting takes its colours from `colors_of` the palette, everything else from the
style sheet in resources; so a change of theme reaches every widget.
"""

import sys
from dataclasses import asdict, dataclass
from enum import Enum, IntEnum, StrEnum
from string import Template

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QFont, QFontDatabase, QPalette
from PySide6.QtWidgets import QApplication, QLabel, QWidget
from typing_extensions import override

from lightpen_app.look.words import set_tooltip, with_short_words
from lightpen_resources import RESOURCES

FAMILIES = ("Lightpen Sans", "Lightpen Sans SC")
GRID = 8  # px; every margin, gap and height is a multiple of it, or half of it
# Points of the system's font without a request for larger text.
USUAL_POINTS = {"win32": 9.0, "darwin": 13.0}
USUAL_POINTS_ELSEWHERE = 11.0
LARGEST_SCALE = 1.4  # of the text; the window has no room for more
SCALE = "text_scale"  # property of the application
CAP_HEIGHT = 0.714  # of the font size, in the bundled font


class TextSize(IntEnum):
    """The type scale, px."""

    SMALL = 13
    BODY = 15
    LEAD = 18
    TITLE = 28
    DISPLAY = 44
    HUGE = 72


class Appearance(StrEnum):
    """Choice of the palette."""

    SYSTEM = "system"
    LIGHT = "light"
    DARK = "dark"


class Tone(Enum):
    """Meaning of a colour; a symbol or word always repeats it."""

    PLAIN = "text"
    QUIET = "muted"
    ACTIVE = "accent"
    GOOD = "good"
    WARN = "warn"
    BAD = "bad"


@dataclass(frozen=True)
class Colors:
    """Named colours of a palette, each as "#rrggbb"."""

    window: str  # grounds: behind all,
    panel: str  # of areas,
    raised: str  # of controls
    line: str  # quiet divisions
    edge: str  # borders that must be seen to use a control
    # Words, and states as words and signs: all are read on every ground. What begins
    # with `on_` is for words on areas of that colour.
    text: str
    muted: str
    accent: str  # of active elements
    on_accent: str
    good: str
    on_good: str
    warn: str
    on_warn: str
    bad: str
    on_bad: str
    partial: str  # filling of a started item; `text` is read on it
    pointer: str  # arrow and frame that show where to go; never text

    def tone(self, tone: Tone) -> QColor:
        """Return the tone of the state."""
        return QColor(getattr(self, tone.value))

    def on_tone(self, tone: Tone) -> QColor:
        """Return the colour of words on an area of that colour."""
        name = f"on_{tone.value}"
        return QColor(getattr(self, name, self.window))


DARK = Colors(
    window="#0f141b",
    panel="#171e27",
    raised="#232d39",
    line="#303c4a",
    edge="#74869a",
    text="#eef3f8",
    muted="#a9b7c6",
    accent="#62b6f5",
    on_accent="#07131f",
    good="#2fc99a",
    on_good="#04140e",
    warn="#f6b73c",
    on_warn="#1a1200",
    bad="#ff8573",
    on_bad="#220703",
    partial="#2c5576",
    pointer="#f6b73c",
)
LIGHT = Colors(
    window="#f3f5f7",
    panel="#ffffff",
    raised="#e7ecf1",
    line="#d3dbe3",
    edge="#75828f",
    text="#15202b",
    muted="#495867",
    accent="#00599b",
    on_accent="#ffffff",
    good="#006b52",
    on_good="#ffffff",
    warn="#856100",
    on_warn="#ffffff",
    bad="#a8102a",
    on_bad="#ffffff",
    partial="#a9cdea",
    pointer="#d9480f",
)


def colors_of(palette: QPalette) -> Colors:
    """Return the colours that go with a widget's palette."""
    return DARK if palette.color(QPalette.ColorRole.Window).lightness() < 128 else LIGHT


def colors_for(appearance: Appearance, scheme: Qt.ColorScheme) -> Colors:
    """Return the colours for a choice and the scheme of the system."""
    if appearance is Appearance.SYSTEM:
        return DARK if scheme == Qt.ColorScheme.Dark else LIGHT
    return DARK if appearance is Appearance.DARK else LIGHT


def load_fonts() -> None:
    """Load the bundled fonts and set the application's font at the system's size."""
    system = QFontDatabase.systemFont(QFontDatabase.SystemFont.GeneralFont)
    set_text_scale(scale_for(system.pointSizeF(), sys.platform))
    for file in sorted((RESOURCES / "fonts").glob("*.ttf")):
        QFontDatabase.addApplicationFont(str(file))
    QApplication.setFont(font(TextSize.BODY))


def scale_for(points: float, platform: str) -> float:
    """Return the magnification of text from the size of the system's font."""
    usual = USUAL_POINTS.get(platform, USUAL_POINTS_ELSEWHERE)
    return min(max(points / usual, 1.0), LARGEST_SCALE)


def set_text_scale(scale: float) -> None:
    """Enlarge all text of the type scale that is drawn from now on."""
    application = QApplication.instance()
    if application is not None:
        application.setProperty(SCALE, scale)


def scaled(size: TextSize) -> int:
    """Return the size of a text of the type scale on this screen, px."""
    application = QApplication.instance()
    scale = None if application is None else application.property(SCALE)
    return round(size * (scale or 1.0))


def font(size: float, *, bold: bool = False) -> QFont:
    """Return the program's font at a size in px, or at a place of the type scale."""
    if isinstance(size, TextSize):
        size = scaled(size)
    result = QFont()
    result.setFamilies(list(FAMILIES))
    result.setPixelSize(max(1, round(size)))
    result.setBold(bold)
    return result


def letters_for(distance_m: float, dots_per_inch: float) -> int:
    """Return the font size that is legible from a distance, px.

    Capitals of 20 minutes of arc, as ISO 9241-303 recommends.
    """
    capital_mm = distance_m * 1000 * 20 / 60 * 3.14159265 / 180
    return round(capital_mm / 25.4 * dots_per_inch / CAP_HEIGHT)


def apply_theme(application: QApplication, colors: Colors) -> None:
    """Give the whole application these colours and the style sheet."""
    sheet = style_sheet(colors)
    if application.styleSheet() == sheet:
        return
    application.setPalette(palette_of(colors))
    application.setStyleSheet("")  # Qt replaces a sheet four times slower than none
    application.setStyleSheet(sheet)
    # On Windows a new sheet brings back the system's fonts of tables, lists and menus.
    QApplication.setFont(font(TextSize.BODY))


def style_sheet(colors: Colors) -> str:
    """Return the style sheet of resources, filled in."""
    template = Template((RESOURCES / "style" / "lightpen.qss").read_text("utf-8"))
    sizes = {f"size_{size.name.lower()}": f"{scaled(size)}px" for size in TextSize}
    icons = (RESOURCES / "icons").as_posix()
    theme = "dark" if colors is DARK else "light"
    return template.substitute(asdict(colors), **sizes, icons=icons, theme=theme)


class TextLabel(QLabel):
    """A label that fits its place, whatever it names: the tool tip has the whole."""

    _is_short = False

    @override
    def setText(self, text: str) -> None:
        shown = with_short_words(text)
        if self._is_short or shown != text:
            set_tooltip(self, text if shown != text else "")
        self._is_short = shown != text
        super().setText(shown)


def text_label(size: TextSize = TextSize.BODY, tone: Tone = Tone.PLAIN) -> QLabel:
    """Return a label that wraps its words, at a place of the type scale."""
    label = TextLabel()
    label.setWordWrap(True)
    label.setTextFormat(Qt.TextFormat.PlainText)
    label.setProperty("scale", size.name.lower())
    set_tone(label, tone)
    return label


def set_tone(widget: QWidget, tone: Tone) -> None:
    """Set the tone of a widget's text."""
    set_styled(widget, "tone", tone.value)


def set_size(widget: QWidget, size: TextSize) -> None:
    """Set the size of a label or a table on the type scale."""
    set_styled(widget, "scale", size.name.lower())


def set_styled(widget: QWidget, name: str, value: str) -> None:
    """Set a property used by the style sheet."""
    if widget.property(name) == value:
        return
    widget.setProperty(name, value)
    if widget.testAttribute(Qt.WidgetAttribute.WA_WState_Polished):
        widget.style().unpolish(widget)
        widget.style().polish(widget)


def palette_of(colors: Colors) -> QPalette:
    """Return the palette of widgets in these colours."""
    role = QPalette.ColorRole
    palette = QPalette()
    for name, color in (
        (role.Window, colors.window),
        (role.WindowText, colors.text),
        (role.Base, colors.panel),
        (role.AlternateBase, colors.raised),
        (role.Text, colors.text),
        (role.PlaceholderText, colors.muted),
        (role.Button, colors.raised),
        (role.ButtonText, colors.text),
        (role.BrightText, colors.bad),
        (role.Highlight, colors.accent),
        (role.HighlightedText, colors.on_accent),
        (role.Accent, colors.accent),
        (role.Link, colors.accent),
        (role.LinkVisited, colors.accent),
        (role.ToolTipBase, colors.raised),
        (role.ToolTipText, colors.text),
        (role.Light, colors.raised),
        (role.Midlight, colors.raised),
        (role.Mid, colors.line),
        (role.Dark, colors.edge),
        (role.Shadow, colors.window),
    ):
        palette.setColor(name, QColor(color))
    for name in (role.WindowText, role.Text, role.ButtonText):
        palette.setColor(QPalette.ColorGroup.Disabled, name, QColor(colors.muted))
    return palette
