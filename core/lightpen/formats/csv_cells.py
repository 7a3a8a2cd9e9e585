"""CSV tables without formulas for spreadsheets [1]_.

References
----------
.. [1] OWASP, "CSV Injection", https://owasp.org/www-community/attacks/CSV_Injection.
"""

import csv
import io
from collections.abc import Iterable

# First characters of texts that a spreadsheet evaluates, also in full width.
_FORMULA = (*"=+-@\t\r\n", *"\uff1d\uff0b\uff0d\uff20")


def csv_table(rows: Iterable[Iterable[object]]) -> str:
    """Return rows as CSV; a text that could be a formula begins with an apostrophe.

    Numbers stay numbers.
    """
    lines = io.StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    writer.writerows([_shown(cell) for cell in row] for row in rows)
    return lines.getvalue()


def _shown(value: object) -> object:
    is_formula = isinstance(value, str) and value.lstrip(" ").startswith(_FORMULA)
    return f"'{value}" if is_formula else value
