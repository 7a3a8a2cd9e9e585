"""Hand motion: tracking a goal, tremor, endless swing.

A hand goes after a goal x* with a limited speed and a lag,

    x'' = (w - x') / lag,    w = x*' + clip(gain (x* - x), top speed),

which is a damping of ``1 / (2 sqrt(gain lag))``: 0.8 overshoots by some two per cent.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from lightpen.arrays import FloatArray
from lightpen_extensions.simulator.postures import (
    TREMOR_BAND,
    Postures,
    operator_postures,
)

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
    `lightpen_extensions.simulator.postures.operator_postures`; a step is `STEP` s from
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
