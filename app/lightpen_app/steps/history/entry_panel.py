"""One entry of the archive as text, with its actions."""

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QWidget

from lightpen.archive.chains.entries import BESIDE_SWINGS, Event, Kind, StoredEntry
from lightpen.archive.history.history import Line
from lightpen.record.folder.verifications import VERIFIED
from lightpen.record.library.supervision import Signature
from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.sentences import worded
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import PARTED, breakable, moment_text
from lightpen_app.steps.history.texts import (
    EventText,
    item_text,
    kind_text,
    setting_text,
    type_and_state_text,
    verdict_text,
)
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.reason_bar import ReasonBar
from lightpen_app.widgets.sign_label import SignLabel, StatusMessage
from lightpen_app.widgets.translated import Translated

SHORT = 12  # characters of a hash


class EntryPanel(Translated, QWidget):
    """Shows an entry with its comments; adds a comment."""

    note_given = Signal(object, str)  # Written, str: a note on an entry
    report_requested = Signal(object)  # Written: entry whose printed report to show

    def __init__(self, kind_of: EventText) -> None:
        super().__init__()
        self._kind_of = kind_of
        self._line: Line | None = None
        self._asked: StoredEntry | None = None
        self._messages: tuple[StoredEntry, ...] = ()

        # Widgets
        self._what = text_label(TextSize.LEAD)
        self._who = text_label(TextSize.BODY)
        self._why = text_label(TextSize.BODY)
        self._kept = text_label(TextSize.SMALL, Tone.QUIET)
        self._changed = SignLabel()
        self._notes = text_label(TextSize.BODY)
        self._texts = (self._what, self._who, self._why, self._notes, self._kept)
        self._note = self.make_button(self.tr("Add comment..."), self._ask)
        self._report = PushButton()
        self._reason = ReasonBar()

        # Layout
        flags = Qt.TextInteractionFlag.TextSelectableByMouse
        for text in self._texts:
            text.setTextInteractionFlags(flags)
        margins = (0, GRID, 0, 0)
        layout = vertical_layout(
            self, self._changed, *self._texts, spacing=GRID // 2, margins=margins
        )
        layout.addSpacing(GRID)
        horizontal_layout(layout, self._note, self._report, 1)
        fill(layout, self._reason, 1)

        # Connections
        self._report.clicked.connect(self._request_report)
        self._reason.given.connect(self._on_given)

        self._retranslate()

    def value(self) -> Line | None:
        """Return the displayed line."""
        return self._line

    def set_value(self, line: Line | None) -> None:
        """Show the entry of another line; its remarks are not known yet."""
        if line == self._line:
            return
        self._line, self._messages = line, ()
        self._reason.hide()
        self._retranslate()

    def set_messages(self, remarks: Sequence[StoredEntry]) -> None:
        """Show the messages on the entry."""
        self._messages = tuple(remarks)
        self._retranslate()

    def words(self) -> tuple[str, ...]:
        """Return the texts on the entry."""
        texts = (self._changed.value().text, *(text.text() for text in self._texts))
        return tuple(filter(None, texts))

    def _ask(self) -> None:
        line = self._line
        if line is None or line.entry is None:
            return
        self._asked = line.entry
        self._reason.ask(of_supervisor=False)

    def _word_question(self) -> None:
        self._reason.set_words(
            self.tr("Comment on this entry. It cannot be changed later."),
            self.tr("Comment"),
            self.tr("Add"),
            self.tr("Cancel"),
        )

    def _request_report(self) -> None:
        if self._line is not None and self._line.entry is not None:
            self.report_requested.emit(self._line.entry)

    def _on_given(self, text: str, signature: Signature | None) -> None:
        self.note_given.emit(self._asked, text)

    def _retranslate(self) -> None:
        line, entry = self._line, None if self._line is None else self._line.entry
        is_changed = line is not None and entry is None
        self._word_question()
        self._changed.set_value(StatusMessage())
        if is_changed:
            assert line is not None
            text = self.tr(
                "Entry {0} was modified after it was entered and is not reliable. "
                "Restore the archive from a copy."
            ).format(line.number)
            self._changed.set_value(StatusMessage.fault(text))
        for label, text in zip(self._texts, self._label_texts(line), strict=True):
            label.setText(breakable(text))
            label.setVisible(bool(text))
        nothing = "" if entry is not None else self.tr("Select an entry.")
        self._note.set_why_not(nothing, self.tr("Add a comment"))
        kind = None if entry is None else entry.entry.event.kind
        self._report.setText(
            self.tr("Verification report...")
            if kind is Kind.VERIFICATION
            else self.tr("Calibration report...")
        )
        self._report.set_why_not(
            nothing or self._why_no_report(line),
            self.tr("Preview, save as PDF, or print"),
        )

    def _label_texts(self, line: Line | None) -> tuple[str, ...]:
        if line is None:
            return (self.tr("No entry selected"), *[""] * (len(self._texts) - 1))
        if line.entry is None:
            return ("",) * len(self._texts)
        entry, event = line.entry.entry, line.entry.entry.event
        when = moment_text(event.at)
        kept = self.tr("Entry {0}, {1}, SHA-256 {2}").format(
            entry.number, event.program, line.entry.sha256[:SHORT]
        )
        kind = type_and_state_text(line, self._kind_of)
        what = PARTED.join(filter(None, (kind, when)))
        return what, self._who_of(event), _why_of(event), self._notes_text(), kept

    def _who_of(self, event: Event) -> str:
        names = event.names
        pairs = (
            (self.tr("Station {0}"), names.station),
            (self.tr("Operator {0}"), names.operator),
            (self.tr("Pen {0}"), names.pen),
            (self.tr("Tip {0}"), names.tip),
            (self.tr("Cone {0}"), names.cone),
        )
        return PARTED.join(words.format(name) for words, name in pairs if name)

    def _notes_text(self) -> str:
        lines = []
        for each in self._messages:
            event = each.entry.event
            when = moment_text(event.at)
            head = [kind_text(event.kind, event.grade), when, event.names.operator]
            heading = PARTED.join(filter(None, head))
            lines.append(f"{heading}: {event.reason}" if event.reason else heading)
        return "\n".join(lines)

    def _why_no_report(self, line: Line | None) -> str:
        if line is None or line.entry is None:
            return ""
        if line.entry.entry.event.kind not in (Kind.ACCEPTED, Kind.VERIFICATION):
            return self.tr("Only accepted tips and verifications have a report.")
        return ""


def _why_of(event: Event) -> str:
    """Return verdict and reason, the text of a comment, or settings."""
    if event.kind is Kind.NOTE:
        return event.reason
    if event.kind is Kind.LIBRARY:
        return PARTED.join(filter(None, (item_text(event), event.reason)))
    why = worded(event.why)
    settings = event.settings.items() if event.kind in BESIDE_SWINGS else ()
    values = (setting_text(*each) for each in settings if each[0] != VERIFIED)
    words = (verdict_text(event.grade), why, event.reason, *values)
    return PARTED.join(filter(None, words))
