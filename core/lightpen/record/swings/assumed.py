"""Assumptions of a station in the settings of a record."""

from collections.abc import Mapping
from dataclasses import asdict

from lightpen.formats.json_records import Plain
from lightpen.model.assumptions import USUAL, Assumptions

PREFIX = "assumed_"


def assumption_entries(assumptions: Assumptions) -> dict[str, Plain]:
    """Return assumptions as settings of a record."""
    return {PREFIX + name: value for name, value in asdict(assumptions).items()}


def recorded_assumptions(settings: Mapping[str, Plain]) -> Assumptions:
    """Return the assumptions among settings; defaults for missing ones.

    Raises `ValueError` if one makes no sense.
    """
    values = asdict(USUAL)
    for name in values:
        value = settings.get(PREFIX + name)
        if isinstance(value, int | float):
            values[name] = float(value)
    return Assumptions(**values)
