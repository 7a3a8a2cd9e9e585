"""When two names are the same name, however they are typed."""

import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, TypeAlias

# Cyrillic and Greek letters, after case folding, that look like Latin ones.
_LOOKALIKES = str.maketrans(
    "авеёзікмнорстухѕјһԁԛԝӏɑαβεζηικμνορτυχϲϳ", "abeë3ikmhopctyxsjhdqwlaabezhikmnoptyxcj"
)
_HYPHENS = "\u2043\u2212\u02d7"  # that are no dashes to Unicode
_SOFT = "\u00ad"


def folded_name(name: str) -> str:
    """Return a name without case, width, kind of hyphen, alphabet and extra spaces.

    Two names that look alike have the same one; characters without width are left out.
    """
    folded = unicodedata.normalize("NFKC", name).casefold()
    # Case folding may undo the normal form.
    folded = unicodedata.normalize("NFKC", folded).translate(_LOOKALIKES)
    plain = "".join(map(_plain, folded))
    return " ".join(plain.split())


def same_name(name: str, known: Iterable[str]) -> str | None:
    """Return which of the known names a name is; None if it is another one."""
    folded = folded_name(name)
    return next((each for each in known if folded_name(each) == folded), None)


def _plain(character: str) -> str:
    category = unicodedata.category(character)
    if character in _HYPHENS or category == "Pd":
        return "-"
    return "" if character == _SOFT or category == "Cf" else character


Method: TypeAlias = Literal["joint", "two-stage"]
METHODS: tuple[Method, ...] = ("joint", "two-stage")


class Origin(StrEnum):
    """Origin of images.

    A simulated tip is never current for a pen; one of recorded images may be, as the
    person who accepts it knows their date and subject.
    """

    LIVE = "live camera"
    RECORDED = "recorded"
    SIMULATED = "simulated"


PLACES = ("laboratory", "customer", "laboratoryBranch", "customerBranch", "other")


@dataclass(frozen=True)
class Laboratory:
    """A calibration laboratory, as certificates and reports state it.

    A certificate needs name, e-mail address, city and country.
    """

    name: str = ""
    email: str = ""
    city: str = ""
    country: str = ""  # ISO 3166-1, two letters
    street: str = ""
    post_code: str = ""
    procedure: str = ""  # name or number of the working instruction
    place: str = PLACES[0]  # where it calibrates, one of `PLACES`


def is_country(code: str) -> bool:
    """Return whether a text has the form of a country code of ISO 3166-1."""
    return re.fullmatch("[A-Z]{2}", code) is not None
