"""From a live image to a longer record: decide, and put on disk what is kept."""

from collections.abc import Callable, Sequence
from typing import TypeAlias

from lightpen.arrays import Image
from lightpen.cameras.protocol import Stats
from lightpen.detection.reasons import Reason
from lightpen.detection.sighting import Sighting
from lightpen.record.writing import OtherView, RecordWriter
from lightpen.swing.rules import Transition, advance_swing
from lightpen.swing.state import Happening, SwingSetup, SwingState

Rule: TypeAlias = Callable[[SwingSetup, SwingState, Sighting, float], Transition]


def capture_image(
    setup: SwingSetup,
    state: SwingState,
    writer: RecordWriter,
    image: Image,
    sighting: Sighting,
    time: float,
    device_time_ns: int | None = None,
    stats: Stats | None = None,
    rule: Rule | None = None,
    others: Sequence[OtherView] = (),
) -> Transition:
    """Take one image into a swing.

    Parameters
    ----------
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
    stats : Stats, optional
        What became of the camera's images since the swing began.
    rule : Rule, optional
        What the image does to the swing; that of a live one by default.
    others : sequence of OtherView, optional
        What the other cameras of a rig saw at that moment.

    Returns
    -------
    Transition
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
    transition = (rule or advance_swing)(setup, state, sighting, time)
    # The image last: if the disk fails before, state and record both go without it.
    for event in transition.events:
        if event.what is Happening.SLIPPED and event.numbers:
            writer.take_out(event.numbers, Reason.SLIPPED)
    for event in transition.events:
        if event.what is Happening.KEPT:
            writer.append(
                image,
                sighting.pixels,
                sighting.rotation,
                sighting.translation,
                time,
                device_time_ns,
                stats,
                others,
            )
    return transition
