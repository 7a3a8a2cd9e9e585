"""A board as a PDF page of vector graphics at true scale.

References
----------
.. [1] ISO 32000-1:2008, "Document management - Portable document format", sections
   7.5 and 8.5.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lightpen.arrays import BoolArray
from lightpen.errors import UsageError
from lightpen.intrinsics.boards import Board, marker_dictionary

POINTS_A_MM = 72 / 25.4
PAPERS = {  # mm
    "A4": (210.0, 297.0),
    "A3": (297.0, 420.0),
    "A2": (420.0, 594.0),
    "A1": (594.0, 841.0),
    "A0": (841.0, 1189.0),
    "letter": (215.9, 279.4),
}
MARGIN = 8.0  # mm, which printers leave white
FOOT = 18.0  # mm, for the scale and the words
RULER = 100.0  # mm
QUARTER = 0.5522847498  # of the radius: control points of a quarter of a circle


@dataclass(frozen=True)
class _Drawing:
    """A drawing of a board: size in mm, and filled areas."""

    width: float
    height: float
    areas: tuple[str, ...]


def board_page(board: Board, paper: str | None = None) -> bytes:
    """Return a page with the board at true scale, as PDF.

    ``paper`` is one of `PAPERS`, by default the smallest that holds the board. Raises
    `UsageError` if the board is larger.
    """
    drawing = _draw(board)
    width, height = _page_size(board, drawing, paper)
    left, top = 0.5 * (width - drawing.width), MARGIN
    shift = f"1 0 0 -1 {left:.4f} {height - top:.4f} cm"
    content = "\n".join(
        [
            f"{POINTS_A_MM:.10f} 0 0 {POINTS_A_MM:.10f} 0 0 cm",
            "0 g",
            "q",
            shift,
            *drawing.areas,
            "Q",
            *_foot(board, left),
        ]
    )
    return _pdf(content, width, height)


def _page_size(
    board: Board, drawing: _Drawing, paper: str | None
) -> tuple[float, float]:
    """Return the size of the sheet in its orientation, mm."""
    needed = drawing.width + 2 * MARGIN, drawing.height + MARGIN + FOOT
    sizes = PAPERS.values() if paper is None else [PAPERS[paper]]
    for short, long in sizes:
        for size in ((short, long), (long, short)):
            if needed[0] <= size[0] and needed[1] <= size[1]:
                return size
    raise UsageError(
        "board.no-paper",
        board=board.name,
        width=drawing.width,
        height=drawing.height,
        foot=MARGIN,
    )


def _draw(board: Board) -> _Drawing:
    if board.kind.is_circles:
        return _draw_circles(board)
    extra = 0 if board.kind.has_markers else 1
    columns, rows = board.columns + extra, board.rows + extra
    areas, number = [], 0
    gap = 0.5 * (board.pitch - board.detail)
    for row in range(rows):
        for column in range(columns):
            x, y = column * board.pitch, row * board.pitch
            if (row + column) % 2 == 0:
                areas.append(_rectangle(x, y, board.pitch, board.pitch))
            elif board.kind.has_markers:
                areas += _marker(board, number, x + gap, y + gap, board.detail)
                number += 1
    return _Drawing(columns * board.pitch, rows * board.pitch, tuple(areas))


def _draw_circles(board: Board) -> _Drawing:
    points = board.points[:, :2]
    points = points - points.min(axis=0) + board.detail
    areas = tuple(_circle(x, y, 0.5 * board.detail) for x, y in points.tolist())
    width, height = (points.max(axis=0) + board.detail).tolist()
    return _Drawing(width, height, areas)


def _marker(board: Board, number: int, x: float, y: float, side: float) -> list[str]:
    """Return the black cells of a marker, runs of them in one."""
    dictionary = marker_dictionary(board)
    n_cells = dictionary.markerSize + 2
    black = np.asarray(dictionary.generateImageMarker(number, n_cells)) < 128
    cell = side / n_cells
    return [
        _rectangle(x + begin * cell, y + row * cell, (end - begin) * cell, cell)
        for row, begin, end in _runs(black)
    ]


def _runs(black: BoolArray) -> Iterator[tuple[int, int, int]]:
    """Yield row, begin and end of black runs."""
    for row, cells in enumerate(black):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], cells, [0]]).astype(int)))
        for begin, end in edges.reshape(-1, 2).tolist():
            yield row, begin, end


def _rectangle(x: float, y: float, width: float, height: float) -> str:
    return f"{x:.5f} {y:.5f} {width:.5f} {height:.5f} re f"


def _circle(x: float, y: float, r: float) -> str:
    c = QUARTER * r
    curves = [
        (x + r, y + c, x + c, y + r, x, y + r),
        (x - c, y + r, x - r, y + c, x - r, y),
        (x - r, y - c, x - c, y - r, x, y - r),
        (x + c, y - r, x + r, y - c, x + r, y),
    ]
    drawn = " ".join(
        " ".join(f"{value:.5f}" for value in curve) + " c" for curve in curves
    )
    return f"{x + r:.5f} {y:.5f} m {drawn} f"


def _foot(board: Board, left: float) -> list[str]:
    """Return a scale of 100 mm and the description, above the lower edge."""
    ticks = [
        f"{left + x:.4f} {MARGIN:.4f} m {left + x:.4f} {MARGIN + 2:.4f} l S"
        for x in np.arange(0.0, RULER + 1, 10.0).tolist()
    ]
    words = (
        f"{board.name}   Print at 100 %: the scale is 100 mm long. "
        "Mount it flat, measure the board."
    )
    return [
        "0.15 w",
        f"{left:.4f} {MARGIN:.4f} m {left + RULER:.4f} {MARGIN:.4f} l S",
        *ticks,
        f"BT /F1 2.6 Tf {left:.4f} {MARGIN + 3.2:.4f} Td ({words}) Tj ET",
    ]


def _pdf(content: str, width: float, height: float) -> bytes:
    box = f"[0 0 {width * POINTS_A_MM:.4f} {height * POINTS_A_MM:.4f}]"
    stream = content.encode("ascii")
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R "
        b"/ViewerPreferences << /PrintScaling /None >> >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox {box} /Contents 4 0 R "
        "/Resources << /Font << /F1 5 0 R >> >> >>".encode(),
        f"<< /Length {len(stream)} >>\nstream\n".encode() + stream + b"\nendstream",
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
    ]
    data = b"%PDF-1.6\n"
    places = []
    for number, each in enumerate(objects, 1):
        places.append(len(data))
        data += f"{number} 0 obj\n".encode() + each + b"\nendobj\n"
    table = "".join(f"{place:010d} 00000 n \n" for place in places)
    end = (
        f"xref\n0 {len(objects) + 1}\n0000000000 65535 f \n{table}"
        f"trailer\n<< /Size {len(objects) + 1} /Root 1 0 R >>\n"
        f"startxref\n{len(data)}\n%%EOF\n"
    )
    return data + end.encode()
