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
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.reasons import Reason
from lightpen.detection.region_of_interest import RegionOfInterest
from lightpen.messages import Message, message
from lightpen.model.assumptions import USUAL, Assumptions
from lightpen.model.camera import Camera
from lightpen.model.coverage import dial_counts
from lightpen.model.limits import SwingLimits
from lightpen.model.pen import Pen
from lightpen.model.posture import Posture
from lightpen.model.rig import Rig, rig_of
from lightpen.swing.capture.kept_images import (
    MIN_JOINT,
    AcceptedImages,
    first_images,
    none_kept,
)
from lightpen.swing.capture.seat import Seat
from lightpen.swing_messages import SHOW_PEN, Code

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
