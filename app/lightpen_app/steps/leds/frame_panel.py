"""The pen in space, and the check of its frame."""

import math

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QGroupBox

from lightpen.pen_check.draft import FrameCheck, Rule, RuleCheck, RuleStatus
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import fill, grid_layout, vertical_layout
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import set_tooltip
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.pen_view import PenPicture, PenView
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage

SIGNS = {
    RuleStatus.MET: (Sign.CHECK, Tone.GOOD),
    RuleStatus.BROKEN: (Sign.CROSS, Tone.BAD),
}
LONG = (Rule.LINE, Rule.ORIGIN, Rule.AXIS, Rule.PLANE)  # that have a deviation


class FramePanel(Translated, QGroupBox):
    """Draws a pen and lists the rules of its frame."""

    led_chosen = Signal(int)  # the LED of this number was clicked
    move_requested = Signal()  # transform the coordinates into the pen frame

    def __init__(self) -> None:
        super().__init__()
        self.say(self, self.tr("Pen and pen frame"))
        self._value: FrameCheck | None = None

        # Widgets
        self.view = PenView()
        self._rules = {rule: SignLabel() for rule in Rule}
        self._amounts = {rule: text_label(TextSize.SMALL, Tone.QUIET) for rule in LONG}
        self._layout_note = SignLabel()
        self._move = self.make_button(
            self.tr("Transform to pen frame"),
            self.move_requested,
            tip=self.tr(
                "The coordinates are in another frame, for example of a measuring "
                "machine."
            ),
        )

        # Layout
        layout = vertical_layout(self, (self.view, 1))
        grid = grid_layout(layout, spacing=(GRID, GRID // 4))
        grid.setColumnStretch(0, 1)
        for row, rule in enumerate(Rule):
            grid.addWidget(self._rules[rule], row, 0, 1, 1 if rule in LONG else 2)
            if rule in LONG:
                self._amounts[rule].setWordWrap(False)
                right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
                grid.addWidget(self._amounts[rule], row, 1, right)
        fill(layout, self._layout_note, self._move)

        # Connections
        self.view.led_chosen.connect(self.led_chosen)

        self._retranslate()

    def set_picture(self, picture: PenPicture) -> None:
        """Draw another pen."""
        self.view.set_value(picture)

    def set_value(self, value: FrameCheck | None) -> None:
        """List the checks of another pen; None clears the list."""
        self._value = value
        self._refresh()

    def _retranslate(self) -> None:
        self._refresh()

    def _refresh(self) -> None:
        value = self._value
        checks = {} if value is None else {each.rule: each for each in value.checks}
        for rule in Rule:
            self._show(rule, checks.get(rule))
        self._move.setVisible(value is not None and value.can_be_moved)
        note = StatusMessage()
        if value is not None and value.remark:
            words = self.tr(
                "Other layout than the ten-LED pen; the frame of the file is used "
                "as is."
            )
            note = StatusMessage(words, Sign.WARNING, Tone.QUIET)
            set_tooltip(self._layout_note, worded(value.remark))
        self._layout_note.set_value(note)

    def _show(self, rule: Rule, check: RuleCheck | None) -> None:
        label, amount = self._rules[rule], self._amounts.get(rule)
        known = check is not None and not math.isnan(check.amount)
        if amount is not None:
            amount.setVisible(known)
            amount.setText(_length(check.amount) if check is not None else "")
        if check is None or check.outcome is RuleStatus.OPEN:
            label.set_value(StatusMessage())
            return
        label.set_value(StatusMessage(self._words(rule), *SIGNS[check.outcome]))
        met = check.outcome is RuleStatus.MET
        outcome = self.tr("fulfilled") if met else self.tr("not fulfilled")
        label.setAccessibleDescription(outcome)
        set_tooltip(label, outcome)

    def _words(self, rule: Rule) -> str:
        match rule:
            case Rule.LEDS:
                return self.tr("LED spacing")
            case Rule.NUMBERS:
                return self.tr("LED numbering")
            case Rule.LINE:
                return self.tr("LEDs 1-4 on a line")
            case Rule.ORIGIN:
                return self.tr("LED 1 at x = y = 0")
            case Rule.AXIS:
                return self.tr("y axis along LEDs 1-4")
            case Rule.PLANE:
                return self.tr("LEDs 5-10 at z = 0")
            case Rule.HANDED:
                return self.tr("Right-handed axes")
            case Rule.NORMALS:
                return self.tr("Discs facing the viewer")


def _length(amount: float) -> str:
    """Return a length with some three digits."""
    return f"{amount:.2f} mm" if amount < 10 else f"{amount:.0f} mm"
