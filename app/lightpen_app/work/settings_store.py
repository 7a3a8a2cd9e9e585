"""The settings file: checked reading, atomic writing, shared by windows.

It is a JSON object of sections, each with its entries. Who writes puts only what was
changed into what is there by then, so that each of two windows keeps its own.
"""

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from lightpen.errors import FileError
from lightpen.formats.files import (
    MEGABYTE,
    read_bytes,
    strerror,
    sync_folder,
    write_whole,
)
from lightpen.formats.own_json import DamagedError, parse_own_json
from lightpen.formats.part_files import folder_locked, sweep_parts
from lightpen.messages import Message, message, printable

WHAT = message("file.settings")
LIMIT = 4 * MEGABYTE
PATIENCE = 0.5  # s for another window to write its own

Content: TypeAlias = Mapping[str, Mapping[str, Any]]
Changes: TypeAlias = dict[tuple[str, str], Any]  # by section and name


@dataclass(frozen=True)
class LoadedSettings:
    """Content of a settings file, and its faults."""

    content: Content
    fault: Message | None = None


def load(file: Path) -> LoadedSettings:
    """Return the settings of a file; nothing if there is none yet."""
    sweep_parts(file.parent)
    if not file.exists():
        return LoadedSettings({})
    try:
        return LoadedSettings(_read(file))
    except DamagedError:
        return LoadedSettings({}, _moved_away(file))
    except FileError as error:
        return LoadedSettings({}, error.message)


def with_changes(content: Content, changes: Changes) -> Content:
    """Return the settings with changes applied."""
    sections = {name: dict(entries) for name, entries in content.items()}
    for (section, name), entry in changes.items():
        sections.setdefault(section, {})[name] = entry
    return sections


def save(file: Path, content: Content, changes: Changes) -> Message | None:
    """Write changes to the content of a file, and return a message if needed."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with folder_locked(file.parent, PATIENCE) as is_alone:
            fault = None if is_alone else _held(file)
            if file.exists():
                try:
                    content = with_changes(_read(file), changes)
                except DamagedError:
                    fault = _moved_away(file)
            write_whole(file, json.dumps(content, ensure_ascii=True, indent=1).encode())
            sync_folder(file.parent)
    except OSError as error:
        reason = strerror(error)
        raise FileError("settings.unwritable", file=file, reason=reason) from error
    return fault


def _read(file: Path) -> Content:
    return parse_own_json(read_bytes(file, WHAT, LIMIT), dict[str, dict[str, Any]])


def _moved_away(file: Path) -> Message:
    aside = file.with_name(f"{file.name}.damaged")
    with suppress(OSError):  # it is reported all the same
        file.replace(aside)
    return message("settings.damaged", file=file, aside=printable(aside.name))


def _held(file: Path) -> Message:
    return message("settings.held", file=file, seconds=PATIENCE)
