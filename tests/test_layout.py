"""Tests of where things stand: what `lint-imports` checks covers all that there is."""

import ast
import tomllib
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from docs.architecture import PAGE, measure, page

ROOT = Path(__file__).parents[1]
PACKAGES = {
    "lightpen": ROOT / "core" / "lightpen",
    "lightpen_extensions": ROOT / "core" / "lightpen_extensions",
    "lightpen_app": ROOT / "app" / "lightpen_app",
}

LONGEST_PAGE = 250  # lines; more belongs into presenters and controls
GIVEN = {"main"}  # where a program starts


def names_given_twice(folders: Iterable[Path]) -> dict[str, list[str]]:
    """Return the public classes and functions that share a name, with their modules."""
    modules = defaultdict(list)
    for folder in folders:
        for path in sorted(folder.rglob("*.py")):
            for node in ast.parse(path.read_text(encoding="utf-8")).body:
                if not isinstance(node, ast.ClassDef | ast.FunctionDef):
                    continue
                if node.name not in GIVEN and not node.name.startswith("_"):
                    modules[node.name].append(str(path.relative_to(folder.parent)))
    return {name: places for name, places in modules.items() if len(places) > 1}


def parts_of(folder: Path) -> set[str]:
    """Return the modules and packages that stand directly in a package."""
    return {
        path.stem
        for path in folder.iterdir()
        if path.suffix == ".py" or any(path.rglob("*.py"))
    } - {"__init__"}


def layers_of(contract: dict[str, Any]) -> set[str]:
    """Return the names in the layers of a contract, and those it leaves out."""
    lines = " ".join(contract["layers"]).replace("|", " ").replace(":", " ")
    return {*lines.split(), *contract.get("exhaustive_ignores", ())}


@pytest.fixture(scope="module")
def contracts() -> list[dict[str, Any]]:
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    found: list[dict[str, Any]] = tomllib.loads(text)["tool"]["importlinter"][
        "contracts"
    ]
    return found


@pytest.mark.slow
def test_a_class_and_a_function_are_found_by_their_name_alone() -> None:
    assert names_given_twice(PACKAGES.values()) == {}


def test_no_page_is_long() -> None:
    pages = (PACKAGES["lightpen_app"] / "steps").glob("*/page.py")
    lengths = {
        each.parent.name: len(each.read_text(encoding="utf-8").splitlines())
        for each in pages
    }

    assert lengths
    assert max(lengths.values()) <= LONGEST_PAGE, lengths


@pytest.mark.parametrize("package", ["lightpen", "lightpen_app"])
def test_every_package_has_its_place_in_the_order_of_imports(
    contracts: list[dict[str, Any]], package: str
) -> None:
    (contract,) = (each for each in contracts if each.get("containers") == [package])

    assert layers_of(contract) == parts_of(PACKAGES[package])


@pytest.mark.parametrize(
    ("package", "folder"),
    [
        ("lightpen_app.steps", PACKAGES["lightpen_app"] / "steps"),
        ("lightpen_extensions", PACKAGES["lightpen_extensions"]),
    ],
)
def test_every_step_and_extension_is_among_those_that_know_no_other(
    contracts: list[dict[str, Any]], package: str, folder: Path
) -> None:
    found = {path.name for path in folder.iterdir() if (path / "__init__.py").exists()}

    named = [set(each["modules"]) for each in contracts if "modules" in each]
    assert {f"{package}.{name}" for name in found} in named


def test_the_page_of_the_architecture_is_that_of_the_imports() -> None:
    content = PAGE.read_text("utf-8")

    assert page(content, measure()) == content, "Run docs/architecture.py --write."
