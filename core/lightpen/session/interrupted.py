"""An interrupted swing: read back to go on with it, or set aside for good."""

from dataclasses import dataclass, replace
from pathlib import Path

from lightpen.session.capture import resume_swing
from lightpen.session.preparation import recorded_setup
from lightpen.session.progress import limits_for_more
from lightpen.session.record import DISCARDED, Record, open_record
from lightpen.session.recording import RecordWriter
from lightpen.session.swing_state import SwingSetup, SwingState


@dataclass(frozen=True, eq=False)
class Resumable:
    """An interrupted swing, ready to go on.

    Attributes
    ----------
    record : Record
    setup : SwingSetup
        Of the record's own files.
    state : SwingState
        With all images that the record acknowledged.
    """

    record: Record
    setup: SwingSetup
    state: SwingState

    def fits(self, image_size: tuple[int, int]) -> bool:
        """Return whether images of this width and height, px, can go on with it."""
        camera = self.setup.camera
        return image_size == (camera.width, camera.height)


def read_resumable(folder: Path) -> Resumable:
    """Read an interrupted swing and fit its images anew.

    Raises
    ------
    FileError
        The record or one of its files cannot be read.
    """
    record = open_record(folder)
    setup = recorded_setup(record)
    return Resumable(record, setup, resume_swing(setup, record))


def read_for_more(folder: Path) -> Resumable:
    """Read a swing that has all it needs, to capture more images nevertheless.

    Raises
    ------
    FileError
        The record or one of its files cannot be read.
    """
    swing = read_resumable(folder)
    limits = limits_for_more(swing.setup.limits, swing.state.n_kept)
    return replace(swing, setup=replace(swing.setup, limits=limits))


def discard_swing(folder: Path) -> None:
    """Conclude an interrupted swing without a verdict; its images are kept.

    Raises
    ------
    FileError
        The record cannot be read or written.
    """
    with RecordWriter.resume(open_record(folder)) as writer:
        writer.conclude(DISCARDED)
