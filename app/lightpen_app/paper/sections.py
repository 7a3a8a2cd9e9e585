"""What a record on paper says, section by section, from what the file states."""

from collections.abc import Iterable
from dataclasses import replace
from datetime import datetime

from PySide6.QtCore import QCoreApplication, QRectF
from PySide6.QtGui import QPainter

from lightpen.estimation.verdict import Grade
from lightpen.record.retraced import Retraced
from lightpen.record.statement import Entered, Statement
from lightpen_app.look.phrases import grade_text, origin_text
from lightpen_app.look.theme import LIGHT
from lightpen_app.paper.evidence import file_pieces, image_pieces, led_pieces
from lightpen_app.paper.findings import budget_pieces, result_pieces, rule_pieces
from lightpen_app.paper.pieces import (
    MM,
    WIDTH,
    Piece,
    PrintSize,
    draw_text,
    facts,
    heading,
    line_pen,
    paragraph,
    printed_text,
    text_height,
)
from lightpen_app.paper.recorded_words import worded_anew

translate = QCoreApplication.translate

GRADE_COLORS = {
    Grade.PASS: LIGHT.good,
    Grade.CHECK: LIGHT.warn,
    Grade.REPEAT: LIGHT.bad,
}


def all_sections(
    statement: Statement, retraced: Retraced | None, entered: Entered | None
) -> tuple[Piece, ...]:
    """Return the whole record, from its title to its end mark."""
    return (
        *_title(statement),
        *_items(statement),
        *result_pieces(statement),
        *rule_pieces(statement),
        *budget_pieces(statement.calibration),
        *image_pieces(statement.calibration, retraced),
        *led_pieces(statement.calibration),
        *file_pieces(statement.calibration),
        *_proof(statement, entered),
        *_signatures(),
    )


def title_text() -> str:
    """Return what the paper is."""
    return translate("paper", "Calibration record")


def zoned_moment_text(moment: datetime) -> str:
    """Return a moment with the time zone that it was written in."""
    return moment.isoformat(sep=" ", timespec="seconds")


def _title(statement: Statement) -> Iterable[Piece]:
    yield paragraph(title_text(), PrintSize.TITLE, bold=True)
    yield paragraph(
        translate("paper", "Centre of the probe tip of a light pen, by images"),
        PrintSize.HEADING,
        LIGHT.muted,
    )
    yield _verdict(statement)


def _verdict(statement: Statement) -> Piece:
    """Return the grade in a frame, with its reason."""
    word = grade_text(statement.grade)
    lines = [worded_anew(statement.why.text)]
    if statement.accepted is None:
        lines.append(translate("paper", "This tip was not accepted."))
    elif statement.restores is not None:
        told = translate(
            "paper",
            "This tip of an earlier calibration was put in force again, with the "
            "reason: {0}",
        )
        lines.append(told.format(statement.reason))
    elif statement.grade is Grade.PASS:
        lines.append(translate("paper", "The tip was accepted."))
    else:
        lines.append(
            translate("paper", "The tip was accepted with the reason: {0}").format(
                statement.reason
            )
        )
    text, left, pad = "\n".join(lines), 900.0, 60.0
    height = max(
        text_height(text, PrintSize.BODY, WIDTH - left - pad),
        text_height(word, PrintSize.TITLE, left),
    )
    color = GRADE_COLORS[statement.grade]

    def paint(painter: QPainter) -> None:
        painter.setPen(line_pen(color, 15))
        painter.drawRect(QRectF(0, 0, WIDTH, height + 2 * pad))
        area = QRectF(pad, pad, left, height)
        draw_text(painter, area, word, PrintSize.TITLE, color, bold=True)
        area = QRectF(left, pad + 10, WIDTH - left - pad, height)
        draw_text(painter, area, text, PrintSize.BODY)

    return Piece(paint, height + 2 * pad, space=110)


def _items(statement: Statement) -> Iterable[Piece]:
    names, calibration = statement.names, statement.calibration
    accepted = statement.accepted
    diameter, temperature = (
        names.ball_diameter,
        calibration.assumptions.get("temperature_c"),
    )
    yield heading(translate("paper", "What was calibrated"))
    yield from facts(
        [
            (translate("paper", "Pen, serial number"), _stated(names.pen)),
            (translate("paper", "Station"), _stated(names.station)),
            (translate("paper", "Probe tip"), _stated(names.tip)),
            (translate("paper", "Operator"), _stated(names.operator)),
            (
                translate("paper", "Ball diameter"),
                _stated("" if diameter is None else f"{diameter:g} mm"),
            ),
            (
                translate("paper", "Computed"),
                zoned_moment_text(calibration.created),
            ),
            (translate("paper", "Cone"), _stated(names.cone)),
            (
                translate("paper", "Accepted"),
                translate("paper", "no")
                if accepted is None
                else zoned_moment_text(accepted),
            ),
            (translate("paper", "Images are"), origin_text(statement.origin)),
            (
                translate("paper", "Temperature of the pen"),
                translate("paper", "not measured")
                if temperature is None
                else f"{temperature:.1f} \xb0C",
            ),
            (translate("paper", "Method"), _method(calibration.method)),
            (
                translate("paper", "Program"),
                f"{calibration.program.name} {calibration.program.version}",
            ),
        ]
    )
    stated = (names.pen, names.tip, names.cone, names.station, names.operator)
    if any(printed_text(each) != each for each in (*stated, statement.reason)):
        yield paragraph(
            translate(
                "paper",
                "What stands as [U+...] is the Unicode number of a character that the "
                "fonts of this paper do not have.",
            )
        )


def _proof(statement: Statement, entered: Entered | None) -> Iterable[Piece]:
    """Return what binds the paper to its file; the signatures stand on its page."""
    return (replace(piece, keeps=True) for piece in _binding(statement, entered))


def _binding(statement: Statement, entered: Entered | None) -> Iterable[Piece]:
    yield heading(translate("paper", "The file behind this paper"))
    rows = [
        (translate("paper", "JSON file"), statement.file),
        ("SHA-256", statement.sha256),
    ]
    if entered is None:
        nowhere = translate("paper", "none")
        rows.append((translate("paper", "Entry in the archive"), nowhere))
    else:
        rows += [
            (translate("paper", "Entry in the archive"), f"{entered.number}"),
            (translate("paper", "Its SHA-256"), entered.sha256),
            (translate("paper", "SHA-256 of the entry before"), entered.previous),
        ]
    yield from facts(rows, n_columns=1)
    unchecked = translate(
        "paper", "The file has no checksum: a change of it would not have been noticed."
    )
    if not statement.is_checked:
        yield paragraph(unchecked)
    yield paragraph(
        translate(
            "paper",
            "All figures are of that file alone, which holds more and is the original. "
            "They relate only to the items named, as they were at that time. This is a "
            "calibration record, not a certificate of an accredited laboratory. It is "
            "to be copied whole or not at all.",
        )
    )


def _signatures() -> Iterable[Piece]:
    names = (translate("paper", "Calibrated by"), translate("paper", "Checked by"))
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

    yield Piece(paint, height, space=200, keeps=True)
    end = translate("paper", "End of the record")
    yield paragraph(f"\u2014 {end} \u2014", PrintSize.SMALL, LIGHT.muted)


def _method(method: str) -> str:
    if method == "joint":
        return translate("paper", "joint adjustment of all images")
    return translate("paper", "two-stage, as published by S. Liu et al. (2013)")


def _stated(text: str) -> str:
    return text or translate("paper", "not stated")
