"""Tests of tables in delimited text."""

import contextlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.formats.pen_files import PEN_FILE
from lightpen.formats.spreadsheets import table_text
from lightpen.formats.tables import Table, number_flaw, parse_table
from lightpen.messages import message

LEDS = message("table.of-leds")
COLUMNS = (("led",), ("x_mm",), ("y_mm",))
NUMBERS = [[1, 0.5, -2.25], [2, 60.125, 1e-7], [3, 120.0, 3e2]]


def numbers(table: Table) -> list[list[float]]:
    rows: list[list[float]] = table.numbers(table.columns(COLUMNS, LEDS)).tolist()
    return rows


def all_numbers(text: str) -> FloatArray:
    table = parse_table(text, "lp04_leds.csv")
    return table.numbers(range(table.n_columns))


def refusal(text: str) -> str:
    with pytest.raises(FileError) as info:
        all_numbers(text)
    return str(info.value)


@pytest.mark.parametrize(
    "text",
    [
        "led,x_mm,y_mm\n1,0.5,-2.25\n2,60.125,1e-7\n3,120,3E2\n",
        "led;x_mm;y_mm\n1;0.5;-2.25\n2;60.125;1e-7\n3;120;3E2\n",
        "led;x_mm;y_mm\n1;0,5;-2,25\n2;60,125;1e-7\n3;120;3E2\n",
        "led\tx_mm\ty_mm\n1\t0,5\t-2,25\n2\t60,125\t1e-7\n3\t120\t3E2",
        "1,0.5,-2.25\n2,60.125,1e-7\n3,120,3e2",
        "  1   0.5  -2.25\n  2  60.125  1e-7\n  3 120.    3e2\n",
        "\n# from the machine; 20 degrees, 3 runs\nled , x_mm, y_mm\n\n"
        "1, .5, -2.25\n  # back plane\n2, +60.125, 1e-7\n3, 120, 3e2\n\n\n",
        '"led"  "x_mm"  y_mm\n"1"   0.5  "-2.25"\n2  60.125 1e-7\n3 120 3e2',
        '"led","x_mm","y_mm"\n"1","0.5","-2.25"\n"2","60.125","1e-7"\n3,120,"3e2"\n',
        'LED;X_mm;Y_MM;"note; if any"\n1;0,5;-2,25;"a;b"\n2;60,125;1e-7;\n3;120;300;c',
        "led,x_mm,y_mm,\n1,0.5,-2.25,\n2,60.125,1e-7,\n3,120,3e2,\n",
        "y_mm,led,name,x_mm\n-2.25,1,a,0.5\n1e-7,2,b,60.125\n300,3,c,120\n",
        "sep=;\nled;x_mm;y_mm\n1;0,5;-2,25\n2;60,125;1e-7\n3;120;3e2\n",
    ],
    ids=[
        *("commas", "semicolons", "decimal commas", "tabs", "no header", "blanks"),
        *(
            "comments",
            "quotes and blanks",
            "quotes",
            "text with separators",
            "separator at the end",
        ),
        *("other order", "hint for Excel"),
    ],
)
def test_every_layout_gives_the_same_numbers(text: str) -> None:
    assert numbers(parse_table(text, "leds.csv")) == NUMBERS


def test_a_file_is_read_by_its_path(tmp_path: Path) -> None:
    path = tmp_path / "leds.csv"
    path.write_bytes(b"\xef\xbb\xbfled,x_mm,y_mm\r\n1,0.5,-2.25\r\n")
    asked = []
    text = table_text(path, PEN_FILE, 1000, lambda data, name: asked.append(name))
    table = parse_table(text, "leds.csv")
    assert (asked, table.lines) == (["leds.csv"], [2])
    assert numbers(table) == NUMBERS[:1]


def test_rows_know_their_lines() -> None:
    table = parse_table("# one\nled,x\n\n1,2\n# five\n3,4\n", "t.csv")
    assert table.lines == [4, 6]
    assert (
        str(table.error(1, message("number.no-list")))
        == "Line 6 of t.csv: it is not a list of numbers."
    )


def test_a_letter_in_a_number_is_named_with_its_line() -> None:
    lines = ["led;x_mm;y_mm", *(f"{n};{n},5;0,0" for n in range(1, 13)), "13;12,4O;0,0"]
    assert refusal("\n".join(lines)) == (
        'Line 14 of lp04_leds.csv: "12,4O" is not a number; leave out what '
        "is not known or does not belong here."
    )


@pytest.mark.parametrize(
    ("cell", "flaw"),
    [
        ("", "a cell is empty"),
        ("nan", "not a finite number"),
        ("-inf", "not a finite number"),
        ("1.#QNAN", "not a finite number"),
        ("1e999", "too large"),
        ("1e", '"1e" is not a number'),
        ("1_000", "not a number"),
        ("l2", "not a number"),
        ("1 000", "not a number"),
        ("\N{ARABIC-INDIC DIGIT ONE}2", "not a number"),
        ("0x10", "not a number"),
        ("--1", "not a number"),
        ("1.2.3", "not a number"),
        ("\x1b[31m", r'"\\x1b\[31m" is not a number'),
    ],
)
def test_what_is_not_a_number_is_named(cell: str, flaw: str) -> None:
    with pytest.raises(FileError, match=f"^Line 3 of t.csv: .*{flaw}"):
        parse_table(f'led;x\n1;2\n3;"{cell}"\n', "t.csv").numbers([0, 1])


@pytest.mark.parametrize(
    ("cell", "number"),
    [
        ("\N{MINUS SIGN}3", -3.0),
        ("\N{EN DASH}0,5", -0.5),
        ("\uff11\uff0e\uff15", 1.5),
        ("1\N{NARROW NO-BREAK SPACE}248,5", 1248.5),
        ("-2.5D-01", -0.25),
        ("1.25d+2", 125.0),
    ],
)
def test_numbers_of_word_processors_and_fortran_are_read(
    cell: str, number: float
) -> None:
    assert parse_table(f"1;{cell}\n2;{cell}\n", "t.csv").numbers([1])[0] == number


def test_lines_of_a_report_are_no_table() -> None:
    text = refusal("led,x,y\n1\n2,3\nDIM 3\n1,2,3\n")
    assert text.startswith("Line 2 of lp04_leds.csv has 1 cells where line 1 has 3.")
    assert "no table" in text


def test_blanks_separate_decimal_commas() -> None:
    table = parse_table("led  x  y\n1  2,5  -3,0\n2  4,5  5,0\n", "t.txt")

    assert table.numbers([1, 2]).tolist() == [[2.5, -3.0], [4.5, 5.0]]


@pytest.mark.parametrize(
    "text",
    [
        "| led | x |\n|-----|---:|\n| 1 | 2 |\n| 3 | 4 |\n",
        "led   x\n---------\n  1   2\n  3   4\n",
        "led;x\n=====;=====\n1;2\n3;4\n",
    ],
)
def test_rules_of_tables_are_no_rows(text: str) -> None:
    table = parse_table(text, "t.md")

    assert table.header == ("led", "x")
    assert table.numbers([0, 1]).tolist() == [[1, 2], [3, 4]]


def test_points_and_commas_are_not_mixed() -> None:
    text = refusal("led;x\n1;2.5\n2;3\n3;1,234\n")
    assert text.startswith("Line 4 of lp04_leds.csv: the file has decimal points and")
    assert "on line 2" in text


def test_thousands_separators_are_refused() -> None:
    assert '"1.234,5" has separators of thousands' in refusal("led;x\n1;1.234,5\n")


def test_a_row_of_another_length_is_named() -> None:
    text = refusal("led,x,y\n1,2,3\n2,3\n")
    assert text.startswith("Line 3 of lp04_leds.csv has 2 cells where line 1 has 3.")
    assert "cut short" in text


def test_decimal_commas_between_commas_are_explained() -> None:
    assert "separate the columns by semicolons" in refusal("led,x\n1,2,5\n2,3,5\n")


def test_a_column_named_twice_is_refused() -> None:
    assert 'duplicate column "x" in the header.' in refusal("led,x,X\n1,2,3\n")


def test_of_columns_that_mean_the_same_the_best_is_read() -> None:
    table = parse_table("led,x,x_px [1]\n1,2,3\n", "t.csv")
    names = (("led",), ("x_px", "x"))
    assert table.columns(names, message("table.of-centers")) == [0, 2]


def test_a_missing_column_is_named() -> None:
    table = parse_table("led,x_mm\n1,2\n", "t.csv")
    with pytest.raises(FileError, match=r"no column y_mm; .* columns led,x_mm,y_mm"):
        table.columns(COLUMNS, LEDS)


def test_a_wrong_number_of_columns_without_header_is_refused() -> None:
    table = parse_table("1,2\n", "t.csv")
    with pytest.raises(FileError, match="no header and 2 columns; LEDs of a pen need"):
        table.columns(COLUMNS, LEDS)


@pytest.mark.parametrize(
    ("text", "flaw"),
    [
        ("# nothing\n\n", "only comments"),
        ("sep=;\n", "no rows"),
        ("led,x\n", "no rows below"),
        ('led,x\n1,"2\n', "Line 2 of .* quotation marks do not pair up"),
        ('led,x\n1,"2"3\n', "quotation marks"),
    ],
)
def test_what_is_no_table_is_refused(text: str, flaw: str) -> None:
    with pytest.raises(FileError, match=flaw):
        parse_table(text, "t.csv")


@pytest.mark.parametrize("cell", ["1.5", "1e12", "-3000000000"])
def test_what_is_not_a_whole_number_is_refused(cell: str) -> None:
    table = parse_table(f"led,x\n1,2\n{cell},2\n", "t.csv")
    with pytest.raises(FileError, match=r"^Line 3 .* is not a whole number"):
        table.whole_numbers(0)


def test_whole_numbers_may_be_written_with_a_point() -> None:
    table = parse_table("1.0 3\n2.000e+00 4\n", "t.csv")
    assert table.whole_numbers(0).tolist() == [1, 2]


@given(
    st.lists(
        st.lists(
            st.floats(allow_nan=False, allow_infinity=False), min_size=3, max_size=3
        ),
        min_size=1,
        max_size=10,
    ),
    st.sampled_from([(",", "."), (";", "."), (";", ","), ("\t", ","), (" ", ".")]),
    st.booleans(),
)
def test_any_numbers_are_read_back_to_the_last_digit(
    rows: list[list[float]], marks: tuple[str, str], with_header: bool
) -> None:
    separator, decimal = marks
    lines = [
        separator.join(repr(number).replace(".", decimal) for number in row)
        for row in rows
    ]
    header = [separator.join(["led", "x_mm", "y_mm"])] if with_header else []
    assert numbers(parse_table("\n".join(header + lines), "t.csv")) == rows


@given(st.text(alphabet=st.sampled_from('0123456789.,;\t +-eE#"\naO\u2212\xa0')))
def test_any_text_is_a_table_or_is_refused(text: str) -> None:
    with contextlib.suppress(FileError):
        assert np.all(np.isfinite(all_numbers(text)))


@given(st.text(alphabet=st.sampled_from("0123456789.+-eEnaif_ ,"), max_size=8))
def test_a_cell_without_flaw_is_what_python_reads(cell: str) -> None:
    if not number_flaw(cell):
        assert np.isfinite(float(cell))
    else:
        with pytest.raises(FileError):
            parse_table(f'led;x\n1;"{cell}"\n1.5;2,5', "t.csv").numbers([0, 1])


def test_more_lines_than_fit_the_memory_are_refused() -> None:
    with pytest.raises(FileError, match=r"t\.csv has more than 300000 lines"):
        parse_table("1,1\n" * 300_001, "t.csv")


def test_more_cells_than_fit_the_memory_are_refused() -> None:
    with pytest.raises(FileError, match=r"t\.csv has 2,000,010 cells; at most 2,000"):
        parse_table(("1" + ",1" * 29 + "\n") * 66_667, "t.csv")


def test_what_is_no_number_is_so_in_one_pass() -> None:
    # Twice over the digits for each of them would take an hour.
    assert number_flaw("1" * 300_000 + "a") is not None
