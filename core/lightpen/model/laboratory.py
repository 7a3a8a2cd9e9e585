"""Laboratory, operator and procedure of a calibration."""

import re
from dataclasses import dataclass

PLACES = ("laboratory", "customer", "laboratoryBranch", "customerBranch", "other")


@dataclass(frozen=True)
class Laboratory:
    """A calibration laboratory, as certificates and reports state it.

    A certificate needs name, e-mail address, city and country.

    Attributes
    ----------
    country : str
        ISO 3166-1, two letters.
    procedure : str
        Name or number of the working instruction.
    place : str
        Where it calibrates, one of `PLACES`.
    """

    name: str = ""
    email: str = ""
    city: str = ""
    country: str = ""
    street: str = ""
    post_code: str = ""
    procedure: str = ""
    place: str = PLACES[0]


def is_country(code: str) -> bool:
    """Return whether a text has the form of a country code of ISO 3166-1."""
    return re.fullmatch("[A-Z]{2}", code) is not None
