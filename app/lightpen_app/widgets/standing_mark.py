"""How a tip stands, as a remark that is beside its name wherever it shows."""

from typing import TYPE_CHECKING

from PySide6.QtCore import QCoreApplication, QRectF, Qt
from PySide6.QtGui import QIcon, QPainter, QPixmap
from PySide6.QtWidgets import QWidget

from lightpen.model.origin import Origin
from lightpen.record.names import Names
from lightpen.record.standing import Standings, TipStanding
from lightpen.record.tip_library import ItemKind
from lightpen_app.look.signs import Sign, draw_sign
from lightpen_app.look.theme import Tone, colors_of
from lightpen_app.look.words import PARTED
from lightpen_app.widgets.sign_label import SIDE, Remark

CONTEXT = "standing"

if TYPE_CHECKING:

    def QT_TRANSLATE_NOOP(context: str, text: str) -> str:  # noqa: N802 - Qt's
        """Return the text; PySide6 gives it the type of any object."""
else:
    from PySide6.QtCore import QT_TRANSLATE_NOOP

_WORDS: dict[TipStanding, str] = {
    TipStanding.VALID: QT_TRANSLATE_NOOP("standing", "valid"),
    TipStanding.OVERDUE: QT_TRANSLATE_NOOP("standing", "OVERDUE"),
    TipStanding.UNCALIBRATED: QT_TRANSLATE_NOOP("standing", "NOT CALIBRATED"),
    TipStanding.RETIRED: QT_TRANSLATE_NOOP("standing", "RETIRED"),
}
_MARKS: dict[TipStanding, tuple[Sign, Tone]] = {
    TipStanding.VALID: (Sign.CHECK, Tone.GOOD),
    TipStanding.OVERDUE: (Sign.WARNING, Tone.WARN),
    TipStanding.UNCALIBRATED: (Sign.WARNING, Tone.WARN),
    TipStanding.RETIRED: (Sign.CROSS, Tone.BAD),
}
_OF_KIND: dict[ItemKind, str] = {
    ItemKind.PEN: QT_TRANSLATE_NOOP("standing", "Pen {0}"),
    ItemKind.TIP: QT_TRANSLATE_NOOP("standing", "Tip {0}"),
    ItemKind.CONE: QT_TRANSLATE_NOOP("standing", "Cone {0}"),
}
WORST_FIRST = (TipStanding.RETIRED, TipStanding.OVERDUE, TipStanding.UNCALIBRATED)


def standing_text(standing: TipStanding) -> str:
    """Return the word for how something stands."""
    return QCoreApplication.translate(CONTEXT, _WORDS[standing])


def standing_remark(standing: TipStanding | None) -> Remark:
    """Return how something stands as a remark; none where that is not known."""
    if standing is None:
        return Remark()
    return Remark(standing_text(standing), *_MARKS[standing])


def remark_icon(remark: Remark, widget: QWidget) -> QIcon:
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


def subject_remark(names: Names, origin: Origin | None, standings: Standings) -> Remark:
    """Return what of pen, tip and cone must not be measured with, and why.

    Simulated ones are never measured with.
    """
    if origin is Origin.SIMULATED:
        return Remark()
    of = standings.of_item
    found = {
        ItemKind.TIP: standings.of_tip(names.pen, names.tip),
        ItemKind.PEN: of(ItemKind.PEN, names.pen),
        ItemKind.CONE: of(ItemKind.CONE, names.cone),
    }
    told = {kind: each for kind, each in found.items() if each in WORST_FIRST and each}
    if not told:
        return Remark()
    words = PARTED.join(
        QCoreApplication.translate(CONTEXT, _OF_KIND[kind]).format(standing_text(each))
        for kind, each in told.items()
    )
    worst = min(told.values(), key=WORST_FIRST.index)
    return Remark(words, *_MARKS[worst])
