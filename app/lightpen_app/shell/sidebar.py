"""The left side of the window: item, steps and help."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum, auto

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtWidgets import QFrame, QLabel, QWidget
from typing_extensions import override

from lightpen.model.names import Origin
from lightpen.record.library.tip_library import StationStatus
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import Preparation
from lightpen.swing.status import SwingStatus
from lightpen_app.look.layouts import fill, vertical_layout
from lightpen_app.look.signs import SIDE, Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, set_styled, text_label
from lightpen_app.look.words import PARTED, set_tooltip, shortened
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import PageScroll, SizeClass
from lightpen_app.widgets.state_banner import (
    SignLabel,
    StatusMessage,
    origin_message,
    subject_message,
)


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


def list_steps(
    statuses: Sequence[Status], now: int, *, is_reason_said: bool = False
) -> tuple[Step, ...]:
    """Return the steps when the page of index `now` is shown.

    The page that is shown is never closed, and going back is always free: a step
    before it is closed only by its own reason. No reason is shown where the page says
    itself what is missing.
    """
    steps = [
        _step(status, is_now=index == now) for index, status in enumerate(statuses)
    ]
    closed = [i for i, step in enumerate(steps) if step.state is StepState.CLOSED]
    for index in closed[:1] if not is_reason_said else ():
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


INDENT = 33  # px, of a reason, below the words of its step
MARKS = {
    StepState.DONE: (Sign.CHECK, Tone.GOOD),
    StepState.DOUBTFUL: (Sign.WARNING, Tone.WARN),
    StepState.NOW: (Sign.PLAY, Tone.ACTIVE),
    StepState.TO_DO: (Sign.RING, Tone.QUIET),
    StepState.CLOSED: (Sign.LOCK, Tone.QUIET),
}


class StepButton(Translated, PushButton):
    """One step: its sign and its name."""

    def __init__(self, step: Step) -> None:
        super().__init__(0)
        self._step = step
        self.setFlat(True)
        self.setIconSize(QSize(SIDE, SIDE))
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # a click leads to the page
        self._refresh()

    def value(self) -> Step:
        """Return the step shown."""
        return self._step

    def set_value(self, step: Step) -> None:
        """Show another state of the step."""
        if step != self._step:
            self._step = step
            self._refresh()

    @override
    def _refresh(self) -> None:
        words = {
            StepState.DONE: self.tr("done"),
            StepState.DOUBTFUL: self.tr("done, check needed"),
            StepState.NOW: self.tr("now"),
            StepState.TO_DO: self.tr("to do"),
            StepState.CLOSED: self.tr("closed"),
        }
        state = self._step.state
        self.setText(self._step.title)
        self.set_mark(*MARKS[state])
        set_styled(self, "step", state.name)
        self.setAccessibleName(f"{self._step.title}, {words[state]}")
        self.setAccessibleDescription(self._step.why_closed)


class StepList(Translated, QWidget):
    """List of the steps, with the reason of one that is closed.

    A click, Space or Enter requests a step.
    """

    step_chosen = Signal(int)  # index of the step, which may be closed

    def __init__(self) -> None:
        super().__init__()
        self.say(self, self.tr("Steps"))
        self._buttons: list[StepButton] = []
        self._reasons: list[QLabel] = []
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
        side = GRID // 2 if narrow else GRID
        self._layout.setContentsMargins(side, 0, side, 0)

    def set_steps(self, steps: Sequence[Step]) -> None:
        """Show these steps; there are no fewer than before."""
        for index in range(len(self._buttons), len(steps)):
            button = StepButton(steps[index])
            button.clicked.connect(lambda _=False, at=index: self.step_chosen.emit(at))
            reason = text_label(TextSize.SMALL, Tone.QUIET)
            reason.setContentsMargins(INDENT, 0, 0, GRID)
            self._buttons.append(button)
            self._reasons.append(reason)
            fill(self._layout, button, reason)
        shown = zip(self._buttons, self._reasons, steps, strict=False)
        for button, reason, step in shown:
            button.set_value(step)
            reason.setText(step.why_closed)
            reason.setVisible(step.shows_reason)


WIDTH, NARROW_WIDTH = 30 * GRID, 18 * GRID


@dataclass(frozen=True)
class Subject:
    """Item under calibration, as shown beside the steps."""

    names: Names  # names of the swing, or the selected ones without a swing
    origin: Origin | None  # of the images; None if the swing does not state it
    statuses: StationStatus = field(default_factory=StationStatus)  # of all tips


def subject_of(
    status: SwingStatus, chosen: Preparation, statuses: StationStatus
) -> Subject:
    """Return the item of the current swing, or the selected one."""
    if status.state is not None:
        return Subject(status.names, status.origin, statuses)
    has_files = chosen.camera_file is not None or chosen.pen_file is not None
    origin = chosen.origin if has_files else Origin.LIVE  # nothing is chosen yet
    return Subject(chosen.names, origin, statuses)


class Sidebar(Translated, QFrame):
    """The steps, with buttons for the functions of the function keys."""

    step_chosen = Signal(int)  # index of the step, which may be closed
    # The item under calibration and the origin of its images, in one line; whether some
    # of it must not be used for measuring.
    subject_changed = Signal(str, bool)

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("sidebar")
        self._room = SizeClass()

        # Widgets
        self._name = self.say(text_label(TextSize.LEAD), self.tr("Pen tip calibration"))
        self._subject = text_label(TextSize.SMALL, Tone.QUIET)
        self._origin = SignLabel()
        self._status = SignLabel()
        self._remark = SignLabel()
        self._steps = StepList()
        self.operator_view = PushButton()
        self.help = PushButton()
        self.options = PushButton()
        buttons = (self.operator_view, self.help, self.options)

        # Layout
        self._layout = layout = vertical_layout(self)
        self._head = vertical_layout(layout, self._name, self._subject)
        self._head.setSpacing(GRID // 2)
        fill(self._head, self._status, self._origin, self._remark)
        content = QWidget()
        self._content = vertical_layout(content, self._steps, 1)
        self._scroll = PageScroll()
        self._scroll.setWidget(content)
        fill(layout, (self._scroll, 1))
        self._foot = vertical_layout(layout, *buttons, spacing=0)
        for button in buttons:
            button.setFlat(True)

        # Connections
        self._steps.step_chosen.connect(self.step_chosen)
        self._scroll.height_changed.connect(self._reveal_present)

        self._value = Subject(Names(), Origin.LIVE)
        self.set_room(SizeClass())

    def steps(self) -> tuple[Step, ...]:
        """Return the steps shown."""
        return self._steps.steps()

    def set_steps(self, steps: Sequence[Step]) -> None:
        """Show these steps."""
        self._steps.set_steps(steps)
        self._reveal_present()

    def subject(self) -> str:
        """Return the item as text, one line for each name."""
        return self._subject.text()

    def set_subject(self, subject: Subject) -> None:
        """Show the item and the origin of its images."""
        if subject != self._value:
            self._value = subject
            self._show_subject()

    def set_remark(self, remark: StatusMessage) -> None:
        """Show what an extension remarks on every page."""
        self._remark.set_value(remark)

    def _reveal_present(self) -> None:
        present = self._steps.present()
        if present is not None:
            self._content.activate()  # a reason may have appeared
            self._scroll.ensureWidgetVisible(present, 0, 0)

    def _show_subject(self) -> None:
        names = self._value.names
        named = (
            (self.tr("Pen {0}"), names.pen),
            (self.tr("Tip {0}"), names.tip),
            (self.tr("Cone {0}"), names.cone),
        )
        parts = [words.format(name) for words, name in named if name]
        margins, metrics = self._head.contentsMargins(), self._subject.fontMetrics()
        width = self.width() - margins.left() - margins.right()
        right = Qt.TextElideMode.ElideRight
        shown = [metrics.elidedText(part, right, width) for part in parts]
        self._subject.setText("\n".join(shown))
        set_tooltip(self._subject, "\n".join(parts) if shown != parts else "")
        self._subject.setVisible(bool(parts))
        status = subject_message(names, self._value.origin, self._value.statuses)
        self._status.set_value(status)
        origin = origin_message(self._value.origin)
        self._origin.set_value(origin)
        line = filter(None, (*map(shortened, parts), status.text, origin.text))
        self.subject_changed.emit(PARTED.join(line), bool(status.text))

    def set_room(self, room: SizeClass) -> None:
        """Become narrower in a small window."""
        self._room = room
        narrow = room.is_narrow
        self.setFixedWidth(NARROW_WIDTH if narrow else WIDTH)
        if narrow:
            self._head.setContentsMargins(GRID, 0, GRID, GRID)
        else:
            self._head.setContentsMargins(5 * GRID // 2, 0, 2 * GRID, 2 * GRID)
        side = 0 if narrow else GRID
        self._foot.setContentsMargins(side, 0, side, 0)
        top, bottom = (GRID, GRID) if room.is_low else (3 * GRID, 2 * GRID)
        self._layout.setContentsMargins(0, top, 0, bottom)
        self._name.setVisible(not room.is_low)  # the title of the window shows it
        self._steps.set_narrow(narrow)
        self._refresh()

    def _refresh(self) -> None:
        self._show_subject()
        for button, text, key in (
            (self.operator_view, self.tr("Operator view"), "F11"),
            (self.help, self.tr("Help"), "F1"),
            (self.options, self.tr("Options"), "F10"),
        ):
            with_key = f"{text}  \u00b7  {key}"
            button.setText(text if self._room.is_narrow else with_key)
            set_tooltip(button, with_key if self._room.is_narrow else "")
            button.setAccessibleName(text)
