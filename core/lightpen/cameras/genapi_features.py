"""Features of a camera by GenApi, as in Harvesters and pypylon."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

from lightpen.cameras.protocol import Range

WRITE_ONLY, READ_WRITE = 2, 4  # of EAccessMode; a command is write-only


@dataclass(frozen=True)
class GenapiFeatures:
    """The features of an open camera.

    Parameters
    ----------
    find : callable
        Returns a node by name, or None.
    spell : callable
        Returns the name of an attribute of a node as this library spells it.
    access : callable
        Returns the access mode of a node.
    converting_errors : callable
        Returns a context that converts errors.
    """

    find: Callable[[str], Any]
    spell: Callable[[str], str]
    access: Callable[[Any], int]
    converting_errors: Callable[[], AbstractContextManager[None]]

    def has(self, name: str) -> bool:
        """Return whether the camera has a feature that is available now."""
        with self.converting_errors():
            node = self.find(name)
            return node is not None and self.access(node) in (WRITE_ONLY, READ_WRITE)

    def number(self, name: str) -> float:
        """Return the value of a number."""
        return float(self._read(name, "value"))

    def limits(self, name: str) -> Range:
        """Return the present range of a number."""
        low, high = self._read(name, "min"), self._read(name, "max")
        # What a float is rounded to is seen when it is read back.
        step = self._read(name, "inc") if isinstance(low, int) else 0.0
        return Range(float(low), float(high), float(step))

    def set_number(self, name: str, value: float) -> None:
        """Set a number that is within its limits."""
        is_integer = isinstance(self._read(name, "value"), int)
        self._write(name, round(value) if is_integer else float(value))

    def choice(self, name: str) -> str:
        """Return the current entry of an enumeration."""
        return str(self._read(name, "value"))

    def choices(self, name: str) -> tuple[str, ...]:
        """Return the entries of an enumeration that can be chosen now."""
        return tuple(map(str, self._read(name, "symbolics")))

    def choose(self, name: str, entry: str) -> None:
        """Choose an entry of an enumeration."""
        self._write(name, entry)

    def switch_on(self, name: str) -> None:
        """Set a truth value."""
        self._write(name, True)

    def execute(self, name: str) -> None:
        """Execute a command."""
        with self.converting_errors():
            getattr(self.find(name), self.spell("execute"))()

    def _read(self, name: str, what: str) -> Any:
        with self.converting_errors():
            return getattr(self.find(name), self.spell(what))

    def _write(self, name: str, value: float | str | bool) -> None:
        with self.converting_errors():
            setattr(self.find(name), self.spell("value"), value)


def refusals(genapi: Any) -> tuple[type[Exception], ...]:
    """Return the exceptions of GenApi for refused requests."""
    return (
        genapi.AccessException,
        genapi.InvalidArgumentException,
        genapi.LogicalErrorException,
        genapi.OutOfRangeException,
    )
