"""The tips of a pen that can be calibrated next, each by one click."""

from collections.abc import Sequence

from PySide6.QtCore import Signal
from PySide6.QtGui import QIcon
from PySide6.QtWidgets import QHBoxLayout, QWidget

from lightpen.record.next_tips import NextTip
from lightpen.record.standing import Standings, TipStanding
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import PARTED, shortened
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.sign_label import Remark
from lightpen_app.widgets.standing_mark import remark_icon, standing_remark
from lightpen_app.widgets.translated import Translated

LONGEST = 12  # characters of a tip on its button


class NextTipsRow(Translated, QWidget):
    """Shows other tips with how each stands; hidden while there is none.

    Signals
    -------
    chosen(NextTip)
        It is to be calibrated.
    """

    chosen = Signal(object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._value: tuple[NextTip, ...] = ()
        self._buttons: list[PushButton] = []
        self._standings = Standings()

        # Widgets
        self._label = text_label(TextSize.SMALL, Tone.QUIET)

        # Layout
        self._layout = QHBoxLayout(self)
        self._layout.setContentsMargins(0, 0, 0, 0)
        self._layout.setSpacing(GRID)
        self._layout.addWidget(self._label)

        self._retranslate()
        self.hide()

    def value(self) -> tuple[NextTip, ...]:
        """Return the tips that are shown."""
        return self._value

    def set_standings(self, standings: Standings) -> None:
        """Mark the tips as they stand."""
        self._standings = standings
        self._retranslate()

    def set_value(self, value: Sequence[NextTip]) -> None:
        """Show other tips, or none."""
        self._value = tuple(value)
        while self._buttons:
            button = self._buttons.pop()
            self._layout.removeWidget(button)
            button.deleteLater()
        for each in self._value:
            button = PushButton(0)
            button.clicked.connect(lambda _=False, each=each: self.chosen.emit(each))
            self._buttons.append(button)
            self._layout.addWidget(button)
        self.setVisible(bool(value))
        self._retranslate()

    def _retranslate(self) -> None:
        self._label.setText(self.tr("Next tip"))
        for button, each in zip(self._buttons, self._value, strict=True):
            tip, mark = each.tip, self._mark_of(each)
            button.setText(shortened(tip, LONGEST))
            button.setIcon(remark_icon(mark, self) if mark.text else QIcon())
            name = self.tr("Next tip {0}").format(tip)
            button.setAccessibleName(name)
            button.setAccessibleDescription(mark.text)
            told = self.tr("Calibrate tip {0} next, with its ball and nominal centre")
            button.setToolTip(PARTED.join(filter(None, (told.format(tip), mark.text))))

    def _mark_of(self, each: NextTip) -> Remark:
        """Return what is the matter with a tip: overdue, or not calibrated."""
        if each.last is not None and each.last.is_simulated:
            return Remark()
        standing = self._standings.of_tip(each.pen, each.tip)
        return Remark() if standing is TipStanding.VALID else standing_remark(standing)
