"""When two names are the same name, however they are typed."""

import unicodedata
from collections.abc import Iterable

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
