"""The operator view: a window in large letters, legible from the cone."""

from dataclasses import dataclass, field

from PySide6.QtCore import QRect, Qt, Signal
from PySide6.QtGui import QCloseEvent, QGuiApplication, QKeyEvent, QResizeEvent, QScreen
from PySide6.QtWidgets import QProgressBar, QWidget
from typing_extensions import override

from lightpen_app.look.layouts import grid_layout, vertical_layout
from lightpen_app.look.theme import GRID, Tone, letters_for
from lightpen_app.look.words import PARTED
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import FittedText
from lightpen_app.widgets.posture_dial import DialValue, PostureDial
from lightpen_app.widgets.state_banner import State, StateBanner

DISTANCES_M = (1, 2, 3, 4, 6)
DIAL_SHARE, SIDE_SHARE = 9, 11  # of the width
NOTICE_SHARE, SMALL_SHARE = 0.12, 0.06  # of the height, at most
LEAST_SHARE = 1 / 18  # of the height; smaller letters would leave it empty
LEGEND_SHARE = 0.04  # of the height, at most, for the letters of the dial
LEAST_LETTERS = 0.46  # of the size for the viewing distance: 8 mm high at 3 m
USUAL_DPI = 92.0  # a 24 inch screen of 1920 x 1080
CREDIBLE_DPI = (60.0, 250.0)  # outside, a screen does not show its size


@dataclass(frozen=True, eq=False)
class OperatorValue:
    """Present content of the operator view."""

    instruction: str = ""  # instruction in a few words
    hint: str = ""  # a sentence more
    state: State = field(default_factory=State)
    count: str = ""  # such as "60 kept, 40 to go"
    time_left: str = ""  # such as "about 20 s left"; empty where nothing is waited for
    fraction: float | None = None  # fraction done, 0 to 1
    keys: str = ""  # keys of this view besides closing it
    dial: DialValue | None = None


class OperatorView(Translated, QWidget):
    """One instruction, the dial, the count and the state, of a pen and its tip.

    The letters are as large as the viewing distance asks for, where they fit; on a
    large window they are larger.
    """

    closed = Signal()  # the view was closed; nothing else ends
    advance_requested = Signal()  # Enter or PageDown
    pause_requested = Signal()  # Space

    def __init__(self) -> None:
        super().__init__(None, Qt.WindowType.Window)
        self.say(self, self.tr("Operator view"))
        self._value = OperatorValue()
        self._distance_m = 3.0
        self.setAutoFillBackground(True)

        # Widgets
        self._subject = FittedText(43, 1)
        self._notice = FittedText(43, 2)
        self._notice.hide()
        self._instruction = FittedText(86, 1)
        self._hint = FittedText(43, 1)
        self._dial = PostureDial()
        self._count = FittedText(120, 1)
        self._time_left = FittedText(43, 1)
        self._progress = QProgressBar(maximum=1000, textVisible=False)
        self._banner = StateBanner(speaks=False)  # the page shows it
        self._keys = FittedText(43, 1)

        # Layout
        self._layout = layout = grid_layout(
            self,
            spacing=(4 * GRID, GRID),
            margins=(4 * GRID, 3 * GRID, 4 * GRID, 3 * GRID),
        )
        layout.addWidget(self._subject, 0, 0, 1, 2)
        layout.addWidget(self._notice, 1, 0, 1, 2)
        layout.addWidget(self._dial, 2, 0)
        vertical_layout(
            layout,
            (self._instruction, 6),
            (self._hint, 5),
            (self._count, 3),
            self._progress,
            (self._time_left, 2),
            (self._banner, 5),
            at=(2, 1),
        )
        layout.addWidget(self._keys, 3, 0, 1, 2)
        layout.setRowStretch(2, 1)
        layout.setColumnStretch(1, SIDE_SHARE)

        self._refresh()
        self._resize_letters()

    def value(self) -> OperatorValue:
        """Return the value."""
        return self._value

    def set_value(self, value: OperatorValue) -> None:
        """Show something else."""
        self._value = value
        self._instruction.set_text(value.instruction)
        self._hint.set_text(value.hint, bold=False)
        self._banner.set_value(value.state)
        self._count.set_text(value.count)
        self._time_left.set_text(value.time_left, Tone.QUIET, bold=False)
        for words in (self._count, self._time_left):
            words.setVisible(bool(words.text()))
        self._progress.setVisible(value.fraction is not None)
        if value.fraction is not None:
            self._progress.setValue(round(1000 * value.fraction))
        self._dial.setVisible(value.dial is not None)
        self._layout.setColumnStretch(0, 0 if value.dial is None else DIAL_SHARE)
        self._layout.setHorizontalSpacing(0 if value.dial is None else 4 * GRID)
        if value.dial is not None:
            self._dial.set_value(value.dial)
        self._show_keys()
        self._resize_letters()

    def set_subject(self, text: str, is_marked: bool = False) -> None:
        """Show the item under calibration.

        What is marked must not be used for measuring, as the text states.
        """
        tone = Tone.WARN if is_marked else Tone.QUIET
        self._subject.set_text(text, tone, bold=is_marked)

    def set_notice(self, text: str) -> None:
        """Show a sentence that must be read, or none."""
        self._notice.set_text(text, Tone.BAD)
        self._notice.setVisible(bool(text))
        self._resize_letters()

    def set_distance_m(self, distance_m: float) -> None:
        """Size the letters for another viewing distance, m."""
        self._distance_m = distance_m
        self._resize_letters()

    def letters(self) -> int:
        """Return the size of letters for the viewing distance, px."""
        return letters_for(self._distance_m, _dots_per_inch(self.screen()))

    def open_beside(self, window: QWidget) -> None:
        """Fill a screen other than the one of the given window, if there is one."""
        other = other_screen(window.screen(), QGuiApplication.screens())
        self.setScreen(other)
        self.setGeometry(QRect(other.geometry()))
        self._resize_letters()
        self.showFullScreen()
        self.activateWindow()

    @override
    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._resize_letters()

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        match event.key():
            case Qt.Key.Key_Escape:
                self.close()
            case Qt.Key.Key_Return | Qt.Key.Key_Enter | Qt.Key.Key_PageDown:
                self.advance_requested.emit()
            case Qt.Key.Key_Space:
                self.pause_requested.emit()
            case _:
                super().keyPressEvent(event)

    @override
    def closeEvent(self, event: QCloseEvent) -> None:
        super().closeEvent(event)
        self.closed.emit()

    def _resize_letters(self) -> None:
        letters = max(self.letters(), self.height() * LEAST_SHARE)
        self._instruction.set_largest(letters * 1.2)
        self._hint.set_largest(letters * 0.6)
        self._notice.set_largest(letters * LEAST_LETTERS)
        for quiet in (self._subject, self._time_left, self._keys):
            quiet.set_largest(letters * LEAST_LETTERS)
        least = min(letters * LEAST_LETTERS, self.height() * LEGEND_SHARE)
        self._dial.set_least_letters(least)
        is_digit = len(self._value.count) == 1
        self._count.set_largest(letters * (2.4 if is_digit else 1.2))
        has_room = self._value.dial is None
        self._banner.set_word_size(letters * (1.6 if has_room else 1.0))
        for widget, share in (
            (self._notice, NOTICE_SHARE),
            (self._subject, SMALL_SHARE),
            (self._keys, SMALL_SHARE),
        ):
            room = round(self.height() * share)
            widget.setFixedHeight(min(widget.sizeHint().height(), room))

    def _refresh(self) -> None:
        self._show_keys()

    def _show_keys(self) -> None:
        keys = self._value.keys, self.tr("Esc: leave this view")
        self._keys.set_text(PARTED.join(filter(None, keys)), Tone.QUIET, bold=False)


def other_screen(present: QScreen, screens: list[QScreen]) -> QScreen:
    """Return a screen other than the present one, or that one if it is alone."""
    return next((screen for screen in screens if screen != present), present)


def _dots_per_inch(screen: QScreen) -> float:
    """Return the pixels per inch of a screen, or a default."""
    dpi = screen.physicalDotsPerInch()
    low, high = CREDIBLE_DPI
    return dpi if low <= dpi <= high else USUAL_DPI
