"""What the repository holds beside the program: for IT, auditors and contributors."""

import re
import shutil
import subprocess
import sys
from importlib.metadata import metadata
from pathlib import Path

import pytest

from lightpen import __version__

ROOT = Path(__file__).parents[1]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
POWERSHELL = re.compile(r"powershell (?=-)(?!-NoProfile)")


def tracked() -> list[Path]:
    if shutil.which("git") is None:
        pytest.skip("needs git")
    listing = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if listing.returncode != 0:
        pytest.skip("this is no clone")
    return [ROOT / name for name in listing.stdout.split("\0") if name]


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.stem)
def test_every_action_is_pinned_by_hash_and_only_a_release_has_a_secret(
    workflow: Path,
) -> None:
    text = workflow.read_text("utf-8")
    used = re.findall(r"uses: *(\S+)", text)

    assert used
    assert [each for each in used if not re.search(r"@[0-9a-f]{40}$", each)] == []
    assert "pull_request_target" not in text
    is_release = workflow.stem == "release"
    assert ("secrets." in text) == is_release
    assert ("pull_request" in text) != is_release


def test_a_release_is_of_a_tag_approved_signed_checked_and_summed() -> None:
    text = (ROOT / ".github" / "workflows" / "release.yml").read_text("utf-8")

    assert re.search(r'^on:\n  push:\n    tags: \["v\*"\]\n\n', text, re.MULTILINE)
    steps = ["build_deb.py", "check_deb.sh", "environment: release", "LIGHTPEN_SIGN"]
    steps += ["check.py", "dossier.py"]
    places = [text.find(step) for step in [*steps, "SHA256SUMS", "--verify-tag"]]
    assert -1 not in places
    assert places == sorted(places)


def test_the_version_to_cite_is_that_of_the_program() -> None:
    stated = (ROOT / "CITATION.cff").read_text("utf-8")

    assert f"\nversion: {__version__}\n" in stated


def test_the_package_states_both_licences_and_what_it_runs_on() -> None:
    stated = metadata("lightpen")

    assert stated["License-Expression"] == "MIT AND OFL-1.1"
    assert stated["Requires-Python"] == ">=3.11"
    assert {f"Programming Language :: Python :: 3.{n}" for n in (11, 12, 13)} <= set(
        stated.get_all("Classifier") or ()
    )


@pytest.mark.parametrize("name", ["run", "run.ps1"])
def test_a_python_of_32_bits_is_not_used_and_named(name: str) -> None:
    script = (ROOT / name).read_text("utf-8")
    (condition,) = re.findall(r"^ *.*?(import ensurepip[^']*)'", script, re.MULTILINE)
    words = [sys.executable, "-c"]

    usual = subprocess.run([*words, condition], check=False).returncode
    narrow = f"import sys; sys.maxsize = 2**31 - 1\n{condition}"
    small = subprocess.run([*words, narrow], check=False).returncode

    assert (usual, small) == (0, 1)
    assert "32-bit" in script


def test_no_profile_of_a_user_changes_what_powershell_runs() -> None:
    texts = [path for path in tracked() if path.suffix in (".md", ".ps1", ".yml")]
    found = [path for path in texts if POWERSHELL.search(path.read_text("utf-8"))]

    assert texts
    assert found == []
