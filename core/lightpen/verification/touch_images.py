"""The images of live touches on the disk, from which a verification can be repeated.

Each run is a record of its own, as `lightpen.record.reading` describes it: an image is
written before it counts, with the touch that it is of; one that counts no more is taken
out. So a run can be given to whatever takes recorded images, and what a crash leaves is
whole.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from lightpen.cameras.protocol import Frame
from lightpen.detection.sighting import Sighting
from lightpen.errors import FileError
from lightpen.formats.hashes import InputFile, hashed
from lightpen.record.header import Header
from lightpen.record.journal import JOURNAL
from lightpen.record.names import Names
from lightpen.record.reading import DISCARDED, image_name
from lightpen.record.verifications import TOUCHES
from lightpen.record.writing import OtherView, RecordWriter, make_folder
from lightpen.verification.session import SessionState, SessionTransition
from lightpen.verification.touching import TouchHappening, TouchPhase, TouchRules

CONCLUDED = "concluded"
NOT_COUNTED = "not counted"


@dataclass(frozen=True)
class TouchRecord:
    """Where the images of a run are kept.

    Attributes
    ----------
    journal : InputFile
        With the checksum of each image in it.
    """

    folder: Path
    journal: InputFile


@dataclass(frozen=True, eq=False)
class NewRecord:
    """A folder that was made for a record, and its header."""

    folder: Path
    header: Header


class TouchImages:
    """Keeps the images of one run after another.

    Parameters
    ----------
    begin : callable
        Returns the header of a record that begins now, and makes its folder.
    """

    def __init__(self, begin: Callable[[], NewRecord]) -> None:
        self._begin = begin
        self._writer: RecordWriter | None = None
        self._folder: Path | None = None
        self._numbers: dict[str, int] = {}  # of images that count, by name
        self._touch = 1  # that the next image is of
        self._records: tuple[TouchRecord, ...] = ()

    @property
    def records(self) -> tuple[TouchRecord, ...]:
        """The runs of the task at hand that are done."""
        return self._records

    def keep(self, frame: Frame, seen: Sighting) -> str:
        """Put an image on the disk, and return its name in the record.

        Raises
        ------
        FileError
            It cannot be written.
        """
        if self._writer is None:
            new = self._begin()
            self._writer = RecordWriter.create(new.folder, new.header, is_swing=False)
            self._folder = new.folder
        others = frame.others[: len(seen.others)]
        number = self._writer.append(
            *(frame.image, seen.pixels, seen.rotation, seen.translation),
            frame.host_ts_ns * 1e-9,
            frame.device_ts_ns,
            others=[
                OtherView(other.image, view.pixels, other.device_ts_ns)
                for other, view in zip(others, seen.others, strict=True)
            ],
            touch=self._touch,
        )
        name = Path(image_name(number)).name
        self._numbers[name] = number
        return name

    def follow(self, before: SessionState, transition: SessionTransition) -> None:
        """Take out what does not count any more, and end a run that is done.

        Raises
        ------
        FileError
            It cannot be written.
        """
        state = transition.state
        has_ended = transition.finished is not None or len(state.runs) > len(
            before.runs
        )
        counting = before if has_ended else state
        touching = counting.touching
        names = {frame.name for still in touching.taken for frame in still.frames}
        for event in transition.events if has_ended else ():
            if event.what is TouchHappening.TAKEN:
                names.update(event.names)
        if not has_ended:
            doubted = () if touching.doubted is None else (touching.doubted,)
            names.update(seen.frame.name for seen in (*touching.held, *doubted))
        if any(event.what is TouchHappening.TAKEN for event in transition.events):
            self._touch += 1
        self._take_out([name for name in self._numbers if name not in names])
        if has_ended:
            self._end(CONCLUDED)

    def forget(self) -> None:
        """Close the run at hand as one that was given up, and begin another task."""
        with suppress(FileError):  # it stays as one that was interrupted
            self._end(DISCARDED)
        self._records = ()

    def next_task(self) -> tuple[TouchRecord, ...]:
        """Return the runs of the task that is done; those of another follow."""
        records, self._records = self._records, ()
        return records

    def _take_out(self, names: list[str]) -> None:
        if names and self._writer is not None:
            self._writer.take_out([self._numbers[name] for name in names], NOT_COUNTED)
            for name in names:
                del self._numbers[name]

    def _end(self, verdict: str) -> None:
        writer, folder = self._writer, self._folder
        self._writer, self._numbers, self._touch = None, {}, 1
        if writer is None or folder is None:
            return
        with writer:
            writer.conclude(verdict)
        if verdict is CONCLUDED:
            record = TouchRecord(folder, hashed(folder / JOURNAL))
            self._records = (*self._records, record)


def is_held_on(rules: TouchRules, state: SessionState) -> bool:
    """Return whether the next image is one of a touch, if the pen stays still."""
    touching = state.touching
    n_held = len(touching.held)
    is_holding = touching.phase is TouchPhase.HOLDING or not rules.n_settling
    return is_holding and n_held >= rules.n_settling


def new_record(root: Path, names: Names, header: Header) -> NewRecord:
    """Make a folder for the images of a run below that of the verifications."""
    return NewRecord(make_folder(root / TOUCHES, names, header.created), header)
