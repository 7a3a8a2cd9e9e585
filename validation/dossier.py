"""Write the validation dossier of a release: requirement, test, result, version.

    ./run test --slow -n auto --dist loadfile --junitxml=dist/tests.xml
    .venv/bin/python validation/dossier.py dist/tests.xml --out dist

writes ``Lightpen-<version>-validation.json`` and ``.pdf``, with the test of feature
fitting, which it runs. The exit status is 1 if a requirement is not proven.
"""

import argparse
import json
import os
import platform
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from hashlib import sha256
from html import escape
from pathlib import Path
from xml.etree import ElementTree

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from PySide6.QtGui import QGuiApplication, QPageSize, QPdfWriter, QTextDocument

from lightpen import __version__
from validation.feature_fitting import FittingResult, run_fitting_test

ROOT = Path(__file__).resolve().parents[1]
REQUIREMENTS = ROOT / "validation" / "requirements.toml"
REQUIREMENT_HEAD = ("no.", "requirement", "passed", "skipped", "failed", "result")
HEAD = "<h1>Validation of Lightpen {version}</h1>"
FORM = (
    "Reference pairs by the null-space method, {n} for each kind of feature, seeded; "
    "deviations from the reference feature, least squares, as ISO 10360-6 has it."
)


@dataclass(frozen=True)
class Outcome:
    """How a test ended: passed, failed or skipped."""

    name: str
    outcome: str


@dataclass(frozen=True)
class ProvenRequirement:
    """A requirement, the tests that prove it, and whether they do.

    Attributes
    ----------
    missing : tuple of str
        What it names of which no test was run.
    """

    id: str
    text: str
    tests: tuple[Outcome, ...]
    missing: tuple[str, ...] = ()

    @property
    def result(self) -> str:
        """Return passed, failed, or not tested."""
        outcomes = {test.outcome for test in self.tests}
        if "failed" in outcomes:
            return "failed"
        is_tested = "passed" in outcomes and not self.missing
        return "passed" if is_tested else "not tested"

    def count(self, outcome: str) -> int:
        """Return how many of its tests ended so."""
        return sum(test.outcome == outcome for test in self.tests)


def main() -> int:
    """Write the dossier, and return the exit status."""
    options = _parser().parse_args()
    proven = proven_requirements(REQUIREMENTS, read_results(options.results))
    fitting = run_fitting_test()
    options.out.mkdir(parents=True, exist_ok=True)
    file = options.out / f"Lightpen-{__version__}-validation.json"
    file.write_text(json.dumps(content(proven, fitting), indent=1) + "\n", "utf-8")
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    _application = QGuiApplication([])
    write_pdf(page(proven, fitting, file), file.with_suffix(".pdf"))
    for requirement in proven:
        print(f"{requirement.id:4} {requirement.result}")
    is_fit = all(result.passed for result in fitting)
    print(f"feature fitting {'passed' if is_fit else 'failed'}")
    return 0 if is_fit and all(each.result == "passed" for each in proven) else 1


def read_results(file: Path) -> list[Outcome]:
    """Return the results in a JUnit file of pytest, by ``file::name``."""
    results = []
    for case in ElementTree.parse(file).iter("testcase"):
        tags = {child.tag for child in case}
        failed = tags & {"failure", "error"}
        outcome = "failed" if failed else "skipped" if "skipped" in tags else "passed"
        place = case.get("classname", "").replace(".", "/") + ".py"
        results.append(Outcome(f"{place}::{case.get('name')}", outcome))
    return results


def proven_requirements(
    requirements: Path, results: Iterable[Outcome]
) -> list[ProvenRequirement]:
    """Join requirements with the results of their tests."""
    listed = tomllib.loads(requirements.read_text("utf-8"))["requirement"]
    known = list(results)
    return [
        ProvenRequirement(
            each["id"],
            each["text"],
            tuple(test for test in known if _is_of(test, each["tests"])),
            tuple(n for n in each["tests"] if not any(_is_of(t, [n]) for t in known)),
        )
        for each in listed
    ]


def _is_of(test: Outcome, named: Sequence[str]) -> bool:
    """Return whether a test is in the folders, files and tests that are named."""
    ends = ("", "/", "::", "[")  # itself, or in a folder, a file, or with parameters
    return any(
        test.name == name or test.name.startswith(tuple(name + end for end in ends[1:]))
        for name in named
    )


def content(
    proven: Sequence[ProvenRequirement], fitting: Sequence[FittingResult]
) -> dict[str, object]:
    """Return the dossier as it stands in its JSON file."""
    return {
        "program": "Lightpen",
        "version": __version__,
        "commit": _commit(),
        "made": datetime.now(UTC).isoformat(timespec="seconds"),
        "system": platform.platform(),
        "python": platform.python_version(),
        "requirements": [asdict(each) | {"result": each.result} for each in proven],
        "feature_fitting": [asdict(each) | {"passed": each.passed} for each in fitting],
    }


def page(
    proven: Sequence[ProvenRequirement], fitting: Sequence[FittingResult], file: Path
) -> str:
    """Return the dossier as a page of HTML; its tests stand in the JSON file."""
    requirements = [
        (each.id, each.text, each.count("passed"), each.count("skipped"),
         each.count("failed"), each.result)
        for each in proven
    ]  # fmt: skip
    fits = [
        (each.kind, each.quality, f"{each.deviation:.1e}", f"{each.permissible:.0e}",
         "passed" if each.passed else "failed")
        for each in fitting
    ]  # fmt: skip
    digest = sha256(file.read_bytes()).hexdigest()
    return "".join(
        [
            HEAD.format(version=__version__),
            f"<p>Commit {_commit()}, {datetime.now(UTC):%Y-%m-%d}, ",
            f"{platform.platform()}, Python {platform.python_version()}</p>",
            f"<p>Each test with its result: {file.name}, SHA-256 {digest}</p>",
            "<h2>Requirements</h2>",
            _table(REQUIREMENT_HEAD, requirements),
            "<h2>Software test: feature fitting (ISO 10360-6)</h2>",
            f"<p>{FORM.format(n=fitting[0].n_sets)}</p>",
            _table(("feature", "quality", "largest deviation", "MPE", "result"), fits),
            "<p>Reviewed by, date:</p><p>Approved by, date:</p>",
        ]
    )


def _table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    cells = "".join(f"<th align='left'>{escape(each)}</th>" for each in head)
    lines = (
        "<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>"
        for row in rows
    )
    table = "<table border='1' cellspacing='0' cellpadding='4' width='100%'>"
    return f"{table}<tr>{cells}</tr>{''.join(lines)}</table>"


def write_pdf(html: str, file: Path) -> None:
    """Print a page of HTML on A4; there must be an application of Qt, for its fonts."""
    writer = QPdfWriter(str(file))
    writer.setPageSize(QPageSize(QPageSize.PageSizeId.A4))
    writer.setTitle(f"Validation of Lightpen {__version__}")
    document = QTextDocument()
    document.setHtml(html)
    document.print_(writer)


def _commit() -> str:
    if shutil.which("git") is None:
        return "unknown"
    words = ["git", "describe", "--always", "--dirty", "--abbrev=40"]
    found = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    return found.stdout.strip() or "unknown"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Write the validation dossier.")
    parser.add_argument("results", type=Path, help="JUnit file of the tests")
    parser.add_argument("--out", type=Path, default=ROOT / "dist", metavar="FOLDER")
    return parser


if __name__ == "__main__":
    sys.exit(main())
