"""The left side of the window: item, steps and help."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from PySide6.QtCore import QPoint, Qt, Signal
from PySide6.QtWidgets import QFrame, QWidget

from lightpen.model.origin import Origin
from lightpen.record.library.calibration_status import StationStatus
from lightpen.record.swings.names import Names
from lightpen.swing.preparation import Preparation
from lightpen.swing.status import SwingStatus
from lightpen_app.look.layouts import fill, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.tooltips import set_tooltip
from lightpen_app.look.words import PARTED, shortened
from lightpen_app.shell.step_list import Step, StepList
from lightpen_app.widgets.origin_mark import origin_message
from lightpen_app.widgets.page_scroll import PageScroll
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.responsive_layout import SizeClass
from lightpen_app.widgets.sign_label import SignLabel, StatusMessage
from lightpen_app.widgets.status_mark import subject_message
from lightpen_app.widgets.translated import Translated

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
    # The buttons.
    operator_view_chosen = Signal()
    help_chosen = Signal()
    options_chosen = Signal()
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
        self._operator_view = PushButton()
        self._help = PushButton()
        self._options = PushButton()
        buttons = (self._operator_view, self._help, self._options)

        # Layout
        self._layout = layout = vertical_layout(self)
        self._head = vertical_layout(layout, self._name, self._subject)
        self._head.setSpacing(GRID // 2)
        fill(self._head, self._status, self._origin, self._remark)
        content = QWidget()
        vertical_layout(content, self._steps, 1)
        self._scroll = PageScroll()
        self._scroll.setWidget(content)
        fill(layout, (self._scroll, 1))
        self._foot = vertical_layout(layout, *buttons, spacing=0)
        for button in buttons:
            button.setFlat(True)

        # Connections
        self._steps.step_chosen.connect(self.step_chosen)
        self._operator_view.clicked.connect(self.operator_view_chosen)
        self._help.clicked.connect(self.help_chosen)
        self._options.clicked.connect(self.options_chosen)
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

    def subject_status(self) -> StatusMessage:
        """Return the item that must not be used for measuring."""
        return self._status.value()

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
        self._retranslate()

    def options_corner(self) -> QPoint:
        """Return the screen position of the top left of the options button."""
        return self._options.mapToGlobal(QPoint(0, 0))

    def _retranslate(self) -> None:
        self._show_subject()
        for button, text, key in (
            (self._operator_view, self.tr("Operator view"), "F11"),
            (self._help, self.tr("Help"), "F1"),
            (self._options, self.tr("Options"), "F10"),
        ):
            with_key = f"{text}  \u00b7  {key}"
            button.setText(text if self._room.is_narrow else with_key)
            set_tooltip(button, with_key if self._room.is_narrow else "")
            button.setAccessibleName(text)
