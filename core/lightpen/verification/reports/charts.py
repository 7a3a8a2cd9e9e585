"""The control chart of a tip, as a table and as a picture."""

from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
from typing_extensions import override

from lightpen.errors import UsageError
from lightpen.formats.csv_cells import csv_table
from lightpen.formats.files import write_whole
from lightpen.messages import printable
from lightpen.verification.tasks.repeatability import Repeatability

WIDTH, HEIGHT, MARGIN = 720, 200, 60  # px, of the chart of one coordinate
COLOURS = {"line": "#1f5fa8", "center": "#3a3a3a", "limit": "#b3261e"}


def write_chart(found: Repeatability, path: Path) -> None:
    """Write the control chart of a tip as .csv or .svg, by the suffix of its name."""
    suffix = path.suffix.lower()
    if suffix == ".csv":
        text = _table(found)
    elif suffix == ".svg":
        text = _picture(found)
    else:
        raise UsageError("chart.suffix", name=printable(path.name))
    write_whole(path, text.encode("utf-8", "backslashreplace"))


def _table(found: Repeatability) -> str:
    header = "number,name,axis,value_mm,lower_mm,center_mm,upper_mm"
    rows: list[list[object]] = [list(header.split(","))]
    for i, tip in enumerate(found.tips):
        for k, axis in enumerate("xyz"):
            # Rounded numbers, not texts: a minus makes no formula of them.
            numbers = map(_Rounded, (tip.tip_pen[k], *_lines(found, k)))
            rows.append([i + 1, tip.name, axis, *numbers])
    return csv_table(rows)


def _lines(found: Repeatability, k: int) -> tuple[float, ...]:
    """Return lower limit, centre and upper limit, if there are any."""
    control = found.control
    if control is None:
        return ()
    return tuple(float(e[k]) for e in (control.lower, control.center, control.upper))


class _Rounded(float):
    """A number that is written with six decimals."""

    @override
    def __repr__(self) -> str:
        return f"{self:.6f}"


def _picture(found: Repeatability) -> str:
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" '
        f'height="{3 * HEIGHT}" font-family="sans-serif" font-size="12">',
        f'<rect width="{WIDTH}" height="{3 * HEIGHT}" fill="white"/>',
    ]
    for k, axis in enumerate("xyz"):
        parts += _coordinate(found, k, axis)
    return "\n".join([*parts, "</svg>"]) + "\n"


def _coordinate(found: Repeatability, k: int, axis: str) -> list[str]:
    lines, values = _lines(found, k), found.scatter.points[:, k]
    ends = np.array([values.min(), values.max(), *lines])
    low, high = float(ends.min()), float(ends.max())
    reach = max(high - low, 1e-9)
    top, height = k * HEIGHT + 30, HEIGHT - 50

    def place(value: float) -> float:
        return top + height * (high - value) / reach

    def across(i: int) -> float:
        return MARGIN + (WIDTH - 2 * MARGIN) * (i + 0.5) / len(values)

    parts = [f'<text x="8" y="{k * HEIGHT + 18}">{axis}, mm</text>']
    for value, kind in zip(lines, ("limit", "center", "limit"), strict=False):
        y = place(value)
        parts.append(
            f'<line x1="{MARGIN}" y1="{y:.1f}" x2="{WIDTH - MARGIN}" y2="{y:.1f}" '
            f'stroke="{COLOURS[kind]}" stroke-dasharray="4 3"/>'
            f'<text x="{WIDTH - MARGIN + 4}" y="{y + 4:.1f}">{value:.4f}</text>'
        )
    points = " ".join(f"{across(i):.1f},{place(v):.1f}" for i, v in enumerate(values))
    parts.append(
        f'<polyline points="{points}" fill="none" stroke="{COLOURS["line"]}"/>'
    )
    for i, value in enumerate(values):
        is_beyond = bool(lines) and not lines[0] <= value <= lines[-1]
        kind = "limit" if is_beyond else "line"
        parts.append(
            f'<circle cx="{across(i):.1f}" cy="{place(value):.1f}" r="3.5" '
            f'fill="{COLOURS[kind]}"><title>{escape(found.tips[i].name)}: '
            f"{value:.4f}</title></circle>"
        )
    return parts
