"""Laboratory, operator and procedure of a calibration."""

import re
from dataclasses import dataclass

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
