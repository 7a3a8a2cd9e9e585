"""Progress: what is missing, and where to lean next."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import simulate_centers

from lightpen.detection.pen_detection import detect_from_centers
from lightpen.estimation.uncertainty.prediction import PredictedUncertainty
from lightpen.messages import SIDES, Code
from lightpen.model.limits import USUAL, Assumptions, SwingLimits
from lightpen.model.rigid import Posture, rotations_of
from lightpen.swing.capture.guidance import (
    N_MORE,
    guided,
    limits_for_more,
    measure_shortfall,
    missing,
    next_target,
    oriented,
    out_of_reach,
    turn_range,
)
from lightpen.swing.capture.kept_images import kept_before
from lightpen.swing.capture.state import SwingSetup, SwingState, start_swing
from lightpen_extensions.simulator.swings import (
    Postures,
    Swing,
    paper_camera,
    paper_pen,
    swing_from_postures,
    swing_poses,
)

CAMERA, PEN = paper_camera(), paper_pen()


# With these files any U can be reached.
EXACT_PEN = replace(PEN, scale_sigma=1e-9, diameter_sigma=1e-6, expansion=0.0)


def state_of(
    setup: SwingSetup, swing: Swing, assumed: Assumptions = USUAL, noise: int = 1
) -> SwingState:
    """Return a swing that has kept these postures."""
    pixels = simulate_centers(
        *(CAMERA, PEN, swing.rotations, swing.translations, 0.05),
        np.random.default_rng(noise),
    )
    kept = kept_before(
        *(setup.rig, setup.pen, np.arange(len(swing)), pixels[:, None]),
        *(swing.rotations, swing.translations, assumed),
    )
    return replace(start_swing(setup), kept=kept)


def to_the_right(n: int) -> Swing:
    rng = np.random.default_rng(0)
    return swing_from_postures(
        Postures(
            np.radians(rng.uniform(0, 30, n)),
            np.radians(rng.uniform(-100, 100, n)),
            np.radians(rng.uniform(-30, 30, n)),
        )
    )


@pytest.mark.slow
def test_the_estimate_of_images_to_come_holds() -> None:
    """Noise alone falls faster than at stations: the estimate is on the safe side."""
    limit = 0.011
    setup = SwingSetup(CAMERA, PEN, SwingLimits(max_uncertainty=limit))

    def median(value: Callable[[SwingState], float], n_images: int) -> float:
        swings = (swing_poses(n_images, np.random.default_rng(i)) for i in range(7))
        states = [state_of(setup, s, noise=i) for i, s in enumerate(swings)]
        return float(np.median([value(state) for state in states]))

    more = median(lambda s: measure_shortfall(setup, s).n_for_uncertainty, 60)
    assert more > 30
    reached = median(lambda s: s.kept.uncertainty, 60 + round(more))
    assert 0.75 * limit < reached < limit


def test_the_more_of_u_is_of_the_files_the_more_images_it_takes() -> None:
    setup = SwingSetup(CAMERA, PEN, SwingLimits(max_uncertainty=0.012))
    state = state_of(setup, swing_poses(20, np.random.default_rng(0)))
    reached = PredictedUncertainty(uncertainty=0.02, floor=0.007)
    state = replace(state, kept=replace(state.kept, predicted=reached))

    n_needed = measure_shortfall(setup, state).n_for_uncertainty

    # What is not of the files goes with the number of images to the power of -2/3.
    of_images = (0.02**2 - 0.007**2) * (20 / (20 + n_needed)) ** (2 / 3)
    assert np.hypot(np.sqrt(of_images), 0.007) == pytest.approx(0.012, rel=0.01)


def test_no_more_images_are_announced_than_the_limit_allows() -> None:
    swing = swing_poses(60, np.random.default_rng(0))
    for max_images, n_more in ((70, 10), (60, 0), (50, 0)):
        limits = SwingLimits(max_uncertainty=1e-3, max_images=max_images)
        setup = SwingSetup(CAMERA, EXACT_PEN, limits)
        assert measure_shortfall(setup, state_of(setup, swing)).n_more == n_more


def test_no_images_are_asked_for_where_the_files_leave_too_much_open() -> None:
    swing = swing_poses(60, np.random.default_rng(0))
    vague = replace(PEN, led_sigma=0.03)
    setup = SwingSetup(CAMERA, vague, SwingLimits(max_uncertainty=0.02))
    state = state_of(setup, swing)

    assert state.kept.predicted.floor > 0.02
    assert measure_shortfall(setup, state).n_for_uncertainty == 0


def test_what_no_image_can_mend_is_reported_with_its_file() -> None:
    swing = swing_poses(60, np.random.default_rng(0))
    vague = replace(PEN, led_sigma=0.03)
    setup = SwingSetup(CAMERA, vague, SwingLimits(max_uncertainty=0.02))
    state = state_of(setup, swing)
    floor = 1000 * state.kept.predicted.floor

    short = measure_shortfall(setup, state)

    reported = out_of_reach(setup.limits, state, short)

    words = f"the lowest achievable U (k = 2) is {floor:.1f} \N{MICRO SIGN}m"
    assert words in str(reported)
    assert reported in missing(setup, state)
    assert out_of_reach(SwingLimits(max_uncertainty=1.0), state, short) is None


def test_what_other_postures_still_lower_is_not_said_to_be_out_of_reach() -> None:
    """The floor of few postures is above that of all: it would be said too high."""
    setup = SwingSetup(CAMERA, PEN, SwingLimits(max_uncertainty=0.003))
    early = state_of(setup, to_the_right(15), USUAL)
    whole = state_of(setup, swing_poses(60, np.random.default_rng(0)), USUAL)
    assert early.kept.predicted.floor > 0.003 > whole.kept.predicted.floor

    assert out_of_reach(setup.limits, early, measure_shortfall(setup, early)) is None


def test_fields_that_the_camera_cannot_see_are_not_asked_for() -> None:
    swing = swing_poses(60, np.random.default_rng(0))
    limits = SwingLimits(min_per_field=2)
    narrow = replace(CAMERA, width=round(CAMERA.cx) + 50)  # it sees the left half
    state = state_of(SwingSetup(CAMERA, PEN, limits), swing)

    whole = measure_shortfall(SwingSetup(CAMERA, PEN, limits), state).wanted
    half = measure_shortfall(SwingSetup(narrow, PEN, limits), state).wanted

    assert whole[0].tolist() == [2] + 7 * [0]
    assert (whole[1:] == 2).all()
    assert (half[1:, 0] == 0).all()
    assert (half[1:, 4] == 2).all()


def test_a_swing_that_is_done_can_go_on() -> None:
    swing = swing_poses(60, np.random.default_rng(0))
    limits = SwingLimits(max_uncertainty=1.0, max_images=60, min_per_field=0)
    setup = SwingSetup(CAMERA, PEN, limits)
    state = state_of(setup, swing)
    more = replace(setup, limits=limits_for_more(limits, 60))

    assert measure_shortfall(setup, state).is_none
    assert measure_shortfall(more, state).n_more == N_MORE


def test_images_that_fields_lack_are_missing_though_the_number_suffices() -> None:
    limits = SwingLimits(max_uncertainty=1.0, min_images=60)
    setup = SwingSetup(CAMERA, PEN, limits)
    short = measure_shortfall(setup, state_of(setup, to_the_right(120)))

    assert short.n_images == short.fields.sum() > 0
    assert not short.is_none


def test_a_target_out_of_reach_is_chosen_anew_after_a_while() -> None:
    setup = SwingSetup(CAMERA, PEN, SwingLimits(max_uncertainty=1.0))
    target = Posture(0.4, 1.0, 1.5)
    state = replace(
        state_of(setup, to_the_right(120)),
        heading=0.0,
        target=target,
        target_since=10.0,
    )
    pose = state.kept.rotations[-1], state.kept.translations[-1]
    detection = detect_from_centers(CAMERA, PEN, state.kept.pixels[-1, 0], *pose)

    soon = guided(setup, replace(state, time=13.9), detection)
    late = guided(setup, replace(state, time=14.0), detection)

    assert soon.target is target
    assert late.target != target
    assert late.target_since == 14.0


def test_a_target_at_which_the_pen_stays_for_long_gives_way_to_another() -> None:
    setup = SwingSetup(CAMERA, PEN, SwingLimits(max_uncertainty=1e-4))
    state = replace(state_of(setup, to_the_right(20)), heading=0.0, time=10.0)
    pose = state.kept.rotations[-1], state.kept.translations[-1]
    detection = detect_from_centers(CAMERA, PEN, state.kept.pixels[-1, 0], *pose)
    state = guided(setup, state, detection)
    target = state.target
    assert target is not None
    numbers = target.tilt - np.radians(3), target.direction, target.turn
    (near,) = rotations_of(PEN, *(np.array([number]) for number in numbers))
    detection = replace(detection, rotation=near)

    soon = guided(setup, replace(state, time=11.0), detection)
    late = guided(setup, replace(soon, time=14.5), detection)

    assert soon.target == target
    assert late.target not in (None, target)


def test_the_range_of_turns_holds_each_posture_that_was_kept() -> None:
    rng = np.random.default_rng(4)
    n_poses = 40
    turns = rng.uniform(-0.6, 0.5, n_poses)
    rotations = rotations_of(
        *(PEN, rng.uniform(0, 0.5, n_poses), rng.uniform(0, 6, n_poses), turns)
    )

    low, high = turn_range(PEN, rotations) or (0, 0)

    np.testing.assert_allclose((low, high), (turns.min(), turns.max()), atol=1e-9)
    assert turn_range(PEN, rotations[:0]) is None


def test_missing_directions_are_named() -> None:
    setup = SwingSetup(CAMERA, PEN, SwingLimits(max_uncertainty=1.0))
    state = state_of(setup, to_the_right(120))
    (message,) = missing(setup, state)
    assert message.code == Code.TOO_LITTLE_TILT
    assert message.values["sides"] == SIDES[3:6]


def test_the_target_is_in_a_bare_field_once_the_uncertainty_suffices() -> None:
    setup = SwingSetup(CAMERA, PEN, SwingLimits(max_uncertainty=1.0))
    state = state_of(setup, to_the_right(120))
    target = next_target(setup, state, state.kept.rotations[-1])
    assert target is not None
    assert round(target.direction / (np.pi / 4)) in (3, 4, 5)


def test_there_is_no_target_before_the_tip_rests() -> None:
    setup = SwingSetup(CAMERA, PEN)
    upright = rotations_of(PEN, np.zeros(1), np.zeros(1), np.zeros(1))[0]
    assert next_target(setup, start_swing(setup), upright) is None


def test_the_operators_side_is_learnt_from_a_lean_of_an_upright_pen_and_kept() -> None:
    setup = SwingSetup(CAMERA, PEN)
    state = start_swing(setup)
    headings = []
    for tilt, direction, still_s in (
        *((20.0, 300.0, None), (5.0, 10.0, 0.0), (20.0, 300.0, None)),
        *((5.0, 10.0, 1.0), (20.0, 170.0, None), (20.0, 300.0, None)),
    ):
        still_since = None if still_s is None else state.time - still_s
        state = replace(state, still_since=still_since)
        swing = swing_from_postures(Postures(*np.radians([[tilt], [direction], [0.0]])))
        pixels = simulate_centers(
            *(CAMERA, PEN, swing.rotations, swing.translations, 0.0),
            np.random.default_rng(0),
        )
        detection = detect_from_centers(
            CAMERA, PEN, pixels[0], swing.rotations[0], swing.translations[0]
        )
        state = oriented(setup, state, detection)
        headings.append(state.heading)
    assert headings == [None, None, None, None, np.pi, np.pi]
