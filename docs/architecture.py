"""Measure the imports between packages: ``python docs/architecture.py [--write]``.

Prints, for each package with sub-packages, the number of its parts (modules and
sub-packages directly in it), of the import arrows between them, and of the levels of
that graph. With ``--write`` it renews the diagrams in docs/architecture.md.
"""

import argparse
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import grimp

ROOT = Path(__file__).resolve().parents[1]
PAGE = Path(__file__).with_name("architecture.md")
BEGIN, END = "<!-- diagrams:begin -->", "<!-- diagrams:end -->"
SOURCES = {
    "lightpen": "core",
    "lightpen_extensions": "core",
    "lightpen_app": "app",
    "lightpen_app_extensions": "app",
}
MEASURED = (
    "lightpen",
    "lightpen.estimation",
    "lightpen_extensions.measure",
    "lightpen.record",
    "lightpen.swing",
    "lightpen.archive",
    "lightpen_app",
)

Arrows = Mapping[str, frozenset[str]]
"""The parts of a package, each with those that it imports."""


def read_arrows(graph: grimp.ImportGraph, package: str) -> Arrows:
    """Return the parts of a package and the imports between them.

    A module directly in the package is a part; so is a sub-package with all in it.
    """
    depth = package.count(".") + 1

    def part_of(module: str) -> str | None:
        names = module.split(".")
        return (
            names[depth]
            if ".".join(names[:depth]) == package and len(names) > depth
            else None
        )

    imported: dict[str, set[str]] = {}
    for module in graph.modules:
        part = part_of(module)
        if part is None:
            continue
        others = {
            part_of(each) for each in graph.find_modules_directly_imported_by(module)
        }
        imported.setdefault(part, set()).update(
            each for each in others if each not in {None, part}
        )
    return {part: frozenset(others) for part, others in imported.items()}


def count_levels(arrows: Arrows) -> int:
    """Return the number of modules on the longest way along arrows; 0 in a cycle."""
    levels: dict[str, int] = {}
    while len(levels) < len(arrows):
        ready = [
            part
            for part, others in arrows.items()
            if part not in levels and others <= levels.keys()
        ]
        if not ready:
            return 0
        levels.update(
            {
                part: 1 + max((levels[each] for each in arrows[part]), default=0)
                for part in ready
            }
        )
    return max(levels.values(), default=0)


def without_shortcuts(arrows: Arrows) -> Iterator[tuple[str, str]]:
    """Yield the arrows that no longer way replaces, in their order (no cycles)."""
    reached: dict[str, frozenset[str]] = {}

    def reach(part: str) -> frozenset[str]:
        if part not in reached:
            reached[part] = arrows[part].union(*map(reach, arrows[part]))
        return reached[part]

    for part in sorted(arrows):
        for other in sorted(arrows[part]):
            if not any(other in reach(each) for each in arrows[part] - {other}):
                yield part, other


def draw(package: str, arrows: Arrows) -> str:
    """Return the diagram of a package in Mermaid's language, without shortcuts."""
    lines = [f"### `{package}`", "", "```mermaid", "flowchart TD"]
    lines += [f"    {part} --> {other}" for part, other in without_shortcuts(arrows)]
    return "\n".join([*lines, "```"])


def table(measured: Mapping[str, Arrows]) -> str:
    """Return the table of parts, arrows and levels."""
    lines = ["| package | parts | arrows | levels |", "|---|---|---|---|"]
    lines += [
        f"| `{package}` | {len(arrows)} | {sum(map(len, arrows.values()))} "
        f"| {count_levels(arrows) or 'cycle'} |"
        for package, arrows in measured.items()
    ]
    return "\n".join(lines)


def measure() -> dict[str, Arrows]:
    """Return the arrows of each measured package."""
    sys.path[:0] = [str(ROOT / folder) for folder in SOURCES.values()]
    graph = grimp.build_graph(
        *SOURCES, cache_dir=None, exclude_type_checking_imports=False
    )
    return {package: read_arrows(graph, package) for package in MEASURED}


def page(content: str, measured: Mapping[str, Arrows]) -> str:
    """Return the content of docs/architecture.md with table and diagrams renewed."""
    before, _, rest = content.partition(BEGIN)
    _, _, after = rest.partition(END)
    diagrams = "\n\n".join(
        draw(package, arrows) for package, arrows in measured.items()
    )
    return f"{before}{BEGIN}\n{table(measured)}\n\n{diagrams}\n{END}{after}"


def main() -> None:
    """Print the table; with ``--write`` renew docs/architecture.md."""
    parser = argparse.ArgumentParser(
        description="Measure the imports between packages."
    )
    parser.add_argument(
        "--write", action="store_true", help="renew docs/architecture.md"
    )
    options = parser.parse_args()
    measured = measure()
    print(table(measured))
    if options.write:
        PAGE.write_text(
            page(PAGE.read_text(encoding="utf-8"), measured), encoding="utf-8"
        )


if __name__ == "__main__":
    main()
