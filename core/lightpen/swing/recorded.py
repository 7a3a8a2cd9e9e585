"""The rule of a swing whose images were recorded before: all are read, each once.

Nobody is at the cone to be guided, so nothing is waited for, asked for or dropped on
the way. Every image that shows the pen takes part; the estimator, which sees them all,
finds those that slipped.
"""

from collections import Counter
from dataclasses import replace

import numpy as np

from lightpen.detection.labelling.constellation import certain_leds
from lightpen.detection.reasons import Reason
from lightpen.detection.sighting import Sighting
from lightpen.messages import images_read
from lightpen.swing.kept_images import keep
from lightpen.swing.rules import Transition, finish
from lightpen.swing.state import (
    Happening,
    Phase,
    Progress,
    SwingEvent,
    SwingSetup,
    SwingState,
)


def read_image(
    setup: SwingSetup,
    state: SwingState,
    sighting: Sighting,
    time: float,
    n_images: int,
    *,
    is_known: bool = False,
) -> Transition:
    """Take the next recorded image; the last one ends the capture.

    Parameters
    ----------
    time : float
        When it is read, s.
    n_images : int
        Of the recording.
    is_known : bool
        Whether it was taken before the swing was interrupted.

    Returns
    -------
    Transition
        As `lightpen.swing.rules.advance` returns it.
    """
    progress = Progress(state.progress.n_read + 1, n_images)
    state = replace(
        state,
        phase=Phase.CAPTURING,
        time=time,
        progress=progress,
        message=images_read(progress.n_read, n_images),
    )
    events: tuple[SwingEvent, ...] = ()
    flaw = _flaw(setup, sighting)
    if flaw is not Reason.NONE:
        counts = Counter(state.n_dropped)
        counts[flaw] += 1
        state = replace(state, n_dropped=counts)
    elif not is_known:
        number = state.next_number
        kept = keep(setup.camera, setup.pen, state.kept, sighting, number, time)
        state = replace(state, kept=kept, next_number=number + 1)
        events = (SwingEvent(Happening.KEPT, (number,)),)
    if progress.n_read < n_images:
        return Transition(state, events)
    ended = finish(state)
    return Transition(ended.state, (*events, *ended.events))


def _flaw(setup: SwingSetup, sighting: Sighting) -> Reason:
    """Return why an image cannot take part."""
    if not sighting.has_pose:
        return sighting.reason
    if sighting.n_leds < certain_leds(setup.pen) or not np.isfinite(sighting.sigma):
        return Reason.TOO_FEW_LEDS
    return Reason.NONE
