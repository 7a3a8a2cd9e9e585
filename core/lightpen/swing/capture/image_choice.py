"""Which images of a capture are kept, and why the others are of no use.

In all of them the tip rests in the cone. An image is kept if its posture differs from
those of all kept images. Unusable images, and kept ones whose tip turns out to have
slipped, are counted by reason.
"""

from dataclasses import replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.labelling.constellation import certain_leds
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.reasons import Reason
from lightpen.messages import message
from lightpen.model.posture import angles_between
from lightpen.swing.capture.kept_images import keep, none_kept, without_slipped
from lightpen.swing.capture.state import (
    SwingEvent,
    SwingEventKind,
    SwingSetup,
    SwingState,
    Transition,
)
from lightpen.swing_messages import TOO_FAST, Code

FEW = 12  # images; not worth more than a new start
BAD_SIGMA = 3.0  # times the noise of the other images
SOME_SIGMA = 0.05  # px; less is never bad


def take_image(
    setup: SwingSetup, state: SwingState, detection: PenDetection
) -> Transition:
    """Keep an image if its posture is new and its detection good."""
    if not _is_new(state.kept.rotations, detection, setup.limits.spacing):
        return Transition(state)
    flaw = _flaw(setup, state, detection)
    if flaw is not Reason.NONE:
        return Transition(_flawed(setup, state, detection, flaw))
    return _kept(setup, state, detection)


def with_new(
    setup: SwingSetup, rotations: FloatArray, detection: PenDetection
) -> FloatArray:
    """Return the postures (M, 3, 3), the one of the detection added if new."""
    if not _is_new(rotations, detection, setup.limits.spacing):
        return rotations
    return np.concatenate([rotations, detection.rotation[None]])


def drop_slipped(state: SwingState, numbers: set[int]) -> Transition:
    """Count images that were kept, by their numbers, as slipped."""
    if not numbers:
        return Transition(state)
    return Transition(
        state.with_dropped(len(numbers)),
        (SwingEvent(SwingEventKind.SLIPPED, tuple(sorted(numbers))),),
    )


def drop_all(setup: SwingSetup, state: SwingState) -> Transition:
    """Drop all images: they were taken while the tip was in a wrong place."""
    numbers = set(map(int, state.kept.numbers))
    kept = none_kept(setup.rig.n_cameras, setup.pen.n_leds, setup.assumptions)
    return drop_slipped(replace(state, kept=kept), numbers)


def _kept(setup: SwingSetup, state: SwingState, detection: PenDetection) -> Transition:
    """Accept an image, and exclude earlier ones that have slipped."""
    number, counts = state.next_number, state.counts
    kept = keep(setup.rig, setup.pen, state.kept, detection, number, state.time)
    kept, dropped = without_slipped(setup.rig, setup.pen, kept)
    state = replace(state, kept=kept)
    if number in dropped:  # it was never recorded
        return drop_slipped(state.with_dropped(1), dropped - {number})
    state = replace(
        state,
        next_number=number + 1,
        flawed_rotations=np.zeros((0, 3, 3)),
        trace=state.trace.with_estimate(kept),
    )
    enough = setup.limits.min_per_field
    full = (state.counts >= enough) & (counts < enough)
    filled = (
        SwingEvent(SwingEventKind.FIELD_FULL, (int(row), int(column)))
        for row, column in np.argwhere(full)
    )
    slipped = drop_slipped(state, dropped)
    is_kept = SwingEvent(SwingEventKind.KEPT, (number,))
    return Transition(slipped.state, (is_kept, *slipped.events, *filled))


def _is_new(rotations: FloatArray, detection: PenDetection, spacing: float) -> bool:
    if not len(rotations):
        return True
    return bool(angles_between(detection.rotation[None], rotations).min() >= spacing)


def _flawed(
    setup: SwingSetup, state: SwingState, detection: PenDetection, flaw: Reason
) -> SwingState:
    """Set the message on an unusable image, and count it once a posture."""
    flawed = with_new(setup, state.flawed_rotations, detection)
    needed = certain_leds(setup.pen)
    messages = {
        Reason.TOO_FEW_LEDS: message(
            Code.FEW_LEDS, seen=detection.n_leds, needed=needed
        ),
        Reason.BLURRED: TOO_FAST,
        Reason.MISFIT: message(
            Code.BAD_FIT, noise=detection.sigma, usual=state.kept.sigma
        ),
    }
    n_new = len(flawed) - len(state.flawed_rotations)
    state = replace(state, message=messages[flaw], flawed_rotations=flawed)
    return state.with_dropped(n_new, flaw)


def _flaw(setup: SwingSetup, state: SwingState, detection: PenDetection) -> Reason:
    """Return why an image with a new posture is of no use."""
    if detection.n_leds < certain_leds(setup.pen):
        return Reason.TOO_FEW_LEDS
    if detection.is_blurred:
        return Reason.BLURRED
    usual = state.kept.sigma if state.n_kept >= FEW else np.inf
    if detection.sigma > max(BAD_SIGMA * usual, SOME_SIGMA):
        return Reason.MISFIT
    return Reason.NONE
