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
    WIDTH,
    Block,
    PrintSize,
    draw_text,
    line_pen,
    text_height,
    text_width,
)
from lightpen_app.print_report.template import Content, condition, fill

translate = QCoreApplication.translate

HEIGHT = 80 * MM  # of the plot
DOT = 22.0  # dots, across
WHISKER = 200.0  # times a deviation is drawn
N_DECIMALS = 4
FIGURES = (
    *("nominal", "lower_limit", "upper_limit", "actual", "deviation"),
    *("expanded_uncertainty", "probability_of_conformity"),
)


def part_blocks(record: Mapping[str, Any]) -> tuple[Block, ...]:
    """Return characteristics, budget, features, alignment, points and plan."""
    characteristics, alignment = record["characteristics"], record["alignment"]
    rejected = [i for i, e in enumerate(characteristics) if e["decision"] == "rejected"]
    point_texts, points = _points(record["touches"])
    texts = {
        "aligned": condition(alignment is not None),
        "unaligned": condition(alignment is None),
        **point_texts,
    }
    tables = {
        "characteristics": [
            (
                each["name"],
                *(_text(each[name]) for name in FIGURES),
                each["decision"] or "",
            )
            for each in characteristics
        ],
        "features": [_feature_row(each) for each in record["features"]],
        "alignment": _alignment_rows(alignment),
        "plan": [
            (
                *(each["name"], each["kind"]),
                ", ".join(f"{k} {v}" for k, v in each.get("nominal", {}).items() if v),
            )
            for each in record["plan"]["features"]
        ],
    }
    strong = {"characteristics": rejected}
    return fill("part", Content(texts, tables, strong, drawn={"points": points}))


def _text(value: float | None) -> str:
    return "" if value is None else number_text(value, N_DECIMALS)


def _feature_row(feature: Mapping[str, Any]) -> tuple[str, ...]:
    sizes = ", ".join(f"{k} {_text(v)}" for k, v in _sizes(feature["sizes"]))
    return (
        *(feature["name"], _kind(feature)),
        *map(_text, feature["origin_mm"]),
        _text(max(feature["expanded_uncertainty"][:3])),
        *(sizes, _text(feature["form_error_mm"]), str(feature["n_touches"])),
    )


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


def _alignment_rows(alignment: dict[str, Any] | None) -> list[tuple[str, ...]]:
    if alignment is None:
        return []
    turn = alignment["part_from_cam_rotation"]
    shift = alignment["part_from_cam_translation_mm"]
    return [
        ("xyz"[i], *(f"{x:.8f}" for x in turn[i]), _text(shift[i])) for i in range(3)
    ]


def _points(
    touches: list[dict[str, Any]],
) -> tuple[dict[str, str | None], tuple[Block, ...]]:
    """Return a plot of all points with their deviations, from the flattest side."""
    points = np.array([each["point_cam_mm"] for each in touches])
    off = np.array([each["deviation_cam_mm"] or [0, 0, 0] for each in touches])
    middle = points.mean(axis=0)
    axes = np.linalg.svd(points - middle, full_matrices=False)[2]
    texts: dict[str, str | None] = {
        "n_points": str(len(points)) if len(axes) > 1 else None,
        "enlargement": f"{WHISKER:.0f}",
        "largest_deviation": _text(float(np.linalg.norm(off, axis=1).max())),
    }
    if len(axes) < 2:
        return texts, ()
    flat = (points - middle) @ axes[:2].T
    ends = flat + WHISKER * off @ axes[:2].T
    plot = Block(lambda painter: _draw(painter, flat, ends, touches), HEIGHT, space=60)
    return texts, (plot,)


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
