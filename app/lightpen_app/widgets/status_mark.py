"""Status of a tip as a remark beside its name."""

from PySide6.QtCore import QCoreApplication, QRectF, Qt
from PySide6.QtGui import QIcon, QPainter, QPixmap
from PySide6.QtWidgets import QWidget

from lightpen.model.origin import Origin
from lightpen.record.library.calibration_status import StationStatus, TipStatus
from lightpen.record.library.tip_library import ItemKind
from lightpen.record.swings.names import Names
from lightpen_app.look.signs import Sign, draw_sign
from lightpen_app.look.theme import Tone, colors_of
from lightpen_app.look.translatable import QT_TRANSLATE_NOOP
from lightpen_app.look.words import PARTED
from lightpen_app.widgets.sign_label import SIDE, StatusMessage

CONTEXT = "standing"


_WORDS: dict[TipStatus, str] = {
    TipStatus.VALID: QT_TRANSLATE_NOOP("standing", "valid"),
    TipStatus.OVERDUE: QT_TRANSLATE_NOOP("standing", "OVERDUE"),
    TipStatus.UNCALIBRATED: QT_TRANSLATE_NOOP("standing", "NOT CALIBRATED"),
    TipStatus.RETIRED: QT_TRANSLATE_NOOP("standing", "RETIRED"),
}
_MARKS: dict[TipStatus, tuple[Sign, Tone]] = {
    TipStatus.VALID: (Sign.CHECK, Tone.GOOD),
    TipStatus.OVERDUE: (Sign.WARNING, Tone.WARN),
    TipStatus.UNCALIBRATED: (Sign.WARNING, Tone.WARN),
    TipStatus.RETIRED: (Sign.CROSS, Tone.BAD),
}
_OF_KIND: dict[ItemKind, str] = {
    ItemKind.PEN: QT_TRANSLATE_NOOP("standing", "Pen {0}"),
    ItemKind.TIP: QT_TRANSLATE_NOOP("standing", "Tip {0}"),
    ItemKind.CONE: QT_TRANSLATE_NOOP("standing", "Cone {0}"),
}
WORST_FIRST = (TipStatus.RETIRED, TipStatus.OVERDUE, TipStatus.UNCALIBRATED)


def status_text(status: TipStatus) -> str:
    """Return the name of a status."""
    return QCoreApplication.translate(CONTEXT, _WORDS[status])


def status_message(status: TipStatus | None) -> StatusMessage:
    """Return a remark on a status; None if unknown."""
    if status is None:
        return StatusMessage()
    return StatusMessage(status_text(status), *_MARKS[status])


def message_icon(remark: StatusMessage, widget: QWidget) -> QIcon:
    """Return the sign of a remark as an icon in the colours of a widget."""
    scale = widget.devicePixelRatioF()
    picture = QPixmap(round(SIDE * scale), round(SIDE * scale))
    picture.setDevicePixelRatio(scale)
    picture.fill(Qt.GlobalColor.transparent)
    painter = QPainter(picture)
    color = colors_of(widget.palette()).tone(remark.tone)
    draw_sign(painter, QRectF(0, 0, SIDE, SIDE), remark.sign, color)
    painter.end()
    return QIcon(picture)


def subject_message(
    names: Names, origin: Origin | None, statuses: StationStatus
) -> StatusMessage:
    """Return which of pen, tip and cone are blocked for measuring, and why.

    Simulated ones are never used for measuring.
    """
    if origin is Origin.SIMULATED:
        return StatusMessage()
    of = statuses.of_item
    found = {
        ItemKind.TIP: statuses.of_tip(names.pen, names.tip),
        ItemKind.PEN: of(ItemKind.PEN, names.pen),
        ItemKind.CONE: of(ItemKind.CONE, names.cone),
    }
    marked = {
        kind: each for kind, each in found.items() if each in WORST_FIRST and each
    }
    if not marked:
        return StatusMessage()
    words = PARTED.join(
        QCoreApplication.translate(CONTEXT, _OF_KIND[kind]).format(status_text(each))
        for kind, each in marked.items()
    )
    worst = min(marked.values(), key=WORST_FIRST.index)
    return StatusMessage(words, *_MARKS[worst])
