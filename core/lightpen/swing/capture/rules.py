"""The rules of a swing: transition from one image to the next.

`advance_swing` takes the state of a swing, what the next image shows and when it was
taken, and returns the new state and what happened. It has no clock and no threads.
The tip must rest in one place for a second before anything is kept. Then an image is
kept where its posture differs from that of all kept ones and its tip is in the cone. A
tip that leaves the cone costs the images that it spoils, and no others. The swing ends
when the postures and the uncertainty suffice.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import ceil

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.reasons import Reason
from lightpen.estimation.pivot.pivot import outlier_distance
from lightpen.messages import (
    FOLLOW_ARROW,
    HOLD_STILL,
    HOLD_UPRIGHT,
    LEAN_TO_YOUR_RIGHT,
    PAUSED,
    PEN_LIFTED,
    PEN_LOST,
    SEAT_TIP,
    SHOW_PEN,
    SOLVING,
    SWING_TO_SEAT,
    Code,
    Message,
    message,
)
from lightpen.model.coverage import MIN_SPREAD, posture_spread
from lightpen.model.pen import Pen
from lightpen.model.rigid import angles_between, posture_of
from lightpen.swing.capture.guidance import (
    guided,
    is_upright,
    measure_shortfall,
    oriented,
)
from lightpen.swing.capture.kept_images import (
    AcceptedImages,
    Seat,
    distance_unit,
    fit_seat,
    tip_distances,
    tip_offsets,
    without_slipped,
)
from lightpen.swing.capture.state import (
    FEW,
    Pause,
    Phase,
    RecentDetection,
    SwingEvent,
    SwingEventKind,
    SwingSetup,
    SwingState,
    Transition,
    drop_all,
    drop_slipped,
    start_swing,
    take_image,
    trace_of,
    with_new,
)

BATCH = 1.0  # s, of images in which the tip must rest
FULL = 0.8  # of a batch, that its images must span
MIN_BATCH = 6  # images
STEADY = 3.0  # median distance of the tip, standard deviations; 1.5 is usual
MIN_KEPT = 3  # images for a better noise estimate than the last ones give


def seat_of(state: SwingState) -> Seat | None:
    """Return the best estimate of tip and cone."""
    return state.kept.seat or state.seat


def steady_seat(pen: Pen, state: SwingState) -> Seat | None:
    """Return the resting place of the tip in the last second; None if it moved.

    With a nominal tip the pen may stand still. Without one it must swing a little, or
    any still pen would do.
    """
    recent = state.recent
    if len(recent) < MIN_BATCH or state.time - recent[0].time < FULL * BATCH:
        return None
    rotations, translations = _poses(recent)
    if pen.nominal_tip is None and posture_spread(rotations)[0][1] < MIN_SPREAD:
        return None
    covariances = _covariances(state, recent)
    seat = fit_seat(pen, rotations, translations, covariances)
    distances = tip_distances(seat, rotations, translations, covariances)
    return seat if np.median(distances) < STEADY else None


def in_place(state: SwingState, recent: Sequence[RecentDetection]) -> BoolArray:
    """Return in which detections the tip is in the cone, (N,)."""
    seat = seat_of(state)
    if seat is None or not recent:
        return np.zeros(len(recent), dtype=bool)
    rotations, translations = _poses(recent)
    covariances = _covariances(state, recent)
    distances = tip_distances(seat, rotations, translations, covariances)
    return np.asarray(distances <= outlier_distance() * distance_unit(state.kept))


def rests_in_place(state: SwingState, seconds: float) -> bool:
    """Return whether the tip was in the cone for this time."""
    recent = [each for each in state.recent if each.time >= state.time - seconds]
    if not recent or recent[-1].time - recent[0].time <= FULL * seconds:
        return False
    return bool(np.mean(in_place(state, recent)) > FULL)


def offset(state: SwingState, seconds: float = 0.0) -> float:
    """Return the median distance of the tip from the cone over a time, mm."""
    seat = seat_of(state)
    recent = [each for each in state.recent if each.time >= state.time - seconds]
    if seat is None or not recent:
        return 0.0
    lengths = np.linalg.norm(tip_offsets(seat, *_poses(recent)), axis=1)
    return float(np.median(lengths))


def _poses(recent: Sequence[RecentDetection]) -> tuple[FloatArray, FloatArray]:
    detections = [each.detection for each in recent]
    rotations = np.array([each.rotation for each in detections])
    return rotations, np.array([each.translation for each in detections])


def _covariances(state: SwingState, recent: Sequence[RecentDetection]) -> FloatArray:
    sigma = state.kept.sigma
    if state.n_kept < MIN_KEPT:
        sigma = float(np.median([g.detection.sigma for g in state.recent]))
    return np.array([each.detection.cofactors for each in recent]) * sigma**2


SETTLING = 0.5  # s between the tip being found at rest and the countdown
COUNTDOWN = 3.0  # s
LOST_AFTER = 0.7  # s without the pen
RESEATED = 0.5  # s in the cone that end a pause
LIFTED = 3.0  # mm from the cone; less is a slip
LEAVING = 0.2  # s out of the cone until the pen counts as lifted
ABOUT_TO_SLIP = 0.5  # s before a slip, in which the tip may be half out
SLIP_REPORTED = 4.0  # s for which a slip is reported, at least
ASTRAY = 2.0  # s out of the cone until the capture pauses
UPRIGHT = np.radians(8.0)
STILL = np.radians(1.5)
CONFIRMING = 3.0  # s upright and still that confirm without a key


def advance_swing(
    setup: SwingSetup, state: SwingState, detection: PenDetection, time: float
) -> Transition:
    """Return the swing after one more image at a time, s, that never decreases.

    An event `KEPT` asks for the image to be recorded under its number, before the next
    image is taken; one of `SLIPPED` names kept images that are dropped.
    """
    state = _noticed(setup, state, detection, time)
    rule = _RULES.get(state.phase)
    if rule is None:
        return Transition(state)
    transition = rule(setup, state, detection)
    if any(event.what is SwingEventKind.SLIPPED for event in transition.events):
        return replace(transition, state=replace(transition.state, slipped_at=time))
    return transition


def pause(state: SwingState) -> SwingState:
    """Return the swing paused by the user."""
    if state.phase in (Phase.SOLVING, Phase.VERDICT):
        return state
    paused = _enter(state, Phase.PAUSED, PAUSED)
    return replace(paused, pause=Pause.BY_USER)


def resume(state: SwingState) -> SwingState:
    """Return the swing resumed after the user's pause, from finding the seat on.

    Of recorded images the next one is read.
    """
    if state.phase is not Phase.PAUSED or state.pause is not Pause.BY_USER:
        return state
    n_read, n_images = state.progress.n_read, state.progress.n_images
    if n_images:
        return _enter(
            state,
            Phase.CAPTURING,
            message(Code.IMAGES_READ, n_read=n_read, n_images=n_images),
        )
    return _await_seat(state)


def finish(state: SwingState) -> Transition:
    """End the capture, whatever is missing."""
    solving = _enter(state, Phase.SOLVING, SOLVING)
    return Transition(
        replace(solving, target=None), (SwingEvent(SwingEventKind.CAPTURED),)
    )


def conclude(state: SwingState, verdict: Message, passed: bool) -> Transition:
    """Show the verdict on the solved swing."""
    event_kind = SwingEventKind.DONE if passed else SwingEventKind.FAILED
    return Transition(_enter(state, Phase.VERDICT, verdict), (SwingEvent(event_kind),))


def forget_side(state: SwingState) -> SwingState:
    """Return the swing with the operator's heading to be determined again."""
    return replace(state, heading=None, was_upright=False, target=None)


def has_just_slipped(state: SwingState) -> bool:
    """Return whether the last slip is shown: just now, and no image was kept since."""
    at, times = state.slipped_at, state.kept.times
    if at is None or (len(times) and times[-1] > at):
        return False
    return state.time - at < SLIP_REPORTED


def has_enough(setup: SwingSetup, state: SwingState) -> bool:
    """Return whether a swing is complete or has reached its maximum."""
    if state.n_kept >= setup.limits.max_images:
        return True
    return state.n_kept > 0 and measure_shortfall(setup, state).is_none


def stillness(state: SwingState) -> float:
    """Return the fraction of the confirmation hold elapsed, 0 to 1."""
    if state.still_since is None:
        return 0.0
    return min((state.time - state.still_since) / CONFIRMING, 1.0)


def start_again(
    setup: SwingSetup, kept: AcceptedImages, next_number: int, time: float = 0.0
) -> SwingState:
    """Return an interrupted swing with its accepted images; see `kept_before`.

    ``next_number`` is the number of the next image in the swing's record.
    """
    state = start_swing(setup, time)
    trace = trace_of(setup.rig, setup.pen, kept)
    return replace(state, kept=kept, next_number=next_number, trace=trace)


def _noticed(
    setup: SwingSetup, state: SwingState, detection: PenDetection, time: float
) -> SwingState:
    """Return the state with the detection added."""
    recent = [each for each in state.recent if each.time > time - BATCH]
    if not detection.has_pose:
        return replace(state, time=time, recent=tuple(recent), still_since=None)
    still_since = state.still_since
    if posture_of(setup.pen, detection.rotation).tilt > UPRIGHT:
        still_since = None
    elif still_since is None or not _is_still(recent, detection):
        still_since = time
    return replace(
        state,
        time=time,
        recent=(*recent, RecentDetection(time, detection)),
        last_seen=time,
        still_since=still_since,
    )


def _is_still(recent: list[RecentDetection], detection: PenDetection) -> bool:
    if not recent:
        return False
    before = recent[0].detection.rotation
    return bool(angles_between(before[None], detection.rotation[None])[0, 0] < STILL)


def _wait(setup: SwingSetup, state: SwingState, detection: PenDetection) -> Transition:
    if not detection.has_pose:
        return Transition(state)
    return Transition(_enter(state, Phase.SEEN, _seating(setup)))


def _seen(setup: SwingSetup, state: SwingState, detection: PenDetection) -> Transition:
    if _is_lost(state):
        return Transition(_enter(state, Phase.WAIT, SHOW_PEN))
    seat = steady_seat(setup.pen, state)
    if seat is None:
        return Transition(state)
    return _settle(setup, state, seat)


def _settle(setup: SwingSetup, state: SwingState, seat: Seat) -> Transition:
    """Start with a resting tip, or continue if it is in the same place."""
    events: tuple[SwingEvent, ...] = (SwingEvent(SwingEventKind.SEATED),)
    if state.n_kept and not rests_in_place(state, BATCH):
        if state.n_kept >= FEW:
            return Transition(replace(state, message=_elsewhere(state)))
        dropped = drop_all(setup, state).after(events)
        state, events = dropped.state, dropped.events
    settled = _enter(state, Phase.SETTLED, HOLD_STILL)
    return Transition(replace(settled, seat=state.kept.seat or seat), events)


def _settled(
    setup: SwingSetup, state: SwingState, detection: PenDetection
) -> Transition:
    unsettled = _unsettled(setup, state)
    if unsettled is not None:
        return unsettled
    if state.time - state.since < SETTLING:
        return Transition(state)
    if state.n_kept:
        return Transition(_enter(state, Phase.CAPTURING, _asking(state)))
    return Transition(
        _enter(state, Phase.COUNTDOWN, message(Code.STARTS_IN, seconds=ceil(COUNTDOWN)))
    )


def _countdown(
    setup: SwingSetup, state: SwingState, detection: PenDetection
) -> Transition:
    unsettled = _unsettled(setup, state)
    if unsettled is not None:
        return unsettled
    left = COUNTDOWN - (state.time - state.since)
    if left > 0:
        return Transition(
            replace(state, message=message(Code.STARTS_IN, seconds=ceil(left)))
        )
    return Transition(_enter(state, Phase.CAPTURING, _asking(state)))


def _unsettled(setup: SwingSetup, state: SwingState) -> Transition | None:
    """Return the step back if the pen is lost or its tip has left the seat."""
    lost = (SwingEvent(SwingEventKind.LOST),)
    if _is_lost(state):
        return Transition(_await_seat(state), lost)
    just_now = [each for each in state.recent if each.time > state.time - LEAVING]
    if in_place(state, just_now).any():
        return None
    return Transition(
        replace(_enter(state, Phase.SEEN, _seating(setup)), recent=()), lost
    )


def _capturing(
    setup: SwingSetup, state: SwingState, detection: PenDetection
) -> Transition:
    if _is_lost(state):
        return _pause_for(state, Pause.LOST, PEN_LOST)
    if detection.reason is Reason.UNHANDLED:
        state = state.with_dropped(1, detection.reason)
    if not detection.has_pose:
        return Transition(state)
    if not in_place(state, state.recent[-1:]).all():
        return _out_of_cone(setup, state, detection)
    state = replace(state, strayed_since=None, stray_rotations=np.zeros((0, 3, 3)))
    state = guided(setup, oriented(setup, state, detection), detection)
    taken = take_image(setup, replace(state, message=_asking(state)), detection)
    is_kept = taken.state.next_number > state.next_number
    if is_kept and has_enough(setup, taken.state):
        return finish(taken.state).after(taken.events)
    return taken


def _out_of_cone(
    setup: SwingSetup, state: SwingState, detection: PenDetection
) -> Transition:
    """Note that the tip is out of the cone; never keep such an image."""
    if state.strayed_since is None:  # one image alone may be a bad one
        return Transition(replace(state, strayed_since=state.time))
    strayed_for = state.time - state.strayed_since
    kept, dropped = state.kept, set[int]()
    begins = not len(state.stray_rotations)
    if begins:
        since = state.strayed_since - ABOUT_TO_SLIP
        kept, dropped = without_slipped(setup.rig, setup.pen, kept, since)
    strays = with_new(setup, state.stray_rotations, detection)
    n_new = len(strays) - len(state.stray_rotations)
    state = replace(state, kept=kept, stray_rotations=strays).with_dropped(n_new)
    transition = drop_slipped(state, dropped)
    state, events = transition.state, transition.events
    if offset(state) > LIFTED:
        if strayed_for < LEAVING:
            return transition
        return _pause_for(state, Pause.LIFTED, PEN_LIFTED).after(events)
    if strayed_for > ASTRAY:
        if max(len(strays), FEW) < state.n_kept:
            return _pause_for(state, Pause.ELSEWHERE, _elsewhere(state)).after(events)
        transition = drop_all(setup, state)
        seating = _enter(transition.state, Phase.SEEN, _seating(setup))
        return Transition(replace(seating, recent=()), (*events, *transition.events))
    if begins and not events:
        events = (SwingEvent(SwingEventKind.SLIPPED),)
    n_dropped = len(strays) + len(dropped)
    return Transition(
        replace(state, message=message(Code.TIP_SLIPPED, n_dropped=n_dropped)), events
    )


def _paused(
    setup: SwingSetup, state: SwingState, detection: PenDetection
) -> Transition:
    if state.pause is Pause.BY_USER:
        return Transition(state)
    if _is_lost(state):
        return Transition(replace(state, pause=Pause.LOST, message=PEN_LOST))
    is_in_place = bool(state.recent) and bool(in_place(state, state.recent[-1:]).all())
    if state.pause is Pause.LOST and detection.has_pose and not is_in_place:
        state = replace(state, pause=Pause.LIFTED, message=PEN_LIFTED)
    if state.time - state.since > RESEATED and rests_in_place(state, RESEATED):
        capturing = _enter(state, Phase.CAPTURING, _asking(state))
        return Transition(capturing, (SwingEvent(SwingEventKind.SEATED),))
    seat = steady_seat(setup.pen, state)
    if seat is None or in_place(state, state.recent[-1:]).all():
        return Transition(state)
    return _settle(setup, state, seat)


_RULES: dict[Phase, Callable[[SwingSetup, SwingState, PenDetection], Transition]] = {
    Phase.WAIT: _wait,
    Phase.SEEN: _seen,
    Phase.SETTLED: _settled,
    Phase.COUNTDOWN: _countdown,
    Phase.CAPTURING: _capturing,
    Phase.PAUSED: _paused,
}


def _enter(state: SwingState, phase: Phase, message: Message) -> SwingState:
    return replace(
        state,
        phase=phase,
        since=state.time,
        message=message,
        pause=Pause.NONE,
        strayed_since=None,
        stray_rotations=np.zeros((0, 3, 3)),
        was_upright=False,
    )


def _await_seat(state: SwingState) -> SwingState:
    """Return to where the pen must be seen and seated again."""
    return replace(_enter(state, Phase.WAIT, SHOW_PEN), recent=())


def _pause_for(state: SwingState, why: Pause, message: Message) -> Transition:
    paused = replace(_enter(state, Phase.PAUSED, message), pause=why)
    return Transition(paused, (SwingEvent(SwingEventKind.LOST),))


def _is_lost(state: SwingState) -> bool:
    return state.time - state.last_seen > LOST_AFTER


def _seating(setup: SwingSetup) -> Message:
    known = setup.pen.nominal_tip is not None
    return SEAT_TIP if known else SWING_TO_SEAT


def _elsewhere(state: SwingState) -> Message:
    return message(Code.TIP_ELSEWHERE, distance=offset(state, BATCH))


def _asking(state: SwingState) -> Message:
    if state.heading is None and not (state.was_upright or is_upright(state)):
        return HOLD_UPRIGHT
    if state.heading is None:
        return LEAN_TO_YOUR_RIGHT
    return FOLLOW_ARROW
