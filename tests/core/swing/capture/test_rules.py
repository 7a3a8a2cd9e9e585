"""The swing, driven by a simulated hand: states, rules and end."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from tests.simulated_centers import simulate_centers

from lightpen.arrays import FloatArray
from lightpen.detection.pen_detection import PenDetection, detect_from_centers, unseen
from lightpen.detection.reasons import Reason
from lightpen.messages import (
    FOLLOW_ARROW,
    HOLD_UPRIGHT,
    LEAN_TO_YOUR_RIGHT,
    PEN_LOST,
    SEAT_TIP,
    SWING_TO_SEAT,
    Code,
    message,
    too_little_tilt,
)
from lightpen.model.limits import SwingLimits
from lightpen.model.pen import Pen
from lightpen.model.rigid import angles_between
from lightpen.swing.capture.guidance import missing
from lightpen.swing.capture.kept_images import Seat, kept_before
from lightpen.swing.capture.rules import (
    advance_swing,
    conclude,
    finish,
    forget_side,
    pause,
    resume,
    start_again,
    stillness,
)
from lightpen.swing.capture.state import (
    Pause,
    Phase,
    SwingEvent,
    SwingEventKind,
    SwingSetup,
    SwingState,
    Transition,
    start_swing,
)
from lightpen_extensions.simulator.camera import SkippingClock
from lightpen_extensions.simulator.hand import SimulatedOperator
from lightpen_extensions.simulator.swings import (
    PAPER_CONE,
    PAPER_TIP,
    Swing,
    paper_camera,
    paper_pen,
    swing_poses,
)

PERIOD = 0.15  # s, thrice the usual one: what is decided takes longer than either


# With these files any U can be reached.
EXACT_PEN = replace(paper_pen(), scale_sigma=1e-9, diameter_sigma=1e-6, expansion=0.0)


class Station:
    """A simulated operator before a camera of which only the LED centres are used."""

    def __init__(
        self,
        *,
        seed: int = 2,
        sigma: float = 0.05,
        limits: SwingLimits | None = None,
        pen: Pen | None = None,
        period: float = PERIOD,
    ) -> None:
        self.clock = SkippingClock()
        self.period = period
        self.operator = SimulatedOperator(self.clock, seed)
        self.rng = np.random.default_rng([seed, 1])
        self.sigma = sigma
        self.setup = SwingSetup(
            paper_camera(), pen or paper_pen(), limits or SwingLimits()
        )
        self.state = start_swing(self.setup)
        self.cone = PAPER_CONE
        self.events: list[SwingEvent] = []
        self.phases = [self.state.phase]
        self.wished: object = None
        self.taken: list[Transition] = []

    def sight(self) -> PenDetection:
        """Return what the camera sees now."""
        held = self.operator.held(np.array([self.now]))
        rotations = held.postures.rotations
        translations = self.cone + held.offsets - rotations @ PAPER_TIP
        pixels = simulate_centers(
            self.setup.camera,
            self.setup.pen,
            rotations,
            translations,
            self.sigma,
            self.rng,
        )[0]
        pixels[[led - 1 for led in held.covered]] = np.nan
        if held.is_away:
            pixels[:] = np.nan
        return detect_from_centers(
            *(self.setup.camera, self.setup.pen, pixels),
            *(rotations[0], translations[0]),
        )

    @property
    def now(self) -> float:
        return self.clock.now_ns() * 1e-9

    def take(self, transition: Transition) -> None:
        self.taken.append(transition)
        self.state = transition.state
        self.events += transition.events
        if self.phases[-1] is not transition.state.phase:
            self.phases.append(transition.state.phase)

    def follow(self) -> None:
        """Do what the screen asks for."""
        target = self.state.target
        if self.state.message.code == Code.LEAN_TO_YOUR_RIGHT:
            wish: object = "right"
        else:
            wish = target
        if wish is None or wish is self.wished:
            return
        self.wished = wish
        if target is None:
            self.operator.lean_towards(np.radians(20), 0.0, 0.0)
        else:
            self.operator.lean_towards(target.tilt, target.direction, target.turn)

    def run(self, seconds: float, until: Phase | None = None) -> "Station":
        for _ in range(round(seconds / self.period)):
            self.clock.wait(self.period)
            self.take(advance_swing(self.setup, self.state, self.sight(), self.now))
            self.follow()
            if self.state.phase is until:
                break
        return self

    def event_kinds(self) -> list[SwingEventKind]:
        frequent = (SwingEventKind.KEPT, SwingEventKind.FIELD_FULL)
        return [event.what for event in self.events if event.what not in frequent]

    @property
    def tip_error(self) -> float:
        assert self.state.kept.seat is not None
        return float(np.abs(self.state.kept.seat.tip_pen - PAPER_TIP).max())


@cache
def capturing_for(seconds: float) -> Station:
    station = Station()
    station.operator.seat()
    station.run(60.0, until=Phase.CAPTURING)
    return station.run(seconds)


POSTURES = swing_poses(60, np.random.default_rng(0))


def capturing_from(n_kept: int, sigma: float = 0.05) -> SwingState:
    """Return a swing that captures and has kept the first so many postures."""
    setup, some = SwingSetup(paper_camera(), paper_pen()), slice(n_kept)
    kept = kept_before(
        *(setup.rig, setup.pen, np.arange(n_kept) + 1),
        *(centers_of(POSTURES, sigma)[some, None], POSTURES.rotations[some]),
        POSTURES.translations[some],
    )
    return replace(
        start_again(setup, kept, n_kept + 1),
        phase=Phase.CAPTURING,
        seat=Seat(PAPER_TIP, PAPER_CONE, 1e-4 * np.eye(6)),
    )


def centers_of(swing: Swing, sigma: float) -> FloatArray:
    rng = np.random.default_rng(1)
    return simulate_centers(
        *(paper_camera(), paper_pen(), swing.rotations, swing.translations, sigma, rng)
    )


def shown(
    state: SwingState,
    frames: range,
    *,
    sigma: float = 0.05,
    offset: float = 0.0,
    n_hidden: int = 0,
) -> Transition:
    """Return the swing after further postures, 0.1 s apart, the tip off the cone."""
    moved = replace(
        POSTURES, translations=POSTURES.translations + np.array([offset, 0.0, 0.0])
    )
    setup, pixels = SwingSetup(paper_camera(), paper_pen()), centers_of(moved, sigma)
    pixels[:, :n_hidden] = np.nan
    events: tuple[SwingEvent, ...] = ()
    for i in frames:
        detection = detect_from_centers(
            *(setup.camera, setup.pen, pixels[i]),
            *(moved.rotations[i], moved.translations[i]),
        )
        transition = advance_swing(setup, state, detection, state.time + 0.1)
        state, events = transition.state, (*events, *transition.events)
    return Transition(state, events)


def capturing(seconds: float = 8.0) -> Station:
    """Return a station that has been capturing for some time.

    What the first one saw and took is not worked out again for the others.
    """
    first = capturing_for(seconds)
    station = Station()
    station.operator.seat()
    for transition in first.taken:
        station.clock.wait(PERIOD)
        station.operator.held(np.array([station.now]))
        station.take(transition)
        station.follow()
    station.rng.bit_generator.state = first.rng.bit_generator.state
    return station


@pytest.fixture(scope="module")
def whole() -> Station:
    """Return a station after a whole guided swing."""
    station = Station()
    station.operator.seat()
    return station.run(120.0, until=Phase.SOLVING)


def test_it_ends_when_postures_and_uncertainty_suffice(whole: Station) -> None:
    limits = whole.setup.limits
    assert whole.state.kept.uncertainty <= limits.max_uncertainty
    assert (whole.state.counts[1:] >= limits.min_per_field).all()
    assert whole.state.counts[0, 0] >= limits.min_per_field
    assert limits.min_images <= whole.state.n_kept < limits.max_images
    assert missing(whole.setup, whole.state) == ()
    # Three standard deviations of the weakest direction.
    assert whole.tip_error < 1.5 * whole.state.kept.uncertainty


def test_kept_postures_differ_from_each_other_by_the_spacing(whole: Station) -> None:
    rotations = whole.state.kept.rotations
    angles = angles_between(rotations, rotations)
    apart = angles[np.triu_indices(len(rotations), 1)]
    assert apart.min() >= whole.setup.limits.spacing


def test_each_kept_image_gets_the_next_number(whole: Station) -> None:
    kept = [e.numbers[0] for e in whole.events if e.what is SwingEventKind.KEPT]
    assert kept == list(range(1, whole.state.next_number))
    np.testing.assert_array_equal(whole.state.kept.numbers, kept)


def test_each_field_is_full_once(whole: Station) -> None:
    full = [e.numbers for e in whole.events if e.what is SwingEventKind.FIELD_FULL]
    assert len(set(full)) == len(full) == 17


def test_the_trace_tells_every_estimate(whole: Station) -> None:
    trace = whole.state.trace
    assert len(trace.n_images) == whole.state.n_kept
    np.testing.assert_allclose(trace.uncertainties[-1], whole.state.kept.uncertainty)
    late = trace.uncertainties[-50:]
    # What seat and lens are off by is estimated anew with each image: U may rise, too.
    assert (late[-1] < late[0]).all()


def test_the_countdown_counts_three_two_one() -> None:
    station = Station()
    station.operator.seat()
    station.run(60.0, until=Phase.COUNTDOWN)
    counted = [station.state.message.values]
    while station.state.phase is Phase.COUNTDOWN:
        station.run(PERIOD)
        counted.append(station.state.message.values)
    reported = [values.get("seconds") for values in counted]
    assert list(dict.fromkeys(reported)) == [3, 2, 1, None]
    assert station.state.n_kept <= 1


def test_the_first_lean_teaches_the_operators_side() -> None:
    station = Station()
    station.operator.seat()
    station.run(60.0, until=Phase.CAPTURING)
    assert station.state.message == LEAN_TO_YOUR_RIGHT
    assert station.state.target is None
    station.wished = "right"
    station.operator.lean_towards(np.radians(20), np.pi, 0.0)  # facing the camera
    station.run(2.0)
    assert station.state.heading == np.pi
    assert station.state.message == FOLLOW_ARROW
    assert station.state.target is not None


def test_a_pen_that_is_tilted_at_the_start_does_not_teach_the_operators_side() -> None:
    station = Station()
    station.operator.seat()
    station.operator.lean_towards(np.radians(20), np.pi, 0.0)
    station.wished = "right"
    station.run(60.0, until=Phase.CAPTURING).run(2.0)
    assert station.state.message == HOLD_UPRIGHT
    assert station.state.heading is None

    station.operator.lean_towards(0.0, 0.0, 0.0)
    station.run(3.0)
    assert station.state.message == LEAN_TO_YOUR_RIGHT
    station.operator.lean_towards(np.radians(20), 0.0, 0.0)
    station.run(2.0)
    assert station.state.heading == 0.0


def test_an_operator_who_stands_elsewhere_is_learnt_anew() -> None:
    station = capturing_for(3.0)
    assert station.state.heading == 0.0

    state = forget_side(station.state)

    assert (state.heading, state.target, state.was_upright) == (None, None, False)
    assert state.kept is station.state.kept


def test_a_pen_held_in_the_air_is_not_seated() -> None:
    station = Station()
    station.operator.lift()
    station.run(10.0)
    assert station.phases == [Phase.WAIT, Phase.SEEN]
    assert station.state.message == SEAT_TIP


def test_without_a_nominal_tip_a_still_pen_is_asked_to_swing() -> None:
    pen = replace(paper_pen(), nominal_tip=None)
    station = Station(pen=pen, period=PERIOD / 2)  # so that many images tell the seat
    station.operator.seat()
    station.run(6.0)
    assert station.state.message == SWING_TO_SEAT

    station.operator.swing()
    station.run(10.0, until=Phase.SETTLED)
    assert station.state.seat is not None
    assert np.abs(station.state.seat.tip_pen - PAPER_TIP).max() < 0.5


def test_lifting_in_the_countdown_starts_over() -> None:
    station = Station()
    station.operator.seat()
    station.run(60.0, until=Phase.COUNTDOWN)
    station.operator.lift()
    station.run(2.0)
    assert station.state.phase is Phase.SEEN
    assert station.event_kinds()[-1] is SwingEventKind.LOST


@pytest.mark.slow
def test_a_slip_drops_its_own_images_only() -> None:
    station = capturing()
    before = station.state.kept.numbers
    station.operator.slip(0.3, 1.0)
    station.run(4.0)

    assert station.state.phase is Phase.CAPTURING
    assert SwingEventKind.SLIPPED in station.event_kinds()
    assert station.state.n_dropped[Reason.SLIPPED] > 2
    lost = np.setdiff1d(before, station.state.kept.numbers)
    assert len(lost) <= 3  # of the half second before, by a gate of 99 %
    assert station.tip_error < 1.5 * station.state.kept.uncertainty


def test_a_slip_drops_the_images_before_it_that_were_half_out() -> None:
    state = shown(capturing_from(40), range(40, 46), offset=0.075).state
    creeping = set(state.kept.numbers.tolist()) - set(range(1, 41))
    after = shown(state, range(46, 52), offset=0.5)

    (slip,) = (e for e in after.events if e.what is SwingEventKind.SLIPPED)
    assert set(slip.numbers) <= creeping
    assert len(slip.numbers) >= 2
    assert set(range(1, 41)) <= set(after.state.kept.numbers.tolist())


def test_a_slip_says_so_once_with_the_number_of_images() -> None:
    station = capturing()
    station.operator.slip(0.3, 2.0)
    station.run(1.5)
    n_slipped = station.state.n_dropped[Reason.SLIPPED]
    assert station.state.message == message(Code.TIP_SLIPPED, n_dropped=n_slipped)
    station.run(2.5)
    assert station.event_kinds().count(SwingEventKind.SLIPPED) == 1
    assert station.state.message == FOLLOW_ARROW


@pytest.mark.slow
def test_images_that_slipped_are_found_when_more_is_known() -> None:
    # 0.3 mm in the first images hides in what the tip may still be.
    station = Station(period=0.1)
    station.operator.seat()
    station.run(60.0, until=Phase.CAPTURING)
    station.run(0.8)
    n_early = station.state.n_kept
    station.operator.slip(0.12, 0.6)
    station.run(0.6)
    hidden = station.state.kept.numbers[n_early:]
    station.run(8.0)

    assert len(hidden) >= 2
    assert station.state.phase is Phase.CAPTURING
    dropped = {
        n for e in station.events if e.what is SwingEventKind.SLIPPED for n in e.numbers
    }
    assert dropped & set(hidden.tolist())
    assert station.tip_error < 1.5 * station.state.kept.uncertainty


def test_a_tip_that_stays_elsewhere_pauses_until_it_is_put_back() -> None:
    station = capturing()
    n_kept = station.state.n_kept
    station.operator.slip(0.5, 5.0)
    station.run(4.0)
    assert station.state.pause is Pause.ELSEWHERE
    assert station.state.message.code == Code.TIP_ELSEWHERE
    assert station.state.message.values["distance"] == pytest.approx(0.5, abs=0.05)
    assert abs(station.state.n_kept - n_kept) <= 2

    station.run(3.0)
    assert station.state.phase is Phase.CAPTURING
    assert station.event_kinds()[-1] is SwingEventKind.SEATED


def test_images_from_a_wrong_place_give_way_to_more_from_the_right_one() -> None:
    station = Station()
    station.cone = PAPER_CONE + np.array([0.3, 0.0, 0.0])
    station.operator.seat()
    station.run(60.0, until=Phase.CAPTURING)
    station.run(1.0)
    early = station.state.kept.numbers
    station.cone = PAPER_CONE
    station.run(12.0)

    assert 3 <= len(early) < 12
    assert not np.isin(early, station.state.kept.numbers).any()
    assert station.state.n_kept > 12
    assert station.tip_error < 1.5 * station.state.kept.uncertainty


def test_a_lifted_pen_pauses_and_goes_on_in_the_cone() -> None:
    station = capturing()
    n_kept = station.state.n_kept
    station.operator.lift()
    station.run(3.0)
    assert station.state.pause is Pause.LIFTED
    assert station.state.n_kept <= n_kept + 1
    assert station.event_kinds()[-1] is SwingEventKind.LOST

    station.operator.seat()
    station.run(6.0)
    assert station.state.phase is Phase.CAPTURING
    assert station.state.n_kept > n_kept
    assert station.tip_error < 1.5 * station.state.kept.uncertainty


def test_hidden_leds_pause_after_seven_tenths_of_a_second() -> None:
    station = capturing()
    station.operator.cover(0.6)
    station.run(2.0)
    assert station.state.phase is Phase.CAPTURING
    station.operator.cover(2.0)
    station.run(0.65)
    assert station.state.phase is Phase.CAPTURING
    station.run(0.3)
    assert station.state.pause is Pause.LOST
    assert station.state.message == PEN_LOST
    station.run(4.0)
    assert station.state.phase is Phase.CAPTURING


def test_too_few_leds_are_said_and_not_kept() -> None:
    station = capturing()
    n_kept = station.state.n_kept
    station.operator.cover(leds=[1, 2, 3, 4, 5])
    station.run(3.0)
    assert station.state.n_kept <= n_kept + 1
    assert station.state.message == message(Code.FEW_LEDS, seen=5, needed=6)
    # Some 60 images, but counted once a posture.
    assert 1 <= station.state.n_dropped[Reason.TOO_FEW_LEDS] < 20

    station.operator.uncover()
    station.run(1.0)
    assert station.state.message == FOLLOW_ARROW


def test_a_posture_that_was_of_no_use_counts_again_after_a_kept_image() -> None:
    def hidden(state: SwingState, frame: int) -> SwingState:
        return shown(state, range(frame, frame + 1), n_hidden=5).state

    once = hidden(hidden(capturing_from(20), 30), 30)
    assert once.n_dropped[Reason.TOO_FEW_LEDS] == 1
    kept = shown(once, range(21, 22)).state
    assert kept.n_kept == 21
    assert hidden(kept, 30).n_dropped[Reason.TOO_FEW_LEDS] == 2


def test_an_image_that_the_program_failed_on_is_counted_and_the_swing_goes_on() -> None:
    station = capturing()
    n_kept = station.state.n_kept
    failed = unseen(station.setup.pen, Reason.UNHANDLED)
    station.take(advance_swing(station.setup, station.state, failed, station.now))
    assert station.state.n_dropped[Reason.UNHANDLED] == 1
    assert station.state.phase is Phase.CAPTURING

    station.run(2.0)
    assert station.state.n_dropped[Reason.UNHANDLED] == 1
    assert station.state.n_kept > n_kept


def test_a_noisy_image_is_judged_by_the_others_as_soon_as_there_are_enough() -> None:
    first = shown(capturing_from(0, 0.3), range(6), sigma=0.3).state
    assert first.n_kept == 6

    later = shown(capturing_from(20), range(20, 26), sigma=0.3).state
    assert later.n_kept == 20
    assert later.n_dropped[Reason.MISFIT] > 0


def test_the_users_pause_keeps_nothing_until_the_user_goes_on() -> None:
    station = capturing()
    n_kept = station.state.n_kept
    station.state = pause(station.state)
    station.run(3.0)
    assert station.state.pause is Pause.BY_USER
    assert station.state.n_kept == n_kept

    station.state = resume(station.state)
    station.run(5.0)
    assert Phase.COUNTDOWN not in station.phases[-4:]
    assert station.state.phase is Phase.CAPTURING
    assert station.state.n_kept > n_kept


def test_finishing_early_says_what_is_missing() -> None:
    station = capturing(4.0)
    n_images = int(np.maximum(2 - station.state.counts[1:], 0).sum())
    bare = np.flatnonzero((station.state.counts[1:] < 2).any(axis=0))
    said = missing(station.setup, station.state)
    assert message(Code.TOO_FEW_IMAGES, n_kept=station.state.n_kept, needed=60) in said
    assert (
        message(Code.UNCERTAIN, uncertainty=station.state.kept.uncertainty, limit=0.012)
        in said
    )
    assert too_little_tilt(n_images, bare.tolist()) in said

    transition = finish(station.state)
    assert transition.state.phase is Phase.SOLVING
    assert transition.events == (SwingEvent(SwingEventKind.CAPTURED),)


@pytest.mark.slow
def test_the_ceiling_ends_a_swing_that_is_not_good_enough() -> None:
    limits = SwingLimits(max_uncertainty=0.01, min_images=30, max_images=40)
    station = Station(limits=limits, pen=EXACT_PEN)
    station.operator.seat()
    station.run(120.0, until=Phase.SOLVING)
    assert station.state.n_kept == 40
    assert missing(station.setup, station.state)[-1].code == Code.UNCERTAIN


def test_the_verdict_is_reported(whole: Station) -> None:
    good = message(Code.GOOD, uncertainty=0.004)
    transition = conclude(whole.state, good, passed=True)
    assert transition.state.phase is Phase.VERDICT
    assert transition.state.message == good
    assert transition.events == (SwingEvent(SwingEventKind.DONE),)
    assert conclude(whole.state, good, passed=False).events == (
        SwingEvent(SwingEventKind.FAILED),
    )
    assert (
        advance_swing(whole.setup, transition.state, whole.sight(), whole.now).events
        == ()
    )


def test_a_pause_does_not_stop_the_solving(whole: Station) -> None:
    assert pause(whole.state) is whole.state


def test_an_upright_and_still_pen_is_noticed() -> None:
    station = Station()
    station.operator.seat()
    station.run(60.0, until=Phase.COUNTDOWN)
    assert station.state.still_since is not None
    assert station.now - station.state.still_since > 0.5
    station.operator.swing()
    station.wished = "right"
    station.run(3.0)
    assert station.state.still_since is None or (
        station.now - station.state.still_since < 1.0
    )


def test_three_seconds_upright_and_still_say_yes_and_no_more_than_that() -> None:
    still = replace(Station().state, still_since=1.0)
    assert stillness(replace(still, still_since=None, time=9.0)) == 0.0
    assert stillness(replace(still, time=3.9)) == pytest.approx(2.9 / 3)
    assert stillness(replace(still, time=4.0)) == 1.0
    assert stillness(replace(still, time=9.0)) == 1.0


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "drops"), [(1, False), (2, False), (5, True)])
def test_whatever_happens_the_events_tell_what_is_kept(seed: int, drops: bool) -> None:
    station = Station(seed=seed)
    operator, rng = station.operator, np.random.default_rng(seed)
    operator.seat()
    disturbances = (
        lambda: operator.slip(rng.uniform(0.05, 1.0), rng.uniform(0.1, 4.0)),
        operator.lift,
        operator.seat,
        operator.seat,
        operator.move_away,
        lambda: operator.cover(rng.uniform(0.1, 2.0)),
        lambda: operator.cover(rng.uniform(0.1, 2.0), [1, 2, 3, 7]),
        lambda: station.clock.wait(rng.uniform(0.1, 4.0)),
    )
    station.run(8.0)
    for _ in range(20):
        disturbances[rng.integers(len(disturbances))]()
        station.run(rng.uniform(0.3, 4.0))

    recorded: set[int] = set()
    n_lost = 0
    for event in station.events:
        if event.what is SwingEventKind.KEPT:
            assert event.numbers[0] not in recorded
            recorded |= set(event.numbers)
        elif event.what is SwingEventKind.SLIPPED:
            assert set(event.numbers) <= recorded
            recorded -= set(event.numbers)
            n_lost += len(event.numbers)
    assert recorded == set(station.state.kept.numbers.tolist())
    assert n_lost <= station.state.n_dropped[Reason.SLIPPED]
    assert n_lost > 0 or not drops
    assert len(recorded) > 20
    assert station.tip_error < 2 * station.state.kept.uncertainty


def test_an_uncertainty_that_is_not_known_yet_is_not_reported_as_a_number() -> None:
    station = Station()
    station.operator.seat()
    station.run(60.0, until=Phase.CAPTURING)
    codes = [message.code for message in missing(station.setup, station.state)]
    assert Code.UNKNOWN in codes
    assert Code.UNCERTAIN not in codes
