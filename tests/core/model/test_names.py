"""Names that look alike are the same."""

import pytest

from lightpen.model.names import folded_name, same_name


@pytest.mark.parametrize(
    "typed",
    [
        *("T-10", "t-10", " T-10 ", "T\u201010", "T\u221210", "T\u201310", "T\ufe6310"),
        *("\u0422-10", "\u0442-10", "\u03a4-10", "\uff34-10", "T\u200b-10"),
        *("T\u00ad-10", "T-\uff11\uff10", "T-10\u2060"),
    ],
)
def test_a_tip_has_one_name_however_it_is_typed(typed: str) -> None:
    assert same_name(typed, ["T-1", "T-10"]) == "T-10"


@pytest.mark.parametrize("typed", ["T-1", "T10", "T-100", "T -10", "U-10", ""])
def test_other_names_are_others(typed: str) -> None:
    assert same_name(typed, ["T-10"]) is None


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (
            "\u0410\u0412\u0415\u041a\u041c\u041d\u041e\u0420\u0421\u0422\u0425",
            "ABEKMHOPCTX",
        ),
        (
            "\u0391\u0392\u0395\u0396\u0397\u0399\u039a\u039c\u039d\u039f\u03a1\u03a4\u03a5\u03a7",
            "ABEZHIKMNOPTYX",
        ),
    ],
)
def test_capitals_of_other_alphabets_are_those_that_they_look_like(
    one: str, other: str
) -> None:
    assert folded_name(one) == folded_name(other)


@pytest.mark.parametrize(
    "name", ["T-10", "\u6d4b\u5934 1", "\u00c4-2", "\u1e9e", "\u0130x"]
)
def test_a_folded_name_stays_as_it_is(name: str) -> None:
    assert folded_name(folded_name(name)) == folded_name(name)
