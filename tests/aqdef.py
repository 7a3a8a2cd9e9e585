"""A strict reader of the ASCII transfer format of Q-DAS (AQDEF), for tests.

A line is a key ``K0001``, an index ``/1`` where the field is not of the whole file or
part, a blank and a value. The fields of a characteristic come before the values.
"""

import re
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

LINE = re.compile(r"(K\d{4})(?:/(\d+))? (.*)")
NUMBERS = {"K0001", "K2101", "K2110", "K2111"}
CATALOGUES = {"K0008": "K4092", "K0010": "K4062", "K0012": "K4072"}


@dataclass
class AqdefFile:
    """Fields of a part, of its characteristics, of the values, and of the catalogues.

    Attributes
    ----------
    characteristics, values : list of mapping
        By key, in the order of the characteristics; each has one value.
    """

    part: dict[str, str] = field(default_factory=dict)
    characteristics: list[dict[str, Any]] = field(default_factory=list)
    values: list[dict[str, Any]] = field(default_factory=list)
    catalogues: dict[tuple[str, int], str] = field(default_factory=dict)


def read_aqdef(text: str) -> AqdefFile:
    """Read a file with one part; `ValueError` if it is not as the format has it."""
    read = AqdefFile()
    for line in text.splitlines():
        found = LINE.fullmatch(line)
        if found is None:
            raise ValueError(f"No field: {line}")
        key, index, value = found[1], int(found[2] or 0), found[3]
        if key == "K0100":
            read.characteristics = [{} for _ in range(int(value))]
            read.values = [{} for _ in range(int(value))]
        elif key[1] == "1":
            _put(read.part, key, value)
        elif key[1] == "4":
            _put(read.catalogues, (key, index), value)
        elif key[1] in "02":
            group = read.values if key[1] == "0" else read.characteristics
            if not 1 <= index <= len(group):
                raise ValueError(f"No such characteristic: {line}")
            _put(group[index - 1], key, float(value) if key in NUMBERS else value)
        else:
            raise ValueError(f"Unknown field: {line}")
    _require_sense(read)
    return read


def _put(fields: dict[Any, Any], key: object, value: object) -> None:
    if key in fields:
        raise ValueError(f"{key} is there twice.")
    fields[key] = value


def _require_sense(read: AqdefFile) -> None:
    for characteristic, value in zip(read.characteristics, read.values, strict=True):
        for key in ("K2001", "K2002", "K2142"):
            if not characteristic.get(key):
                raise ValueError(f"{key} is missing.")
        lower, upper = characteristic.get("K2110"), characteristic.get("K2111")
        if lower is not None and upper is not None and not lower < upper:
            raise ValueError("The lower limit is not below the upper one.")
        if "K0001" not in value or value.get("K0002") != "0":
            raise ValueError("There is no valid value.")
        datetime.strptime(str(value["K0004"]), "%d.%m.%Y/%H:%M:%S")
        for key, catalogue in CATALOGUES.items():
            if (catalogue, int(value[key])) not in read.catalogues:
                raise ValueError(f"{key} names nothing in its catalogue.")
