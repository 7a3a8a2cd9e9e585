"""Tests of `lightpen.verification.probing.probing`."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.detection.pen_detection import PenDetection, detect_from_centers, unseen
from lightpen.detection.reasons import Reason
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.posture import rotations_of
from lightpen.simulator.swings import PAPER_CONE, PAPER_TIP, simulate_centers
from lightpen.verification.probing.probing import (
    ONE_IMAGE,
    ProbingEvent,
    ProbingEventKind,
    ProbingPhase,
    ProbingRules,
    ProbingState,
    _seen,
    advance_touch,
    at_rest,
)

RULES = ProbingRules(n_frames=5, n_settling=2)
STILL = 7  # images of one touch by these rules
Place = tuple[FloatArray, float]  # of the tip, mm, and tilt, rad


def detections(
    instrument: Instrument, places: Sequence[Place | None]
) -> list[tuple[str, PenDetection]]:
    """What is seen of a tip that goes through places; None shows no pen."""
    rng = np.random.default_rng(4)
    camera, pen = instrument.camera, instrument.pen
    seen = []
    for i, place in enumerate(places):
        if place is None:
            seen.append((f"image {i}", unseen(pen, Reason.EMPTY)))
            continue
        point, tilt = place
        one = np.zeros(1)
        R = rotations_of(pen, one + tilt, one, one)
        t = point - R @ PAPER_TIP
        (pixels,) = simulate_centers(camera, pen, R, t, 0.01, rng)
        seen.append(
            (f"image {i}", detect_from_centers(camera, pen, pixels, R[0], t[0]))
        )
    return seen


def run(
    instrument: Instrument,
    places: Sequence[Place | None],
    rules: ProbingRules = RULES,
    state: ProbingState | None = None,
) -> tuple[ProbingState, list[ProbingEvent]]:
    state, events = state or ProbingState(), list[ProbingEvent]()
    for name, detection in detections(instrument, places):
        transition = advance_touch(instrument, rules, state, name, detection)
        state = transition.state
        events += transition.events
    return state, events


def moving(n: int = 6) -> list[Place]:
    return [(PAPER_CONE + np.array([0.0, -8.0 * (n - i), 0.0]), 0.1) for i in range(n)]


HELD: Place = (PAPER_CONE, 0.1)


def test_a_still_pen_is_taken_after_so_many_images(instrument: Instrument) -> None:
    state, events = run(instrument, [*moving(), *[HELD] * STILL])

    assert [event.what for event in events] == [ProbingEventKind.RECORDED]
    assert events[0].names == tuple(f"image {i}" for i in range(8, 13))
    assert state.phase is ProbingPhase.RECORDED
    assert len(state.taken[0].frames) == RULES.n_frames


def test_each_of_single_images_is_a_point_even_in_one_place(
    instrument: Instrument,
) -> None:
    state, events = run(instrument, [HELD, HELD, moving()[0], HELD], ONE_IMAGE)

    assert [event.names for event in events] == [(f"image {i}",) for i in range(4)]
    assert len(state.taken) == 4


def test_a_pen_that_rests_is_not_touching_until_it_was_taken_up(
    instrument: Instrument,
) -> None:
    resting, none = at_rest(ProbingState()), list[ProbingEvent]()
    on_the_table = [HELD] * 3 * STILL
    switched_on = [None] * 2 * STILL + [HELD] * 3 * STILL
    one_wrong_image = [HELD, moving()[0], *[HELD] * 3 * STILL]

    for places in (on_the_table, switched_on, one_wrong_image):
        state, events = run(instrument, places, state=resting)
        assert (state.phase, events) == (ProbingPhase.AT_REST, none)

    taken_up = [HELD] * STILL + moving() + [HELD] * STILL
    state, events = run(instrument, taken_up, state=resting)

    assert [event.what for event in events] == [ProbingEventKind.RECORDED]
    assert state.phase is ProbingPhase.RECORDED


def test_a_tip_that_waits_in_its_cone_is_taken_once_the_pen_was_tilted(
    instrument: Instrument,
) -> None:
    tilted = [(PAPER_CONE, 0.1 + 0.1 * i) for i in range(5)]
    resting = at_rest(ProbingState())

    state, _ = run(instrument, [HELD, *tilted, *[tilted[-1]] * STILL], state=resting)

    assert len(state.taken) == 1


def test_progress_tells_how_much_of_a_touch_is_taken(instrument: Instrument) -> None:
    state, _ = run(instrument, [*moving(), *[HELD] * 4])

    assert state.progress(RULES) == pytest.approx(4 / STILL)


def test_the_approach_is_where_the_tip_came_from(instrument: Instrument) -> None:
    state, _ = run(instrument, [*moving(), *[HELD] * STILL])

    approach = state.taken[0].approach_cam
    assert approach is not None
    np.testing.assert_allclose(approach, [0, 1, 0], atol=0.05)


def test_a_moving_pen_is_not_taken(instrument: Instrument) -> None:
    state, events = run(instrument, moving(30))

    assert events == []
    assert state.taken == ()


def test_a_held_pen_is_taken_once_until_it_moves_on(instrument: Instrument) -> None:
    held = [*moving(), *[HELD] * (3 * STILL)]
    state, _ = run(instrument, held)
    assert len(state.taken) == 1

    elsewhere: Place = (PAPER_CONE + np.array([20.0, 0.0, 0.0]), 0.1)
    state, _ = run(instrument, [*held, *[elsewhere] * STILL])
    assert len(state.taken) == 2


def test_one_image_that_disagrees_is_left_out_and_named(instrument: Instrument) -> None:
    jolt: Place = (PAPER_CONE + np.array([1.0, 0.0, 0.0]), 0.1)
    held = [HELD] * 4

    state, events = run(instrument, [*moving(), *held, jolt, *held])

    assert [event.what for event in events] == [ProbingEventKind.RECORDED]
    assert [each.name for each in state.taken[0].rejected] == ["image 10"]


def test_an_image_without_the_pen_is_named_with_its_reason(
    instrument: Instrument,
) -> None:
    state, _ = run(instrument, [*moving(), *[HELD] * 4, None, *[HELD] * 4])

    (rejected,) = state.taken[0].rejected
    assert (rejected.name, rejected.reason) == ("image 10", Reason.EMPTY)


def test_a_pen_lifted_in_the_middle_is_reported_and_nothing_taken(
    instrument: Instrument,
) -> None:
    up: list[Place] = [
        (PAPER_CONE + np.array([0.0, -10.0 * i, 0.0]), 0.1) for i in range(1, 6)
    ]

    state, events = run(instrument, [*moving(), *[HELD] * 5, *up])

    assert [event.what for event in events] == [ProbingEventKind.BROKEN_OFF]
    assert events[0].names[0] == "image 6"
    assert state.taken == ()


def test_a_pen_that_is_lost_ends_the_touch(instrument: Instrument) -> None:
    state, events = run(instrument, [*moving(), *[HELD] * 5, *[None] * 8])

    assert [event.what for event in events] == [ProbingEventKind.BROKEN_OFF]
    assert state.phase is ProbingPhase.MOVING


@pytest.mark.parametrize(("n_lost", "is_one"), [(5, True), (6, False)])
def test_a_touch_goes_on_after_a_few_images_without_the_pen(
    instrument: Instrument, n_lost: int, is_one: bool
) -> None:
    lost = [None] * n_lost
    state, events = run(instrument, [*moving(), *[HELD] * 5, *lost, *[HELD] * 2])
    resting, _ = run(instrument, [*[HELD] * 5, *lost], state=at_rest(ProbingState()))

    assert len(state.taken) == is_one
    assert (events[0].what is ProbingEventKind.RECORDED) == is_one
    assert bool(resting.held) == is_one


def test_the_same_posture_counts_once_where_postures_count(
    instrument: Instrument,
) -> None:
    rules = ProbingRules(5, 2, min_turn=0.15, min_distance=1e6)
    away = moving()
    leant: Place = (PAPER_CONE, 0.4)

    state, _ = run(instrument, [*[HELD] * 7, *away, *[HELD] * 9, *[leant] * 9], rules)

    assert len(state.taken) == 2


def test_rules_that_take_nothing_are_refused() -> None:
    with pytest.raises(ValueError, match="Nothing can be touched"):
        ProbingRules(n_frames=0)


def test_the_noise_of_a_point_is_that_of_its_image(instrument: Instrument) -> None:
    ((name, detection),) = detections(instrument, [HELD])
    noise = [
        np.diag(_seen(instrument, name, replace(detection, sigma=sigma)).noise)
        for sigma in (0.0, 2 * instrument.sigma, 4 * instrument.sigma)
    ]

    assert noise[1] == pytest.approx(4 * noise[0])  # never below that of the swing
    assert noise[2] == pytest.approx(16 * noise[0])
