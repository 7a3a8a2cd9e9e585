"""Look up numbers and texts by name in a parsed file."""

import re
from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.formats.documents import Tree
from lightpen.formats.files import quoted
from lightpen.formats.tables import number_flaw, too_large_number
from lightpen.messages import Message, message, printable

MAX_NUMBERS = 10_000  # of one entry; a covariance has 324
LARGEST_NUMBER = 1e12  # no length, pixel or coefficient comes near it
SYMMETRY_TOLERANCE = 1e-6  # of a covariance, relative: files with few digits


@dataclass(frozen=True)
class Entries:
    """A mapping of a file; names are compared without case and underscores.

    Every method that takes several names takes them as spellings of one entry, of
    which the file may have one.
    """

    name: str | Message  # of the file, or of a place in it, for messages
    values: dict[str, tuple[str, Tree]]  # by plain name: name in the file, value

    @staticmethod
    def of(tree: dict[str, Tree], name: str | Message) -> "Entries":
        """Return the entries of a mapping in the file called `name`."""
        values: dict[str, tuple[str, Tree]] = {}
        for key, value in tree.items():
            plain = _plain(key)
            if plain in values:
                raise _same_meaning(name, values[plain][0], key)
            values[plain] = (key, value)
        return Entries(name, values)

    def has(self, *names: str) -> bool:
        """Return whether an entry exists."""
        return any(_plain(name) in self.values for name in names)

    def entry(self, *names: str) -> tuple[str, Tree]:
        """Return the name that an entry has in the file, and its value.

        Raises `FileError` if it is missing, or there under two names.
        """
        found = [self.values[_plain(n)] for n in names if _plain(n) in self.values]
        if not found:
            raise FileError("entry.missing", name=self.name, entry=names[0])
        if len(found) > 1:
            raise _same_meaning(self.name, found[0][0], found[1][0])
        return found[0]

    def value(self, *names: str) -> Tree:
        """Return the value of an entry; see `entry`."""
        return self.entry(*names)[1]

    def part(self, *names: str) -> "Entries":
        """Return the entries of a mapping within this one; see `entry`."""
        key, value = self.entry(*names)
        if not isinstance(value, dict):
            raise FileError("entry.nothing-below", entry=printable(key), name=self.name)
        return Entries.of(value, self.name)

    def numbers(self, *names: str) -> FloatArray:
        """Return the numbers of a list, matrix or single value in one row.

        A matrix is a list of rows, or a mapping with ``rows``, ``cols`` and ``data``.
        Raises `FileError` if it is missing, has something else than finite numbers, or
        not as many as its ``rows`` and ``cols`` say.
        """
        key, value = self.entry(*names)
        cells = _cells(value)
        if len(cells) > MAX_NUMBERS:
            raise FileError(
                "entry.too-many-numbers",
                entry=printable(key),
                name=self.name,
                counted=counted_numbers(len(cells)),
                most=MAX_NUMBERS,
            )
        for cell in cells:
            flaw = _flaw(cell)
            if flaw:
                raise FileError(
                    "entry.unreadable", entry=printable(key), name=self.name, flaw=flaw
                )
        numbers = np.array([float(str(cell)) for cell in cells])
        if isinstance(value, dict):
            self._check_shape(key, value, len(cells))
            if value.get("dt") == "f":  # OpenCV keeps such a matrix in single precision
                return numbers.astype(np.float32).astype(np.float64)
        return numbers

    def counted(self, count: int, *names: str) -> FloatArray:
        """Return the numbers of an entry that must have `count` of them.

        See `numbers`.
        """
        numbers = self.numbers(*names)
        if len(numbers) != count:
            raise FileError(
                "entry.wrong-count",
                entry=printable(self.entry(*names)[0]),
                name=self.name,
                counted=counted_numbers(len(numbers)),
                needed=count,
            )
        return numbers

    def points(self, *names: str) -> FloatArray:
        """Return the numbers of an entry as points, (M, 2).

        See `numbers`.
        """
        numbers = self.numbers(*names)
        return self.counted(len(numbers) // 2 * 2, *names).reshape(-1, 2)

    def word(self, *names: str) -> str:
        """Return the text of an entry, empty if it is missing or is not a text."""
        value = self.value(*names) if self.has(*names) else ""
        return value.strip() if isinstance(value, str) else ""

    def refuse_others(self, *names: str) -> None:
        """Refuse unknown entries, which may be misspelt."""
        known = {_plain(name) for name in names}
        for plain, (key, _) in self.values.items():
            if plain not in known:
                raise FileError(
                    "entry.unknown",
                    name=self.name,
                    key=quoted(key),
                    known=", ".join(sorted(names)),
                )

    def _check_shape(self, key: str, matrix: dict[str, Tree], count: int) -> None:
        shape = Entries.of(matrix, self.name)
        if not shape.has("rows") or not shape.has("cols"):
            return
        rows, cols = (float(shape.counted(1, side)[0]) for side in ("rows", "cols"))
        if rows * cols != count:
            raise FileError(
                "entry.wrong-shape",
                entry=printable(key),
                name=self.name,
                counted=counted_numbers(count),
                rows=rows,
                cols=cols,
                needed=rows * cols,
            )


def counted_numbers(count: int) -> Message:
    """Return a count of numbers, such as "2 numbers"."""
    if count == 1:
        return message("count.one-number")
    return message("count.numbers", count=count)


def is_covariance(matrix: FloatArray) -> bool:
    """Return whether a square matrix is symmetric with correlations from -1 to 1."""
    variances = np.diagonal(matrix)
    limits = np.multiply.outer(variances, variances) * (1 + SYMMETRY_TOLERANCE)
    asymmetry = (matrix - matrix.T) ** 2
    return bool(
        np.all(variances >= 0)
        and np.all(matrix**2 <= limits)
        and np.all(asymmetry <= SYMMETRY_TOLERANCE**2 * limits)
    )


def _plain(name: str) -> str:
    return name.replace("_", "").casefold()


def _same_meaning(name: str | Message, first: str, second: str) -> FileError:
    return FileError(
        "entry.same-meaning", name=name, first=quoted(first), second=quoted(second)
    )


def _cells(value: Tree) -> list[Tree]:
    if isinstance(value, dict):
        return _cells(value.get("data"))
    if isinstance(value, list):
        return [cell for item in value for cell in _cells(item)]
    if isinstance(value, str):
        return list(re.sub(r"(?<=\d) ?x ?(?=\d)", " ", value).split())  # 640x480
    return [value]


def _flaw(cell: Tree) -> Message | None:
    if not isinstance(cell, str):
        return message("number.no-list")
    flaw = number_flaw(cell)
    if not flaw and abs(float(cell)) > LARGEST_NUMBER:
        return too_large_number(cell)
    return flaw
