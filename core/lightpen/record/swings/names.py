"""Names of station, operator and items, and the folder name of a swing."""

import re
from dataclasses import dataclass
from datetime import datetime

from lightpen.formats.files import is_reserved

UNFIT = re.compile(r"[^\w.-]+")  # for the name of a folder
LONGEST_WORD = 24  # characters; of up to 4 bytes, of the 255 that a name may have


@dataclass(frozen=True)
class Names:
    """Station, operator, serial number of the pen, tip, cone and ball diameter, mm."""

    station: str = ""
    operator: str = ""
    pen: str = ""
    tip: str = ""
    cone: str = ""
    ball_diameter: float | None = None


def folder_name(names: Names, now: datetime) -> str:
    """Return the name of a swing's folder, by the time, the pen and the tip."""
    pen, tip = names.pen[:LONGEST_WORD], names.tip[:LONGEST_WORD]
    words = (f"{now:%Y%m%d-%H%M%S}", pen, tip)
    # Windows leaves dots at the end of a name out, and then finds the folder no more.
    return not_reserved(UNFIT.sub("-", "_".join(filter(None, words))).rstrip("."))


def not_reserved(name: str) -> str:
    """Return a file name, changed where Windows takes it for a device: ``nul.x``."""
    return f"_{name}" if is_reserved(name) else name
