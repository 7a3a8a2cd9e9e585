"""Parse untrusted YAML, XML, JSON and TOML files to trees of plain values.

Everything that is not a mapping or a sequence stays text, so that a number is read to
its last digit whatever the format. Nothing in a file is executed, expanded or followed:
tags that name a type of a program, anchors and aliases, document type definitions and
entities are refused, and so are keys given twice and deep nesting.
"""

import json
import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NoReturn, TypeAlias
from xml.parsers import expat

import yaml

from lightpen.errors import FileError
from lightpen.formats.files import quoted

Tree: TypeAlias = "dict[str, Tree] | list[Tree] | str | bool | None"

MAX_DEPTH = 20  # of nesting; the files read here have at most six levels
MAX_VALUES = 200_000  # with names; a file may keep the points of a calibration

_YAML_NAMESPACE = "tag:yaml.org,2002:"
_YAML_TAGS = {
    _YAML_NAMESPACE + name
    for name in (
        *("map", "seq", "str", "int", "float", "bool", "null", "timestamp"),
        *("opencv-matrix", "opencv-nd-matrix"),
    )
}
_ARRAYS = {"data64F": "data", "data32F": "data"}  # of matrices of OpenCV.js
_YAML_DIRECTIVE = r"%YAML[: ].*"
# A table or an entry after comments.
_TOML = r"""(?a)(?:\s*(?:#.*\n)?)*+(?:\[[\w."'-]+\]\s*(?:#.*)?\n|[\w."'-]+[ \t]*=)"""
# Flow mappings of YAML have comments, single quotes and last commas as Python has.
_PYTHON = r"(?:\s*(?:#.*\n)?)*+\{(?:\s*(?:#.*\n)?)*+'"


def parse_document(text: str, name: str) -> dict[str, Tree]:
    """Return the mapping that a file holds, recognised by content.

    It is YAML, XML, JSON, TOML, or a dictionary in the notation of Python. The name of
    the file is for messages. Raises `FileError` for anything else.
    """
    start = text.lstrip()[:1]
    if start == "<":
        tree = parse_xml(text, name)
    elif re.match(_TOML, text):
        tree = parse_toml(text, name)
    elif re.match(_PYTHON, text):
        text = re.sub(r"\bb'[^'\n]*'", "''", text)
        tree = parse_yaml(re.sub(r"\(([-\d., ]*)\)", r"[\1]", text), name)
    elif start in ("{", "["):
        tree = parse_json(text, name)
    else:
        tree = parse_yaml(text, name)
    if isinstance(tree, list) and any(isinstance(each, dict) for each in tree):
        tree = {"list": tree}
    if not isinstance(tree, dict):
        raise FileError("document.no-values", name=name, start=quoted(text.strip()))
    return tree


def parse_json(text: str, name: str) -> Tree:
    """Return the tree of a JSON text; see `parse_document`."""

    def entries(pairs: list[tuple[str, Tree]]) -> Tree:
        if pairs and all(key == str(i) for i, (key, _) in enumerate(pairs)):
            return [value for _, value in pairs]  # an array of numbers of JavaScript
        mapping: dict[str, Tree] = {}
        for key, value in pairs:
            key = _ARRAYS.get(key, key)
            if key in mapping:
                raise FileError("document.given-twice", key=quoted(key), name=name)
            mapping[key] = value
        return mapping

    try:
        tree: Tree = json.loads(
            text,
            object_pairs_hook=entries,
            parse_int=str,
            parse_float=str,
            parse_constant=str,
        )
    except json.JSONDecodeError as error:
        raise FileError(
            "json.invalid",
            line=error.lineno,
            name=name,
            problem=error.msg,
            column=error.colno,
        ) from error
    except RecursionError as error:
        raise _too_deep(name) from error
    _check_size(tree, name)
    return tree


def parse_yaml(text: str, name: str) -> Tree:
    """Return the tree of a YAML text; see `parse_document`.

    The directive ``%YAML:1.0`` of OpenCV, which is no valid YAML, is skipped; with it
    there need be no blank before a number (``Viewer.PointSize:2`` of ORB-SLAM).
    """
    loader = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader
    if text.startswith("%YAML"):
        text = re.sub(_YAML_DIRECTIVE, "", text, count=1)
        text = re.sub(r"(?m)^([A-Za-z][\w.]*):(?=[-.\d])", r"\1: ", text)
    try:
        return _yaml_document(_limited(yaml.parse(text, Loader=loader), name), name)
    except yaml.MarkedYAMLError as error:
        if error.problem_mark is None:
            raise _no_yaml(name) from error
        raise FileError(
            "yaml.invalid-line",
            line=error.problem_mark.line + 1,
            name=name,
            problem=str(error.problem or error.context),
        ) from error
    except yaml.YAMLError as error:
        raise _no_yaml(name) from error


def parse_toml(text: str, name: str) -> Tree:
    """Return the tree of a TOML text; see `parse_document`."""
    try:
        tree = _as_text(tomllib.loads(text, parse_float=str))
    except tomllib.TOMLDecodeError as error:
        raise FileError("toml.invalid", name=name, problem=str(error)) from error
    except (RecursionError, ValueError) as error:  # nested, or of too many digits
        raise _too_deep(name) from error
    _check_size(tree, name)
    return tree


def _as_text(value: Any) -> Tree:
    if isinstance(value, dict):
        return {str(key): _as_text(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_as_text(each) for each in value]
    return value if isinstance(value, bool) else str(value)


def parse_xml(text: str, name: str) -> Tree:
    """Return the tree of an XML text as OpenCV's FileStorage writes it.

    Elements with children become mappings, or sequences if the children are named
    ``_``; see `parse_document`.
    """
    builder = _XmlBuilder(name)
    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.StartElementHandler = lambda tag, _: builder.open(
        tag, parser.CurrentLineNumber
    )
    parser.EndElementHandler = lambda _: builder.close()
    parser.CharacterDataHandler = builder.add_text
    parser.StartDoctypeDeclHandler = lambda *_: builder.refuse_definition(
        parser.CurrentLineNumber
    )
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise FileError(
            "xml.invalid",
            line=error.lineno,
            name=name,
            problem=expat.ErrorString(error.code),
        ) from error
    return builder.root


def _limited(events: Iterator[Any], name: str) -> Iterator[Any]:
    for count, event in enumerate(events):
        if count > MAX_VALUES:
            raise _too_many(name)
        yield event


def _yaml_document(events: Iterator[Any], name: str) -> Tree:
    tree: Tree = None
    for event in events:
        if isinstance(event, yaml.DocumentStartEvent):
            found = _yaml_node(next(events), events, 0, name)
            if tree is not None and found and _content(found) != _content(tree):
                raise FileError("yaml.several-documents", name=name)
            tree = tree or found
    return tree


def _content(tree: Tree) -> Tree:
    """Return what the messages of ROS about one thing have in common."""
    if not isinstance(tree, dict):
        return tree
    return {key: value for key, value in tree.items() if key != "header"}


def _yaml_node(event: Any, events: Iterator[Any], depth: int, name: str) -> Tree:
    _check_yaml_event(event, name)
    if isinstance(event, yaml.ScalarEvent):
        return str(event.value)
    if depth >= MAX_DEPTH:
        raise _too_deep(name)
    if isinstance(event, yaml.SequenceStartEvent):
        items: list[Tree] = []
        while not isinstance(child := next(events), yaml.SequenceEndEvent):
            items.append(_yaml_node(child, events, depth + 1, name))
        return items
    mapping: dict[str, Tree] = {}
    while not isinstance(child := next(events), yaml.MappingEndEvent):
        key = _yaml_node(child, events, depth + 1, name)
        line = child.start_mark.line + 1
        if not isinstance(key, str):
            raise FileError("yaml.list-as-name", line=line, name=name)
        if key in mapping:
            _refuse_twice(key, line, name)
        mapping[key] = _yaml_node(next(events), events, depth + 1, name)
    return mapping


def _check_yaml_event(event: Any, name: str) -> None:
    line = event.start_mark.line + 1
    if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
        raise FileError(
            "yaml.anchor", line=line, name=name, anchor=quoted(event.anchor)
        )
    if event.tag is not None and event.tag not in _YAML_TAGS and event.tag != "!":
        tag = event.tag.replace(_YAML_NAMESPACE, "!!")
        raise FileError("yaml.tag", line=line, name=name, tag=quoted(tag))


@dataclass(frozen=True)
class _Element:
    tag: str
    names: list[str] = field(default_factory=list)
    values: list[Tree] = field(default_factory=list)
    seen: set[str] = field(default_factory=set)
    text: list[str] = field(default_factory=list)

    def tree(self) -> Tree:
        if not self.names:
            return _xml_scalar("".join(self.text).strip())
        if self.seen == {"_"}:
            return self.values
        return dict(zip(self.names, self.values, strict=True))


class _XmlBuilder:
    """Builds a tree from the elements an XML parser meets."""

    def __init__(self, name: str) -> None:
        self.root: Tree = None
        self._name = name
        self._open: list[_Element] = []
        self._n_elements = 0

    def open(self, tag: str, line: int) -> None:
        if len(self._open) > MAX_DEPTH:
            raise _too_deep(self._name)
        self._n_elements += 1
        if self._n_elements > MAX_VALUES:
            raise _too_many(self._name)
        if self._open:
            parent = self._open[-1]
            if tag in parent.seen and (tag != "_" or len(parent.seen) > 1):
                _refuse_twice(tag, line, self._name)
            parent.seen.add(tag)
        self._open.append(_Element(tag))

    def add_text(self, text: str) -> None:
        self._open[-1].text.append(text)

    def close(self) -> None:
        element = self._open.pop()
        if self._open:
            self._open[-1].names.append(element.tag)
            self._open[-1].values.append(element.tree())
        else:
            self.root = element.tree()

    def refuse_definition(self, line: int) -> NoReturn:
        raise FileError("xml.definition", line=line, name=self._name)


def _xml_scalar(text: str) -> str:
    if len(text) > 1 and text[0] == text[-1] == '"':
        return text[1:-1]
    return text


def _check_size(tree: Tree, name: str) -> None:
    level = [tree]
    n_values = 0
    for _ in range(MAX_DEPTH + 1):
        below: list[Tree] = []
        for node in level:
            if isinstance(node, dict):
                below.extend(node.values())
            elif isinstance(node, list):
                below.extend(node)
        n_values += len(below)
        if n_values > MAX_VALUES:
            raise _too_many(name)
        if not below:
            return
        level = below
    raise _too_deep(name)


def _no_yaml(name: str) -> FileError:
    return FileError("yaml.invalid", name=name)


def _too_many(name: str) -> FileError:
    return FileError("document.too-many-values", name=name, most=MAX_VALUES)


def _too_deep(name: str) -> FileError:
    return FileError("document.too-deep", name=name, n_levels=MAX_DEPTH)


def _refuse_twice(key: str, line: int, name: str) -> NoReturn:
    raise FileError(
        "document.given-twice-on-line", key=quoted(key), line=line, name=name
    )
