"""One state, by a word, a sign and a colour, to be read from a distance."""

from dataclasses import dataclass

from PySide6.QtCore import QRectF, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QShowEvent
from PySide6.QtWidgets import QSizePolicy, QWidget
from typing_extensions import override

from lightpen_app.look.announcements import announce
from lightpen_app.look.signs import Sign, draw_sign
from lightpen_app.look.theme import GRID, TextSize, Tone, colors_of, font
from lightpen_app.widgets.fitted_text import fitted_size


@dataclass(frozen=True)
class State:
    """What the program is doing.

    Attributes
    ----------
    word : str
        One or two words.
    detail : str
        A sentence.
    sign, tone
        Its shape and colour.
    fraction : float or None
        How far a wait has come, 0 to 1; drawn as a ring about the sign.
    """

    word: str = ""
    detail: str = ""
    sign: Sign = Sign.NONE
    tone: Tone = Tone.PLAIN
    fraction: float | None = None


class StateBanner(QWidget):
    """A filled area with a sign, a word and a sentence.

    A screen reader is told each new word with its sentence, once all is shown that
    belongs to it: what stands only in passing is not told.

    Parameters
    ----------
    word_size : float
        Size of the word, px; the sentence is half of it, at least `TextSize.BODY`.
    speaks : bool
        Whether a screen reader is told; not where another banner says the same.

    Signals
    -------
    announced(str)
        What is said aloud where somebody listens.
    """

    announced = Signal(str)

    def __init__(
        self,
        word_size: float = TextSize.DISPLAY,
        parent: QWidget | None = None,
        *,
        speaks: bool = True,
    ) -> None:
        super().__init__(parent)
        self._value = State()
        self._speaks = speaks
        self._speaking = QTimer(self)
        self._speaking.setSingleShot(True)
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
            self.updateGeometry()
            self.update()

    @override
    def sizeHint(self) -> QSize:
        height = 1.4 * self._word_size + 1.5 * self._detail_size + 3 * GRID
        return QSize(round(7 * self._word_size), round(height / GRID + 0.5) * GRID)

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(200, 8 * GRID)

    @property
    def _detail_size(self) -> float:
        return max(0.45 * self._word_size, TextSize.BODY)

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
        share = 0.62 if state.detail else 1.0
        word_box = QRectF(box.left(), box.top(), box.width(), box.height() * share)
        single = int(Qt.TextFlag.TextSingleLine | Qt.AlignmentFlag.AlignVCenter)
        size = fitted_size(
            state.word, word_box, self._word_size, bold=True, flags=single
        )
        painter.setFont(font(size, bold=True))
        painter.drawText(word_box, single, state.word)
        if state.detail:
            detail_box = box.adjusted(0, word_box.height(), 0, 0)
            wrapped = int(Qt.TextFlag.TextWordWrap | Qt.AlignmentFlag.AlignTop)
            size = fitted_size(
                state.detail, detail_box, self._detail_size, bold=False, flags=wrapped
            )
            painter.setFont(font(size))
            painter.drawText(detail_box, wrapped, state.detail)
