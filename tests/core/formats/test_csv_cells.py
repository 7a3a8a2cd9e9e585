"""A CSV table holds no formula that a spreadsheet would calculate."""

import csv
import io

import pytest

from lightpen.formats.spreadsheets import csv_table


@pytest.mark.parametrize(
    "text", [*("=1+1", "+1", "-1+1", "@SUM(A1)", " =1", "\t=1", "\n=1", "\uff1d1")]
)
def test_a_text_that_could_be_a_formula_is_marked(text: str) -> None:
    ((cell, number),) = csv.reader(io.StringIO(csv_table([(text, -1.5)])))
    assert (cell, number) == (f"'{text}", "-1.5")


def test_other_texts_stay_as_they_are() -> None:
    assert csv_table([("T-10", "a=b", 3)]) == "T-10,a=b,3\n"
