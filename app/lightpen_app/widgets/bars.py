"""Bars on a page: prompt, question, reason, withdrawal, progress of a job."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple
from unicodedata import east_asian_width

from PySide6.QtCore import QCoreApplication, QTimer, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QAbstractButton, QFrame, QMenu, QProgressBar, QWidget
from shiboken6 import isValid
from typing_extensions import override

from lightpen_app.look.layouts import grid_layout, horizontal_layout
from lightpen_app.look.theme import GRID, TextSize, Tone, set_tone, text_label
from lightpen_app.look.words import PARTED, TimeLeft
from lightpen_app.widgets.controls import ENTER_KEYS, PushButton, give_focus
from lightpen_app.widgets.fields import EnterEdit, SupervisorFields, Translated


class AskingBar(QFrame):
    """A bar for a question, hidden without one; it returns the focus.

    Otherwise Qt would focus the next widget, such as a button that Enter then presses.
    """

    asking_changed = Signal()  # it asks, or no longer

    def __init__(self) -> None:
        super().__init__()
        self._had_focus: QWidget | None = None
        self.setProperty("area", "notice")
        set_tone(self, Tone.WARN)

    @override
    def setVisible(self, visible: bool) -> None:
        focused, before = self.window().focusWidget(), self._had_focus
        is_inside = focused is not None and self.isAncestorOf(focused)
        if visible and not is_inside:
            self._had_focus = focused
        elif not visible and is_inside and before is not None and isValid(before):
            before.setFocus()
        was_hidden = self.isHidden()
        super().setVisible(visible)
        if self.isHidden() is not was_hidden:
            self.asking_changed.emit()


class Question(NamedTuple):
    """A question with the labels of its answers."""

    text: str = ""
    yes: str = ""
    no: str = ""


class QuestionBar(Translated, AskingBar):
    """Hidden until it asks; either answer hides it again."""

    agreed = Signal()
    declined = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._words: Callable[[], Question] = Question
        self._on_yes: Callable[[], object] = bool  # does nothing

        # Widgets
        self._text = text_label(TextSize.BODY)
        self._decline = PushButton()
        self._agree = PushButton()

        # Layout
        horizontal_layout(
            self,
            (self._text, 1),
            self._decline,
            self._agree,
            margins=(2 * GRID, GRID, GRID, GRID),
        )

        # Connections
        self._agree.clicked.connect(self._on_agree_clicked)
        self._decline.clicked.connect(self._on_decline_clicked)

        self.hide()

    def set_words(self, words: Callable[[], Question]) -> None:
        """Change the question; its words are requested in each language again."""
        self._words = words
        self.refresh()

    def ask_about(
        self, words: Callable[[], Question], on_yes: Callable[[], object]
    ) -> None:
        """Replace the question and the action on consent."""
        self._on_yes = on_yes
        self.set_words(words)
        self.ask()

    def refresh(self) -> None:
        """Update the question; an empty text hides it."""
        asked = self._words()
        if not asked.text:
            self.hide()
        self._text.setText(asked.text)
        self.setAccessibleName(asked.text)
        self._agree.setText(asked.yes)
        self._decline.setText(asked.no)

    def ask(self) -> None:
        """Show the question, with the focus on the answer that changes nothing."""
        self.show()
        give_focus(self._decline)

    def words(self) -> str:
        """Return the question; empty while nothing is asked."""
        return "" if self.isHidden() else self._text.text()

    def _refresh(self) -> None:
        self.refresh()

    def _on_agree_clicked(self) -> None:
        self.hide()
        self.agreed.emit()
        self._on_yes()

    def _on_decline_clicked(self) -> None:
        self.hide()
        self.declined.emit()


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

    def __init__(self) -> None:
        super().__init__()

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
        self._edit.textChanged.connect(self._check_reason)
        self._supervisor.value_edited.connect(self._check_reason)
        self._supervisor.entered.connect(self._on_given)
        self._edit.returnPressed.connect(self._on_given)
        self._give.clicked.connect(self._on_given)
        self._decline.clicked.connect(self._on_declined)

        self._check_reason()
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
        self._check_reason()

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

    def _check_reason(self) -> None:
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


class WithdrawalBar(Translated, ReasonBar):
    """A `ReasonBar` for revoking the acceptance of a tip."""

    def __init__(self) -> None:
        super().__init__()
        self._refresh()

    def _refresh(self) -> None:
        self.set_words(
            self.tr(
                "Revoke this acceptance? The previous result becomes current again. "
                "Both stay in the archive."
            ),
            self.tr("Reason"),
            self.tr("Revoke acceptance"),
            self.tr("Keep acceptance"),
        )


STEPS = 1000


class JobProgress(Translated, QWidget):
    """Shows how far a job is; hidden while none runs.

    A job that is done within ``patience_ms`` is not shown.
    """

    cancelled = Signal()

    def __init__(self, patience_ms: int = 0) -> None:
        super().__init__()
        self._time_left = TimeLeft()
        self._is_running = False

        # Widgets
        self._bar = self.say(QProgressBar(maximum=STEPS), self.tr("Progress"))
        self._cancel = self.make_button(self.tr("Cancel"), self._on_cancel_clicked)
        self._patience = QTimer(self, singleShot=True, interval=patience_ms)

        # Layout
        horizontal_layout(self, (self._bar, 1), self._cancel, spacing=2 * GRID)
        self.hide()

        # Connections
        self._patience.timeout.connect(self.show)

    @property
    def is_running(self) -> bool:
        """Whether a job runs."""
        return self._is_running

    def words(self) -> str:
        """Return what is written on the bar."""
        return self._bar.text()

    def begin(self) -> None:
        """Show that a job has begun."""
        self._is_running = True
        self._time_left.restart()
        self.set_fraction(0.0)
        if self._patience.interval():
            self._patience.start()
        else:
            self.show()

    def set_fraction(self, fraction: float) -> None:
        """Show how far the job is, 0 to 1."""
        self._bar.setValue(round(STEPS * fraction))
        parts = f"{fraction:.0%}", self._time_left.text(fraction)
        self._bar.setFormat(PARTED.join(filter(None, parts)))

    def end(self) -> None:
        """Show that the job has ended."""
        self._is_running = False
        self._patience.stop()
        self.hide()

    def set_running(self, is_running: bool) -> None:
        """Show whether a job runs."""
        if is_running and not self._is_running:
            self.begin()
        elif not is_running:
            self.end()

    def _on_cancel_clicked(self) -> None:
        self.end()
        self.cancelled.emit()
