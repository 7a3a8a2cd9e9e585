"""Write the JSON schema of a calibration record, and its page: ``docs/schema.py``.

Both are made of the types that the program writes and reads, and of their docstrings.
"""

import json
import re
from collections.abc import Mapping
from inspect import cleandoc
from pathlib import Path
from typing import Any

from msgspec.json import schema

from lightpen.estimation.reports.calibration_record import CalibrationRecord

FILE = Path(__file__).with_name("calibration.schema.json")
PAGE = Path(__file__).with_name("calibration-record.md")
BEGIN = "<!-- tables -->"
CHECKSUM = {
    "description": "SHA-256 of the file up to the comma before this entry.",
    "type": "string",
    "pattern": "^[0-9a-f]{64}$",
}
DIALECT = "https://json-schema.org/draft/2020-12/schema"
ROOT = "CalibrationRecord"


def described(docstring: str) -> tuple[str, dict[str, str]]:
    """Return the text of a docstring, and what its section Attributes says of each."""
    text, _, section = cleandoc(docstring).partition("\n\nAttributes\n----------\n")
    found = {}
    for part in re.split(r"\n(?=\S)", section):
        names, _, meaning = part.partition("\n")
        for name in names.partition(" : ")[0].split(", "):
            found[name] = re.sub(r"\bNone\b", "null", " ".join(meaning.split()))
    return text, found


def made_schema() -> dict[str, Any]:
    """Return the schema, as the types of the record give it.

    The program passes over other entries than these; the schema, which says what this
    version writes, does not.
    """
    made = {"$schema": DIALECT, **schema(CalibrationRecord)}
    for each in made["$defs"].values():
        each["description"], meanings = described(each.get("description", ""))
        if "properties" not in each:
            continue
        each["additionalProperties"] = False
        for name, entry in each["properties"].items():
            if name in meanings:
                entry["description"] = meanings[name]
    made["$defs"][ROOT]["properties"]["checksum"] = CHECKSUM
    _put_null_last(made)
    return made


def _put_null_last(part: Any) -> None:
    """Order alternatives alike whatever version of msgspec lists them."""
    if isinstance(part, dict):
        if "anyOf" in part:
            part["anyOf"].sort(key=lambda each: each.get("type") == "null")
        part = list(part.values())
    if isinstance(part, list):
        for each in part:
            _put_null_last(each)


def schema_text() -> str:
    """Return the schema as it is published."""
    return json.dumps(made_schema(), indent=1) + "\n"


def page_text(content: str) -> str:
    """Return the page of the record with its tables made anew."""
    parts = made_schema()["$defs"]
    tables = [
        _section(name, parts)
        for name in _in_order(parts, ROOT)
        if "properties" in parts[name]
    ]
    return "\n\n".join([content.partition(BEGIN)[0] + BEGIN, *tables]) + "\n"


def _in_order(parts: Mapping[str, Any], root: str) -> list[str]:
    """Return the names of all parts, each after the first that refers to it."""
    found = [root]
    for name in found:  # which grows meanwhile
        for other in re.findall(r'"#/\$defs/(\w+)"', json.dumps(parts[name])):
            if other not in found:
                found.append(other)
    return found


def _section(name: str, parts: Mapping[str, Any]) -> str:
    part = parts[name]
    lines = [f"## {name}", "", part["description"], ""]
    lines += ["| entry | type | meaning |", "|---|---|---|"]
    required = part.get("required", ())
    for entry, kind in part["properties"].items():
        optional = "" if entry in required else " (optional)"
        meaning = f"{kind.get('description', '')}{optional}".strip()
        lines.append(f"| `{entry}` | {_type(kind, parts)} | {meaning} |")
    return "\n".join(lines)


def _type(kind: Mapping[str, Any], parts: Mapping[str, Any]) -> str:
    """Return the type of an entry in words; those with entries are links."""
    if "$ref" in kind:
        name = kind["$ref"].rpartition("/")[2]
        if "properties" not in parts[name]:
            return _type(parts[name], parts)
        return f"[{name}](#{name.lower()})"
    if "anyOf" in kind:
        return " or ".join(_type(each, parts) for each in kind["anyOf"])
    if "enum" in kind:
        return " or ".join(f"`{value}`" for value in kind["enum"] if value)
    match kind.get("type"):
        case "array" if "prefixItems" in kind:
            items = kind["prefixItems"]
            return f"{len(items)} x {_type(items[0], parts)}"
        case "array":
            return f"list of {_type(kind.get('items', {}), parts)}"
        case "object" if isinstance(kind.get("additionalProperties"), dict):
            return f"object of {_type(kind['additionalProperties'], parts)}"
        case None:
            return "any value"
        case other:
            return str(other)


if __name__ == "__main__":
    FILE.write_text(schema_text(), encoding="utf-8")
    PAGE.write_text(page_text(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
