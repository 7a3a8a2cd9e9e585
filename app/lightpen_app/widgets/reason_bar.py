"""A question in the page that requires a reason, and possibly a signature."""

from collections.abc import Sequence
from functools import partial
from unicodedata import east_asian_width

from PySide6.QtCore import QCoreApplication, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QAbstractButton, QMenu, QWidget
from typing_extensions import override

from lightpen_app.look.layouts import grid_layout
from lightpen_app.look.theme import GRID, TextSize, text_label
from lightpen_app.widgets.focus import give_focus
from lightpen_app.widgets.keys import ENTER_KEYS
from lightpen_app.widgets.path_field import EnterEdit
from lightpen_app.widgets.prompt_bar import AskingBar
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.supervisor_fields import SupervisorFields

LONGEST_REASON = 200  # characters
LEAST_LETTERS = 10  # of an acceptable reason; an ideograph counts twice


def n_letters(text: str) -> int:
    """Return the number of letters of a text; a wide one counts twice."""
    return sum(1 + (east_asian_width(c) in "WF") for c in text if c.isalpha())


def usual_reasons() -> tuple[str, ...]:
    """Return the usual reasons for accepting a result that needs checking."""
    translate = QCoreApplication.translate
    return (
        translate("ReasonBar", "The tip was replaced or refitted."),
        translate("ReasonBar", "The pen was repaired or its LEDs were measured again."),
        translate("ReasonBar", "The station is being set up."),
        translate("ReasonBar", "The cause was found and has no effect on this tip."),
        translate("ReasonBar", "The accuracy is sufficient for this measurement."),
    )


class ReasonBar(AskingBar):
    """Hidden until it asks; either answer hides it again."""

    # str, Signature or None: the reason, not empty, and the supervisor's signature if
    # one is required
    given = Signal(str, object)
    declined = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)

        # Widgets
        self._text = text_label(TextSize.BODY)
        self._edit = EnterEdit(maxLength=LONGEST_REASON)
        self._usual = PushButton()
        self._menu = QMenu(self._usual)
        self._usual.setMenu(self._menu)
        self._too_short = text_label(TextSize.SMALL)
        self._least = 1
        self._supervisor = SupervisorFields()
        self._decline = PushButton()
        self._give = PushButton()
        self._is_given = False

        # Layout
        layout = grid_layout(self, margins=(2 * GRID, GRID, GRID, GRID))
        layout.addWidget(self._text, 0, 0, 1, 4)
        layout.addWidget(self._edit, 1, 0)
        layout.addWidget(self._usual, 1, 1)
        layout.addWidget(self._too_short, 2, 0, 1, 4)
        layout.addWidget(self._supervisor, 3, 0)
        layout.addWidget(self._decline, 1, 2)
        layout.addWidget(self._give, 1, 3)
        layout.setColumnStretch(0, 1)

        # Connections
        self._edit.textChanged.connect(self._refresh)
        self._supervisor.value_edited.connect(self._refresh)
        self._supervisor.entered.connect(self._on_given)
        self._edit.returnPressed.connect(self._on_given)
        self._give.clicked.connect(self._on_given)
        self._decline.clicked.connect(self._on_declined)

        self._refresh()
        self.hide()

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Keep Enter in an incomplete field from the widgets behind."""
        is_typing = not isinstance(self.window().focusWidget(), QAbstractButton)
        if not (is_typing and event.key() in ENTER_KEYS):
            super().keyPressEvent(event)

    def set_words(
        self,
        question: str,
        field: str,
        yes: str,
        no: str,
        reasons: Sequence[str] | None = None,
    ) -> None:
        """Change the question, the name of its field, its answers, and its reasons.

        What is typed in place of these must have at least `LEAST_LETTERS`; without a
        list, anything will do.
        """
        self._least = 1 if reasons is None else LEAST_LETTERS
        self._usual.setVisible(reasons is not None)
        self._usual.setText(QCoreApplication.translate("ReasonBar", "Reasons"))
        self._menu.clear()
        for reason in reasons or ():
            choose = partial(self._edit.setText, reason)
            self._menu.addAction(reason).triggered.connect(choose)
        self._text.setText(question)
        self.setAccessibleName(question)
        self._edit.setAccessibleName(field)
        self._edit.setPlaceholderText(field)
        self._give.setText(yes)
        self._decline.setText(no)
        self._refresh()

    def ask(self, *, of_supervisor: bool = False) -> None:
        """Ask and wait for a text, signed by a supervisor if required."""
        self._is_given = False
        self._edit.clear()
        self._supervisor.clear()
        self._supervisor.setVisible(of_supervisor)
        self.show()
        give_focus(self._edit)

    def refuse(self) -> None:
        """Ask once more after an insufficient answer; all but the password stays."""
        if not self._is_given:
            return
        self._is_given = False
        self.show()
        if self._supervisor.isVisibleTo(self):
            self._supervisor.clear_password()
        else:
            give_focus(self._edit)

    def _reason(self) -> str:
        return self._edit.text().strip()

    def _is_whole(self) -> bool:
        is_asked = self._supervisor.isVisibleTo(self)
        is_given = bool(self._reason()) and n_letters(self._reason()) >= self._least
        return is_given and (self._supervisor.is_filled() or not is_asked)

    def _refresh(self) -> None:
        self._give.setEnabled(self._is_whole())
        n_typed = n_letters(self._reason())
        self._too_short.setVisible(bool(self._reason()) and n_typed < self._least)
        self._too_short.setText(
            QCoreApplication.translate(
                "ReasonBar", "Letters needed: {0}; entered: {1}."
            ).format(self._least, n_typed)
        )

    def _on_given(self) -> None:
        if self._is_whole():
            is_asked = self._supervisor.isVisibleTo(self)
            signature = self._supervisor.value() if is_asked else None
            self._is_given = True
            self.hide()
            self.given.emit(self._reason(), signature)

    def _on_declined(self) -> None:
        self.hide()
        self.declined.emit()
