"""Swings that no careful operator makes all of: by hand, about one axis, upright."""

from typing import Literal, TypeAlias

import numpy as np

from lightpen_extensions.simulator.image_plans import (
    SWING,
    ScenePlan,
    plan_swing,
    stream,
    swing_of,
)
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import (
    MAX_TILT,
    PAPER_CONE,
    PAPER_TIP,
    Postures,
    Swing,
    operator_postures,
    random_postures,
    swing_from_postures,
    swing_poses,
)

SwingKind: TypeAlias = Literal["field", "operator", "one-axis", "upright"]

UPRIGHT_TILT = np.radians(1.5)  # far too little to fix the tip
FRAME_RATE = 20.0  # images per second of the operator's swing


def draw_postures(n: int, rng: np.random.Generator, kind: SwingKind) -> Postures:
    """Return ``n`` postures of a kind of swing.

    ``operator``: a hand's smooth movement at `FRAME_RATE`. ``one-axis`` and ``upright``
    (hardly tilted) do not fix the tip.
    """
    start = rng.uniform(0, 2 * np.pi)
    match kind:
        case "operator":
            seed = int(rng.integers(2**31))
            return operator_postures(np.arange(n) / FRAME_RATE, seed)
        case "one-axis":
            tilts = MAX_TILT * (2 * (np.arange(n) + 0.5) / n - 1)
            return Postures(tilts, np.full(n, start), np.zeros(n))
        case "upright":
            drawn, shrink = random_postures(n, rng), UPRIGHT_TILT / MAX_TILT
            tilts, rolls = drawn.tilts * shrink, drawn.rolls * shrink
            return Postures(tilts, drawn.directions, rolls)
        case "field":
            raise ValueError("Postures all round are those of `swing_poses`.")


def swing_of_kind(n_frames: int, rng: np.random.Generator, kind: SwingKind) -> Swing:
    """Return a swing of the paper's pen before the paper's camera."""
    if kind == "field":
        return swing_poses(n_frames, rng)
    return swing_from_postures(
        draw_postures(n_frames, rng, kind), PAPER_TIP, PAPER_CONE
    )


def scene_swing(scene: Scene, rng: np.random.Generator, kind: SwingKind) -> Swing:
    """Return the swing of a kind of a scene."""
    if kind == "field":
        return swing_of(scene, rng)
    return swing_from_postures(
        draw_postures(scene.n_images, rng, kind), scene.tip_pen, scene.cone_cam
    )


def plan_kind(scene: Scene, kind: SwingKind) -> ScenePlan:
    """Draw everything random of a scene with a kind of swing but the noise."""
    return plan_swing(scene, scene_swing(scene, stream(scene, SWING), kind))
