"""The validation dossier: requirements joined with the results of their tests."""

import json
import tomllib
from pathlib import Path

import pytest
from validation.dossier import (
    REQUIREMENTS,
    Outcome,
    ProvenRequirement,
    content,
    page,
    proven_requirements,
    read_results,
    write_pdf,
)
from validation.feature_fitting import FittingResult

ROOT = Path(__file__).parents[2]
JUNIT = """<testsuites><testsuite>
<testcase classname="tests.core.test_a" name="test_one"/>
<testcase classname="tests.core.test_a" name="test_two[x]"><failure/></testcase>
<testcase classname="tests.core.test_ab" name="test_three"><skipped/></testcase>
</testsuite></testsuites>"""
SUPPORTING = {"runners", "__pycache__"}  # no function of the program by themselves
FIT = FittingResult("sphere", "size, mm", 20, 1e-10, 1e-6)


@pytest.fixture
def results(tmp_path: Path) -> list[Outcome]:
    (tmp_path / "tests.xml").write_text(JUNIT)
    return read_results(tmp_path / "tests.xml")


@pytest.mark.parametrize(
    ("tests", "result", "count"),
    [
        ('"tests/core/test_a.py::test_one"', "passed", 1),
        ('"tests/core/test_a.py::test_two"', "failed", 1),
        ('"tests/core/test_a.py"', "failed", 2),
        ('"tests/core/test_ab.py"', "not tested", 1),
        ('"tests/core"', "failed", 3),
        ('"tests/co"', "not tested", 0),
        ('"tests/core/test_a.py::test_one", "tests/core/test_c.py"', "not tested", 1),
    ],
)
def test_a_requirement_is_proven_by_tests_that_ran_and_passed(
    tmp_path: Path, results: list[Outcome], tests: str, result: str, count: int
) -> None:
    file = tmp_path / "requirements.toml"
    file.write_text(
        f'[[requirement]]\nid = "R1"\ntext = "It works."\ntests = [{tests}]'
    )

    (proven,) = proven_requirements(file, results)

    assert proven.result == result
    assert len(proven.tests) == count


def test_every_requirement_names_tests_that_exist() -> None:
    listed = tomllib.loads(REQUIREMENTS.read_text("utf-8"))["requirement"]

    assert len({each["id"] for each in listed}) == len(listed)
    for each in listed:
        for name in each["tests"]:
            file, _, test = name.partition("::")
            assert (ROOT / file).exists(), name
            assert not test or f"def {test}(" in (ROOT / file).read_text("utf-8"), name


def test_every_package_of_the_core_and_every_command_is_required_of() -> None:
    listed = tomllib.loads(REQUIREMENTS.read_text("utf-8"))["requirement"]
    named = {name for each in listed for name in each["tests"]}
    folders = [path for path in (ROOT / "tests" / "core").iterdir() if path.is_dir()]
    commands = (ROOT / "tests").glob("test_*_command*.py")
    tested = {
        path.relative_to(ROOT).as_posix()
        for path in (*folders, *commands)
        if path.name not in SUPPORTING
    }

    assert {path for path in tested if not any(n.startswith(path) for n in named)} == (
        set()
    )


@pytest.mark.usefixtures("qapp")
def test_the_dossier_states_results_in_json_and_pdf(tmp_path: Path) -> None:
    passed = Outcome("tests/core/test_a.py::test_one", "passed")
    proven = [ProvenRequirement("R1", "It works & lasts.", (passed,))]
    file = tmp_path / "dossier.json"
    file.write_text(json.dumps(content(proven, [FIT])))

    html = page(proven, [FIT], file)
    write_pdf(html, tmp_path / "dossier.pdf")

    stated = json.loads(file.read_text())
    assert stated["requirements"][0]["result"] == "passed"
    assert stated["feature_fitting"][0]["deviation"] == 1e-10
    assert "It works &amp; lasts." in html
    assert "1.0e-10" in html
    assert (tmp_path / "dossier.pdf").read_bytes().startswith(b"%PDF")
