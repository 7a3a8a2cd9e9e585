"""Sections of a calibration report."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from datetime import datetime

from PySide6.QtCore import QCoreApplication, QRectF
from PySide6.QtGui import QPainter

from lightpen.estimation.reports.verdict import Grade
from lightpen.model.laboratory import Laboratory
from lightpen.model.origin import Origin
from lightpen.record.calibrations.calibrations import CalibrationFile
from lightpen.record.calibrations.export_status import OVERDUE, RETIRED
from lightpen.record.calibrations.reestimated_poses import ReestimatedPoses
from lightpen.record.calibrations.traceability import TracedItem
from lightpen.record.library.entered_files import EntryPlace
from lightpen.record.library.tip_library import ItemKind
from lightpen_app.look.phrases import grade_text, origin_text
from lightpen_app.look.sentences import listed, worded
from lightpen_app.look.theme import LIGHT
from lightpen_app.print_report.blocks import (
    MM,
    WIDTH,
    Block,
    Column,
    PrintSize,
    draw_text,
    facts,
    heading,
    line_pen,
    paragraph,
    printed_text,
    table,
    text_height,
)
from lightpen_app.print_report.evidence import file_blocks, image_blocks, led_blocks
from lightpen_app.print_report.findings import budget_blocks, result_blocks, rule_blocks

translate = QCoreApplication.translate

NUMBER_LENGTH = 12  # digits of the SHA-256 that name a record
GRADE_COLORS = {
    Grade.PASS: LIGHT.good,
    Grade.SCALE: LIGHT.accent,
    Grade.STEADY: LIGHT.accent,
    Grade.CHECK: LIGHT.warn,
    Grade.REPEAT: LIGHT.bad,
}


def all_sections(
    calibration_file: CalibrationFile,
    reestimated: ReestimatedPoses | None,
    entered: EntryPlace | None,
    laboratory: Laboratory | None = None,
) -> tuple[Block, ...]:
    """Return the blocks of the whole report, from its title to its end mark."""
    return (
        *_title(calibration_file),
        *_items(calibration_file),
        *laboratory_blocks(laboratory),
        *traced_blocks(calibration_file.traced),
        *result_blocks(calibration_file),
        *rule_blocks(calibration_file),
        *budget_blocks(calibration_file.calibration),
        *image_blocks(calibration_file.calibration, reestimated),
        *led_blocks(calibration_file.calibration),
        *file_blocks(calibration_file.calibration),
        *proof_blocks(calibration_file.name, calibration_file.sha256, entered),
        *signature_blocks(translate("paper", "Calibrated by")),
    )


def title_text() -> str:
    """Return the title of the report."""
    return translate("paper", "Calibration report")


def zoned_moment_text(moment: datetime) -> str:
    """Return a moment with the time zone that it was written in."""
    return moment.isoformat(sep=" ", timespec="seconds")


def _title(calibration_file: CalibrationFile) -> Iterable[Block]:
    yield paragraph(title_text(), PrintSize.TITLE, bold=True)
    yield paragraph(
        translate("paper", "Probe tip centre of a light pen, image-based"),
        PrintSize.HEADING,
        LIGHT.muted,
    )
    yield _verdict(calibration_file)


def _verdict(calibration_file: CalibrationFile) -> Block:
    word = grade_text(calibration_file.grade)
    lines = [worded(calibration_file.why)]
    if calibration_file.accepted is None:
        lines.append(translate("paper", "This tip has not been accepted."))
    elif calibration_file.origin is Origin.SIMULATED:
        lines.append(translate("paper", "Practice: not used for any pen."))
    elif calibration_file.grade is Grade.PASS:
        lines.append(translate("paper", "The tip was accepted."))
    else:
        lines.append(
            translate("paper", "The tip was accepted. Reason: {0}").format(
                calibration_file.reason
            )
        )
    text, left, pad = "\n".join(lines), 900.0, 60.0
    height = max(
        text_height(text, PrintSize.BODY, WIDTH - left - pad),
        text_height(word, PrintSize.TITLE, left),
    )
    color = GRADE_COLORS[calibration_file.grade]

    def paint(painter: QPainter) -> None:
        painter.setPen(line_pen(color, 15))
        painter.drawRect(QRectF(0, 0, WIDTH, height + 2 * pad))
        area = QRectF(pad, pad, left, height)
        draw_text(painter, area, word, PrintSize.TITLE, color, bold=True)
        area = QRectF(left, pad + 10, WIDTH - left - pad, height)
        draw_text(painter, area, text, PrintSize.BODY)

    return Block(paint, height + 2 * pad, space=110)


def _items(calibration_file: CalibrationFile) -> Iterable[Block]:
    names, calibration = calibration_file.names, calibration_file.calibration
    accepted, due = calibration_file.accepted, calibration_file.due
    measured = calibration_file.measured
    is_practice = calibration_file.origin is Origin.SIMULATED
    diameter = names.ball_diameter
    temperature = calibration.assumptions.temperature_c
    humidity = calibration.assumptions.humidity_percent
    yield heading(translate("paper", "Item under calibration"))
    yield from facts(
        [
            (translate("paper", "Pen serial number"), stated(names.pen)),
            (translate("paper", "Station"), stated(names.station)),
            (translate("paper", "Probe tip"), stated(names.tip)),
            (translate("paper", "Operator"), stated(names.operator)),
            (
                translate("paper", "Ball diameter"),
                stated("" if diameter is None else f"{diameter:g} mm"),
            ),
            (
                translate("paper", "Measured"),
                stated("" if measured is None else zoned_moment_text(measured)),
            ),
            (translate("paper", "Computed"), zoned_moment_text(calibration.created)),
            (translate("paper", "Cone"), stated(names.cone)),
            (
                translate("paper", "Saved")
                if is_practice
                else translate("paper", "Accepted"),
                translate("paper", "no")
                if accepted is None
                else zoned_moment_text(accepted),
            ),
            (translate("paper", "Image source"), origin_text(calibration_file.origin)),
            *environment_facts(temperature, humidity),
            (translate("paper", "Method"), _method(calibration.method)),
            (
                translate("paper", "Next due"),
                stated("" if due is None or is_practice else due.isoformat()),
            ),
            (translate("paper", "Status"), _status(calibration_file)),
            (
                translate("paper", "Program"),
                f"{calibration.program.name} {calibration.program.version}",
            ),
        ]
    )
    given = (names.pen, names.tip, names.cone, names.station, names.operator)
    if any(printed_text(each) != each for each in (*given, calibration_file.reason)):
        yield paragraph(
            translate(
                "paper",
                "[U+...] is the Unicode number of a character missing in the fonts "
                "of this report.",
            )
        )


def environment_facts(
    temperature_c: float | None, humidity_percent: float | None
) -> tuple[tuple[str, str], tuple[str, str]]:
    """Return temperature of the pen and humidity of the room, with their names."""
    unknown = translate("paper", "not measured")
    return (
        (
            translate("paper", "Pen temperature"),
            unknown if temperature_c is None else f"{temperature_c:.1f} \xb0C",
        ),
        (
            translate("paper", "Relative humidity"),
            unknown if humidity_percent is None else f"{humidity_percent:g} %",
        ),
    )


def laboratory_blocks(laboratory: Laboratory | None) -> Iterable[Block]:
    """Return laboratory, place and procedure."""
    known = laboratory or Laboratory()
    place = (known.street, f"{known.post_code} {known.city}".strip(), known.country)
    yield from facts(
        [
            (translate("paper", "Laboratory"), stated(known.name)),
            (translate("paper", "Place"), stated(listed(filter(None, place)))),
            (translate("paper", "Procedure"), stated(known.procedure)),
        ],
        n_columns=1,
    )


def traced_blocks(traced: Sequence[TracedItem]) -> Iterable[Block]:
    """Return the certificates of the equipment used."""
    kinds = {
        ItemKind.CAMERA: translate("paper", "Camera (intrinsics)"),
        ItemKind.PEN: translate("paper", "Pen (LED measurement)"),
        ItemKind.TIP: translate("paper", "Probe tip (ball)"),
        ItemKind.CONE: translate("paper", "Cone"),
        ItemKind.REFERENCE: translate("paper", "Reference"),
    }
    columns = [
        Column(translate("paper", "Measured with"), 1.6),
        Column(translate("paper", "ID"), 1.2),
        Column(translate("paper", "Certificate"), 1.4),
        Column(translate("paper", "Date"), 0.8),
        Column(translate("paper", "Next due"), 0.8),
    ]
    rows = []
    for each in traced:
        item = each.item
        dates = (None, None) if item is None else (item.certified, item.due)
        rows.append(
            (
                *(kinds[each.kind], each.id),
                stated("" if item is None else item.certificate),
                *(stated("" if day is None else day.isoformat()) for day in dates),
            )
        )
    yield heading(translate("paper", "Traceability"))
    if rows:
        yield from table(columns, rows)
    else:
        yield paragraph(stated(""))


def record_number(sha256: str) -> str:
    """Return the number of a report, by the hash of its file."""
    digits = sha256[:NUMBER_LENGTH]
    number = " ".join(digits[i : i + 4] for i in range(0, NUMBER_LENGTH, 4))
    return translate("paper", "No. {0}").format(number)


def proof_blocks(name: str, sha256: str, entered: EntryPlace | None) -> Iterable[Block]:
    """Return the hashes that bind the report to its file."""
    return (replace(block, keeps=True) for block in _binding(name, sha256, entered))


def _binding(name: str, sha256: str, entered: EntryPlace | None) -> Iterable[Block]:
    yield heading(translate("paper", "Source of this report"))
    rows = [(translate("paper", "JSON file"), name), ("SHA-256", sha256)]
    if entered is None:
        nowhere = translate("paper", "none")
        rows.append((translate("paper", "Entry in the archive"), nowhere))
    else:
        rows += [
            (translate("paper", "Entry in the archive"), f"{entered.number}"),
            (translate("paper", "Its SHA-256"), entered.sha256),
            (translate("paper", "Chain of entries"), entered.chain),
        ]
    yield from facts(rows, n_columns=1)
    yield paragraph(
        translate(
            "paper",
            "All figures are taken from this file, which is the complete original. "
            "They relate only to the items named, in their condition at the time. "
            "This is a report, not a certificate of an accredited "
            "laboratory. It must not be reproduced except in full.",
        )
    )


def signature_blocks(by: str) -> Iterable[Block]:
    """Return the fields for signatures, the first with a title, and the end mark."""
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

    yield Block(paint, height, space=200, keeps=True)
    end = translate("paper", "End of report")
    yield paragraph(f"\u2014 {end} \u2014", PrintSize.SMALL, LIGHT.muted)


def _status(calibration_file: CalibrationFile) -> str:
    """Return the library entries of pen and tip."""
    if calibration_file.origin is Origin.SIMULATED:
        return translate("paper", "practice")
    if calibration_file.due is None:
        return stated("")
    return listed(status_words(calibration_file)) or translate("paper", "valid")


def status_words(calibration_file: CalibrationFile) -> tuple[str, ...]:
    """Return why pen or tip are not valid."""
    words = {
        RETIRED: translate("paper", "RETIRED"),
        OVERDUE: translate("paper", "OVERDUE"),
    }
    return tuple(words[each] for each in calibration_file.library_status)


def _method(method: str) -> str:
    if method == "joint":
        return translate("paper", "joint adjustment of all images")
    return translate("paper", "two-stage, as published by S. Liu et al. (2013)")


def stated(text: str) -> str:
    """Return a text, or that it is not stated."""
    return text or translate("paper", "not stated")
