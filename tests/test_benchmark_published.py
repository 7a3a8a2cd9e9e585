"""The figures of docs/benchmark.md are renewed section by section."""

import pytest
from benchmarks.published import BEGIN, END, with_section

ORDER = ("tips", "speed", "soak")


def content(*sections: str) -> str:
    text = f"# Program\n\n{BEGIN}\n{END}\n\n## Licence\n"
    for name in sections:
        text = with_section(text, name, f"Old {name}.\n\n| a | b |", ORDER)
    return text


def test_a_section_is_renewed_and_the_others_stay() -> None:
    renewed = with_section(content("tips", "speed"), "speed", "New.", ORDER)

    assert "Old tips." in renewed
    assert "Old speed." not in renewed
    assert renewed.count("New.") == 1
    assert renewed.startswith("# Program")
    assert renewed.endswith("## Licence\n")


def test_sections_stand_in_their_order_whenever_they_were_measured() -> None:
    renewed = content("soak", "speed", "tips")

    places = [renewed.index(f"`{name}`") for name in ORDER]
    assert places == sorted(places)


def test_renewing_a_section_twice_is_as_once() -> None:
    once = with_section(content("tips"), "speed", "New.", ORDER)

    assert with_section(once, "speed", "New.", ORDER) == once


def test_a_section_that_is_no_more_goes() -> None:
    assert "speed" not in with_section(content("speed"), "tips", "New.", ("tips",))


def test_a_content_without_a_place_for_figures_is_refused() -> None:
    with pytest.raises(ValueError, match="benchmark:begin"):
        with_section("# Program", "tips", "New.", ORDER)
