"""The state of the current task and of an item: banner, marks and signs."""

from dataclasses import dataclass
from math import ceil
from typing import Self

from PySide6.QtCore import QCoreApplication, QRectF, QSize, Qt, QTimer, Signal
from PySide6.QtGui import (
    QColor,
    QFontMetricsF,
    QPainter,
    QPaintEvent,
    QResizeEvent,
    QShowEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget
from typing_extensions import override

from lightpen.model.names import Origin
from lightpen.record.library.tip_library import ItemKind, StationStatus, TipStatus
from lightpen.record.swings.header import Names
from lightpen_app.look.layouts import announce, horizontal_layout
from lightpen_app.look.phrases import origin_text
from lightpen_app.look.signs import SIDE, Sign, draw_sign
from lightpen_app.look.theme import (
    GRID,
    TextSize,
    Tone,
    colors_of,
    font,
    set_tone,
    text_label,
)
from lightpen_app.look.translatable import QT_TRANSLATE_NOOP
from lightpen_app.look.words import PARTED, breakable, phrases_whole
from lightpen_app.widgets.fitting import WRAPPED, fitted_size


@dataclass(frozen=True)
class State:
    """State of the program."""

    word: str = ""  # one or two words
    detail: str = ""  # a sentence
    sign: Sign = Sign.NONE
    tone: Tone = Tone.PLAIN
    # Progress of a wait, 0 to 1; drawn as a ring about the sign.
    fraction: float | None = None


class StateBanner(QWidget):
    """A filled area with a sign, a word and a sentence.

    A screen reader announces each new word with its sentence, once all is shown that
    belongs to it: transient texts are not announced.

    Parameters
    ----------
    word_size : float
        Size of the word, px; the sentence is half of it, at least `TextSize.BODY`, and
        no smaller than `TextSize.SMALL` however long it is: the banner grows.
    speaks : bool
        Whether a screen reader announces it; not where another banner says the same.
    """

    announced = Signal(str)  # text for screen readers

    def __init__(
        self, word_size: float = TextSize.DISPLAY, *, speaks: bool = True
    ) -> None:
        super().__init__()
        self._value = State()
        self._long_height = 0  # px; 0 while the sentence is short
        self._speaks = speaks
        self._speaking = QTimer(self, singleShot=True)
        self._word_size = word_size
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Maximum)

        # Connections
        self._speaking.timeout.connect(self._announce)

    def value(self) -> State:
        """Return the state shown."""
        return self._value

    def set_value(self, value: State) -> None:
        """Show another state."""
        if value == self._value:
            return
        is_new = value.word != self._value.word
        self._value = value
        self.setAccessibleName(value.word)
        self.setAccessibleDescription(value.detail)
        self._ask_room()
        self.update()
        if is_new:
            self._speaking.start()

    @override
    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if not event.spontaneous():
            self._speaking.start()

    def _announce(self) -> None:
        if not (self._speaks and self.isVisible()):
            return
        text = ". ".join(filter(None, (self._value.word, self._value.detail)))
        announce(self, text)
        self.announced.emit(text)

    def set_word_size(self, word_size: float) -> None:
        """Change the size of the word, px."""
        if word_size != self._word_size:
            self._word_size = word_size
            self._ask_room()
            self.updateGeometry()
            self.update()

    @override
    def sizeHint(self) -> QSize:
        usual = round((self._usual_height + 2 * GRID) / GRID + 0.5) * GRID
        return QSize(round(7 * self._word_size), max(usual, self._long_height))

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(200, max(8 * GRID, self._long_height))

    @override
    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._ask_room()

    def _ask_room(self) -> None:
        """Request the height at which a long sentence has the minimum font size."""
        beside = 1.1 * self._word_size + max(0.33 * self._word_size, 2 * GRID)
        width = self.width() - 4 * GRID - ceil(beside)
        metrics = QFontMetricsF(font(TextSize.SMALL))
        box = QRectF(0, 0, max(width, 1), 1e6)
        needed = metrics.boundingRect(box, WRAPPED, self._detail).height()
        is_long = self._value.detail and needed > 0.38 * self._usual_height
        height = ceil(self._word_height + needed) + 2 * GRID if is_long else 0
        if height != self._long_height:
            self._long_height = height
            self.updateGeometry()

    @property
    def _usual_height(self) -> float:
        """Height of the words, where the sentence is short, px."""
        return 1.4 * self._word_size + 1.5 * self._detail_size + GRID

    @property
    def _detail(self) -> str:
        return phrases_whole(self._value.detail)

    @property
    def _detail_size(self) -> float:
        return max(0.45 * self._word_size, TextSize.BODY)

    @property
    def _word_height(self) -> float:
        return QFontMetricsF(font(self._word_size, bold=True)).height()

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        colors = colors_of(self.palette())
        state = self._value
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        filled = state.tone not in (Tone.PLAIN, Tone.QUIET)
        ground = colors.tone(state.tone) if filled else QColor(colors.raised)
        ink = colors.on_tone(state.tone) if filled else colors.tone(state.tone)
        box = QRectF(self.rect())
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(ground)
        painter.drawRoundedRect(box, GRID, GRID)
        inner = box.adjusted(2 * GRID, GRID, -2 * GRID, -GRID)
        side = min(1.1 * self._word_size, inner.height())
        if state.sign is not Sign.NONE:
            place = QRectF(inner.left(), box.center().y() - side / 2, side, side)
            self._draw_fraction(painter, place, ink)
            shrink = 0 if state.fraction is None else side / 5
            sign_box = place.adjusted(shrink, shrink, -shrink, -shrink)
            draw_sign(painter, sign_box, state.sign, ink)
            inner.setLeft(place.right() + max(0.3 * side, 2 * GRID))
        self._draw_words(painter, inner, ink)

    def _draw_fraction(self, painter: QPainter, place: QRectF, ink: QColor) -> None:
        fraction = self._value.fraction
        if fraction is None:
            return
        pen = painter.pen()
        pen.setStyle(Qt.PenStyle.SolidLine)
        pen.setColor(ink)
        pen.setWidthF(place.width() / 10)
        painter.setPen(pen)
        painter.drawArc(place, 90 * 16, round(-360 * 16 * fraction))

    def _draw_words(self, painter: QPainter, box: QRectF, ink: QColor) -> None:
        state = self._value
        painter.setPen(ink)
        height = box.height() * (0.62 if state.detail else 1.0)
        if self._long_height:
            height = min(height, self._word_height)
        word_box = QRectF(box.left(), box.top(), box.width(), height)
        single = int(Qt.TextFlag.TextSingleLine | Qt.AlignmentFlag.AlignVCenter)
        size = fitted_size(
            state.word, word_box, self._word_size, bold=True, flags=single
        )
        painter.setFont(font(size, bold=True))
        painter.drawText(word_box, single, state.word)
        if detail := self._detail:
            detail_box = box.adjusted(0, word_box.height(), 0, 0)
            wrapped = int(Qt.TextFlag.TextWordWrap | Qt.AlignmentFlag.AlignTop)
            size = fitted_size(
                detail, detail_box, self._detail_size, bold=False, flags=wrapped
            )
            painter.setFont(font(size))
            painter.drawText(detail_box, wrapped, detail)


@dataclass(frozen=True)
class StatusMessage:
    """Message with its sign and tone."""

    text: str = ""  # empty for nothing to remark
    sign: Sign = Sign.NONE
    tone: Tone = Tone.PLAIN

    @classmethod
    def good(cls, text: str) -> Self:
        """Return a message on what is as it should be."""
        return cls(text, Sign.CHECK, Tone.GOOD)

    @classmethod
    def warning(cls, text: str) -> Self:
        """Return a message on what needs attention."""
        return cls(text, Sign.WARNING, Tone.WARN)

    @classmethod
    def fault(cls, text: str) -> Self:
        """Return a message on what failed."""
        return cls(text, Sign.CROSS, Tone.BAD)


class SignLabel(QWidget):
    """Shows a status message, in several lines if it wraps; hidden without one."""

    def __init__(self, *, wraps: bool = True) -> None:
        super().__init__()
        self._value = StatusMessage()

        # Widgets
        self._mark = _SignMark()
        self._words = text_label(TextSize.BODY)
        self._words.setWordWrap(wraps)

        # Layout
        horizontal_layout(
            self, (self._mark, 0, Qt.AlignmentFlag.AlignTop), (self._words, 1)
        )

        self.hide()

    def value(self) -> StatusMessage:
        """Return the value."""
        return self._value

    def set_value(self, value: StatusMessage) -> None:
        """Show another remark."""
        if value == self._value:
            return
        self._value = value
        self._mark.set_value(value)
        self._words.setText(breakable(value.text))
        set_tone(self._words, value.tone)
        self.setAccessibleName(value.text)
        self.setVisible(bool(value.text))


class _SignMark(QWidget):
    """The sign alone, as high as the first line of the words."""

    def __init__(self) -> None:
        super().__init__()
        self._value = StatusMessage()
        fixed = QSizePolicy.Policy.Fixed
        self.setSizePolicy(fixed, fixed)

    def set_value(self, value: StatusMessage) -> None:
        self._value = value
        self.update()

    @override
    def sizeHint(self) -> QSize:
        return QSize(SIDE, self.fontMetrics().height())

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        color = colors_of(self.palette()).tone(self._value.tone)
        painter = QPainter(self)
        draw_sign(painter, QRectF(self.rect()), self._value.sign, color)


CONTEXT = "standing"


_WORDS: dict[TipStatus, str] = {
    TipStatus.VALID: QT_TRANSLATE_NOOP("standing", "valid"),
    TipStatus.OVERDUE: QT_TRANSLATE_NOOP("standing", "OVERDUE"),
    TipStatus.UNCALIBRATED: QT_TRANSLATE_NOOP("standing", "NOT CALIBRATED"),
    TipStatus.RETIRED: QT_TRANSLATE_NOOP("standing", "RETIRED"),
}
_MARKS: dict[TipStatus, tuple[Sign, Tone]] = {
    TipStatus.VALID: (Sign.CHECK, Tone.GOOD),
    TipStatus.OVERDUE: (Sign.WARNING, Tone.WARN),
    TipStatus.UNCALIBRATED: (Sign.WARNING, Tone.WARN),
    TipStatus.RETIRED: (Sign.CROSS, Tone.BAD),
}
_OF_KIND: dict[ItemKind, str] = {
    ItemKind.PEN: QT_TRANSLATE_NOOP("standing", "Pen {0}"),
    ItemKind.TIP: QT_TRANSLATE_NOOP("standing", "Tip {0}"),
    ItemKind.CONE: QT_TRANSLATE_NOOP("standing", "Cone {0}"),
}
WORST_FIRST = (TipStatus.RETIRED, TipStatus.OVERDUE, TipStatus.UNCALIBRATED)


def status_text(status: TipStatus) -> str:
    """Return the name of a status."""
    return QCoreApplication.translate(CONTEXT, _WORDS[status])


def status_message(status: TipStatus | None) -> StatusMessage:
    """Return a remark on a status; None if unknown."""
    if status is None:
        return StatusMessage()
    return StatusMessage(status_text(status), *_MARKS[status])


def subject_message(
    names: Names, origin: Origin | None, statuses: StationStatus
) -> StatusMessage:
    """Return which of pen, tip and cone are blocked for measuring, and why.

    Simulated ones are never used for measuring.
    """
    if origin is Origin.SIMULATED:
        return StatusMessage()
    of = statuses.of_item
    found = {
        ItemKind.TIP: statuses.of_tip(names.pen, names.tip),
        ItemKind.PEN: of(ItemKind.PEN, names.pen),
        ItemKind.CONE: of(ItemKind.CONE, names.cone),
    }
    marked = {
        kind: each for kind, each in found.items() if each in WORST_FIRST and each
    }
    if not marked:
        return StatusMessage()
    words = PARTED.join(
        QCoreApplication.translate(CONTEXT, _OF_KIND[kind]).format(status_text(each))
        for kind, each in marked.items()
    )
    worst = min(marked.values(), key=WORST_FIRST.index)
    return StatusMessage(words, *_MARKS[worst])


def origin_message(origin: Origin | None) -> StatusMessage:
    """Return the remark on images that are not live; empty otherwise."""
    if origin is Origin.LIVE:
        return StatusMessage()
    tone = Tone.ACTIVE if origin is Origin.RECORDED else Tone.WARN
    return StatusMessage(origin_text(origin), Sign.RING, tone)
