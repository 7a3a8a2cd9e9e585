"""The rule of a swing whose images were recorded before: all are read, each once.

Nobody is at the cone to be guided, so nothing is waited for, asked for or dropped on
the way. Every image that shows the pen takes part; the estimator, which sees them all,
finds those that slipped.
"""

from collections import Counter
from dataclasses import replace

import numpy as np

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


def take_recorded_image(
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
    state = replace(_further(state, n_images), time=time)
    events: tuple[SwingEvent, ...] = ()
    flaw = _flaw(sighting)
    if flaw is not Reason.NONE:
        state = _with_dropped(state, flaw)
    elif not is_known:
        number = state.next_number
        kept = keep(setup.rig, setup.pen, state.kept, sighting, number, time)
        trace = state.trace.with_estimate(kept)
        state = replace(state, kept=kept, next_number=number + 1, trace=trace)
        events = (SwingEvent(Happening.KEPT, (number,)),)
    return _ended_by_last(Transition(state, events))


def pass_over(state: SwingState, n_images: int) -> Transition:
    """Leave out the next recorded image, which cannot be read or is of another size."""
    passed = _with_dropped(_further(state, n_images), Reason.UNREADABLE)
    return _ended_by_last(Transition(passed))


def _further(state: SwingState, n_images: int) -> SwingState:
    n_read = state.progress.n_read + 1
    return replace(
        state,
        phase=Phase.CAPTURING,
        progress=Progress(n_read, n_images),
        message=images_read(n_read, n_images),
    )


def _with_dropped(state: SwingState, reason: Reason) -> SwingState:
    counts = Counter(state.n_dropped)
    counts[reason] += 1
    return replace(state, n_dropped=counts)


def _ended_by_last(transition: Transition) -> Transition:
    """End the capture where no image is left."""
    progress = transition.state.progress
    if progress.n_read < progress.n_images:
        return transition
    ended = finish(transition.state)
    return Transition(ended.state, (*transition.events, *ended.events))


def _flaw(sighting: Sighting) -> Reason:
    """Return why an image cannot take part."""
    if sighting.has_pose and not np.isfinite(sighting.sigma):
        return Reason.MISFIT
    return sighting.reason
