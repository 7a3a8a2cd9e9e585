"""Figures as they were found before: a change of any is seen.

A file of `tests/data/reference` that is missing is written, and its test fails once.
After a wanted change of figures delete the file, run the test and look at what differs.
"""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lightpen.messages import Message

FOLDER = Path(__file__).parent / "data" / "reference"
WORDS = {"code", "grade", "name"}  # texts that are compared; others are worded anew
MANY = 36  # numbers of one kind, of which only these many sums are kept
N_SUMS = 3
NUMBER = re.compile(r"-?\d+\.\d+|-?\d+")
# Of the largest of the numbers. What another version of a library rounds otherwise is
# less, as solvers end where a step changes nothing more than 1e-8.
TOLERANCE = 1e-5
TINY = 1e-13


def assert_as_before(name: str, found: Any) -> None:
    """Assert that all numbers of a tree of mappings and sequences are as before."""
    figures: dict[str, list[Any]] = {}
    for path, value in _leaves("", found):
        figures.setdefault(path, []).append(value)
    kept = {
        name: each
        for path, values in figures.items()
        for name, each in _kept(path, values)
    }
    file = FOLDER / f"{name}.json"
    if not file.exists():
        file.parent.mkdir(exist_ok=True)
        lines = (f"{json.dumps(k)}: {json.dumps(v)}" for k, v in kept.items())
        file.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
        pytest.fail(f"{file} was missing and is written. Look at it and keep it.")
    before = json.loads(file.read_text(encoding="utf-8"))
    assert sorted(kept) == sorted(before)
    changed = {
        path: (before[path], now)
        for path, now in kept.items()
        if not _are_alike(before[path], now)
    }
    assert not changed, changed


def text_figures(text: str) -> dict[str, list[float]]:
    """Return the numbers that a text shows, and where each stands in its line.

    So it may be worded anew, but for where its columns are.
    """
    found = [each for line in text.splitlines() for each in NUMBER.finditer(line)]
    return {
        "shown": [float(each.group()) for each in found],
        "columns": [each.end() for each in found if each.string.startswith(" ")],
    }


def parts_of(value: Any) -> Any:
    """Return the numbers of a value and of all its parts, as a tree.

    Of an array this is its norm, which has no sign that a library chooses.
    """
    if isinstance(value, np.ndarray):
        known = np.nan_to_num(value.astype(np.float64))
        return [float(np.linalg.norm(known)), value.size]
    if isinstance(value, Message) or not hasattr(value, "__dict__"):
        named = value._asdict() if hasattr(value, "_asdict") else value
        if isinstance(named, Mapping):
            return {str(name): parts_of(each) for name, each in named.items()}
        return [parts_of(each) for each in named] if isinstance(named, tuple) else named
    if not is_dataclass(value):
        return None
    return {each.name: parts_of(getattr(value, each.name)) for each in fields(value)}


def _leaves(path: str, tree: Any) -> Iterator[tuple[str, Any]]:
    """Return the numbers and texts of a tree; items of a list have one path."""
    if isinstance(tree, Message):
        tree = {"code": tree.code, "with": tree.values}
    if isinstance(tree, Mapping):
        for name, entry in tree.items():
            yield from _leaves(f"{path}/{name}", entry)
    elif isinstance(tree, str):
        if path.rpartition("/")[2] in WORDS:
            yield path, str(tree)
    elif isinstance(tree, np.ndarray | list | tuple):
        for entry in tree:
            yield from _leaves(path, entry)
    elif tree is None or isinstance(tree, int | float | np.number | np.bool_):
        yield path, None if tree is None or tree != tree else float(tree)


def _kept(path: str, values: list[Any]) -> Iterator[tuple[str, list[Any]]]:
    """Return few values as they are, and of many their number, size and some sums."""
    if len(values) <= MANY or any(isinstance(each, str) for each in values):
        yield path, [float(f"{v:.8g}") if isinstance(v, float) else v for v in values]
        return
    numbers = np.array(values, dtype=np.float64)
    unknown = np.isnan(numbers)
    weights = np.random.default_rng(len(values)).uniform(-1, 1, (N_SUMS, len(values)))
    known = np.where(unknown, 0.0, numbers)
    sums = [float(np.linalg.norm(known)), *(weights @ known).tolist()]
    yield f"{path} sums", [float(f"{each:.8g}") for each in sums]
    yield f"{path} count", [len(values), *np.round(weights @ unknown, 6).tolist()]


def _are_alike(before: list[Any], now: list[Any]) -> bool:
    if len(before) != len(now) or any(isinstance(each, str) for each in before):
        return before == now
    one, other = (np.array(each, dtype=np.float64) for each in (before, now))
    largest = float(np.max(np.abs(one), initial=0.0, where=np.isfinite(one)))
    room = TOLERANCE * largest + TINY
    return np.allclose(one, other, rtol=0, atol=room, equal_nan=True)
