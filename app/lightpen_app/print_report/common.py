"""What all reports state: laboratory, equipment, proof and signatures."""

from collections.abc import Sequence
from datetime import datetime

from PySide6.QtCore import QCoreApplication, QRectF
from PySide6.QtGui import QPainter

from lightpen.model.laboratory import Laboratory
from lightpen.record.calibrations.traceability import TracedItem
from lightpen.record.library.entered_files import EntryPlace
from lightpen.record.library.tip_library import ItemKind
from lightpen_app.look.sentences import listed
from lightpen_app.look.theme import LIGHT
from lightpen_app.print_report.blocks import (
    MM,
    WIDTH,
    Block,
    PrintSize,
    draw_text,
    line_pen,
)
from lightpen_app.print_report.template import condition

translate = QCoreApplication.translate

NUMBER_LENGTH = 12  # digits of the SHA-256 that name a record


def zoned_moment_text(moment: datetime) -> str:
    """Return a moment with the time zone that it was written in."""
    return moment.isoformat(sep=" ", timespec="seconds")


def environment_texts(
    temperature_c: float | None, humidity_percent: float | None
) -> dict[str, str | None]:
    """Return temperature of the pen and humidity of the room."""
    unknown = translate("paper", "not measured")
    temperature = unknown if temperature_c is None else f"{temperature_c:.1f} \xb0C"
    humidity = unknown if humidity_percent is None else f"{humidity_percent:g} %"
    return {"temperature": temperature, "humidity": humidity}


def laboratory_texts(
    laboratory: Laboratory | None, traced: Sequence[TracedItem]
) -> dict[str, str | None]:
    """Return laboratory, place and procedure, and whether nothing is traced."""
    known = laboratory or Laboratory()
    place = (known.street, f"{known.post_code} {known.city}".strip(), known.country)
    return {
        "laboratory": known.name,
        "place": listed(filter(None, place)),
        "procedure": known.procedure,
        "untraced": condition(not traced),
    }


def traced_rows(traced: Sequence[TracedItem]) -> list[tuple[str, ...]]:
    """Return the certificates of the equipment used."""
    kinds = {
        ItemKind.CAMERA: translate("paper", "Camera (intrinsics)"),
        ItemKind.PEN: translate("paper", "Pen (LED measurement)"),
        ItemKind.TIP: translate("paper", "Probe tip (ball)"),
        ItemKind.CONE: translate("paper", "Cone"),
        ItemKind.REFERENCE: translate("paper", "Reference"),
    }
    unstated = translate("paper", "not stated")
    rows = []
    for each in traced:
        item = each.item
        known = (
            ("", None, None)
            if item is None
            else (item.certificate, item.certified, item.due)
        )
        rows.append((kinds[each.kind], each.id, *(str(k or unstated) for k in known)))
    return rows


def proof_texts(
    name: str, sha256: str, entered: EntryPlace | None
) -> dict[str, str | None]:
    """Return the hashes that bind the report to its file."""
    return {
        "file": name,
        "sha256": sha256,
        "entry": translate("paper", "none") if entered is None else f"{entered.number}",
        "entry_sha256": None if entered is None else entered.sha256,
        "chain": None if entered is None else entered.chain,
    }


def record_number(sha256: str) -> str:
    """Return the number of a report, by the hash of its file."""
    digits = sha256[:NUMBER_LENGTH]
    number = " ".join(digits[i : i + 4] for i in range(0, NUMBER_LENGTH, 4))
    return translate("paper", "No. {0}").format(number)


def signatures(by: str) -> Block:
    """Return the fields for signatures, the first with a title."""
    names = (by, translate("paper", "Checked by"))
    below = translate("paper", "Name, date, signature")
    width, height = WIDTH / 2 - 100, 24 * MM

    def paint(painter: QPainter) -> None:
        for i, name in enumerate(names):
            left = i * (WIDTH / 2 + 100)
            area = QRectF(left, 0, width, PrintSize.BODY)
            draw_text(painter, area, name, PrintSize.BODY, bold=True)
            line = height - 1.6 * PrintSize.SMALL
            painter.setPen(line_pen(LIGHT.text))
            painter.drawLine(round(left), round(line), round(left + width), round(line))
            area = QRectF(left, line + 15, width, PrintSize.SMALL)
            draw_text(painter, area, below, PrintSize.SMALL, LIGHT.muted)

    return Block(paint, height, space=200)
