"""The file of the settings: read with care, written whole, shared by two windows.

It is a JSON object of sections, each with its entries. Who writes puts only what was
changed into what is there by then, so that each of two windows keeps its own.
"""

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from PySide6.QtCore import QByteArray, QSettings

from lightpen.errors import FileError
from lightpen.formats.file_locks import folder_locked
from lightpen.formats.files import (
    MEGABYTE,
    printable,
    read_bytes,
    sync_folder,
    write_whole,
)
from lightpen.formats.own_json import DamagedError, parse_own_json
from lightpen.formats.part_files import sweep_parts
from lightpen.formats.system_reasons import strerror
from lightpen.sentences import Sentence, sentence

WHAT = sentence("file.settings", "settings file")
LIMIT = 4 * MEGABYTE
PATIENCE = 0.5  # s for another window to write its own

Content: TypeAlias = Mapping[str, Mapping[str, Any]]
Changes: TypeAlias = dict[tuple[str, str], Any]  # by section and name


@dataclass(frozen=True)
class Loaded:
    """What a file holds, and why it is not all, if anything was wrong."""

    content: Content
    trouble: Sentence | None = None


def load(file: Path) -> Loaded:
    """Return the settings of a file; of version 0.1 if there is none yet."""
    sweep_parts(file.parent)
    if not file.exists():
        return Loaded(_of_version_0_1(file.with_suffix(".ini")))
    try:
        return Loaded(_read(file))
    except DamagedError:
        return Loaded({}, _set_aside(file))
    except FileError as error:
        return Loaded({}, error.sentence)


def with_changes(content: Content, changes: Changes) -> Content:
    """Return settings with what was changed."""
    sections = {name: dict(entries) for name, entries in content.items()}
    for (section, name), entry in changes.items():
        sections.setdefault(section, {})[name] = entry
    return sections


def save(file: Path, content: Content, changes: Changes) -> Sentence | None:
    """Write what was changed, and return what its user should know of it.

    Parameters
    ----------
    content : mapping
        All that is in force, for a file that has nothing to be kept.

    Raises
    ------
    FileError
        The file cannot be written.
    """
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with folder_locked(file.parent, PATIENCE) as is_alone:
            trouble = None if is_alone else _held(file)
            if file.exists():
                try:
                    content = with_changes(_read(file), changes)
                except DamagedError:
                    trouble = _set_aside(file)
            write_whole(file, json.dumps(content, ensure_ascii=True, indent=1).encode())
            sync_folder(file.parent)
    except OSError as error:
        raise _cannot_be_saved(file, error) from error
    return trouble


def _read(file: Path) -> Content:
    return parse_own_json(read_bytes(file, WHAT, LIMIT), dict[str, dict[str, Any]])


def _of_version_0_1(file: Path) -> Content:
    """Read the settings as version 0.1 wrote them; they are left as they are."""
    if not file.is_file():
        return {}
    ini = QSettings(str(file), QSettings.Format.IniFormat)
    ini.setFallbacksEnabled(False)
    content: dict[str, dict[str, Any]] = {}
    for key in ini.allKeys():
        section, _, name = key.partition("/")
        value = ini.value(key)
        if isinstance(value, QByteArray):
            value = value.toBase64().toStdString()
        entries = content.setdefault(section, {})
        if section == "stations":
            station, _, name = name.partition("/")
            entries = entries.setdefault(_decoded(station), {})
        entries[name] = value
    return content


def _decoded(group: str) -> str:
    """Return a station's name of characters that would have parted groups."""
    return group.replace("%5C", "\\").replace("%2F", "/").replace("%25", "%")


def _set_aside(file: Path) -> Sentence:
    aside = file.with_name(f"{file.name}.damaged")
    with suppress(OSError):  # it is told all the same
        file.replace(aside)
    return sentence(
        "settings.damaged",
        "The settings {file} are damaged and were set aside as {aside}. Restore them "
        "from a copy, or choose anew what is missing.",
        file=printable(str(file)),
        aside=printable(aside.name),
    )


def _held(file: Path) -> Sentence:
    return sentence(
        "settings.held",
        "The settings {file} were saved, though another program kept them to itself "
        "for {seconds:g} s. End that program if it hangs, or it may change them back.",
        file=printable(str(file)),
        seconds=PATIENCE,
    )


def _cannot_be_saved(file: Path, error: OSError) -> FileError:
    return FileError(
        sentence(
            "settings.unwritable",
            "The settings cannot be saved: {file} cannot be written ({reason}). Make "
            "sure that its folder is yours to write and that the disk is not full.",
            file=printable(str(file)),
            reason=strerror(error),
        )
    )
