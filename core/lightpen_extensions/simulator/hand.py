"""The hand of a simulated operator: seats, tilts and lifts the pen.

Time goes in equal small steps, so the movement does not depend on when it is examined.
"""

from collections import deque
from collections.abc import Callable, Collection
from dataclasses import dataclass
from enum import Enum, auto
from functools import lru_cache, partial
from math import inf
from threading import Lock
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.cameras.pairing import Clock
from lightpen_extensions.simulator.swings import (
    TREMOR,
    TREMOR_BAND,
    Postures,
    operator_postures,
)

# Hand motion: tracking a goal, tremor, endless swing.
#
# A hand goes after a goal x* with a limited speed and a lag,
#
#     x'' = (w - x') / lag,    w = x*' + clip(gain (x* - x), top speed),
#
# which is a damping of ``1 / (2 sqrt(gain lag))``: 0.8 overshoots by some two per cent.


STEP = 0.01  # s
STEPS_PER_PIECE = 100  # of a swing, computed at once


@dataclass(frozen=True)
class TrackingMotion:
    """Dynamics of tracking a goal."""

    gain: float  # 1/s
    lag: float  # s
    top_speed: float  # rad/s or mm/s


class Tremor:
    """Three smooth random functions of time with unit variance."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rates = 2 * np.pi * rng.uniform(*TREMOR_BAND, (3, 4))
        self._phases = rng.uniform(0, 2 * np.pi, (3, 4))

    def at(self, times: FloatArray) -> FloatArray:
        """Return the values at times (F,), shape (F, 3)."""
        waves = np.sin(times[:, None, None] * self._rates + self._phases)
        return np.asarray(waves.sum(axis=-1) / np.sqrt(2))


def pursue(
    place: FloatArray,
    rate: FloatArray,
    goal: FloatArray,
    goal_rate: FloatArray,
    pursuit: TrackingMotion,
) -> tuple[FloatArray, FloatArray]:
    """Return position and rate of a hand after one `STEP` towards a goal.

    All are (3,), rad and rad/s, or mm and mm/s.
    """
    wish = pursuit.gain * (goal - place)
    speed = float(np.linalg.norm(wish))
    if speed > pursuit.top_speed:
        wish *= pursuit.top_speed / speed
    rate = rate + STEP / pursuit.lag * (goal_rate + wish - rate)
    return place + STEP * rate, rate


def swing_at(seed: int, step: int) -> tuple[FloatArray, FloatArray]:
    """Return the lean of an endless swing and its rate, (3,) each, rad and rad/s.

    The seed chooses the swing, see
    `lightpen_extensions.simulator.swings.operator_postures`; a step is `STEP` s from
    the start of the clock.
    """
    block, i = divmod(step, STEPS_PER_PIECE)
    leans = _swing_block(seed, block)
    return leans[i], (leans[i + 1] - leans[i]) / STEP


@lru_cache(maxsize=4)
def _swing_block(seed: int, block: int) -> FloatArray:
    steps = block * STEPS_PER_PIECE + np.arange(STEPS_PER_PIECE + 1.0)
    postures = operator_postures(steps * STEP, seed)
    return lean_vectors(postures.tilts, postures.directions, postures.rolls)


def lean_vectors(
    tilt: FloatArray | float, direction: FloatArray | float, turn: FloatArray | float
) -> FloatArray:
    """Return postures as vectors that are smooth through upright, (..., 3), rad.

    The tilt to the right, the tilt away from the camera, and the turn.
    """
    lean = [tilt * np.cos(direction), tilt * np.sin(direction), turn]
    return np.stack([np.asarray(part, dtype=np.float64) for part in lean], axis=-1)


def postures_of(leans: FloatArray) -> Postures:
    """Return the postures (F, 3), rad, of vectors as returned by `lean_vectors`."""
    sideways, away, turns = leans.T
    return Postures(np.hypot(sideways, away), np.arctan2(away, sideways), turns)


N_REMEMBERED = 16  # moments: an exposure of 0.15 s
PATIENCE = 20.0  # s without an image after which the hand rests until the next

REACTION = 0.25  # s from guidance to movement
SEAT = np.zeros(3)  # mm from the cone, camera frame
HOVER = np.array([0.0, -40.0, 0.0])
AWAY = np.array([420.0, -60.0, -40.0])  # out of the image
UPRIGHT = np.radians([3.0, 0.0, 0.0])  # how a pen is brought: not quite upright
PASSED = 8.0  # mm from a place on the way that is near enough
CAUGHT = 1.0  # mm from which the cone pulls the tip in
ARRIVED = 3.0  # mm
FREE_TREMOR = 0.3  # mm, standard deviation of a tip in the air
FREE_AT = 5.0  # mm from the cone, of full tremor
SLIP_TIME = 0.05  # s that a slip takes

GUIDED = TrackingMotion(gain=3.0, lag=0.13, top_speed=np.radians(30))
SWUNG = TrackingMotion(gain=5.0, lag=0.078, top_speed=np.radians(60))
ARM = TrackingMotion(gain=4.0, lag=0.0975, top_speed=300.0)


class HandActivity(Enum):
    """Activity of the operator in the last image."""

    ABSENT = auto()
    APPROACHING = auto()
    SEATED = auto()
    SWINGING = auto()
    LIFTED = auto()
    LEAVING = auto()


@dataclass(frozen=True, eq=False)
class HandPose:
    """Poses of the pen at given times."""

    postures: Postures  # F of them
    offsets: FloatArray  # (F, 3), tip from the bottom of the cone, camera frame, mm
    covered: frozenset[int]  # numbers of the LEDs behind a hand, from 1
    is_away: bool  # whether the pen is out of the image


class _HeldPose(NamedTuple):
    lean: FloatArray  # tilt times its direction, then turn, rad
    offset: FloatArray  # mm


class _Slip(NamedTuple):
    start: float
    end: float
    offset: FloatArray


class _Cover(NamedTuple):
    start: float
    end: float
    leds: frozenset[int]


class _Wish(NamedTuple):
    due: float  # s
    act: Callable[[], None]
    moves: bool  # the pen, not the hand before it


class SimulatedOperator:
    """A simulated operator who holds a pen of ``n_leds`` LEDs.

    The commands may come from any thread. They take effect at the present time of the
    clock, which makes the movement a function of the seed, the commands and their
    times. Angles as in `lightpen_extensions.simulator.swings`. Unless seated in the
    cone, the pen is out of the image at first.
    """

    def __init__(
        self, clock: Clock, seed: int = 1, *, n_leds: int = 10, seated: bool = False
    ) -> None:
        self._clock = clock
        self._seed = seed
        self._all_leds = frozenset(range(1, n_leds + 1))
        self._rng = np.random.default_rng([seed, 1])
        self._turn_tremor = Tremor(self._rng)
        self._tip_tremor = Tremor(self._rng)
        self._lock = Lock()
        self._wishes: list[_Wish] = []
        self._n_steps = int(clock.now_ns() * 1e-9 / STEP)
        self._lean, self._lean_rate = UPRIGHT.copy(), np.zeros(3)
        self._seat = SEAT  # where the tip rests when it is put down
        place = SEAT if seated else AWAY
        self._offset, self._offset_rate = place.copy(), np.zeros(3)
        self._route: list[FloatArray] = []
        self._place = place
        self._goal: FloatArray | None = UPRIGHT  # None while swinging
        self._pursuit = GUIDED
        self._slips: tuple[_Slip, ...] = ()
        self._covers: tuple[_Cover, ...] = ()
        first = _HeldPose(self._lean, self._offset)
        self._moments = deque([first], maxlen=N_REMEMBERED)

    @property
    def doing(self) -> HandActivity:
        """Activity when the last image was taken."""
        with self._lock:
            if self._route:
                leaves = self._place is not self._seat
                return HandActivity.LEAVING if leaves else HandActivity.APPROACHING
            if self._place is not self._seat:
                return (
                    HandActivity.ABSENT if self._place is AWAY else HandActivity.LIFTED
                )
            return (
                HandActivity.SEATED if self._goal is not None else HandActivity.SWINGING
            )

    @property
    def is_free(self) -> bool:
        """Whether the pen is away and no activity is requested."""
        with self._lock:
            is_wanted = any(wish.moves for wish in self._wishes)
            return self._place is AWAY and not self._route and not is_wanted

    def seat(self) -> None:
        """Seat the tip in the cone and hold the pen still."""
        self.touch(SEAT)

    def touch(self, place: FloatArray) -> None:
        """Put the tip on a place and hold it still.

        The place is from the bottom of the cone in the camera frame, mm.
        """
        self._wish(partial(self._put, place))
        self.hold()

    def lift(self) -> None:
        """Lift the tip and stay above the cone."""
        self._wish(partial(self._go, HOVER))

    def move_away(self) -> None:
        """Move the pen out of the image."""
        self._wish(partial(self._go, AWAY))
        self._wish(partial(self._aim, UPRIGHT, GUIDED))

    def swing(self) -> None:
        """Seat the pen and swing it until another request."""
        self._wish(partial(self._put, SEAT))
        self._wish(partial(self._aim, None, SWUNG))

    def hold(self) -> None:
        """Hold the pen still."""
        self._wish(lambda: self._aim(self._lean, GUIDED))

    def lean_towards(self, tilt: float, direction: float, turn: float) -> None:
        """Tilt the pen to a posture, angles in rad, with human dynamics."""
        goal = lean_vectors(tilt, direction, turn)
        self._wish(partial(self._aim, goal, GUIDED), delay=REACTION)

    def slip(self, distance: float, seconds: float) -> None:
        """Let the tip slip out of the cone by a distance, mm, for some seconds."""
        self._wish(partial(self._slip, distance, seconds))

    def cover(self, seconds: float = inf, leds: Collection[int] | None = None) -> None:
        """Cover LEDs, by their numbers from 1 or all, by a hand for some seconds."""
        hidden = self._all_leds if leds is None else frozenset(leds)
        if not hidden <= self._all_leds:
            raise ValueError(
                f"`leds` must be from 1 to {len(self._all_leds)}, got {sorted(hidden)}."
            )
        self._wish(partial(self._cover, seconds, hidden), moves=False)

    def uncover(self) -> None:
        """Uncover all LEDs."""
        self._wish(self._uncover, moves=False)

    def held(self, times: FloatArray) -> HandPose:
        """Return the pose of the pen at times (F,), s, that never decrease.

        They are over no more than 0.15 s.
        """
        with self._lock:
            self._advance(int(np.floor(times.max() / STEP)) + 1)
            steps = np.clip(
                times / STEP, self._n_steps - len(self._moments) + 1, self._n_steps
            )
            leans, offsets = self._between(steps)
            leans = leans + TREMOR * self._turn_tremor.at(times)
            raised = np.linalg.norm(offsets - self._seat, axis=-1)
            freedom = np.minimum(raised / FREE_AT, 1)
            tremor = FREE_TREMOR * self._tip_tremor.at(times)
            offsets = offsets + freedom[:, None] * tremor
            for slip in self._slips:
                offsets = offsets + _slipped(slip, times)
            return HandPose(
                postures_of(leans),
                offsets,
                self._covered(float(times.mean())),
                not self._route and self._place is AWAY,
            )

    def _wish(
        self, act: Callable[[], None], delay: float = 0.0, *, moves: bool = True
    ) -> None:
        due = self._clock.now_ns() * 1e-9 + delay
        with self._lock:
            self._wishes.append(_Wish(due, act, moves))
            self._wishes.sort(key=lambda wish: wish.due)

    def _advance(self, n_steps: int) -> None:
        patience = round(PATIENCE / STEP)
        self._n_steps = max(self._n_steps, n_steps - patience)
        while self._n_steps < n_steps:
            self._n_steps += 1
            while self._wishes and self._wishes[0].due <= self._time:
                self._wishes.pop(0).act()
            self._move_tip()
            self._move_lean()
            self._moments.append(_HeldPose(self._lean, self._offset))

    @property
    def _time(self) -> float:
        return self._n_steps * STEP

    def _move_tip(self) -> None:
        if not self._route:
            return
        goal, is_last = self._route[0], len(self._route) == 1
        self._offset, self._offset_rate = pursue(
            self._offset, self._offset_rate, goal, np.zeros(3), ARM
        )
        distance = np.linalg.norm(goal - self._offset)
        if goal is self._seat and distance < CAUGHT:
            self._offset, self._offset_rate = goal.copy(), np.zeros(3)
            self._route.clear()
        elif goal is not self._seat and distance < (ARRIVED if is_last else PASSED):
            self._route.pop(0)

    def _move_lean(self) -> None:
        goal, rate = self._goal, np.zeros(3)
        if goal is None:
            if self._route:
                goal = UPRIGHT
            else:
                goal, rate = swing_at(self._seed, self._n_steps)
        self._lean, self._lean_rate = pursue(
            self._lean, self._lean_rate, goal, rate, self._pursuit
        )

    def _put(self, place: FloatArray) -> None:
        self._seat = place
        self._go(place)

    def _go(self, place: FloatArray) -> None:
        if place is self._place:
            return
        self._place = place
        above = self._seat + HOVER
        self._route = [above] if place is HOVER else [above, place]

    def _aim(self, goal: FloatArray | None, pursuit: TrackingMotion) -> None:
        self._goal, self._pursuit = goal, pursuit

    def _slip(self, distance: float, seconds: float) -> None:
        direction = self._rng.standard_normal(3)
        offset = distance * direction / np.linalg.norm(direction)
        slips = tuple(slip for slip in self._slips if slip.end > self._time - 1)
        self._slips = (*slips, _Slip(self._time, self._time + seconds, offset))

    def _cover(self, seconds: float, leds: frozenset[int]) -> None:
        covers = tuple(cover for cover in self._covers if cover.end > self._time - 1)
        self._covers = (*covers, _Cover(self._time, self._time + seconds, leds))

    def _uncover(self) -> None:
        self._covers = ()

    def _covered(self, time: float) -> frozenset[int]:
        hidden: frozenset[int] = frozenset()
        for cover in self._covers:
            if cover.start <= time < cover.end:
                hidden |= cover.leds
        return hidden

    def _between(self, steps: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return leans and offsets between the remembered moments, (F, 3) each."""
        oldest = self._n_steps - len(self._moments) + 1
        known = np.arange(oldest, self._n_steps + 1)
        leans = np.array([moment.lean for moment in self._moments])
        offsets = np.array([moment.offset for moment in self._moments])
        columns = range(3)
        return (
            np.stack([np.interp(steps, known, leans[:, i]) for i in columns], -1),
            np.stack([np.interp(steps, known, offsets[:, i]) for i in columns], -1),
        )


def _slipped(slip: _Slip, times: FloatArray) -> FloatArray:
    """Return the displacement of the tip by a slip, (F, 3), mm."""
    nearer_end = np.minimum(times - slip.start, slip.end - times)
    share = np.clip(nearer_end / SLIP_TIME, 0, 1)
    return np.asarray(share[:, None] * slip.offset)
