"""One entry of the archive as text, with its actions."""

from collections.abc import Callable, Sequence
from typing import TypeAlias

from PySide6.QtCore import QCoreApplication, Qt, Signal
from PySide6.QtWidgets import QWidget

from lightpen.archive.chains import BESIDE_SWINGS, Event, Kind, StoredEntry
from lightpen.archive.history import Line, TipState, messages_on
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.own_json import Plain
from lightpen.model.limits import LIMITS
from lightpen.model.names import Origin
from lightpen.record.folder import VERIFIED, TrialOutcome
from lightpen.record.library.signing import (
    OLD_KEY_SIGNATURE,
    STATION_KEY,
    SUPERVISOR_KEY,
    SUPERVISOR_SIGNATURE,
)
from lightpen.record.library.supervision import Signature
from lightpen_app.face import ReportPrinter
from lightpen_app.look.languages import listed, worded
from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.phrases import GRADE_MARKS, grade_text, origin_text
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.translatable import QT_TRANSLATE_NOOP
from lightpen_app.look.words import PARTED, breakable, moment_text
from lightpen_app.widgets.bars import ReasonBar
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.work.job import Job, LatestJob
from lightpen_app.work.workbench import Workbench

NOTICE = "history"  # cause of its notifications
EventText: TypeAlias = Callable[[Event], str]

CONTEXT = "history"
MARKED = (Origin.SIMULATED, Origin.RECORDED)


_KINDS: dict[Kind, str] = {
    Kind.ACCEPTED: QT_TRANSLATE_NOOP("history", "Calibration"),
    Kind.REFUSED: QT_TRANSLATE_NOOP("history", "Rejected"),
    Kind.ABANDONED: QT_TRANSLATE_NOOP("history", "Abandoned"),
    Kind.REVOKED: QT_TRANSLATE_NOOP("history", "Revocation"),
    Kind.NOTE: QT_TRANSLATE_NOOP("history", "Comment"),
    Kind.LIBRARY: QT_TRANSLATE_NOOP("history", "Tip library"),
    Kind.VERIFICATION: QT_TRANSLATE_NOOP("history", "Verification"),
    Kind.CAMERA: QT_TRANSLATE_NOOP("history", "Camera calibration"),
    Kind.LIMITS: QT_TRANSLATE_NOOP("history", "Limits"),
}
_REPEATED = QT_TRANSLATE_NOOP("history", "Repeated")
_OUTCOMES: dict[TrialOutcome, str] = {
    TrialOutcome.ACCEPTED: QT_TRANSLATE_NOOP("history", "accepted"),
    TrialOutcome.REFUSED: QT_TRANSLATE_NOOP("history", "rejected"),
    TrialOutcome.ABANDONED: QT_TRANSLATE_NOOP("history", "abandoned"),
}
_STATES: dict[TipState, str] = {
    TipState.IN_FORCE: QT_TRANSLATE_NOOP("history", "current"),
    TipState.REPLACED: QT_TRANSLATE_NOOP("history", "replaced"),
    TipState.REVOKED: QT_TRANSLATE_NOOP("history", "revoked"),
}
_SAID: dict[str, str] = {  # of an item of the tip library, by its settings
    "id": "{0}",
    "due": QT_TRANSLATE_NOOP("history", "expiry date {0}"),
    "ball_diameter_mm": QT_TRANSLATE_NOOP("history", "ball {0} mm"),
    "nominal_tip_mm": QT_TRANSLATE_NOOP("history", "nominal centre {0} mm"),
    "bending": QT_TRANSLATE_NOOP("history", "bending and U {0} mm"),
    "max_change_mm": QT_TRANSLATE_NOOP("history", "max. change {0} mm"),
    "max_days": QT_TRANSLATE_NOOP("history", "calibration interval {0} days"),
    "note": "{0}",
    "supervisor": QT_TRANSLATE_NOOP("history", "signed by {0}"),
}
_SAID_OF_STATION: dict[str, str] = {  # of its limits, keys, cameras, verifications
    "board": "{0}",
    "camera": QT_TRANSLATE_NOOP("history", "camera {0}"),
    "supervisor": QT_TRANSLATE_NOOP("history", "signed by {0}"),
    "changes_password": QT_TRANSLATE_NOOP("history", "supervisor password changed"),
    STATION_KEY: QT_TRANSLATE_NOOP("history", "station key changed"),
    OLD_KEY_SIGNATURE: "",
    SUPERVISOR_KEY: "",
    SUPERVISOR_SIGNATURE: "",
}
_LIMITS = {limit.key: limit for limit in LIMITS}
_RETIRED = QT_TRANSLATE_NOOP("history", "retired")
_CHANGED = QT_TRANSLATE_NOOP("history", "Modified after entry")
_KEPT = QT_TRANSLATE_NOOP("history", "saved")  # and current for no pen


def kind_text(kind: Kind, grade: str = "") -> str:
    """Return the name of an entry's kind; a swing that passed was repeated only."""
    if kind is Kind.REFUSED and grade == Grade.PASS:
        return _translated(_REPEATED)
    return _translated(_KINDS[kind])


def type_and_state_text(line: Line, kind_of: EventText) -> str:
    """Return the kind of an entry and its later state.

    ``kind_of`` returns the words of an extension; empty without any.
    """
    if line.entry is None:
        return _translated(_CHANGED)
    event = line.entry.entry.event
    words = []
    if event.origin in MARKED:
        words.append(origin_text(event.origin))
    if not words or event.kind is not Kind.ACCEPTED:
        words.append(kind_of(event) or kind_text(event.kind, event.grade))
    if line.state is TipState.IN_FORCE and event.is_simulated:
        words.append(_translated(_KEPT))
    elif line.state is not TipState.NONE:
        words.append(_translated(_STATES[line.state]))
    is_usual = (event.outcome, event.grade) == (TrialOutcome.ACCEPTED, Grade.PASS)
    if event.outcome is not None and not is_usual:
        words.append(_translated(_OUTCOMES[event.outcome]))
    return listed(words)


def item_text(event: Event) -> str:
    """Return the new values of a library item."""
    words = [
        _translated(template).format(event.settings[name])
        for name, template in _SAID.items()
        if event.settings.get(name)
    ]
    if event.settings.get("is_retired"):
        words.append(_translated(_RETIRED))
    return PARTED.join(words)


def setting_text(name: str, value: Plain) -> str:
    """Return the words on a stored setting; a limit has its label, a key none."""
    if name in _SAID_OF_STATION:
        said = _SAID_OF_STATION[name]
        return _translated(said).format(value) if said and value else ""
    limit = _LIMITS.get(name)
    if limit is None or not isinstance(value, int | float):
        return f"{name} {value}"
    if limit.choices:
        return f"{worded(limit.label)}: {worded(limit.choices[int(value)])}"
    return f"{worded(limit.label)}: {value:g}\xa0{limit.unit}".rstrip()


def verdict_text(grade: str) -> str:
    """Return the name of a verdict, unchanged if unknown."""
    try:
        return grade_text(Grade(grade)) if grade else ""
    except ValueError:
        return grade


def line_tone(line: Line, is_verdict: bool) -> Tone:
    """Return the tone of a line, by its kind or verdict."""
    if line.entry is None:
        return Tone.BAD
    event = line.entry.entry.event
    if is_verdict:
        known = {grade.value: tone for grade, (_, tone) in GRADE_MARKS.items()}
        return known.get(event.grade, Tone.PLAIN)
    if line.state is TipState.IN_FORCE:
        return Tone.GOOD
    is_refused = event.outcome is TrialOutcome.REFUSED or (
        event.kind is Kind.REFUSED and event.grade != Grade.PASS
    )
    return Tone.WARN if is_refused else Tone.PLAIN


def _translated(text: str) -> str:
    return QCoreApplication.translate(CONTEXT, text)


SHORT = 12  # characters of a hash


class EntryPanel(Translated, QWidget):
    """Shows an entry with its comments; adds a comment."""

    note_entered = Signal()

    def __init__(
        self, workbench: Workbench, printer: ReportPrinter, kind_of: EventText
    ) -> None:
        super().__init__()
        self._run, self._selection = workbench.run, workbench.selection
        self._notices, self._folder = workbench.notifications, workbench.folder
        self._printer, self._kind_of = printer, kind_of
        self._reading = LatestJob(self)
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
        self._report.setVisible(printer.is_here)
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
        self._report.clicked.connect(self._show_report)
        self._reason.given.connect(self._on_given)

        self._refresh()

    def value(self) -> Line | None:
        """Return the displayed line."""
        return self._line

    def set_value(self, line: Line | None) -> None:
        """Show the entry of another line; its remarks are not known yet."""
        if line == self._line:
            return
        self._line, self._messages = line, ()
        self._reason.hide()
        self._reading.cancel()
        self._refresh()
        if line is not None and line.entry is not None:
            logbook, entry = self._run.logbook, line.entry
            self._reading.start(
                lambda _: messages_on(logbook.opened().database, entry),
                self._on_messages_read,
                self._show_fault,
            )

    def shut_down(self) -> None:
        """Cancel reading."""
        self._reading.cancel()

    def _on_messages_read(self, messages: Sequence[StoredEntry]) -> None:
        self._messages = tuple(messages)
        self._refresh()

    def _show_fault(self, sentence: str) -> None:
        self._notices.notify(NOTICE, sentence)

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

    def _show_report(self) -> None:
        if self._line is None or self._line.entry is None:
            return
        event, folder = self._line.entry.entry.event, self._folder
        if (result := event.result) is None:
            return
        if event.kind is Kind.VERIFICATION:
            self._printer.show_verification(folder / result.place)
        else:
            self._printer.show(lambda: folder / result.place)

    def _on_given(self, text: str, signature: Signature | None) -> None:
        """Enter a comment, also during operations on the whole archive."""
        logbook, about = self._run.logbook, self._asked
        operator = self._selection.preparation.names.operator
        assert about is not None
        job = Job(lambda _: logbook.opened().enter_note(about, text, operator), self)
        job.start(lambda _: self.note_entered.emit(), self._show_fault)

    def _refresh(self) -> None:
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
