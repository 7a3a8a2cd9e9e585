"""Which extras packages bring along, as nothing is added to an installed program."""

import re

EXTRAS = {
    *("genicam", "harvesters"),  # "genicam"
    *("crcmod", "pyigtl"),  # "stream"
    *("psycopg", "psycopg-binary", "tzdata"),  # "postgres"
    "python-calamine",  # "workbooks"
}


def extra_requirements(lock: str) -> str:
    """Return the entries of extras in the text of requirements-dev.lock."""
    entries = re.split(r"^(?=[\w-]+==)", lock, flags=re.MULTILINE)
    return "".join(entry for entry in entries if entry.partition("==")[0] in EXTRAS)
