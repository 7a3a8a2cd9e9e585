"""Postures of the pen, and swing patterns.

A posture is the tilt of the pen, the direction it tilts to and its roll. Upright, the
pen's y axis points up in the image and its discs face the camera:

    R = A(tilt, direction) diag(1, -1, -1) Ry(roll),

where A turns the image's up direction the short way to the direction of the pen,
``(sin(tilt) cos(direction), -cos(tilt), sin(tilt) sin(direction))`` in camera
coordinates.
"""

from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.posture import FACING, moved_from

SwingKind: TypeAlias = Literal["field", "cone", "operator", "one-axis", "upright"]
SWING_KINDS: tuple[SwingKind, ...] = get_args(SwingKind)

MAX_TILT = np.radians(33)
MAX_ROLL = np.radians(32)
CONE_TILT = np.radians(28)
UPRIGHT_TILT = np.radians(1.5)  # far too little to fix the tip
FRAME_RATE = 20.0  # images per second of the operator's swing
TREMOR = np.radians(0.1)
TREMOR_BAND = (7.0, 12.0)  # Hz, of a human hand


@dataclass(frozen=True, eq=False)
class Postures:
    """Postures of a pen, one per frame."""

    tilts: FloatArray  # (F,), of the pen's y axis from the image's up direction, rad
    directions: FloatArray  # (F,), rad: 0 to the right, pi/2 away from the camera
    rolls: FloatArray  # (F,), turn about the pen's y axis, rad

    def __len__(self) -> int:
        return len(self.tilts)

    @property
    def rotations(self) -> FloatArray:
        """Rotations of cam_from_pen, (F, 3, 3)."""
        return moved_from(FACING, self.tilts, self.directions, self.rolls)


def random_postures(n: int, rng: np.random.Generator) -> Postures:
    """Return ``n`` postures that fill the range of tilts and rolls evenly."""
    return Postures(
        MAX_TILT * np.sqrt(rng.random(n)),
        rng.uniform(0, 2 * np.pi, n),
        rng.uniform(-MAX_ROLL, MAX_ROLL, n),
    )


def draw_postures(n: int, rng: np.random.Generator, kind: SwingKind) -> Postures:
    """Return ``n`` postures of a kind of swing.

    ``field``: random all round. ``cone``: constant tilt that goes round once, with
    roll. ``operator``: a hand's smooth movement at `FRAME_RATE`. ``one-axis`` and
    ``upright`` (hardly tilted) do not fix the tip.
    """
    steps = (np.arange(n) + 0.5) / max(n, 1)
    start = rng.uniform(0, 2 * np.pi)
    zero = np.zeros(n)
    match kind:
        case "field":
            return random_postures(n, rng)
        case "cone":
            # The golden ratio keeps roll and direction from repeating together.
            rolls = MAX_ROLL * (2 * np.mod(np.arange(n) * 0.618034, 1) - 1)
            return Postures(zero + CONE_TILT, start + 2 * np.pi * steps, rolls)
        case "operator":
            seed = int(rng.integers(2**31))
            return operator_postures(np.arange(n) / FRAME_RATE, seed)
        case "one-axis":
            return Postures(MAX_TILT * (2 * steps - 1), zero + start, zero)
        case "upright":
            drawn = random_postures(n, rng)
            shrink = UPRIGHT_TILT / MAX_TILT
            return Postures(
                drawn.tilts * shrink, drawn.directions, drawn.rolls * shrink
            )
        case _:
            raise ValueError(f"`kind` must be one of {SWING_KINDS}, got {kind!r}.")


def operator_postures(times: FloatArray, seed: int = 0) -> Postures:
    """Return the postures of the pen in an operator's hand at times (F,), s.

    The pen goes round the cone in some seven seconds while its tilt and roll vary at
    rates of their own; the hand trembles by `TREMOR`. A smooth function of time: the
    same seed continues the same movement.
    """
    rng = np.random.default_rng(seed)
    phases = rng.uniform(0, 2 * np.pi, 3)
    tilt_period, round_period, roll_period = rng.uniform(0.85, 1.15, 3) * (11, 7, 4.5)

    def wave(period: float, phase: float) -> FloatArray:
        return np.asarray(np.sin(2 * np.pi * times / period + phase))

    tilts = np.radians(20) + np.radians(11) * wave(tilt_period, phases[0])
    directions = phases[1] + 2 * np.pi * times / round_period
    rolls = np.radians(27) * wave(roll_period, phases[2])
    tremors = [_tremor(times, rng) for _ in range(3)]
    return Postures(tilts + tremors[0], directions + tremors[1], rolls + tremors[2])


def _tremor(times: FloatArray, rng: np.random.Generator) -> FloatArray:
    rates = rng.uniform(*TREMOR_BAND, 4)
    phases = rng.uniform(0, 2 * np.pi, 4)
    waves = np.sin(2 * np.pi * np.outer(times, rates) + phases)
    return np.asarray(TREMOR / np.sqrt(2) * waves.sum(axis=-1))
