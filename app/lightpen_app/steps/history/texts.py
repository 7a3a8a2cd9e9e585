"""Texts for entries of the archive."""

from collections.abc import Callable
from typing import TypeAlias

from PySide6.QtCore import QCoreApplication

from lightpen.archive.chains.entries import Event, Kind
from lightpen.archive.history.history import Line, TipState
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.json_records import Plain
from lightpen.model.limits import LIMITS
from lightpen.model.origin import Origin
from lightpen.record.folder.outcome import TrialOutcome
from lightpen.record.library.signing.chain_keys import (
    OLD_KEY_SIGNATURE,
    STATION_KEY,
    SUPERVISOR_KEY,
    SUPERVISOR_SIGNATURE,
)
from lightpen_app.look.grades import GRADE_MARKS
from lightpen_app.look.phrases import grade_text, origin_text
from lightpen_app.look.sentences import listed, worded
from lightpen_app.look.theme import Tone
from lightpen_app.look.translatable import QT_TRANSLATE_NOOP
from lightpen_app.look.words import PARTED

EventText: TypeAlias = Callable[[Event], str]

CONTEXT = "history"
MARKED = (Origin.SIMULATED, Origin.RECORDED)


_KINDS: dict[Kind, str] = {
    Kind.ACCEPTED: QT_TRANSLATE_NOOP("history", "Calibration"),
    Kind.REFUSED: QT_TRANSLATE_NOOP("history", "Rejected"),
    Kind.ABANDONED: QT_TRANSLATE_NOOP("history", "Abandoned"),
    Kind.TAKEN_BACK: QT_TRANSLATE_NOOP("history", "Revocation"),
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
    TipState.TAKEN_BACK: QT_TRANSLATE_NOOP("history", "revoked"),
}
_SAID: dict[str, str] = {  # of an item of the tip library, by its settings
    "id": "{0}",
    "due": QT_TRANSLATE_NOOP("history", "expiry date {0}"),
    "ball_diameter_mm": QT_TRANSLATE_NOOP("history", "ball {0} mm"),
    "nominal_tip_mm": QT_TRANSLATE_NOOP("history", "nominal centre {0} mm"),
    "bending": QT_TRANSLATE_NOOP("history", "bending and U {0} mm"),
    "max_change_mm": QT_TRANSLATE_NOOP("history", "max. change {0} mm"),
    "max_days": QT_TRANSLATE_NOOP("history", "calibration interval {0} days"),
    "max_swings": QT_TRANSLATE_NOOP("history", "max. {0} swings"),
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


def usual_words() -> tuple[str, ...]:
    """Return the usual remarks on a calibration, by origin of its images."""
    of_tips = (kind_text(Kind.ACCEPTED), *map(origin_text, MARKED))
    states = tuple(map(_translated, _STATES.values()))
    verified = kind_text(Kind.VERIFICATION)
    return (
        *(listed([word, state]) for word in of_tips for state in states),
        *(listed([origin_text(origin), verified]) for origin in MARKED),
    )


def rare_words() -> tuple[str, ...]:
    """Return the remarks on a swing without a result."""
    kinds = (
        kind_text(Kind.REFUSED),
        kind_text(Kind.REFUSED, Grade.PASS),
        kind_text(Kind.ABANDONED),
    )
    return tuple(listed([origin_text(o), kind]) for o in MARKED for kind in kinds)


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
