"""Workbooks read as tables, and CSV tables without formulas for spreadsheets [1]_.

References
----------
.. [1] OWASP, "CSV Injection", https://owasp.org/www-community/attacks/CSV_Injection.
"""

import csv
import io
import zipfile
from collections.abc import Callable, Iterable
from pathlib import Path

from lightpen.errors import FileError
from lightpen.formats.files import read_bytes, text_of
from lightpen.messages import Message, printable

LARGEST_WORKBOOK = 50_000_000  # bytes, unpacked
FEWEST_CELLS = 3  # of a row of a table in a workbook
# First characters of texts that a spreadsheet evaluates, also in full width.
_FORMULA = (*"=+-@\t\r\n", *"\uff1d\uff0b\uff0d\uff20")


def table_text(
    path: Path, what: Message, limit: int, refuse: Callable[[bytes, str], None]
) -> str:
    """Return the text of a table; of a workbook, its first sheet with one.

    ``refuse`` takes the content and the name of any other file, and raises `FileError`
    if it is of another program.
    """
    data, name = read_bytes(path, what, limit), printable(path.name)
    if _is_workbook(data):
        return _workbook_text(data, name)
    refuse(data, name)
    return text_of(data, path, what)


def _is_workbook(data: bytes) -> bool:
    """Return whether the content of a file is that of a workbook: xlsx, ods or xls."""
    parts = (b"xl/workbook", b"content.xml")
    is_packed = data.startswith(b"PK\x03\x04") and any(each in data for each in parts)
    return is_packed or data.startswith(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1")


def _workbook_text(data: bytes, name: str) -> str:
    """Return the first sheet of a workbook with a table, as lines with tabs."""
    try:
        from python_calamine import CalamineError, CalamineWorkbook
    except ImportError as error:
        raise FileError("workbook.no-reader", name=name) from error
    try:
        if data.startswith(b"PK"):
            with zipfile.ZipFile(io.BytesIO(data)) as packed:
                size = sum(each.file_size for each in packed.infolist())
            if size > LARGEST_WORKBOOK:
                raise FileError("workbook.large", name=name)
        book = CalamineWorkbook.from_filelike(io.BytesIO(data))
        for index in range(len(book.sheet_names)):
            rows = book.get_sheet_by_index(index).to_python(skip_empty_area=True)
            rows = [row for row in rows if any(cell != "" for cell in row)]
            if sum(len(row) - row.count("") >= FEWEST_CELLS for row in rows) > 1:
                return "".join("\t".join(map(_cell, row)) + "\n" for row in rows)
    except (CalamineError, zipfile.BadZipFile, OSError, ValueError) as error:
        raise FileError("workbook.damaged", name=name) from error
    raise FileError("table.no-rows", name=name)


def _cell(value: object) -> str:
    if isinstance(value, float) and value.is_integer() and abs(value) < 2**53:
        return str(int(value))
    return " ".join(str(value).split())


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
