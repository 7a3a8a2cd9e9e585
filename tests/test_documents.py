"""The documents lead where they say, name every command, and are up to date."""

import re
from pathlib import Path

import pytest
from docs.schema import FILE, PAGE, page_text, schema_text

from lightpen.cli import COMMANDS
from lightpen_program.extensions import EXTENSIONS

ROOT = Path(__file__).parents[1]
PAGES = sorted(
    path
    for pattern in ("*.md", "docs/*.md", "installer/*.md", "resources/**/*.md")
    for path in ROOT.glob(pattern)
)
LINK = re.compile(r"\]\((?!https?:)([^)#\s]*)(?:#([^)\s]*))?\)")


def anchors(page: Path) -> set[str]:
    """Return the anchors of the headings of a page, as GitHub makes them."""
    headings = re.findall(r"^#+ +(.*)$", page.read_text("utf-8"), flags=re.MULTILINE)
    plain = (re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings)
    return {heading.replace(" ", "-") for heading in plain}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_leads_to_a_file_and_to_a_heading(page: Path) -> None:
    for place, anchor in LINK.findall(page.read_text("utf-8")):
        linked = page.parent / place if place else page
        assert linked.exists(), place
        if anchor:
            assert anchor in anchors(linked), f"{place}#{anchor}"


@pytest.mark.parametrize(
    "name",
    [
        *(each.name for each in COMMANDS),
        *(each.name for extension in EXTENSIONS for each in extension.commands),
        *("archive", "tips", "open", "report"),
    ],
)
def test_every_command_is_on_the_page_of_commands(name: str) -> None:
    page = (ROOT / "docs" / "command-line.md").read_text("utf-8")

    assert f"`lightpen {name} " in page


def test_the_published_schema_is_that_of_the_types() -> None:
    """If it is not, run ``python docs/schema.py``."""
    assert FILE.read_text("utf-8") == schema_text()


def test_the_page_of_the_record_is_that_of_its_types() -> None:
    content = PAGE.read_text("utf-8")

    assert page_text(content) == content
