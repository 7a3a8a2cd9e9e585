"""State of a swing at one moment, its setup and events.

    WAIT -> SEEN -> SETTLED -> COUNTDOWN -> CAPTURING <-> PAUSED
                                                |
                                                v
                                             SOLVING -> VERDICT

`lightpen.swing.capture.rules` has the rules.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.labelling.constellation import certain_leds
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.pixel_box import RegionOfInterest
from lightpen.detection.reasons import Reason
from lightpen.messages import SHOW_PEN, TOO_FAST, Code, Message, message
from lightpen.model.camera import Camera
from lightpen.model.coverage import dial_counts
from lightpen.model.limits import USUAL, Assumptions, SwingLimits
from lightpen.model.pen import Pen
from lightpen.model.rigid import Posture, Rig, angles_between, rig_of
from lightpen.swing.capture.kept_images import (
    MIN_JOINT,
    AcceptedImages,
    Seat,
    first_images,
    keep,
    none_kept,
    without_slipped,
)

N_TRACED = 12  # estimates of a resumed swing


class Phase(StrEnum):
    """Phase of a swing."""

    WAIT = "wait"
    SEEN = "seen"
    SETTLED = "settled"
    COUNTDOWN = "countdown"
    CAPTURING = "capturing"
    PAUSED = "paused"
    SOLVING = "solving"
    VERDICT = "verdict"


class Pause(StrEnum):
    """Reason of a pause."""

    NONE = ""
    LOST = "lost"
    LIFTED = "lifted"
    ELSEWHERE = "elsewhere"
    BY_USER = "by user"


class SwingEventKind(StrEnum):
    """Kinds of events, each with a sound and a sign."""

    SEATED = "seated"
    KEPT = "kept"
    SLIPPED = "slipped"
    LOST = "lost"
    FIELD_FULL = "field full"
    CAPTURED = "captured"
    DONE = "done"
    FAILED = "failed"
    CONFIRMED = "confirmed"  # after the verdict, by holding the pen still


@dataclass(frozen=True)
class SwingEvent:
    """Something that happened."""

    what: SwingEventKind
    # Of images accepted, or no longer accepted; row and column of a full field.
    numbers: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class SwingSetup:
    """Setup of a swing."""

    camera: Camera
    pen: Pen
    limits: SwingLimits = field(default_factory=SwingLimits)
    # (M, 3), circles of stray light: centre x, y and radius, px
    mask: FloatArray | None = None
    assumptions: Assumptions = USUAL
    # Whether its images were recorded before: all are read, once and in their order,
    # and nobody is asked to lean the pen.
    is_recording: bool = False
    beside: Rig | None = None  # the rig of this camera, if there is one
    other_masks: tuple[FloatArray, ...] = ()
    is_press_test: bool = False  # with firm pressure, compared with another swing

    @property
    def rig(self) -> Rig:
        """All cameras; one alone is a rig of one."""
        return self.beside or rig_of(self.camera)

    @property
    def regions(self) -> tuple[RegionOfInterest, ...]:
        """Camera, pen and mask for the detection in each camera."""
        masks = (self.mask, *self.other_masks)
        cameras = zip(self.rig.cameras, masks, strict=True)
        return tuple(
            RegionOfInterest(camera, self.pen, mask) for camera, mask in cameras
        )


@dataclass(frozen=True, eq=False)
class RecentDetection:
    """A detection with a pose, and its time, s."""

    time: float
    detection: PenDetection


@dataclass(frozen=True, eq=False)
class Trace:
    """History of the estimate."""

    n_images: IntArray  # (K,), kept at each estimate
    tips: FloatArray  # (K, 3), tip in the pen frame, mm
    uncertainties: FloatArray  # (K,), U (k = 2) along the weakest direction, mm
    floors: FloatArray  # (K,), below which more images do not bring it, mm

    def with_estimate(self, kept: AcceptedImages) -> "Trace":
        """Return the trace with the estimate by these images, if there is one."""
        if kept.seat is None:
            return self
        return Trace(
            np.append(self.n_images, len(kept)),
            np.concatenate([self.tips, kept.seat.tip_pen[None]]),
            np.append(self.uncertainties, kept.predicted.uncertainty),
            np.append(self.floors, kept.predicted.floor),
        )


NO_TRACE = Trace(
    np.zeros(0, dtype=np.int64), np.zeros((0, 3)), np.zeros(0), np.zeros(0)
)


def trace_of(rig: Rig, pen: Pen, kept: AcceptedImages) -> Trace:
    """Return the history of the estimate of images accepted before."""
    trace = NO_TRACE
    counts = np.linspace(0, len(kept), N_TRACED + 1).astype(np.int64)[1:]
    for n_images in sorted({int(n) for n in counts if n >= MIN_JOINT} - {len(kept)}):
        trace = trace.with_estimate(first_images(rig, pen, kept, n_images))
    return trace.with_estimate(kept)


@dataclass(frozen=True)
class Progress:
    """Images of a recording read so far; all zero for a live camera."""

    n_read: int = 0
    n_images: int = 0


@dataclass(frozen=True, eq=False)
class SwingState:
    """A swing at one moment."""

    phase: Phase
    since: float  # when the phase began, s
    time: float  # of the last image, s
    message: Message  # for the operator
    kept: AcceptedImages
    last_seen: float  # when the pen was seen last, s
    target_since: float  # when the target was chosen, s
    next_number: int = 1  # of the next image in the swing's record
    # Postures that were new but of no use.
    n_dropped: Mapping[Reason, int] = field(default_factory=Counter)
    seat: Seat | None = None
    recent: tuple[RecentDetection, ...] = ()
    pause: Pause = Pause.NONE
    strayed_since: float | None = None  # when the tip left the cone, s
    # (M, 3, 3), postures held since then
    stray_rotations: FloatArray = field(default_factory=lambda: np.zeros((0, 3, 3)))
    # (M, 3, 3), new postures without a good image yet
    flawed_rotations: FloatArray = field(default_factory=lambda: np.zeros((0, 3, 3)))
    heading: float | None = None  # operator's right in the image, rad, once learnt
    was_upright: bool = (
        False  # since the capture began: a tilt then teaches the heading
    )
    target: Posture | None = None  # to guide to
    slipped_at: float | None = None  # when the tip slipped or images were dropped, s
    still_since: float | None = None  # upright and still, s
    trace: Trace = NO_TRACE
    progress: Progress = Progress()

    @property
    def n_kept(self) -> int:
        """Number of kept images."""
        return len(self.kept)

    @property
    def detection(self) -> PenDetection | None:
        """The last detection with a pose, if it was within a second."""
        return self.recent[-1].detection if self.recent else None

    @property
    def counts(self) -> IntArray:
        """Kept images by field of the dial, (3, 8); upright in the first column."""
        return dial_counts(self.kept.rotations)

    def with_dropped(
        self, n_images: int, reason: Reason = Reason.SLIPPED
    ) -> "SwingState":
        """Return the state with more images counted as dropped."""
        n_dropped = Counter(self.n_dropped)
        if n_images:
            n_dropped[reason] += n_images
        return replace(self, n_dropped=n_dropped)


@dataclass(frozen=True, eq=False)
class Transition:
    """A swing after one more image."""

    state: SwingState
    events: tuple[SwingEvent, ...] = ()

    def after(self, earlier: tuple[SwingEvent, ...]) -> "Transition":
        """Return the transition with the events that came before it."""
        return Transition(self.state, (*earlier, *self.events))


def start_swing(setup: SwingSetup, time: float = 0.0) -> SwingState:
    """Return the state at the start of a swing; ``time`` in s."""
    is_recording = setup.is_recording
    return SwingState(
        phase=Phase.CAPTURING if is_recording else Phase.WAIT,
        since=time,
        time=time,
        message=message(Code.IMAGES_READ, n_read=0, n_images=0)
        if is_recording
        else SHOW_PEN,
        kept=none_kept(setup.rig.n_cameras, setup.pen.n_leds, setup.assumptions),
        last_seen=time,
        target_since=time,
    )


# Which images of a capture are kept, and why the others are of no use.
#
# In all of them the tip rests in the cone. An image is kept if its posture differs from
# those of all kept images. Unusable images, and kept ones whose tip turns out to have
# slipped, are counted by reason.


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
