"""The lock files hold what pyproject.toml asks for, each file by its hash."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LOCKS = ("requirements.lock", "requirements-dev.lock", "requirements-setup.lock")


def pinned(lock: str) -> dict[str, list[str]]:
    """The packages of a lock file with the hashes of their files."""
    text = (ROOT / lock).read_text(encoding="utf-8")
    entries = re.findall(r"^([\w.-]+)==.*?(?=^\S|\Z)", text, re.MULTILINE | re.DOTALL)
    blocks = re.split(r"^(?=[\w.-]+==)", text, flags=re.MULTILINE)[1:]
    assert len(entries) == len(blocks)
    return {
        name: re.findall(r"--hash=sha256:[0-9a-f]{64}", block)
        for name, block in zip(entries, blocks, strict=True)
    }


def named(requirements: list[str]) -> set[str]:
    """The packages that requirements name, as lock files spell them."""
    words = [re.split(r"[^\w.-]", text, maxsplit=1)[0] for text in requirements]
    return {word.casefold().replace("_", "-") for word in words}


@pytest.mark.parametrize("lock", LOCKS)
def test_every_package_is_known_by_the_hashes_of_its_files(lock: str) -> None:
    assert all(hashes for hashes in pinned(lock).values())


def test_what_the_program_needs_is_locked() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))

    assert named(project["project"]["dependencies"]) <= set(pinned(LOCKS[0]))
    assert named(project["dependency-groups"]["dev"]) <= set(pinned(LOCKS[1]))


def test_every_bound_of_the_program_has_an_upper_end() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))

    for requirement in project["project"]["dependencies"]:
        assert re.search(r"<\d|==", requirement.split(";")[0]), requirement
