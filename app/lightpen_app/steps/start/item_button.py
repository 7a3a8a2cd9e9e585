"""A button beside a name that lists the items of the tip library to choose from."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QMenu, QWidget

from lightpen_app.look.words import shortened
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.sign_label import Remark
from lightpen_app.widgets.standing_mark import remark_icon
from lightpen_app.widgets.translated import Translated


@dataclass(frozen=True)
class ItemChoice:
    """An item to choose, and how it stands."""

    name: str
    remark: Remark = field(default_factory=Remark)


class ItemButton(Translated, PushButton):
    """Opens the list; it ends with the way to the library.

    Signals
    -------
    chosen(str)
        The id of an item.
    library_requested()
    """

    chosen = Signal(str)
    library_requested = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(0, parent)
        self._choices: tuple[ItemChoice, ...] = ()
        self._menu = QMenu(self)
        self.setMenu(self._menu)

        # Connections
        self._menu.aboutToShow.connect(self._fill)

        self._retranslate()

    def choices(self) -> tuple[ItemChoice, ...]:
        """Return what can be chosen."""
        return self._choices

    def set_choices(self, choices: Sequence[ItemChoice]) -> None:
        """Let other items be chosen; a list that is open stays as it is."""
        self._choices = tuple(choices)
        if not self._menu.isVisible():
            self._fill()

    def _fill(self) -> None:
        menu = self._menu
        menu.clear()
        for choice in self._choices:
            text = shortened(choice.name).replace("&", "&&")
            word = choice.remark.text
            action = menu.addAction(f"{text}\t{word}" if word else text)
            action.setIcon(remark_icon(choice.remark, self))
            action.triggered.connect(
                lambda _=False, name=choice.name: self.chosen.emit(name)
            )
        if self._choices:
            menu.addSeparator()
        menu.addAction(self.tr("Tip library...")).triggered.connect(
            lambda _=False: self.library_requested.emit()
        )

    def _retranslate(self) -> None:
        self.setText(self.tr("List"))
        self._fill()
