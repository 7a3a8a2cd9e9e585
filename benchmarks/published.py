"""The figures of docs/benchmark.md, by section, each with where it was measured."""

from collections.abc import Sequence

BEGIN, END = "<!-- benchmark:begin -->", "<!-- benchmark:end -->"
MARK = "### Section `"


def with_section(content: str, name: str, text: str, order: Sequence[str]) -> str:
    """Return the content of docs/benchmark.md with what was measured in one section.

    Parameters
    ----------
    text : str
        What the section says from now on.
    order : sequence of str
        All sections, as they follow each other; others go.

    Raises
    ------
    ValueError
        The content has no place for figures.
    """
    before, begin, rest = content.partition(BEGIN)
    figures, end, after = rest.partition(END)
    if not (begin and end):
        raise ValueError(f"There are no lines {BEGIN} and {END}.")
    texts = {}
    for part in figures.split(MARK)[1:]:
        known, _, said = part.partition("`\n")
        texts[known] = said.strip()
    texts[name] = text
    parts = [f"{MARK}{each}`\n\n{texts[each]}\n" for each in order if each in texts]
    return "".join((before, begin, "\n", "\n".join(parts), end, after))
