"""Where pieces stand on pages."""

from dataclasses import replace

from PySide6.QtGui import QPainter

from lightpen_app.print_report.blocks import (
    Block,
    Column,
    PrintSize,
    heading,
    table,
    text_width,
)
from lightpen_app.print_report.charts import fitting_size
from lightpen_app.print_report.pages import PlacedBlock, lay_out

ROOM = 100.0


def paint_nothing(_: QPainter) -> None:
    """Draw nothing: pages are put together without it."""


def block(height: float, space: float = 0.0) -> Block:
    return Block(paint_nothing, height, space)


def tops(page: tuple[PlacedBlock, ...]) -> list[float]:
    return [placed.top for placed in page]


def test_blocks_stand_below_each_other_and_go_on_on_the_next_page() -> None:
    pages = lay_out([block(40), block(40, space=10), block(40, space=10)], ROOM)

    assert [tops(page) for page in pages] == [[0, 50], [0]]


def test_what_fills_a_page_to_its_end_stays_on_it() -> None:
    assert len(lay_out([block(60), block(40)], ROOM)) == 1
    assert len(lay_out([block(60), block(41)], ROOM)) == 2


def test_a_heading_goes_with_what_follows() -> None:
    title = replace(block(20), keeps=True)

    first, second = lay_out([block(60), title, block(40)], ROOM)

    assert second[0].block is title
    assert len(first) == 1


def test_a_block_higher_than_a_page_has_one_to_itself() -> None:
    pages = lay_out([block(10), block(300), block(10)], ROOM)

    assert [len(page) for page in pages] == [1, 1, 1]


def test_the_head_of_a_table_is_repeated_where_it_goes_on() -> None:
    rows = table([Column("LED"), Column("rms")], [(str(i), "0.003") for i in range(9)])
    room = rows[0].height + 5 * rows[1].height

    pages = lay_out(rows, room)

    assert len(pages) == 2
    assert all(page[0].block is rows[0] for page in pages)
    shown = [placed.block for page in pages for placed in page[1:]]
    assert shown == list(rows[1:])


def test_the_last_row_of_a_table_does_not_stand_alone() -> None:
    rows = table([Column("LED")], [(str(i),) for i in range(6)])

    pages = lay_out(rows, rows[0].height + 5 * rows[1].height)

    assert [len(page) for page in pages] == [5, 3]


def test_the_first_row_of_a_table_does_not_stand_alone() -> None:
    rows = table([Column("LED")], [(str(i),) for i in range(6)])
    head = rows[0].height + rows[0].space

    pages = lay_out([block(50), *rows], 50 + head + 1.5 * rows[1].height)

    assert len(pages[0]) == 1
    assert pages[1][0].block is rows[0]


def test_a_title_keeps_off_the_names_of_series_beside_it() -> None:
    title = "Tip from the first n images minus result / µm"
    whole = text_width(title, PrintSize.BODY, bold=True)

    assert fitting_size(title, whole) == PrintSize.BODY
    size = fitting_size(title, 0.9 * whole)
    assert text_width(title, size, bold=True) <= 0.91 * whole


def test_no_heading_ends_a_page() -> None:
    blocks = [block(10), heading("Images"), replace(block(20), keeps=True), block(30)]
    room = sum(each.height + each.space for each in blocks[:-1])

    _, second = lay_out(blocks, room)

    assert len(second) == 3
