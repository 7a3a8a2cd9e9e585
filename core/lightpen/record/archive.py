"""Where accepted calibrations are kept, as the rest of the program sees it."""

from pathlib import Path
from typing import Protocol

from lightpen.record.results import Result


class Archive(Protocol):
    """Keeps every result that was accepted; the newest of a pen and tip is in force.

    Results are added and never changed or taken away. All methods may take as long as a
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

    def in_force(self, pen: str, tip: str) -> Result | None:
        """Return the last accepted result of a pen and a tip, or None.

        Raises
        ------
        FileError
            A result that may be the one in force cannot be read. An older one must not
            come into force again in silence.
        """

    def of_record(self, folder: Path) -> Result | None:
        """Return the last accepted result of the swing in a folder, or None.

        Results that cannot be read are passed over.

        Raises
        ------
        FileError
            The archive cannot be read at all.
        """
