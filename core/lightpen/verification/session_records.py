"""The records of a session, written in their turn, or as soon as they can be."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lightpen.formats.hashes import InputFile, all_hashed
from lightpen.model.origin import Origin
from lightpen.verification.choices import TaskKind
from lightpen.verification.conclusion import Conclusion, conclusion_record
from lightpen.verification.keeping import keep_verification
from lightpen.verification.tip_in_force import TipInForce
from lightpen.verification.under_way import UnderWayFile


@dataclass(frozen=True, eq=False)
class KeptRecord:
    """A record that waits to be written; those of its session are written before.

    Attributes
    ----------
    record_of : callable
        Returns it by the files of the session before it.
    task : TaskKind or None
        That it is of; None of a conclusion.
    ends : UnderWayFile or None
        Of the session, where this record concludes it.
    """

    record_of: Callable[[tuple[InputFile, ...]], Mapping[str, Any]]
    is_simulated: bool
    task: TaskKind | None = None
    ends: UnderWayFile | None = None


class SessionRecords:
    """Writes the records of one session after another.

    Parameters
    ----------
    data : Path
        Folder that what is found is kept in.
    """

    def __init__(self, data: Path) -> None:
        self._data = data
        self._files: list[Path] = []
        self._waiting: list[tuple[KeptRecord, list[Path]]] = []

    @property
    def files(self) -> tuple[Path, ...]:
        """What is written of the session at hand."""
        return tuple(self._files)

    @property
    def are_waiting(self) -> bool:
        """Whether some could not be written yet."""
        return bool(self._waiting)

    @property
    def waiting(self) -> tuple[TaskKind, ...]:
        """The tasks of the session at hand whose records wait."""
        return tuple(
            kept.task
            for kept, files in self._waiting
            if files is self._files and kept.task is not None
        )

    def begin(self, files: tuple[Path, ...] = ()) -> None:
        """Begin another session, of which these are written already."""
        self._files = list(files)

    def add(self, kept: KeptRecord) -> None:
        """Have a record of the session at hand written by the next `write`."""
        self._waiting.append((kept, self._files))

    def write(self) -> None:
        """Write all that waits.

        Raises
        ------
        FileError
            One cannot be written; it and those after it go on waiting.
        """
        while self._waiting:
            kept, files = self._waiting[0]
            self._write(kept, files)
            self._waiting.pop(0)

    def write_now(self, kept: KeptRecord) -> None:
        """Write a record of the session at hand, or not at all.

        Raises
        ------
        FileError
            It cannot be written.
        """
        self._write(kept, self._files)

    def _write(self, kept: KeptRecord, files: list[Path]) -> None:
        record = kept.record_of(all_hashed(files))
        files.append(
            keep_verification(self._data, record, is_simulated=kept.is_simulated)
        )
        if kept.ends is not None:
            kept.ends.conclude()


def concluding(
    tip: TipInForce, conclusion: Conclusion, ends: UnderWayFile | None
) -> KeptRecord:
    """Return the record of a conclusion, to be written when its session is."""
    return KeptRecord(
        lambda files: conclusion_record(
            tip.names, tip.origin, tip.tip_file, conclusion, files
        ),
        tip.origin is Origin.SIMULATED,
        ends=ends,
    )
