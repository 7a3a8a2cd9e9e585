"""Sections of the report of a measured part, from its record."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from PySide6.QtCore import QCoreApplication, QPointF, QRectF
from PySide6.QtGui import QColor, QPainter

from lightpen.arrays import FloatArray
from lightpen.record.folder.verifications import BALL_CENTRE
from lightpen_app.look.quantities import number_text
from lightpen_app.look.theme import LIGHT
from lightpen_app.print_report.blocks import (
    MM,
    RIGHT,
    WIDTH,
    Block,
    Column,
    PrintSize,
    draw_text,
    heading,
    line_pen,
    paragraph,
    table,
    text_height,
    text_width,
)

translate = QCoreApplication.translate

HEIGHT = 80 * MM  # of the plot
DOT = 22.0  # dots, across
WHISKER = 200.0  # times a deviation is drawn
N_DECIMALS = 4


def part_blocks(record: Mapping[str, Any]) -> Iterator[Block]:
    """Yield characteristics, features, alignment, points and plan."""
    yield heading(translate("paper", "Characteristics / mm, degrees"))
    yield from _characteristics(record["characteristics"])
    yield heading(translate("paper", "Features / mm, degrees"))
    yield from _features(record["features"])
    yield from _alignment(record["alignment"])
    yield heading(translate("paper", "Points"))
    yield from _points(record["touches"])
    yield heading(translate("paper", "Measuring plan"))
    yield from _plan(record["plan"])


def _numbers(*columns: str) -> list[Column]:
    return [Column(each, 1.0, RIGHT) for each in columns]


def _text(value: float | None) -> str:
    return "" if value is None else number_text(value, N_DECIMALS)


def _characteristics(entries: list[dict[str, Any]]) -> Iterator[Block]:
    columns = [Column(translate("paper", "Characteristic"), 2.2)]
    columns += _numbers(
        translate("paper", "Nominal"),
        translate("paper", "Lower limit"),
        translate("paper", "Upper limit"),
        translate("paper", "Actual"),
        translate("paper", "Deviation"),
        translate("paper", "U (k = 2)"),
        translate("paper", "P"),
    )
    columns.append(Column(translate("paper", "Decision"), 1.2))
    yield from table(
        columns,
        [
            [
                each["name"],
                *(
                    _text(each[name])
                    for name in (
                        *("nominal", "lower_limit", "upper_limit", "actual"),
                        *("deviation", "expanded_uncertainty"),
                        *("probability_of_conformity",),
                    )
                ),
                each["decision"] or "",
            ]
            for each in entries
        ],
        strong=[i for i, e in enumerate(entries) if e["decision"] == "rejected"],
        size=PrintSize.SMALL,
    )
    yield paragraph(
        translate("paper", "P: probability of conformity (JCGM 106)."), PrintSize.SMALL
    )


def _features(entries: list[dict[str, Any]]) -> Iterator[Block]:
    columns = [
        Column(translate("paper", "Feature"), 1.3),
        Column(translate("paper", "Kind"), 2.1),
        *_numbers("x", "y", "z", translate("paper", "U (k = 2)")),
        Column(translate("paper", "Sizes"), 2.2),
        *_numbers(translate("paper", "Form error"), translate("paper", "Points")),
    ]
    rows = []
    for each in entries:
        sizes = ", ".join(f"{k} {_text(v)}" for k, v in _sizes(each["sizes"]))
        rows.append(
            [
                *(each["name"], _kind(each)),
                *map(_text, each["origin_mm"]),
                _text(max(each["expanded_uncertainty"][:3])),
                *(sizes, _text(each["form_error_mm"]), str(each["n_touches"])),
            ]
        )
    yield from table(columns, rows, size=PrintSize.SMALL)


def _kind(feature: Mapping[str, Any]) -> str:
    """Return the kind of a feature, with the side of the ball and its evidence."""
    kind, by = feature["kind"], feature["side_by"]
    if by == BALL_CENTRE:
        return str(kind)
    return f"{kind}, {feature['side']} ({by})"


def _sizes(sizes: Mapping[str, float]) -> Iterator[tuple[str, float]]:
    """Yield the sizes of a feature as a plan states them, mm and degrees."""
    if "radius" in sizes:
        yield "diameter", 2 * sizes["radius"]
    if "half_angle" in sizes:
        yield "angle", 2 * float(np.rad2deg(sizes["half_angle"]))


def _alignment(alignment: dict[str, Any] | None) -> Iterator[Block]:
    if alignment is None:
        text = translate("paper", "Coordinates are in the frame of the camera.")
        yield paragraph(text)
        return
    yield paragraph(
        translate("paper", "Coordinates are in the frame of the part. Camera to part:")
    )
    turn = alignment["part_from_cam_rotation"]
    shift = alignment["part_from_cam_translation_mm"]
    rows = [
        ["xyz"[i], *(f"{x:.8f}" for x in turn[i]), _text(shift[i])] for i in range(3)
    ]
    columns = [Column("", 0.3), *_numbers("u", "v", "w", translate("paper", "Shift"))]
    yield from table(columns, rows, size=PrintSize.SMALL)


def _points(touches: list[dict[str, Any]]) -> Iterator[Block]:
    """Yield a plot of all points with their deviations, from the flattest side."""
    points = np.array([each["point_cam_mm"] for each in touches])
    off = np.array([each["deviation_cam_mm"] or [0, 0, 0] for each in touches])
    middle = points.mean(axis=0)
    axes = np.linalg.svd(points - middle, full_matrices=False)[2]
    if len(axes) < 2:
        return
    flat = (points - middle) @ axes[:2].T
    ends = flat + WHISKER * off @ axes[:2].T
    yield Block(lambda painter: _draw(painter, flat, ends, touches), HEIGHT, space=60)
    text = translate(
        "paper", "{0} points; deviations are drawn {1} times as large, at most {2} mm."
    )
    largest = number_text(float(np.linalg.norm(off, axis=1).max()), N_DECIMALS)
    yield paragraph(text.format(len(points), round(WHISKER), largest), PrintSize.SMALL)


def _draw(
    painter: QPainter, flat: FloatArray, ends: FloatArray, touches: list[dict[str, Any]]
) -> None:
    low, high = flat.min(axis=0), flat.max(axis=0)
    room = np.array([0.8 * WIDTH, 0.8 * HEIGHT])
    scale = float((room / np.maximum(high - low, 1.0)).min())
    center = np.array([WIDTH / 2, HEIGHT / 2])

    def placed(points: FloatArray) -> list[QPointF]:
        at = (points - (low + high) / 2) * scale + center
        return [QPointF(*each) for each in at.tolist()]

    painter.setPen(line_pen(LIGHT.pointer, 10.0))
    dots = placed(flat)
    for dot, end in zip(dots, placed(ends), strict=True):
        painter.drawLine(dot, end)
    painter.setPen(line_pen(LIGHT.text))
    painter.setBrush(QColor(LIGHT.text))
    for dot in dots:
        painter.drawEllipse(dot, DOT, DOT)
    names = [each["feature"] for each in touches]
    taken = [QRectF(dot.x() - DOT, dot.y() - DOT, 2 * DOT, 2 * DOT) for dot in dots]
    for name in dict.fromkeys(names):
        own = np.array([each == name for each in names])
        (place,) = placed(flat[own].mean(axis=0, keepdims=True))
        area = _free_area(place, name, taken)
        taken.append(area)
        draw_text(painter, area, name, PrintSize.SMALL, LIGHT.muted)


def _free_area(place: QPointF, text: str, taken: list[QRectF]) -> QRectF:
    """Return the nearest position of a text to a place where it covers least."""
    width = text_width(text, PrintSize.SMALL) + DOT
    height = text_height(text, PrintSize.SMALL, width)
    areas = [
        QRectF(place.x() + across * width, place.y() + up * height, width, height)
        for up in sorted(np.arange(-4, 4, 0.5).tolist(), key=lambda x: abs(x + 0.5))
        for across in (-0.5, 0.1, -1.1)
    ]

    def covered(area: QRectF) -> float:
        shared = [area.intersected(each) for each in taken]
        return sum(each.width() * each.height() for each in shared)

    return min(areas, key=covered)


def _plan(plan: dict[str, Any]) -> Iterator[Block]:
    columns = [
        Column(translate("paper", "Feature"), 1.2),
        Column(translate("paper", "Kind"), 0.8),
        Column(translate("paper", "Nominals / mm, degrees"), 3.0),
    ]
    rows = [
        [
            *(each["name"], each["kind"]),
            ", ".join(f"{k} {v}" for k, v in each.get("nominal", {}).items() if v),
        ]
        for each in plan["features"]
    ]
    yield from table(columns, rows, size=PrintSize.SMALL)
