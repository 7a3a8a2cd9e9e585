"""Tables in delimited text: comma, semicolon, tab or blanks; decimal comma; header."""

import csv
import math
import re
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from itertools import compress, pairwise, takewhile
from typing import NoReturn

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.errors import FileError
from lightpen.formats.files import quoted
from lightpen.messages import Message, message

MAX_LINES = 300_000  # 0.2 GB while they are read
MAX_CELLS = 2_000_000
LARGEST_WHOLE = 2**31 - 1  # of LED numbers
LARGEST_MOMENT = 2**63 - 1  # of frame numbers: nanoseconds have 19 digits
DECIMALS = 9  # of times
NOTHING = frozenset(
    (
        *("", "nan", "na", "n/a", "n.a.", "#n/a", "#nv", "none", "null", "missing"),
        *("-", "--", ".", "?", "inf", "-inf", "infinity", "-nan", "nan(ind)"),
        *("-nan(ind)", "1.#qnan", "1.#qnan0", "-1.#ind", "-1.#ind00"),
        *("#div/0!", "#num!", "#zahl!", "#ref!", "#bezug!", "#value!", "#wert!"),
    )
)

# No digit can match in two ways, so that mismatches are found without backtracking.
_NUMBER = r"(?a:[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?)"
_NUMBER_CHARACTERS = b"0123456789+-.eE\n"
_GROUPED = r"(?a)[+-]?\d{1,3}([.,' ]\d{3})+[.,]\d+"
_NOT_FINITE = r"(?i:[+-]?\.?(nan|inf|infinity|1\.#\w+))"
_COMMENT = r"\s*(?:[#%]|//)"  # of MATLAB and C++, too
# Full-width characters, minus signs that are not of ASCII, blanks within numbers.
_PLAIN: dict[int, str] = {0xFF01 + i: chr(0x21 + i) for i in range(94)}
_PLAIN |= {0x2212: "-", 0x2013: "-", 0x00A0: "", 0x2009: "", 0x202F: ""}
_FORTRAN = r"(?a)(?<=\d)[dD](?=[+-]\d)"  # the E of a number
_BLANKS = r" *\S+( +[+-]?\d+,\d+){2,} *"  # between numbers with decimal commas
_CELL = r"[^\s;,|=+:-]"  # lines of a spreadsheet and rules have none
_CELL_OF_TWO_LINES = r'(?m)(?:^|(?<=[;,\t]))"[^"\n]*\n[^"\n]*"(?=[;,\t\n])'
_JSON = r"\s*[\[{]\s*[\"{\[]"
_IN_BRACKETS = r"\s*(#|[\[(].*[\])])$"  # a unit
_LED_NAME = r"(?a)^(#|[^\W\d_]).*?(?=\d+$)"
_FILE_SUFFIX = r"(?ai)(\.[a-z]\w*)+$"
_DATE = r"(?a)(\d{4}-\d\d-\d\d[T ])?(\d\d:\d\d:\d\d([.,]\d+)?)(Z|[+-]\d\d:?\d\d)?"


@dataclass(frozen=True, eq=False)
class Table:
    """The cells of a table, as text."""

    name: str  # of the file
    header: tuple[str, ...]  # in lower case; empty if there is none
    rows: list[list[str]]  # all equally long, without surrounding blanks
    lines: list[int]  # of the file that the rows stand on, from 1

    @property
    def n_columns(self) -> int:
        """Number of columns."""
        return len(self.rows[0])

    def columns(self, names: Sequence[Sequence[str]], what: Message) -> list[int]:
        """Return the indices of columns by the accepted names of each, the best first.

        A table without header has its columns in the order of `names`. ``what``
        is the content of the table for messages.
        """
        wanted = ",".join(alternatives[0] for alternatives in names)
        if not self.header:
            if self.n_columns == len(names):
                return list(range(len(names)))
            n_columns = (
                message("table.one-column")
                if self.n_columns == 1
                else message("table.columns", count=self.n_columns)
            )
            raise FileError(
                "table.no-header",
                name=self.name,
                n_columns=n_columns,
                what=what,
                n_needed=len(names),
                wanted=wanted,
            )
        places = []
        header = list(map(_plain, self.header))
        for alternatives in names:
            best = next(filter(header.__contains__, map(_plain, alternatives)), None)
            if best is None:
                raise FileError(
                    "table.no-column",
                    name=self.name,
                    column=alternatives[0],
                    what=what,
                    wanted=wanted,
                    header=quoted(",".join(self.header)),
                )
            places.append(header.index(best))
        return places

    def numbers(self, columns: Sequence[int]) -> FloatArray:
        """Return columns, by their indices from 0, as numbers (N, k).

        Raises `FileError`, which names the line, for a cell that is no finite number.
        """
        cells = [row[column] for row in self.rows for column in columns]
        values = _clean_numbers(cells)
        if values is None:
            self._refuse_numbers(columns)
        return values.reshape(len(self.rows), len(columns))

    def numbers_or_none(self, columns: Sequence[int]) -> FloatArray:
        """Return columns as `numbers`; NaN where a cell is empty or says that."""
        rows = [[row[column] for column in columns] for row in self.rows]
        gone = np.array([[cell.casefold() in NOTHING for cell in row] for row in rows])
        known = [
            ["0" if cell.casefold() in NOTHING else cell for cell in row]
            for row in rows
        ]
        values = replace(self, rows=known).numbers(range(len(columns)))
        return np.where(gone, np.nan, values)

    def moments(self, column: int) -> IntArray:
        """Return a column of numbers or times of frames, as whole numbers in order.

        Times with decimals are counted in thousandths, or in thousandths of these.
        """
        cells = _moments([row[column] for row in self.rows])
        if any(map(number_flaw, cells)):
            self.numbers([column])  # names the line
        exact = list(map(Decimal, cells))
        least = -min(int(value.normalize().as_tuple().exponent) for value in exact)
        exact = [
            value.scaleb(min(-(-max(least, 0) // 3) * 3, DECIMALS)) for value in exact
        ]
        for row, value in enumerate(exact):
            if abs(value) > LARGEST_MOMENT or value % 1:
                cell = quoted(self.rows[row][column])
                raise self.error(row, message("table.no-moment", cell=cell))
        return np.array(list(map(int, exact)), dtype=np.int64)

    def whole_numbers(self, column: int) -> IntArray:
        """Return a column, by its index from 0, of whole numbers (LEDs).

        They may end a name, such as ``LED1``. Raises `FileError`, which names the line,
        for any other cell.
        """
        cells = [[re.sub(_LED_NAME, "", row[column])] for row in self.rows]
        values = replace(self, rows=cells).numbers([0])[:, 0]
        wrong = (values != np.round(values)) | (np.abs(values) > LARGEST_WHOLE)
        if np.any(wrong):
            row = int(np.argmax(wrong))
            raise self.error(
                row, message("table.not-whole", cell=quoted(self.rows[row][column]))
            )
        return values.astype(np.int64)

    def only(self, places: Iterable[int]) -> "Table":
        """Return these rows alone, by their indices from 0."""
        rows = [(self.rows[i], self.lines[i]) for i in places]
        return replace(self, rows=[r for r, _ in rows], lines=[n for _, n in rows])

    def error(self, row: int, flaw: Message) -> FileError:
        """Return the error that names the line of a row."""
        return FileError("table.line", line=self.lines[row], name=self.name, flaw=flaw)

    def _refuse_numbers(self, columns: Sequence[int]) -> NoReturn:
        """Raise the error of the first cell that is not a number."""
        first: dict[str, int] = {}
        for i, row in enumerate(self.rows):
            cells = [row[column] for column in columns]
            text = "\n".join(cells)
            if _clean_numbers([text.replace(",", ".")]) is None:
                for cell in cells:
                    flaw = number_flaw(cell)
                    if flaw and number_flaw(cell.replace(",", ".")):
                        raise self.error(i, flaw)
            for mark in ".,":
                if mark in text:
                    first.setdefault(mark, i)
        raise self.error(
            max(first.values()),
            message("table.points-and-commas", line=self.lines[min(first.values())]),
        )


def parse_table(text: str, name: str, *, is_foreign: bool = False) -> Table:
    r"""Read a table from a text with ``\n`` at the line ends.

    The separator is found from the lines: semicolon, tab, comma or blanks. Numbers may
    have decimal commas unless the comma separates columns. Blank lines and lines that
    begin with ``#`` or ``//`` are skipped. A first line without numbers is a header.
    A foreign table may have columns of the same name, short lines, and its header in a
    comment.
    """
    if re.match(_JSON, text):
        raise FileError("table.json", name=name)
    text = text if text.isascii() else text.translate(_PLAIN)
    text = re.sub(_FORTRAN, "e", text)
    text = re.sub(_CELL_OF_TWO_LINES, lambda cell: cell[0].replace("\n", " "), text)
    lines = _filled_lines(text, name)
    separator = _separator([line for _, line in lines])
    hint = re.fullmatch(r"sep=([;,\t|])\s*", lines[0][1])  # of Excel, to itself
    if hint:
        separator = hint[1]
        del lines[0]
    if not lines:
        raise FileError("table.no-rows", name=name)
    numbers = [number for number, _ in lines]
    _check_cells(lines, separator, name)
    rows = [_cells(line, separator, number, name) for number, line in lines]
    if separator is None and len(rows[0]) == 1 < len(rows[-1]):
        rows[0] = rows[0][0].split(",")  # only the names are separated by commas
    if separator is None and len(rows[0]) + 1 == len(rows[-1]):
        counts = [row[0] for row in rows[1:]]
        if any(counts == list(map(str, range(i, i + len(counts)))) for i in (0, 1)):
            rows[0].insert(0, "")  # R and pandas count the rows
    while all(row[-1] == "" and len(row) > 1 for row in rows):
        rows = [row[:-1] for row in rows]
    if n_titles := _n_titles(rows):
        rows, numbers = rows[n_titles:], numbers[n_titles:]
    if is_foreign:
        length = max(map(len, rows))
        rows = [row + [""] * (length - len(row)) for row in rows]
    else:
        _check_lengths(rows, numbers, separator, name)
    header: tuple[str, ...] = ()
    if not any(map(_looks_numeric, rows[0])):
        header = tuple(cell.casefold() for cell in rows.pop(0))
        number = numbers.pop(0)
        if not is_foreign:
            header = _with_lines_below(header, rows, numbers)
            _check_header(header, number, name)
        # Of recordings that were joined, each has the header.
        kept = [tuple(map(str.casefold, row)) != header for row in rows]
        rows, numbers = list(compress(rows, kept)), list(compress(numbers, kept))
    else:
        header = _header_in_comment(text, separator, rows[0], is_foreign)
        if (
            separator is None
            and not is_foreign
            and not re.search(r"\bx(\b|_)", " ".join(header))
        ):
            header = ()  # a sentence of as many words
    if not rows:
        raise FileError("table.only-header", name=name)
    return Table(name, header, rows, numbers)


def _plain(name: str) -> str:
    """Return the letters and digits of the name of a column, without unit."""
    return re.sub(r"[\W_]", "", re.sub(_IN_BRACKETS, "", name)) or name


def _with_lines_below(
    header: tuple[str, ...], rows: list[list[str]], numbers: list[int]
) -> tuple[str, ...]:
    """Return unique names of columns, of several lines, which are taken off the rows.

    A name that stands above several columns stands in the first of their cells.
    """
    for row in rows[:2]:
        if len(set(header)) == len(header) or any(map(_looks_numeric, row)):
            break
        above, names = "", []
        for cell, below in zip(header, rows.pop(0), strict=True):
            above = cell or above
            names.append(f"{above} {below}".strip().casefold())
        header = tuple(names)
        numbers.pop(0)
    return header


def _n_titles(rows: list[list[str]]) -> int:
    """Return the number of lines above the names, which have fewer cells."""
    filled = [len(row) - row.count("") for row in rows]
    usual, length = sorted(filled)[len(filled) // 2], statistics.mode(map(len, rows))
    n_titles = next(
        i
        for i, count in enumerate(filled)
        # Names of pairs of columns reach the last pair; titles do not.
        if len(rows[i]) >= length
        and (2 * count > usual or (count > 1 and any(rows[i][-2:])))
    )
    if any(map(_looks_numeric, rows[n_titles])) and rows[0] != [str(len(rows) - 1)]:
        return 0  # unless they count the lines below
    words = list(
        takewhile(lambda row: not any(map(_looks_numeric, row)), rows[n_titles:])
    )
    if not words or n_titles + len(words) == len(rows):
        return n_titles
    # The last with the most names: units, which are equal, may stand below them.
    n_names, best = max((len({*row} - {""}), i) for i, row in enumerate(words))
    is_unique = n_names == len(words[best]) - words[best].count("")
    return n_titles + (best if is_unique else 0)


def _moments(cells: list[str]) -> list[str]:
    """Return the numbers of frames, also of ``frame_017.png`` and of times.

    Names whose last numbers are not in the order of all their numbers are counted.
    """
    moments = list(map(_moment, cells))
    if any(re.fullmatch(_NUMBER, moment) for moment in moments):
        return moments
    digits = {
        name: [
            Decimal(n) for n in re.findall(r"(?a)\d+", re.sub(_FILE_SUFFIX, "", name))
        ]
        for name in cells
    }
    if not all(digits.values()):
        return moments
    ordered = sorted(digits, key=digits.__getitem__)
    number_of = {name: digits[name][-1] for name in ordered}
    if any(number_of[one] >= number_of[other] for one, other in pairwise(ordered)):
        number_of = {name: Decimal(i) for i, name in enumerate(ordered, 1)}
    return [str(number_of[name]) for name in cells]


def _moment(cell: str) -> str:
    """Return a number, date or time as a number, any other cell as it is."""
    if dated := re.fullmatch(_DATE, cell):
        instant = (dated[1] or "1970-01-01T") + dated[2].replace(",", ".")
        return str(np.datetime64(instant, "ns").astype(np.int64))
    return cell.replace(",", ".")


def _header_in_comment(
    text: str, separator: str | None, row: list[str], is_foreign: bool
) -> tuple[str, ...]:
    """Return the names of the last comment before the data, if it has as many.

    In a foreign table, rows with words may be longer.
    """
    header: tuple[str, ...] = ()
    for line in text.split("\n"):
        if line.strip() and not re.match(_COMMENT, line):
            break
        cells = [c.strip() for c in line.strip().lstrip("#%/ ").split(separator)]
        header = tuple(cell.casefold() for cell in cells) if line.strip() else header
    has_words = not all(map(_looks_numeric, filter(None, row)))
    if header and is_foreign and separator and has_words:
        header += ("",) * (len(row) - len(header))
    return header if len(header) == len(row) else ()


def number_flaw(text: str) -> Message | None:
    """Return why a text is not a finite number; None if it is."""
    if re.fullmatch(_NUMBER, text):
        return None if math.isfinite(float(text)) else too_large_number(text)
    if not text:
        return message("number.missing")
    if re.fullmatch(_NOT_FINITE, text):
        return message("number.not-finite", cell=quoted(text))
    if re.fullmatch(_GROUPED, text):
        return message("number.grouped", cell=quoted(text))
    return message("number.none", cell=quoted(text))


def too_large_number(text: str) -> Message:
    """Return the flaw of a number that is too large."""
    return message("number.too-large", cell=quoted(text))


def _clean_numbers(cells: list[str]) -> FloatArray | None:
    """Return the cells as numbers, or None if any of them is not one."""
    text = "\n".join(cells)
    if "," in text:
        if "." in text:
            return None
        text = text.replace(",", ".")
    if not text.isascii() or text.encode().translate(None, _NUMBER_CHARACTERS):
        return None
    try:
        values = np.array(list(map(float, text.split("\n"))))
    except ValueError:
        return None
    return values if np.all(np.isfinite(values)) else None


def _filled_lines(text: str, name: str) -> list[tuple[int, str]]:
    """Return the lines with data and their numbers."""
    if text.count("\n") > MAX_LINES:
        raise FileError("table.too-many-lines", name=name, most=MAX_LINES)
    lines = [
        (number, line.strip(" |"))
        for number, line in enumerate(text.split("\n"), 1)
        if re.search(_CELL, line) and not re.match(_COMMENT, line)
    ]
    if not lines:
        raise FileError("table.only-comments", name=name)
    return lines


def _separator(lines: list[str]) -> str | None:
    """Return the column separator of most lines; None for blanks."""
    if 2 * sum(bool(re.fullmatch(_BLANKS, line)) for line in lines) > len(lines):
        return None
    for candidate in (";", "\t", "|", ","):
        if 2 * sum(candidate in line for line in lines) > len(lines):
            return candidate
    return None


def _cells(line: str, separator: str | None, number: int, name: str) -> list[str]:
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]

    try:
        if separator is None:
            reader = csv.reader([" ".join(line.split())], delimiter=" ", strict=True)
        else:
            reader = csv.reader(
                [line], delimiter=separator, skipinitialspace=True, strict=True
            )
        return [cell.strip() for cell in next(reader)]
    except csv.Error as error:
        raise FileError("table.quotation-marks", line=number, name=name) from error


def _check_cells(
    lines: list[tuple[int, str]], separator: str | None, name: str
) -> None:
    """Refuse too many cells before allocating memory."""
    if separator is None:
        n_cells = sum(len(line.split()) for _, line in lines)
    else:
        n_cells = sum(line.count(separator) for _, line in lines) + len(lines)
    if n_cells > MAX_CELLS:
        raise FileError(
            "table.too-many-cells", name=name, n_cells=n_cells, most=MAX_CELLS
        )


def _looks_numeric(cell: str) -> bool:
    flaw = number_flaw(cell.replace(",", "."))
    return not flaw or re.fullmatch(_NOT_FINITE, cell) is not None


def _check_lengths(
    rows: list[list[str]], numbers: list[int], separator: str | None, name: str
) -> None:
    expected = len(rows[0])
    n_equal = sum(len(row) == expected for row in rows)
    for number, row in zip(numbers, rows, strict=True):
        if len(row) != expected:
            if separator == "," and len(row) > expected:
                hint = message("table.decimal-commas")
            elif 2 * n_equal < len(rows):
                hint = message("table.none")
            else:
                hint = message("table.short-line")
            raise FileError(
                "table.line-lengths",
                line=number,
                name=name,
                n_cells=len(row),
                first_line=numbers[0],
                expected=expected,
                hint=hint,
            )


def _check_header(header: tuple[str, ...], number: int, name: str) -> None:
    seen: set[str] = set()
    for column in header:
        if column in seen:
            raise FileError(
                "table.column-twice", line=number, name=name, column=quoted(column)
            )
        seen.add(column)
