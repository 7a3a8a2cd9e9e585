"""Measuring plans are read, checked as a whole before anything is measured, and kept.

What is wrong is said in the words of the plan: where, what was found, what is needed.
"""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from lightpen.errors import FileError
from lightpen.formats.documents import parse_document
from lightpen.formats.files import read_text, write_whole
from lightpen.messages import Message, message, printable
from lightpen.model.artefacts import Side
from lightpen_extensions.measure.measuring.characteristics import (
    DEVIATIONS,
    NEEDS_DATUM,
    is_defined,
)
from lightpen_extensions.measure.measuring.plan import (
    FARTHEST,
    Plan,
    PlannedCharacteristic,
    PlannedFeature,
)
from lightpen_extensions.measure.measuring.plan import CharacteristicKind as Of
from lightpen_extensions.measure.measuring.surfaces import NAMES, SURFACES, FeatureKind

PLAN = message("measuring.plan")
MAX_SIZE = 1_000_000  # bytes
MAX_FEATURES = 1000
WITH_NORMAL = {FeatureKind.POINT, FeatureKind.LINE}
NOUNS = {"features": "feature", "characteristics": "characteristic"}
TYPES = {
    "array": "a list in brackets",
    "object": "a group of entries",
    "str": "a text",
    "float": "a number",
    "int": "a whole number",
    "bool": "true or false",
    "null": "nothing",
}
SENTENCES = (
    (r"Expected `(.+?)`, got `(.+?)`", "{1} is given, {0} is needed"),
    (r"Object missing required field `(.+?)`", "the entry {0!r} is missing"),
    (r"Object contains unknown field `(.+?)`", "the entry {0!r} is unknown"),
    (r"Invalid enum value '(.+?)'", "{0!r} is no word that the plan knows there"),
    (r"Expected `.*` (>=|<=|>|<) (.+)", "the number must be {0} {1}"),
    (r"Expected `array` of length (?:>= )?(\d+).*", "a list of {0} is needed"),
)


def read_plan(path: Path) -> Plan:
    """Read a plan; raise `FileError` for unknown or contradictory entries."""
    return parse_plan(read_text(path, PLAN, MAX_SIZE), printable(path.name))


def parse_plan(text: str, name: str) -> Plan:
    """Return the plan that a YAML text holds; see `read_plan`."""
    tree = _with_lists(parse_document(text, name))
    try:
        plan = msgspec.convert(tree, Plan, strict=False)
    except msgspec.ValidationError as error:
        found = _in_words(str(error), tree)
        raise FileError("measuring.bad-plan", name=name, found=found) from error
    for problem in problems_of(plan):
        raise FileError("measuring.bad-plan", name=name, found=problem)
    return plan


def write_plan(plan: Plan, path: Path) -> None:
    """Write a plan as YAML."""
    import yaml

    entries = msgspec.to_builtins(plan)
    text = yaml.safe_dump(entries, sort_keys=False, allow_unicode=True)
    write_whole(path, text.encode())


def problems_of(plan: Plan) -> Iterator[str]:
    """Yield the contradictions of a plan, in English as the rest of the format."""
    names = [each.name for each in plan.features]
    for name in names:
        if names.count(name) > 1:
            yield f"{name!r} is defined twice"
    if len(names) > MAX_FEATURES:
        yield f"more than {MAX_FEATURES} features"
    kinds: dict[str, FeatureKind | None] = {e.name: e.kind for e in plan.features}
    for each in plan.features:
        yield from (f"feature {each.name!r}: {p}" for p in _of_feature(each, kinds))
    if plan.alignment is not None:
        unknown = _unknown(plan.alignment.features, kinds)
        yield from (f"alignment: {each}" for each in unknown)
    for planned in plan.characteristics:
        problems = _of_characteristic(plan, planned, kinds)
        yield from (f"characteristic {planned.label!r}: {p}" for p in problems)


def missing_normal(plan: Plan) -> Message | None:
    """Return that the plan has no plane, nor a normal, for a point or a line."""
    if any(each.kind in {None, FeatureKind.PLANE} for each in plan.features):
        return None
    for each in plan.features:
        is_stated = each.normal is not None or each.side is not Side.AUTO
        if each.kind in WITH_NORMAL and not is_stated:
            return message("measuring.no-normal", name=each.name, kind=NAMES[each.kind])
    return None


def _of_feature(
    each: PlannedFeature, kinds: Mapping[str, FeatureKind | None]
) -> Iterator[str]:
    if each.kind is not None and each.touches is not None:
        needed = SURFACES[each.kind].min_points
        if each.touches < needed:
            yield f"a {each.kind.value} needs {needed} touches"
    if each.nominal is not None and each.nominal.axis == (0, 0, 0):
        yield "the axis has the length 0"
    if each.normal == (0, 0, 0):
        yield "the normal has the length 0"
    if each.kind not in {None, *WITH_NORMAL} and (each.surface or each.normal):
        yield "'surface' and 'normal' are for a point or a line"
    if each.surface and kinds.get(each.surface, FeatureKind.POINT) not in {
        *(None, FeatureKind.PLANE)
    }:
        yield f"the surface {each.surface!r} is no plane of the plan"


def _of_characteristic(
    plan: Plan, each: PlannedCharacteristic, kinds: Mapping[str, FeatureKind | None]
) -> Iterator[str]:
    yield from _unknown(each.features, kinds)
    if len({*each.features}) < len(each.features):
        yield "it names one feature twice"
    # WORKAROUND for msgspec 0.22: bounds of a number in a union with a tuple fail.
    ends = np.atleast_1d(0.0 if each.tolerance is None else each.tolerance)
    width = ends[-1] - ends[0] if len(ends) > 1 else ends[0]
    if not (np.abs(ends) <= FARTHEST).all() or width < 0:
        yield f"the tolerance {each.tolerance} is none"
    is_deviation = each.quantity in DEVIATIONS
    if is_deviation and each.tolerance is not None and len(ends) > 1:
        yield f"the tolerance of a {each.quantity} is one number, its upper limit"
    judged = each.tolerance is not None or each.certified is not None
    if judged and not is_deviation and each.nominal is None:
        yield "a tolerance needs the 'nominal' that it refers to"
    if each.quantity in NEEDS_DATUM and not each.datum:
        yield f"a {each.quantity} needs a 'datum'"
    datum = kinds.get(each.datum)
    if not is_defined(each.quantity, [kinds.get(name) for name in each.of], datum):
        of = _listed(each.features, kinds)
        yield f"a {each.quantity} is not defined for {of}"
    if each.quantity is Of.POSITION and kinds.keys() >= set(each.of):
        nominal = plan.feature(each.of[0]).nominal
        if nominal is None or nominal.origin is None:
            yield f"the nominal origin of {each.of[0]!r} is missing"


def _unknown(
    used: tuple[str, ...] | list[str], kinds: Mapping[str, FeatureKind | None]
) -> Iterator[str]:
    for name in used:
        if name not in kinds:
            yield f"there is no feature {name!r}"


def _listed(names: tuple[str, ...], kinds: Mapping[str, FeatureKind | None]) -> str:
    """Return features with their kinds."""
    found = ((name, kinds.get(name)) for name in names)
    return ", ".join(
        name if kind is None else f"{name} ({kind.value})" for name, kind in found
    )


def _with_lists(tree: Any) -> Any:
    """Return a document in which one name stands for a list of one."""
    if not isinstance(tree, dict):
        return tree
    entries = tree.get("characteristics")
    for each in entries if isinstance(entries, list) else ():
        if isinstance(each, dict) and isinstance(each.get("of"), str):
            each["of"] = [each["of"]]
    return tree


def _in_words(error: str, tree: Any) -> str:
    """Return what msgspec found of a document in the words of a plan."""
    what, _, path = error.partition(" - at `$")
    for pattern, sentence in SENTENCES:
        found = re.fullmatch(pattern, what)
        if found:
            what = sentence.format(*(_typed(each) for each in found.groups()))
            break
    where: list[str] = []
    for name, index in re.findall(r"\.(\w+)|\[(\d+)\]", path):
        if index and where:
            noun = NOUNS.get(where[-1], where[-1])
            tree = tree[int(index)]
            own = tree.get("name") if isinstance(tree, dict) else None
            where[-1] = f"{noun} {own or int(index) + 1}"
        elif name:
            tree = tree.get(name) if isinstance(tree, dict) else None
            where.append(name)
    return f"{', '.join(where)}: {what}" if where else what


def _typed(word: str) -> str:
    """Return types of a document as a user calls them."""
    return " or ".join(TYPES.get(each, each) for each in word.split(" | "))
