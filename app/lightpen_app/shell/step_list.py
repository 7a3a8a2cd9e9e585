"""The list of steps: done, current, to do, or unavailable with the reason."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum, auto

from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QAbstractButton, QSizePolicy, QWidget
from typing_extensions import override

from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.signs import Sign, draw_sign
from lightpen_app.look.theme import GRID, TextSize, Tone, colors_of, font
from lightpen_app.widgets.translated import Translated


class StepState(Enum):
    """State of a step."""

    DONE = auto()
    DOUBTFUL = auto()
    NOW = auto()
    TO_DO = auto()
    CLOSED = auto()


@dataclass(frozen=True)
class Status:
    """Status of a page."""

    title: str
    complete: bool  # whether the step has all its inputs
    why_closed: str  # why the step cannot be entered; empty when it can
    doubtful: bool = False  # whether it was completed despite warnings


@dataclass(frozen=True)
class Step:
    """A step as the list shows it."""

    title: str
    state: StepState
    why_closed: str = ""  # a sentence for a closed step, else empty
    # Whether the sentence is shown; only the first closed step does.
    shows_reason: bool = False


def list_steps(statuses: Sequence[Status], now: int) -> tuple[Step, ...]:
    """Return the steps when the page of index `now` is shown.

    The page that is shown is never closed, and going back is always free: a step
    before it is closed only by its own reason.
    """
    steps = [
        _step(status, is_now=index == now) for index, status in enumerate(statuses)
    ]
    closed = [i for i, step in enumerate(steps) if step.state is StepState.CLOSED]
    for index in closed[:1]:
        steps[index] = replace(steps[index], shows_reason=True)
    return tuple(steps)


def _step(status: Status, *, is_now: bool) -> Step:
    if is_now:
        return Step(status.title, StepState.NOW)
    if status.why_closed:
        return Step(status.title, StepState.CLOSED, status.why_closed)
    done = StepState.DOUBTFUL if status.doubtful else StepState.DONE
    state = done if status.complete else StepState.TO_DO
    return Step(status.title, state)


SIGN_SIZE = 2 * GRID
SIGN_LEFT, NARROW_SIGN_LEFT = 5 * GRID // 2, 3 * GRID // 2
TEXT_LEFT, NARROW_TEXT_LEFT = 6 * GRID, 9 * GRID // 2
WRAPPED = int(Qt.TextFlag.TextWordWrap)
MARKS = {
    StepState.DONE: (Sign.CHECK, Tone.GOOD),
    StepState.DOUBTFUL: (Sign.WARNING, Tone.WARN),
    StepState.NOW: (Sign.PLAY, Tone.ACTIVE),
    StepState.TO_DO: (Sign.RING, Tone.QUIET),
    StepState.CLOSED: (Sign.LOCK, Tone.QUIET),
}


class StepButton(Translated, QAbstractButton):
    """One step: its sign, its name, and why it is closed."""

    def __init__(self, step: Step, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._step = step
        self._is_narrow = False
        policy = QSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        policy.setHeightForWidth(True)
        self.setSizePolicy(policy)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # a click leads to the page
        self.setAttribute(Qt.WidgetAttribute.WA_Hover)
        self._retranslate()

    def value(self) -> Step:
        """Return the step shown."""
        return self._step

    def set_value(self, step: Step) -> None:
        """Show another state of the step."""
        if step != self._step:
            self._step = step
            self._retranslate()
            self.updateGeometry()
            self.update()

    def set_narrow(self, narrow: bool) -> None:
        """Draw the sign and the words nearer to the edge and to each other."""
        self._is_narrow = narrow
        self.updateGeometry()
        self.update()

    @override
    def sizeHint(self) -> QSize:
        width = (16 if self._is_narrow else 28) * GRID
        return QSize(width, self.heightForWidth(width))

    @override
    def heightForWidth(self, width: int) -> int:
        height = 5 * GRID
        if self._step.shows_reason:
            height += round(self._reason_height(width)) + GRID
        return height

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        step = self._step
        colors = colors_of(self.palette())
        sign, tone = MARKS[step.state]
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        edge = GRID / 2 if self._is_narrow else GRID
        box = QRectF(self.rect()).adjusted(edge, 0, -edge, 0)
        if step.state is StepState.NOW or self.underMouse():
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(colors.raised))
            painter.drawRoundedRect(box, 6, 6)
        if self.hasFocus():
            painter.setPen(QPen(QColor(colors.accent), 2))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRoundedRect(box.adjusted(1, 1, -1, -1), 6, 6)
        left = NARROW_SIGN_LEFT if self._is_narrow else SIGN_LEFT
        mark = QRectF(left, 1.5 * GRID, SIGN_SIZE, SIGN_SIZE)
        draw_sign(painter, mark, sign, colors.tone(tone))
        now = step.state is StepState.NOW
        bright = step.state not in (StepState.TO_DO, StepState.CLOSED)
        painter.setPen(QColor(colors.text if bright else colors.muted))
        painter.setFont(font(TextSize.BODY, bold=now))
        name = QRectF(
            self._text_left, 0, self.width() - self._text_left - GRID, 5 * GRID
        )
        painter.drawText(name, Qt.AlignmentFlag.AlignVCenter, step.title)
        if step.shows_reason:
            painter.setPen(QColor(colors.muted))
            painter.setFont(font(TextSize.SMALL))
            reason = QRectF(
                self._text_left,
                4.5 * GRID,
                self._reason_width(self.width()),
                self.height(),
            )
            painter.drawText(reason, WRAPPED, step.why_closed)

    @property
    def _text_left(self) -> int:
        return NARROW_TEXT_LEFT if self._is_narrow else TEXT_LEFT

    def _reason_width(self, width: int) -> float:
        return width - self._text_left - (1 if self._is_narrow else 2) * GRID

    def _reason_height(self, width: int) -> float:
        metrics = QFontMetricsF(font(TextSize.SMALL))
        room = QRectF(0, 0, self._reason_width(width), 1e4)
        return metrics.boundingRect(room, WRAPPED, self._step.why_closed).height()

    @override
    def _retranslate(self) -> None:
        words = {
            StepState.DONE: self.tr("done"),
            StepState.DOUBTFUL: self.tr("done, check needed"),
            StepState.NOW: self.tr("now"),
            StepState.TO_DO: self.tr("to do"),
            StepState.CLOSED: self.tr("closed"),
        }
        self.setAccessibleName(f"{self._step.title}, {words[self._step.state]}")
        self.setAccessibleDescription(self._step.why_closed)


class StepList(Translated, QWidget):
    """List of the steps; a click, Space or Enter requests one."""

    step_chosen = Signal(int)  # index of the step, which may be closed

    def __init__(self) -> None:
        super().__init__()
        self.say(self, self.tr("Steps"))
        self._buttons: list[StepButton] = []
        self._is_narrow = False
        self._layout = vertical_layout(self, spacing=GRID // 2)

    def steps(self) -> tuple[Step, ...]:
        """Return the steps shown."""
        return tuple(button.value() for button in self._buttons)

    def present(self) -> StepButton | None:
        """Return the button of the current step."""
        found = (b for b in self._buttons if b.value().state is StepState.NOW)
        return next(found, None)

    def set_narrow(self, narrow: bool) -> None:
        """Show the steps narrow or wide."""
        self._is_narrow = narrow
        for button in self._buttons:
            button.set_narrow(narrow)

    def set_steps(self, steps: Sequence[Step]) -> None:
        """Show these steps."""
        for button, step in zip(self._buttons, steps, strict=False):
            button.set_value(step)
        for index in range(len(self._buttons), len(steps)):
            button = StepButton(steps[index], self)
            button.set_narrow(self._is_narrow)
            button.clicked.connect(lambda _=False, at=index: self.step_chosen.emit(at))
            self._buttons.append(button)
            self._layout.addWidget(button)
        while len(self._buttons) > len(steps):
            button = self._buttons.pop()
            self._layout.removeWidget(button)
            button.deleteLater()
