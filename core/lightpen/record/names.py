"""Who calibrates what, and the folder that the record of a new swing gets."""

import os
import re
from dataclasses import dataclass
from datetime import datetime
from itertools import chain, count
from pathlib import Path

UNFIT = re.compile(r"[^\w.-]+")  # for the name of a folder
LONGEST_WORD = 24  # characters; of up to 4 bytes, of the 255 that a name may have


@dataclass(frozen=True)
class Names:
    """Who calibrates what, where.

    Attributes
    ----------
    station, operator, pen, tip, cone : str
        ``pen`` is its serial number.
    ball_diameter : float or None
        Of the tip, mm; None when it is not known.
    """

    station: str = ""
    operator: str = ""
    pen: str = ""
    tip: str = ""
    cone: str = ""
    ball_diameter: float | None = None


def new_folder(root: Path, names: Names, now: datetime) -> Path:
    """Return a folder that does not exist, named by the time, the pen and the tip.

    Parameters
    ----------
    root : Path
        That the records are in.
    names : Names
        Whatever characters they have.
    """
    pen, tip = names.pen[:LONGEST_WORD], names.tip[:LONGEST_WORD]
    words = (f"{now:%Y%m%d-%H%M%S}", pen, tip)
    stem = UNFIT.sub("-", "_".join(filter(None, words)))
    free = (
        folder
        for tail in chain([""], map("-{}".format, count(2)))
        if not os.path.lexists(folder := root / (stem + tail))
    )
    return next(free)
