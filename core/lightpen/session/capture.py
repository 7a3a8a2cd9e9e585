"""From a live image to a longer record: decide, and put on disk what is kept."""

import numpy as np

from lightpen.arrays import Image
from lightpen.observe import Reason
from lightpen.session.kept import kept_before
from lightpen.session.record import Record
from lightpen.session.recording import RecordWriter
from lightpen.session.sighting import Sighting
from lightpen.session.swing import Fed, feed, start_again
from lightpen.session.swing_state import Happening, SwingSetup, SwingState


def capture_image(
    setup: SwingSetup,
    state: SwingState,
    writer: RecordWriter,
    image: Image,
    sighting: Sighting,
    time: float,
    device_time_ns: int | None = None,
) -> Fed:
    """Take one live image into a swing.

    Parameters
    ----------
    setup : SwingSetup
    state : SwingState
    writer : RecordWriter
        Of the record that belongs to the state.
    image : (H, W) array
        Grey image of the camera's size, 8 or 16 bit.
    sighting : Sighting
        What it shows.
    time : float
        When it was taken, s.
    device_time_ns : int, optional
        By the clock of the camera.

    Returns
    -------
    Fed
        An image that is kept is on the disk by now.

    Raises
    ------
    FileError
        The image could not be recorded; ``state`` and the record go without it.
    """
    if state.next_number != writer.next_number:
        raise ValueError(
            f"The swing is at image {state.next_number}, the record at "
            f"{writer.next_number}."
        )
    fed = feed(setup, state, sighting, time)
    # The image last: if the disk fails before, state and record both go without it.
    for event in fed.events:
        if event.what is Happening.SLIPPED and event.numbers:
            writer.take_out(event.numbers, Reason.SLIPPED)
    for event in fed.events:
        if event.what is Happening.KEPT:
            writer.append(
                image,
                sighting.pixels,
                sighting.rotation,
                sighting.translation,
                time,
                device_time_ns,
            )
    return fed


def resume_swing(setup: SwingSetup, record: Record, time: float = 0.0) -> SwingState:
    """Return an interrupted swing with all images that its record acknowledged.

    Parameters
    ----------
    setup : SwingSetup
        Of the record's own camera and pen.
    record : Record
    time : float
        s.
    """
    images = record.used_images
    kept = kept_before(
        setup.camera,
        setup.pen,
        record.numbers,
        np.array([image.pixels for image in images]),
        np.array([image.rotation for image in images]),
        np.array([image.translation for image in images]),
    )
    return start_again(setup, kept, record.next_number, time)
