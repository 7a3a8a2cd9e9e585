"""Tests of `lightpen_extensions.measure.probing.probing`."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import simulate_centers

from lightpen.arrays import FloatArray
from lightpen.detection.pen_detection import PenDetection, detect_from_centers, unseen
from lightpen.detection.reasons import Reason
from lightpen.estimation.pivot.pivot import outlier_distance
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.rigid import rotation_from_vector, rotations_of
from lightpen_extensions.measure.probing.probing import (
    ONE_IMAGE,
    ProbingPhase,
    ProbingRules,
    ProbingState,
    TipObservation,
    _agrees,
    _has_left,
    _seen,
    advance_touch,
    approach_of,
    at_rest,
    with_taken,
)
from lightpen_extensions.measure.tasks.probed_point import ProbingFrame, StillFrames
from lightpen_extensions.simulator.swings import PAPER_CONE, PAPER_TIP

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


Names = tuple[str, ...]  # images of a point
BROKEN_OFF: Names = ("broken off",)


def run(
    instrument: Instrument,
    places: Sequence[Place | None],
    rules: ProbingRules = RULES,
    state: ProbingState | None = None,
) -> tuple[ProbingState, list[Names]]:
    state, events = state or ProbingState(), list[Names]()
    for name, detection in detections(instrument, places):
        transition = advance_touch(instrument, rules, state, name, detection)
        state = transition.state
        events += [BROKEN_OFF] * transition.is_broken_off
        events += [transition.recorded] if transition.recorded else []
    return state, events


def moving(n: int = 6) -> list[Place]:
    return [(PAPER_CONE + np.array([0.0, -8.0 * (n - i), 0.0]), 0.1) for i in range(n)]


HELD: Place = (PAPER_CONE, 0.1)


def test_a_still_pen_is_taken_after_so_many_images(instrument: Instrument) -> None:
    state, events = run(instrument, [*moving(), *[HELD] * STILL])

    assert events == [tuple(f"image {i}" for i in range(8, 13))]
    assert state.phase is ProbingPhase.RECORDED
    assert len(state.taken[0].frames) == RULES.n_frames


def test_each_of_single_images_is_a_point_even_in_one_place(
    instrument: Instrument,
) -> None:
    state, events = run(instrument, [HELD, HELD, moving()[0], HELD], ONE_IMAGE)

    assert events == [(f"image {i}",) for i in range(4)]
    assert len(state.taken) == 4


def test_a_pen_that_rests_is_not_touching_until_it_was_taken_up(
    instrument: Instrument,
) -> None:
    resting, none = at_rest(ProbingState()), list[Names]()
    on_the_table = [HELD] * 3 * STILL
    switched_on = [None] * 2 * STILL + [HELD] * 3 * STILL
    one_wrong_image = [HELD, moving()[0], *[HELD] * 3 * STILL]

    for places in (on_the_table, switched_on, one_wrong_image):
        state, events = run(instrument, places, state=resting)
        assert (state.phase, events) == (ProbingPhase.AT_REST, none)
        assert len(state.held) == 2  # the first and last image
        assert state.held[1].frame.name == f"image {len(places) - 1}"

    taken_up = [HELD] * STILL + moving() + [HELD] * STILL
    state, events = run(instrument, taken_up, state=resting)

    assert len(events) == 1
    assert events != [BROKEN_OFF]
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
    taken, _ = run(instrument, [*moving(), *[HELD] * STILL])

    assert state.progress(RULES) == pytest.approx(4 / STILL)
    assert taken.progress(RULES) == ProbingState().progress(RULES) == 0.0


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

    assert len(events) == 1
    assert events != [BROKEN_OFF]
    assert [each.name for each in state.taken[0].rejected] == ["image 10"]


def test_an_image_without_the_pen_is_named_with_its_reason(
    instrument: Instrument,
) -> None:
    state, _ = run(instrument, [*moving(), *[HELD] * 4, None, *[HELD] * 4])

    (rejected,) = state.taken[0].rejected
    assert (rejected.name, rejected.reason) == ("image 10", Reason.EMPTY)


@pytest.mark.parametrize(("n_lost", "is_one"), [(5, True), (6, False)])
def test_a_touch_goes_on_after_a_few_images_without_the_pen(
    instrument: Instrument, n_lost: int, is_one: bool
) -> None:
    lost = [None] * n_lost
    state, events = run(instrument, [*moving(), *[HELD] * 5, *lost, *[HELD] * 2])
    resting, _ = run(instrument, [*[HELD] * 5, *lost], state=at_rest(ProbingState()))

    assert len(state.taken) == is_one
    assert (events != [BROKEN_OFF]) == is_one
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


def observation(
    instrument: Instrument, off: float = 0.0, degrees: float = 0.0, noise: float = 0.0
) -> TipObservation:
    """What one image shows of a tip, exact or with noise in each coordinate, mm."""
    R = rotation_from_vector(np.radians([0.0, 0.0, degrees]))
    tip_cam = PAPER_CONE + np.array([0.0, off, 0.0])
    pixels = np.zeros((1, instrument.pen.n_leds, 2))
    frame = ProbingFrame("image", pixels, R, tip_cam - R @ instrument.tip_pen)
    return TipObservation(frame, tip_cam, noise**2 * np.eye(3))


@pytest.mark.parametrize(
    ("noise", "n_held", "sigma"),
    # Of the image, of the mean of what is held, and of a tip at rest.
    [
        (0.0, 1, 0.01),
        (0.02, 1, np.sqrt(2 * 0.02**2 + 0.01**2)),
        (0.02, 4, np.sqrt(1.25 * 0.02**2 + 0.01**2)),
    ],
)
@pytest.mark.parametrize(
    ("by", "degrees", "is_still"),
    [(0.99, 0.0, True), (1.01, 0.0, False), (0.0, 0.99, True), (0.0, 1.01, False)],
)
def test_a_pen_is_still_within_its_noise_and_a_degree(
    instrument: Instrument,
    noise: float,
    n_held: int,
    sigma: float,
    by: float,
    degrees: float,
    is_still: bool,
) -> None:
    held = (observation(instrument, noise=noise),) * n_held
    off = by * outlier_distance() * sigma
    seen = observation(instrument, off, degrees, noise)
    assert _agrees(held, seen) == is_still


@pytest.mark.parametrize(
    ("off", "degrees", "has_left"),
    [(1.99, 0.0, False), (2.01, 0.0, True), (0.0, 2.99, False), (0.0, 3.01, True)],
)
def test_a_pen_was_taken_up_once_it_moved_two_millimetres_or_turned_three_degrees(
    instrument: Instrument, off: float, degrees: float, has_left: bool
) -> None:
    rest = observation(instrument)
    assert _has_left((rest,), observation(instrument, off, degrees)) == has_left
    assert not _has_left((), rest)


@pytest.mark.parametrize(
    ("offs", "direction"),
    [
        ([5.0, 1.9], 1.0),  # the last place that is far enough
        ([-5.0, 2.1], 1.0),
        ([3.0, -2.1, 1.0], -1.0),
        ([1.9, -1.9], None),
        ([], None),
    ],
)
def test_the_approach_is_from_the_last_place_that_is_far_enough(
    offs: list[float], direction: float | None
) -> None:
    path = tuple(PAPER_CONE - np.array([0.0, off, 0.0]) for off in offs)
    found = approach_of(ProbingState(path=path), PAPER_CONE)

    expected = None if direction is None else [0.0, direction, 0.0]
    assert (None if found is None else found.round(12).tolist()) == expected


def test_only_the_newest_places_of_the_tip_are_kept(instrument: Instrument) -> None:
    wandering = [
        (PAPER_CONE + np.array([10.0 * (i % 3), 0.0, 0.0]), 0.1) for i in range(60)
    ]
    state, _ = run(instrument, wandering)

    assert len(state.path) == 20
    begun, _ = run(instrument, [*wandering[:2], *[wandering[2]] * 4])
    assert len(begun.path) == 1
    left, _ = run(instrument, [*[wandering[0]] * 3, *wandering[1:3]])
    assert len(left.path) == 1  # the last place of what was held


def test_touches_of_an_earlier_run_have_their_places(instrument: Instrument) -> None:
    again = observation(instrument, 3.1, 0.0)
    after = with_taken(instrument, ProbingState(), [StillFrames((again.frame,))])

    assert len(after.taken) == 1
    np.testing.assert_allclose(after.places[-1].tip_cam, again.tip_cam)
    np.testing.assert_array_equal(after.places[-1].noise, np.zeros((3, 3)))


def test_at_rest_nothing_is_held_and_the_way_there_is_forgotten(
    instrument: Instrument,
) -> None:
    state, _ = run(instrument, [*moving(), *[HELD] * STILL])
    assert state.n_lost == 0
    rest = at_rest(state)

    assert (rest.phase, rest.held, rest.path) == (ProbingPhase.AT_REST, (), ())
    assert rest.taken == state.taken


@pytest.mark.parametrize("n_lost", [5, 6])
def test_a_pen_that_is_lost_after_a_point_is_counted(
    instrument: Instrument, n_lost: int
) -> None:
    state, events = run(instrument, [*moving(), *[HELD] * STILL, *[None] * n_lost])
    assert len(events) == 1
    assert events != [BROKEN_OFF]
    assert state.n_lost == n_lost
    seen, _ = run(instrument, [HELD], state=state)
    assert seen.n_lost == 0


@pytest.mark.parametrize(
    ("n_frames", "n_held", "is_told"),
    [(5, 4, False), (5, 5, True), (4, 3, False), (4, 4, True)],
)
def test_a_touch_breaks_off_once_half_of_its_images_were_held(
    instrument: Instrument, n_frames: int, n_held: int, is_told: bool
) -> None:
    """After two that settle, whether the pen moves or is lost."""
    rules = ProbingRules(n_frames, n_settling=2)
    away = [(PAPER_CONE + np.array([0.0, -9.0 - i, 0.0]), 0.1) for i in range(3)]
    for after in (away, [None] * 6):
        _, events = run(instrument, [*moving(), *[HELD] * n_held, *after], rules)
        assert bool(events) == is_told


def test_a_pen_is_held_on_a_known_place_in_vain(instrument: Instrument) -> None:
    rules = ProbingRules(n_frames=2, n_settling=0, min_turn=1.0, min_distance=3.0)
    once, _ = run(instrument, [HELD] * 2, rules)
    known = ProbingState(places=once.places, path=(PAPER_CONE,))
    state, events = run(instrument, [HELD] * 2, rules, known)

    assert (state.phase, len(state.held), events) == (ProbingPhase.KNOWN, 2, [])


def test_an_image_between_two_places_is_neither(instrument: Instrument) -> None:
    """The second place has two images where they agree, and only the last if not."""
    there, beyond = (
        (PAPER_CONE + np.array([by, 0.0, 0.0]), 0.1) for by in (20.0, 40.0)
    )
    same, _ = run(instrument, [HELD, HELD, there, there])
    other, _ = run(instrument, [HELD, HELD, there, beyond])

    assert [len(state.held) for state in (same, other)] == [2, 1]
