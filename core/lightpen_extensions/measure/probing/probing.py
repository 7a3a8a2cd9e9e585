"""Automatic probing: a point is recorded when the pen is held still on it.

`advance_touch` takes the state and what the next image shows, and returns the new state
and what happened. It has no clock and no threads: live images and recorded ones go
through the same steps. The pen is still while its tip stays within the noise of its
images and its posture hardly turns. One image that disagrees is left out and named; a
second one means that the pen has moved, and what was held so far counts no more. After
a touch the pen must move on before the next one begins. Live, a pen that rests
somewhere when probing begins must leave that place before its first touch.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.reasons import Reason
from lightpen.estimation.pivot.pivot import (
    in_deviations,
    outlier_distance,
    tip_covariances,
)
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.rigid import angles_between
from lightpen_extensions.measure.tasks.probed_point import (
    ProbingFrame,
    RejectedFrame,
    StillFrames,
)

FAST, PRECISE = 5, 30  # images of a touch
SETTLING = 3  # images, after which the hand is at rest
RESTING = 0.01  # mm, by which a tip at rest may move
STILL_TURN = np.radians(1.0)
MAX_LOST = 5  # images in a row without the pen; more end a touch
WORTH_TELLING = 0.5  # of its images: fraction held when a point was broken off
MAX_PATH = 20  # images
FAR_ENOUGH = (
    2.0  # mm, that show the direction of approach, or that the pen was taken up
)
TAKEN_UP_TURN = np.radians(3.0)  # likewise


class ProbingPhase(StrEnum):
    """Phase of a touch."""

    AT_REST = "at rest"  # not seen to move since probing began
    MOVING = "moving"  # or not seen
    HOLDING = "holding"
    RECORDED = "recorded"  # the pen must move
    KNOWN = "known"  # the same after a point that was touched before


@dataclass(frozen=True)
class ProbingRules:
    """Rules of recording a touch."""

    n_frames: int = FAST  # images of a touch
    n_settling: int = SETTLING  # images before them, the pen being still
    min_turn: float = 0.0  # from the posture of each touch before, rad; or
    min_distance: float = 0.0  # from its position, mm: one of both suffices

    def __post_init__(self) -> None:
        if self.n_frames < 1 or self.n_settling < 0:
            raise ValueError(f"Nothing can be touched by {self}.")


ONE_IMAGE = ProbingRules(n_frames=1, n_settling=0)


@dataclass(frozen=True, eq=False)
class TipObservation:
    """The tip by one image: place (3,), mm, and its covariance by noise, (3, 3)."""

    frame: ProbingFrame
    tip_cam: FloatArray
    noise: FloatArray


@dataclass(frozen=True, eq=False)
class ProbingState:
    """The touches so far."""

    phase: ProbingPhase = ProbingPhase.MOVING
    held: tuple[TipObservation, ...] = ()  # while still; at rest the first and last
    deviating: TipObservation | None = None  # the last one, if it disagrees
    rejected: tuple[RejectedFrame, ...] = ()  # between those held
    n_lost: int = 0  # images in a row without the pen
    path: tuple[FloatArray, ...] = ()  # earlier positions of the tip, (3,) each, mm
    taken: tuple[StillFrames, ...] = ()  # points probed so far
    places: tuple[TipObservation, ...] = ()  # one observation of each point

    def progress(self, rules: ProbingRules) -> float:
        """Return the completed fraction of a touch, 0 to 1."""
        if self.phase is not ProbingPhase.HOLDING:
            return 0.0
        return len(self.held) / (rules.n_frames + rules.n_settling)


@dataclass(frozen=True, eq=False)
class ProbingTransition:
    """The touches after one more image."""

    state: ProbingState
    recorded: tuple[str, ...] = ()  # images of the point that is complete now
    is_broken_off: bool = False  # whether a point was, before it was complete


def advance_touch(
    instrument: Instrument,
    rules: ProbingRules,
    state: ProbingState,
    name: str,
    detection: PenDetection,
) -> ProbingTransition:
    """Take one more image, of several cameras what they saw together."""
    if not detection.has_pose or detection.is_blurred:
        reason = detection.reason or Reason.BLURRED
        return _without_pose(rules, state, RejectedFrame(name, reason))
    seen = _seen(instrument, name, detection)
    state = replace(state, n_lost=0)
    if state.phase is ProbingPhase.AT_REST and not _has_left(state.held, seen):
        rest = (*state.held[:1], seen)
        return ProbingTransition(replace(state, held=rest, deviating=None))
    if not state.held or rules.n_frames == 1:
        return _moved_to(rules, state, (seen,))
    if _agrees(state.held, seen):
        rejected = state.rejected
        if state.deviating is not None:
            rejected = (
                *rejected,
                RejectedFrame(_name(state.deviating), Reason.SLIPPED),
            )
        state = replace(state, deviating=None, rejected=rejected)
        if state.phase is not ProbingPhase.HOLDING:
            return ProbingTransition(state)
        return _held(rules, replace(state, held=(*state.held, seen)))
    if state.deviating is None:
        return ProbingTransition(replace(state, deviating=seen))
    both_elsewhere = _agrees((state.deviating,), seen)
    return _moved_to(
        rules, state, (state.deviating, seen) if both_elsewhere else (seen,)
    )


def at_rest(state: ProbingState) -> ProbingState:
    """Return the touches so far; the pen must leave its place before the next."""
    moving = _let_go(state)
    return replace(moving, phase=ProbingPhase.AT_REST, path=())


def take_all(
    instrument: Instrument,
    rules: ProbingRules,
    images: Iterable[tuple[str, PenDetection]],
) -> ProbingState:
    """Take recorded images (name, sighting), one after the other."""
    state = ProbingState()
    for name, detection in images:
        state = advance_touch(instrument, rules, state, name, detection).state
    return state


def with_taken(
    instrument: Instrument, state: ProbingState, held: Sequence[StillFrames]
) -> ProbingState:
    """Return the state with the touches of an earlier run."""
    places = []
    for frame in (still.frames[0] for still in held):
        tip_cam = frame.rotation @ instrument.tip_pen + frame.translation
        places.append(TipObservation(frame, tip_cam, np.zeros((3, 3))))
    return replace(state, taken=tuple(held), places=tuple(places))


def touch_frame(name: str, detection: PenDetection) -> ProbingFrame:
    """Return the observation of the pen in images with a pose."""
    return ProbingFrame(
        name, detection.rig_pixels, detection.rotation, detection.translation
    )


def _seen(instrument: Instrument, name: str, detection: PenDetection) -> TipObservation:
    R = detection.rotation
    sigma = max(detection.sigma, instrument.sigma)
    noise = tip_covariances(
        R[None], detection.cofactors[None] * sigma**2, instrument.tip_pen
    )[0]
    tip_cam = R @ instrument.tip_pen + detection.translation
    return TipObservation(touch_frame(name, detection), tip_cam, noise)


def _name(seen: TipObservation) -> str:
    return seen.frame.name


def _agrees(held: tuple[TipObservation, ...], seen: TipObservation) -> bool:
    """Return whether the pen is still in the same place."""
    turned = angles_between(seen.frame.rotation[None], held[0].frame.rotation[None])[
        0, 0
    ]
    if turned > STILL_TURN:
        return False
    n = len(held)
    middle = np.mean([each.tip_cam for each in held], axis=0)
    noise = seen.noise + held[0].noise / n + RESTING**2 * np.eye(3)
    return bool(
        in_deviations((seen.tip_cam - middle)[None], noise[None])[0]
        <= outlier_distance()
    )


def _has_left(rest: tuple[TipObservation, ...], seen: TipObservation) -> bool:
    """Return whether the pen is clearly elsewhere than where it rested."""
    return bool(rest) and _differs(seen, rest[0], TAKEN_UP_TURN, FAR_ENOUGH)


def _differs(
    seen: TipObservation, before: TipObservation, turn: float, distance: float
) -> bool:
    """Return whether the pen turned, rad, or its tip moved, mm, by at least so much."""
    rotations = seen.frame.rotation[None], before.frame.rotation[None]
    way = float(np.linalg.norm(seen.tip_cam - before.tip_cam))
    return bool(angles_between(*rotations)[0, 0] >= turn or way >= distance)


def _without_pose(
    rules: ProbingRules, state: ProbingState, rejected: RejectedFrame
) -> ProbingTransition:
    state = replace(state, n_lost=state.n_lost + 1)
    if state.n_lost > MAX_LOST and state.phase is ProbingPhase.AT_REST:
        return ProbingTransition(replace(state, held=()))
    if state.n_lost > MAX_LOST:
        is_broken_off = _is_broken_off(rules, state)
        return ProbingTransition(_let_go(state), is_broken_off=is_broken_off)
    if state.phase is ProbingPhase.HOLDING:
        state = replace(state, rejected=(*state.rejected, rejected))
    return ProbingTransition(state)


def _let_go(state: ProbingState) -> ProbingState:
    """Return to a moving pen."""
    path = (*state.path, *(each.tip_cam for each in state.held[-1:]))[-MAX_PATH:]
    return replace(
        state,
        phase=ProbingPhase.MOVING,
        held=(),
        deviating=None,
        rejected=(),
        path=path,
    )


def _is_broken_off(rules: ProbingRules, state: ProbingState) -> bool:
    """Return whether a touch was incomplete; a resting hand may move a little."""
    needed = rules.n_settling + WORTH_TELLING * rules.n_frames
    return state.phase is ProbingPhase.HOLDING and len(state.held) >= needed


def _moved_to(
    rules: ProbingRules, state: ProbingState, held: tuple[TipObservation, ...]
) -> ProbingTransition:
    holding = replace(_let_go(state), phase=ProbingPhase.HOLDING, held=held)
    return replace(_held(rules, holding), is_broken_off=_is_broken_off(rules, state))


def _held(rules: ProbingRules, state: ProbingState) -> ProbingTransition:
    """Take the touch if it was held long enough."""
    if len(state.held) < rules.n_settling + rules.n_frames:
        return ProbingTransition(state)
    used = state.held[rules.n_settling :]
    if not _is_new(rules, state, used[0]):
        return ProbingTransition(replace(state, phase=ProbingPhase.KNOWN))
    still = StillFrames(
        frames=tuple(each.frame for each in used),
        rejected=state.rejected,
        approach_cam=approach_of(state, used[0].tip_cam),
    )
    taken = replace(
        state,
        phase=ProbingPhase.RECORDED,
        rejected=(),
        path=(),
        taken=(*state.taken, still),
        places=(*state.places, used[0]),
    )
    return ProbingTransition(taken, tuple(map(_name, used)))


def _is_new(rules: ProbingRules, state: ProbingState, seen: TipObservation) -> bool:
    least = rules.min_turn, rules.min_distance
    return all(_differs(seen, before, *least) for before in state.places)


def approach_of(state: ProbingState, tip_cam: FloatArray) -> FloatArray | None:
    """Return the direction in which the tip came, if it came from far enough."""
    for before in reversed(state.path):
        way = tip_cam - before
        distance = float(np.linalg.norm(way))
        if distance > FAR_ENOUGH:
            return np.asarray(way / distance)
    return None
