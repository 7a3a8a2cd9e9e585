from collections.abc import Callable

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen_extensions.simulator.camera import SkippingClock
from lightpen_extensions.simulator.hand import (
    AWAY,
    GUIDED,
    HOVER,
    REACTION,
    HandActivity,
    HandPose,
    SimulatedOperator,
)
from lightpen_extensions.simulator.swings import (
    MAX_TILT,
    PAPER_CONE,
    PAPER_TIP,
    TREMOR,
    Postures,
    leds_in_camera,
    operator_postures,
    paper_camera,
    paper_pen,
)

PERIOD = 0.05  # s
SHAKE = 6 * TREMOR  # rad, that four sine waves together hardly exceed


class Scene:
    """An operator, looked at through a clock that skips."""

    def __init__(self, seed: int = 1, *, seated: bool = True) -> None:
        self.clock = SkippingClock()
        self.operator = SimulatedOperator(self.clock, seed, seated=seated)

    @property
    def now(self) -> float:
        return self.clock.now_ns() * 1e-9

    def doing(self) -> HandActivity:
        return self.operator.doing

    def look(self) -> HandPose:
        return self.operator.held(np.array([self.now]))

    def watch(self, seconds: float, period: float = PERIOD) -> list[HandPose]:
        seen = []
        for _ in range(round(seconds / period)):
            self.clock.wait(period)
            seen.append(self.look())
        return seen


def leans(seen: list[HandPose]) -> FloatArray:
    """Return tilt to the right, tilt away and turn, (F, 3), rad."""
    return np.concatenate([lean_of(held.postures) for held in seen])


def lean_of(postures: Postures) -> FloatArray:
    tilts, directions = postures.tilts, postures.directions
    right, away = tilts * np.cos(directions), tilts * np.sin(directions)
    return np.stack([right, away, postures.rolls], axis=-1)


def offsets(seen: list[HandPose]) -> FloatArray:
    return np.concatenate([held.offsets for held in seen])


def seen_after(
    act: Callable[[SimulatedOperator], None], seconds: float = 2.0
) -> list[HandPose]:
    scene = Scene()
    scene.watch(1)
    act(scene.operator)
    return scene.watch(seconds)


def play(period: float) -> tuple[FloatArray, FloatArray]:
    """Return leans and offsets of a play at its whole seconds, looked at otherwise."""
    scene = Scene(seed=4, seated=False)
    acts = (
        scene.operator.seat,
        lambda: scene.operator.lean_towards(0.4, 1.0, -0.2),
        scene.operator.swing,
        lambda: scene.operator.slip(0.5, 1.5),
        scene.operator.lift,
        scene.operator.hold,
    )
    seen = []
    for act in acts:
        act()
        scene.watch(3, period)
        seen.append(scene.look())
    return leans(seen), offsets(seen)


def test_the_movement_does_not_depend_on_when_it_is_looked_at() -> None:
    for seldom, often in zip(play(0.5), play(0.01), strict=True):
        np.testing.assert_allclose(seldom, often, atol=1e-6)  # 1 ns of the clock


def test_the_pen_is_absent_then_approaches_and_then_sits_in_the_cone() -> None:
    scene = Scene(seated=False)
    first = scene.look()
    assert scene.doing() is HandActivity.ABSENT
    assert first.is_away

    scene.operator.seat()
    scene.watch(0.5)
    assert scene.doing() is HandActivity.APPROACHING
    seen = scene.watch(5)

    assert scene.doing() is HandActivity.SEATED
    np.testing.assert_array_equal(offsets(seen[-20:]), 0)
    assert np.abs(np.diff(offsets(seen), axis=0)).max() < 300 * PERIOD + 2  # mm


def test_an_operator_who_was_asked_for_something_is_free_no_more() -> None:
    scene = Scene(seated=False)
    assert scene.operator.is_free

    scene.operator.uncover()
    assert scene.operator.is_free
    scene.operator.swing()
    assert scene.doing() is HandActivity.ABSENT
    assert not scene.operator.is_free
    scene.watch(8)
    assert not scene.operator.is_free

    scene.operator.move_away()
    scene.watch(8)
    assert scene.operator.is_free


def test_a_pen_that_is_away_shows_no_led_in_the_image() -> None:
    scene = Scene()
    scene.operator.lean_towards(
        MAX_TILT, np.pi, 0
    )  # to the side from which it is in longest
    scene.watch(2)
    scene.operator.move_away()
    held = scene.watch(6)[-1]
    rotation = held.postures.rotations[0]
    translation = PAPER_CONE + held.offsets[0] - rotation @ PAPER_TIP
    leds, _ = leds_in_camera(paper_pen(), rotation, translation)
    camera = paper_camera()

    assert scene.doing() is HandActivity.ABSENT
    assert held.is_away
    assert (camera.project(leds)[:, 0] > camera.width).all()
    assert np.linalg.norm(held.offsets[0] - AWAY) < 10


def test_a_seated_pen_only_trembles() -> None:
    seen = Scene().watch(30)

    scatter = leans(seen).std(axis=0)
    np.testing.assert_allclose(scatter, TREMOR, rtol=0.15)  # of 600 looks
    np.testing.assert_array_equal(offsets(seen), 0)


@pytest.mark.parametrize("direction", np.radians([0, 90, 180, 270]))
def test_guidance_is_followed_at_the_speed_of_a_person(direction: float) -> None:
    scene = Scene()
    start = leans([scene.look()])[0]
    goal = lean_of(
        Postures(np.radians([30.0]), np.array([direction]), np.radians([20.0]))
    )[0]
    scene.operator.lean_towards(np.radians(30), direction, np.radians(20))
    seen = leans(scene.watch(5))

    way = (goal - start) / np.linalg.norm(goal - start)
    progress = (seen - start) @ way
    length = float((goal - start) @ way)
    speed = np.diff(progress).max() / PERIOD
    np.testing.assert_allclose(seen[-1], goal, atol=SHAKE)
    assert progress.max() < 1.03 * length + SHAKE
    assert speed == pytest.approx(GUIDED.top_speed, rel=0.25)  # tremor on it
    assert (progress[: round(REACTION / PERIOD)] < SHAKE).all()


def test_the_last_guidance_counts() -> None:
    scene = Scene()
    for direction in (0.0, 2.0, 4.0):
        scene.operator.lean_towards(0.4, direction, 0.1)
    lean = leans(scene.watch(4))[-1]

    expected = [0.4 * np.cos(4.0), 0.4 * np.sin(4.0), 0.1]
    np.testing.assert_allclose(lean, expected, atol=SHAKE)


def test_the_swing_is_that_of_the_simulator() -> None:
    scene = Scene(seed=7)
    scene.operator.swing()
    scene.watch(3)
    assert scene.doing() is HandActivity.SWINGING
    times = []
    seen = []
    for _ in range(100):
        scene.clock.wait(PERIOD)
        times.append(scene.now)
        seen.append(scene.look())

    expected = lean_of(operator_postures(np.array(times), seed=7))
    # Both tremble, each in its own way.
    np.testing.assert_allclose(leans(seen), expected, atol=2 * SHAKE)


def test_holding_stops_the_swing_where_it_is() -> None:
    scene = Scene()
    scene.operator.swing()
    scene.watch(4)
    scene.operator.hold()
    seen = leans(scene.watch(4))[20:]

    assert scene.doing() is HandActivity.SEATED
    assert np.ptp(seen, axis=0).max() < 2 * SHAKE
    assert np.linalg.norm(seen[-1, :2]) > np.radians(5)


def test_a_swing_begins_with_seating_the_pen() -> None:
    scene = Scene(seated=False)
    scene.operator.swing()
    seen = scene.watch(6)

    assert scene.doing() is HandActivity.SWINGING
    free = np.linalg.norm(offsets(seen), axis=1) > 0
    assert np.linalg.norm(leans(seen)[free][:, :2], axis=1).max() < np.radians(5)


def test_a_lifted_pen_hovers_and_sits_again() -> None:
    scene = Scene()
    scene.operator.lift()
    lifted = offsets(scene.watch(3))[-1]
    assert scene.doing() is HandActivity.LIFTED
    np.testing.assert_allclose(lifted, HOVER, atol=5)

    scene.operator.seat()
    seated = offsets(scene.watch(3))[-1]
    assert scene.doing() is HandActivity.SEATED
    np.testing.assert_array_equal(seated, 0)


def test_a_slip_displaces_the_tip_for_its_time() -> None:
    seen = offsets(seen_after(lambda operator: operator.slip(0.8, 1.0)))
    distances = np.linalg.norm(seen, axis=1)

    assert np.count_nonzero(distances) == pytest.approx(1.0 / PERIOD, abs=1)
    np.testing.assert_allclose(distances[3:17], 0.8)
    np.testing.assert_array_equal(distances[22:], 0)


def test_a_hand_hides_leds_for_its_time() -> None:
    seen = seen_after(lambda operator: operator.cover(1.0, [2, 5]))
    hidden = [held.covered for held in seen]

    assert hidden[3:17] == [frozenset({2, 5})] * 14
    assert hidden[22:] == [frozenset()] * (len(hidden) - 22)


def test_a_hand_hides_all_leds_until_it_is_taken_away() -> None:
    scene = Scene()
    scene.operator.cover()
    assert scene.watch(30)[-1].covered == frozenset(range(1, 11))

    scene.operator.uncover()
    assert scene.watch(0.1)[-1].covered == frozenset()


def test_a_long_pause_costs_no_time() -> None:
    scene = Scene(seated=False)
    scene.operator.seat()
    scene.clock.wait(30 * 24 * 3600)  # would take an hour step by step
    held = scene.look()

    assert scene.doing() is HandActivity.SEATED
    np.testing.assert_array_equal(held.offsets, 0)


def test_a_tip_rests_where_it_is_to_touch() -> None:
    place = np.array([40.0, -10.0, 5.0])

    seen = seen_after(lambda operator: operator.touch(place), 4.0)

    np.testing.assert_array_equal(offsets(seen[-10:]), np.tile(place, (10, 1)))


def test_a_tip_that_touches_elsewhere_comes_from_above() -> None:
    place = np.array([40.0, 0.0, 0.0])

    heights = offsets(seen_after(lambda operator: operator.touch(place), 4.0))[:, 1]

    assert heights.min() < -30  # v points down
