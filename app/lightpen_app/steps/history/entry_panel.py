"""One entry of the archive in words, and what can be done about it."""

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from lightpen.archive.entries import BESIDE_SWINGS, IN_FORCE_BY, Event, Kind, Written
from lightpen.archive.history import Line, TipState
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import PARTED, breakable, moment_text
from lightpen_app.steps.history.texts import (
    item_text,
    kind_text,
    verdict_text,
    what_text,
)
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.reason_bar import ReasonBar
from lightpen_app.widgets.sign_label import Remark, SignLabel
from lightpen_app.widgets.translated import Translated

SHORT = 12  # characters of a hash


class EntryPanel(Translated, QWidget):
    """Shows an entry with the notes on it; takes a note, or puts its tip in force.

    Signals
    -------
    note_given(Written, str)
        A note on an entry.
    restore_requested(Written, str)
        The tip of an entry shall be in force again, for a reason.
    paper_requested(Written)
        The record on paper of an entry's tip shall be shown.
    """

    note_given = Signal(object, str)
    restore_requested = Signal(object, str)
    paper_requested = Signal(object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._line: Line | None = None
        self._asked: Written | None = None
        self._home = ""
        self._restores = False
        self._remarks: tuple[Written, ...] = ()

        # Widgets
        self._what = text_label(TextSize.LEAD)
        self._who = text_label(TextSize.BODY)
        self._why = text_label(TextSize.BODY)
        self._kept = text_label(TextSize.SMALL, Tone.QUIET)
        self._changed = SignLabel()
        self._notes = text_label(TextSize.BODY)
        self._texts = (self._what, self._who, self._why, self._notes, self._kept)
        self._note = PushButton()
        self._restore = PushButton()
        self._paper = PushButton()
        self._reason = ReasonBar()

        # Layout
        buttons = QHBoxLayout()
        buttons.setSpacing(GRID)
        for button in (self._note, self._restore, self._paper):
            buttons.addWidget(button)
        buttons.addStretch(1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, GRID, 0, 0)
        layout.setSpacing(GRID // 2)
        layout.addWidget(self._changed)
        for text in self._texts:
            flags = Qt.TextInteractionFlag.TextSelectableByMouse
            text.setTextInteractionFlags(flags)
            layout.addWidget(text)
        layout.addSpacing(GRID)
        layout.addLayout(buttons)
        layout.addWidget(self._reason)
        layout.addStretch(1)

        # Connections
        self._note.clicked.connect(lambda: self._ask(restores=False))
        self._restore.clicked.connect(lambda: self._ask(restores=True))
        self._paper.clicked.connect(self._ask_paper)
        self._reason.given.connect(self._on_given)

        self._retranslate()

    def value(self) -> Line | None:
        """Return the line whose entry is shown."""
        return self._line

    def set_value(self, line: Line | None) -> None:
        """Show the entry of another line; its remarks are not known yet."""
        if line == self._line:
            return
        self._line, self._remarks = line, ()
        self._reason.hide()
        self._retranslate()

    def set_home(self, chain: str) -> None:
        """Take over which chain is at home here: the files of its results are here."""
        self._home = chain

    def set_remarks(self, remarks: Sequence[Written]) -> None:
        """Show what concerns the entry."""
        self._remarks = tuple(remarks)
        self._retranslate()

    def words(self) -> tuple[str, ...]:
        """Return what is said of the entry."""
        said = (self._changed.value().text, *(text.text() for text in self._texts))
        return tuple(filter(None, said))

    def _ask(self, *, restores: bool) -> None:
        line = self._line
        if line is None or line.entry is None:
            return
        self._asked, self._restores = line.entry, restores
        self._word_question()
        self._reason.ask()

    def _word_question(self) -> None:
        if self._restores:
            self._reason.set_words(
                self.tr(
                    "Put this tip in force again? It becomes a new entry; the tip in "
                    "force now is kept."
                ),
                self.tr("Reason"),
                self.tr("Put in force"),
                self.tr("Leave it"),
            )
        else:
            self._reason.set_words(
                self.tr("A note on this entry; it cannot be changed later."),
                self.tr("Note"),
                self.tr("Enter"),
                self.tr("Leave it"),
            )

    def _ask_paper(self) -> None:
        if self._line is not None and self._line.entry is not None:
            self.paper_requested.emit(self._line.entry)

    def _on_given(self, text: str) -> None:
        given = self.restore_requested if self._restores else self.note_given
        given.emit(self._asked, text)

    def _retranslate(self) -> None:
        line, entry = self._line, None if self._line is None else self._line.entry
        is_changed = line is not None and entry is None
        self._word_question()
        self._changed.set_value(Remark())
        if is_changed:
            assert line is not None
            text = self.tr(
                "Entry {0} was changed since it was entered. Nothing that it says now "
                "can be trusted; restore the archive from a copy."
            ).format(line.number)
            self._changed.set_value(Remark(text, Sign.CROSS, Tone.BAD))
        for label, text in zip(self._texts, self._told(line), strict=True):
            label.setText(breakable(text))
            label.setVisible(bool(text))
        self._note.setText(self.tr("Add a note..."))
        self._restore.setText(self.tr("Put in force again..."))
        nothing = "" if entry is not None else self.tr("Choose an entry.")
        self._note.set_why_not(nothing, self.tr("Say something of this entry"))
        self._restore.set_why_not(
            nothing or self._why_not_restored(line), self.tr("As a new entry")
        )
        self._paper.setText(self.tr("Record on paper..."))
        self._paper.set_why_not(
            nothing or self._why_not_on_paper(line),
            self.tr("Look at it, save it as PDF or print it"),
        )

    def _told(self, line: Line | None) -> tuple[str, ...]:
        """Return the words of each label."""
        if line is None:
            return (self.tr("No entry is chosen."), *[""] * (len(self._texts) - 1))
        if line.entry is None:
            return ("",) * len(self._texts)
        entry, event = line.entry.entry, line.entry.entry.event
        when = moment_text(event.at, self.tr("d MMMM yyyy, hh:mm"))
        kept = self.tr("Entry {0}, {1}, SHA-256 {2}").format(
            entry.number, event.program, line.entry.sha256[:SHORT]
        )
        what = PARTED.join(filter(None, (what_text(line), when)))
        return what, self._who_of(event), _why_of(event), self._notes_text(), kept

    def _who_of(self, event: Event) -> str:
        names = event.names
        pairs = (
            (self.tr("Station {0}"), names.station),
            (self.tr("by {0}"), names.operator),
            (self.tr("Pen {0}"), names.pen),
            (self.tr("Tip {0}"), names.tip),
            (self.tr("Cone {0}"), names.cone),
        )
        return PARTED.join(words.format(name) for words, name in pairs if name)

    def _notes_text(self) -> str:
        lines = []
        for each in self._remarks:
            event = each.entry.event
            when = moment_text(event.at, "yyyy-MM-dd hh:mm")
            head = [kind_text(event.kind), when, event.names.operator]
            told = PARTED.join(filter(None, head))
            lines.append(f"{told}: {event.reason}" if event.reason else told)
        return "\n".join(lines)

    def _why_not_restored(self, line: Line | None) -> str:
        if line is None or line.entry is None:
            return ""
        if line.entry.entry.event.kind not in IN_FORCE_BY:
            return self.tr("Only a tip that was accepted can be put in force.")
        if line.state is TipState.IN_FORCE:
            return self.tr("It is in force.")
        return ""

    def _why_not_on_paper(self, line: Line | None) -> str:
        if line is None or line.entry is None:
            return ""
        if line.entry.entry.event.kind not in IN_FORCE_BY:
            return self.tr("Only a tip that was accepted has a record on paper.")
        if line.chain != self._home:
            return self.tr("Its result is at the station that it is of.")
        return ""


def _why_of(event: Event) -> str:
    """Return verdict and reason, a note's text, or the settings of what is no swing."""
    if event.kind is Kind.NOTE:
        return event.reason
    if event.kind is Kind.LIBRARY:
        return PARTED.join(filter(None, (item_text(event), event.reason)))
    why = "" if event.why is None else event.why.text
    settings = event.settings.items() if event.kind in BESIDE_SWINGS else ()
    said = (f"{name} {value}" for name, value in settings)
    words = (verdict_text(event.grade), why, event.reason, *said)
    return PARTED.join(filter(None, words))
