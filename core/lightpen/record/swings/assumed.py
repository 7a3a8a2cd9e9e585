"""Assumptions and method of a station in the settings of a record."""

from collections.abc import Mapping
from dataclasses import asdict

from lightpen.formats.json_records import Plain
from lightpen.model.assumptions import USUAL, Assumptions
from lightpen.model.method import Method

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


def recorded_method(settings: Mapping[str, Plain]) -> Method:
    """Return the method of the reported tip among settings."""
    return "two-stage" if settings.get("method") == "two-stage" else "joint"
