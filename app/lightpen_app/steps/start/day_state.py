"""View state of the day page: tips of a station, and readiness for a swing."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from datetime import date, timedelta

from PySide6.QtCore import QCoreApplication

from lightpen.cameras.protocol import Connection
from lightpen.estimation.contact.single_images import USUAL_SIGMA
from lightpen.estimation.reports.verdict import Grade
from lightpen.local_time import local_time
from lightpen.model.names import Origin
from lightpen.record.library.tip_library import ItemKind, StationStatus, TipStatus
from lightpen.swing.preparation import MissingInput, Preparation
from lightpen_app.face import ReadinessItem
from lightpen_app.look.phrases import GRADE_MARKS, age_text, first_missing, grade_text
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import Tone
from lightpen_app.look.words import (
    LEAST_SHOWN,
    PARTED,
    number_text,
    on_one_line,
    shortened,
)
from lightpen_app.widgets.state_banner import StatusMessage, status_message

translate = QCoreApplication.translate

SOON = timedelta(days=7)  # before a tip is due: then it is listed as due


@dataclass(frozen=True)
class TipRow:
    """A tip of a pen, as the table shows it."""

    pen: str
    tip: str
    due: StatusMessage
    uncertainty: str
    age: str
    grade: StatusMessage
    is_due: bool

    def matches(self, text: str) -> bool:
        """Return whether a text is part of the name of tip or pen."""
        return any(text.casefold() in name.casefold() for name in (self.tip, self.pen))


@dataclass(frozen=True)
class CameraState:
    """State of the live images."""

    connection: Connection
    rate: float | None = None  # images received per second
    # RMS residual of the LEDs in the last images, px; None where no pen is seen.
    misfit: float | None = None


def tip_rows(now: Preparation, statuses: StationStatus) -> tuple[TipRow, ...]:
    """Return the tips of the station, those that are due first."""
    names = now.names
    pairs = set(statuses.in_force)
    listed = statuses.library.tips
    pairs |= {
        (names.pen, tip.id)
        for tip in listed.values()
        if not tip.is_retired and not statuses.pens_of(tip.id)
    }
    if names.tip:
        pairs.add((names.pen, names.tip))
    is_simulated = now.origin is Origin.SIMULATED
    rows = [
        _row(pen, tip, statuses, is_simulated=is_simulated)
        for pen, tip in pairs
        if statuses.of_tip(pen, tip) is not TipStatus.RETIRED
    ]
    last = date.max
    return tuple(
        sorted(
            rows,
            key=lambda row: (
                not row.is_due,
                statuses.due(row.pen, row.tip) or last,
                row.tip,
                row.pen,
            ),
        )
    )


def readiness(
    now: Preparation, statuses: StationStatus, camera: CameraState, file_doubt: str
) -> tuple[ReadinessItem, ...]:
    """Return the preconditions of a swing, in order of examination."""
    return (
        ReadinessItem(
            "camera",
            translate("DayView", "Camera"),
            _camera_message(now, camera),
            translate("DayControl", "Check the camera"),
        ),
        ReadinessItem(
            "leds",
            translate("DayView", "LEDs"),
            _leds_message(now, statuses, camera, file_doubt),
            translate("DayControl", "Check the LEDs"),
        ),
        ReadinessItem(
            "temperature",
            translate("DayView", "Temperature"),
            _temperature_message(now),
            translate("DayControl", "Enter the temperature"),
        ),
    )


def tip_details(now: Preparation, statuses: StationStatus) -> str:
    """Return the text on the selected tip, in one line; empty without one."""
    names = now.names
    if not names.tip:
        return ""
    tip, point = statuses.library.tip(names.tip), now.nominal_tip
    if point is None and now.pen is not None:
        point = now.pen.nominal_tip
    parts = [
        translate("DayPage", "Tip {0}, pen {1}").format(
            *map(shortened, (names.tip, names.pen))
        )
    ]
    if names.ball_diameter:
        parts.append(translate("DayPage", "ball {0:g} mm").format(names.ball_diameter))
    if names.cone:
        parts.append(translate("DayPage", "cone {0}").format(shortened(names.cone)))
    if point is not None:
        x, y, z = (f"{each:g}" for each in point.tolist())
        parts.append(translate("DayPage", "nominal {0} {1} {2} mm").format(x, y, z))
    limit = now.limits.max_uncertainty
    words = translate("DayPage", "limit of U {0:g} mm").format(limit)
    parts.append(on_one_line(words))
    if tip is not None and tip.note:
        parts.append(tip.note)
    return PARTED.join(parts)


def _row(pen: str, tip: str, statuses: StationStatus, *, is_simulated: bool) -> TipRow:
    found, status = statuses.current(pen, tip), statuses.of_tip(pen, tip)
    if found is None:
        mark = status_message(None if is_simulated else status)
        is_due = status is TipStatus.UNCALIBRATED and not is_simulated
        practice = StatusMessage()
        if is_simulated:
            words = translate("DayPage", "Practice")
            practice = StatusMessage(words, Sign.RING, Tone.QUIET)
        return TipRow(pen, tip, mark, "", "", practice, is_due)
    assert statuses.now is not None
    today, last = local_time(statuses.now).date(), statuses.due(pen, tip)
    is_over = status is TipStatus.OVERDUE
    is_due = is_over or (last is not None and last <= today + SOON)
    due = StatusMessage(_due_text(last, today), Sign.NONE, Tone.PLAIN)
    if is_due:
        due = replace(due, sign=Sign.WARNING, tone=Tone.WARN)
    if is_over:
        due = status_message(status)
    u = found.uncertainty
    um = (
        ""
        if u is None
        else translate("DayPage", "{0} \u00b5m").format(number_text(1000 * u, 1))
    )
    age = age_text((today - local_time(found.calibrated).date()).days)
    return TipRow(pen, tip, due, um, age, _grade_message(found.grade), is_due)


def _grade_message(grade: Grade | None) -> StatusMessage:
    if grade is None:
        return StatusMessage()
    return StatusMessage(grade_text(grade), *GRADE_MARKS[grade])


def _due_text(last: date | None, today: date) -> str:
    if last is None:
        return ""
    days = (last - today).days
    if days == 0:
        return translate("DayPage", "due today")
    return translate("DayPage", "due in {0} days").format(days)


def _amber(*sentences: str) -> StatusMessage:
    return StatusMessage.warning(next(filter(None, sentences)))


def _first_of(missing: Iterable[MissingInput]) -> str:
    return first_missing(tuple(missing))


def _camera_message(now: Preparation, camera: CameraState) -> StatusMessage:
    missing = _first_of(now.camera_missing_inputs())
    if camera.connection is not Connection.STREAMING or missing:
        no_images = translate("DayPage", "The camera sends no images.")
        return _amber(missing, no_images)
    text = translate("DayPage", "Camera")
    if camera.rate is not None:
        text = translate("DayPage", "Camera {0:.0f} fps").format(camera.rate)
    return StatusMessage.good(text)


def _leds_message(
    now: Preparation, statuses: StationStatus, camera: CameraState, file_doubt: str
) -> StatusMessage:
    pen = now.names.pen
    if missing := _first_of(now.leds_missing_inputs()):
        return _amber(missing)
    if file_doubt:
        return _amber(file_doubt)
    if camera.misfit is not None and camera.misfit > USUAL_SIGMA:
        words = translate("DayPage", "LEDs fit to {0:.2f} px only, usual is {1:g} px.")
        return _amber(words.format(camera.misfit, USUAL_SIGMA))
    if statuses.of_item(ItemKind.PEN, pen) is TipStatus.OVERDUE:
        return _amber(translate("DayPage", "Pen {0} is overdue.").format(pen))
    text = translate("DayPage", "LEDs of pen {0}").format(shortened(pen, LEAST_SHOWN))
    return StatusMessage.good(text)


def _temperature_message(now: Preparation) -> StatusMessage:
    measured = now.assumptions_today.temperature_c
    if now.lacks_temperature:
        return _amber(translate("DayPage", "Measure the temperature of the pen."))
    if measured is None:
        text = translate("DayPage", "No temperature")
        return StatusMessage(text, Sign.RING, Tone.QUIET)
    text = translate("DayPage", "Pen at {0:.1f} \u00b0C").format(measured)
    return StatusMessage.good(text)
