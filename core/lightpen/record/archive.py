"""Where accepted calibrations are kept, as the rest of the program sees it."""

from datetime import datetime
from pathlib import Path
from typing import Protocol

from lightpen.record.results import Result
from lightpen.record.supervision import Supervision
from lightpen.record.tip_library import Library


class Archive(Protocol):
    """Keeps every result that was accepted; the newest of a pen and tip is in force.

    Results are added and never changed or removed: one that is taken back is kept, and
    the one before is in force again. Those of a simulated pen are kept apart, and none
    of them is in force for a real one. All methods may take as long as a
    disk or a network does, and may be called from any thread.
    """

    def store(self, result: Result) -> None:
        """Put a result in force.

        When this returns, the result is kept whatever happens next; when it raises, or
        is killed, it is kept whole or not at all.

        Raises
        ------
        FileError
            It cannot be kept; what was in force before stays so.
        """

    def take_back(self, result: Result, operator: str, now: datetime) -> None:
        """Let the result before a result in force be in force again.

        It is one step, as `store`.

        Parameters
        ----------
        operator : str
            Who takes it back.

        Raises
        ------
        FileError
            It is not in force any more, or what takes it back cannot be kept.
        """

    def in_force(
        self, pen: str, tip: str, *, is_simulated: bool = False
    ) -> Result | None:
        """Return the last accepted result of a pen and a tip, or None.

        Parameters
        ----------
        is_simulated : bool
            Whether of a simulated pen; else of a real one.

        Raises
        ------
        FileError
            A result that may be the one in force cannot be read. An older one must not
            come into force again in silence.
        """

    def tips(self, pen: str, *, is_simulated: bool = False) -> tuple[str, ...]:
        """Return the tips of a pen that have a result in force, the newest first.

        Results that cannot be read are passed over.

        Raises
        ------
        FileError
            The archive cannot be read at all.
        """

    def supervision(self) -> Supervision:
        """Return what supervisors have laid down for what it keeps.

        Raises
        ------
        FileError
            It cannot be read, or was changed.
        """

    def library(self) -> Library:
        """Return the pens, tips and cones that are known, with their limits.

        Raises
        ------
        FileError
            It cannot be read, or was changed.
        """

    def of_record(self, folder: Path) -> Result | None:
        """Return the last accepted result of the swing in a folder, or None.

        Results that cannot be read or that were taken back are passed over.

        Raises
        ------
        FileError
            The archive cannot be read at all.
        """
