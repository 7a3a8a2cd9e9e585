"""The images of a scene: draw everything random, then render.

The seed of a scene determines everything. Each image draws from its own generator, so
that it does not depend on which others are rendered, nor in which order.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, Image
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig, rig_of
from lightpen_extensions.simulator.render import Optics, View, render_view
from lightpen_extensions.simulator.scenes import Scene, expose
from lightpen_extensions.simulator.swings import (
    Swing,
    perturbed_pen,
    seen_from,
    shows_all,
    swing_poses,
)

LED_DECIMALS = 5  # of a measuring machine's millimetres
MIN_GAIN = 0.93  # of the dimmest LED against the brightest

# Independent streams of a seed.
SWING, _GEOMETRY, _GAINS, FRAME, _NOISE = range(5)


@dataclass(frozen=True, eq=False)
class ImagePlan:
    """One image of a scene before it is rendered."""

    index: int  # from 0
    view: View
    optics: Optics
    rotation: FloatArray  # (3, 3), cam_from_pen at mid-exposure
    translation: FloatArray  # (3,), mm


@dataclass(frozen=True, eq=False)
class ScenePlan:
    """A scene with everything random drawn, ready to be rendered."""

    scene: Scene
    swing: Swing  # the truth
    measured_pen: Pen  # as its geometry was measured
    gains: FloatArray  # (L,), brightness of each LED
    image_plans: tuple[ImagePlan, ...]


def plan_scene(scene: Scene) -> ScenePlan:
    """Draw everything random of a scene but the noise; always the same."""
    return plan_rig(scene, rig_of(scene.camera))[0]


def plan_rig(scene: Scene, rig: Rig) -> tuple[ScenePlan, ...]:
    """Draw everything random that several cameras see at once, but the noise.

    The camera of the scene stands for the middle of the rig, from which cam_from_rig
    is; each plan is in the frame of its camera.
    """
    stands = list(zip(rig.cameras, rig.rotations, rig.translations, strict=True))

    def shows(swing: Swing) -> BoolArray:
        each = [
            shows_all(camera, scene.pen, seen_from(swing, R, t))
            for camera, R, t in stands
        ]
        return np.asarray(np.all(each, axis=0))

    swing = swing_of(scene, stream(scene, SWING), shows)
    plans = []
    for c, (camera, R, t) in enumerate(stands):
        there = seen_from(swing, R, t)
        seen = replace(scene, camera=camera, cone_cam=there.cone_cam, viewpoint=c)
        plans.append(plan_swing(seen, there))
    return tuple(plans)


def swing_of(
    scene: Scene,
    rng: np.random.Generator,
    shows: Callable[[Swing], BoolArray] | None = None,
) -> Swing:
    """Draw the swing of a scene; for ``shows`` see `swings.swing_poses`."""
    return swing_poses(
        scene.n_images,
        rng,
        pen=scene.pen,
        camera=scene.camera,
        tip_pen=scene.tip_pen,
        cone_cam=scene.cone_cam,
        shows=shows,
    )


def plan_swing(scene: Scene, swing: Swing) -> ScenePlan:
    """Return the plan of a scene with a swing, in which the pen rests in each image."""
    measured = perturbed_pen(scene.pen, scene.led_noise, stream(scene, _GEOMETRY))
    leds = np.round(measured.leds, LED_DECIMALS)
    measured_pen = replace(measured, leds=leds, led_sigma=scene.led_noise or None)
    gains = led_gains(scene)
    image_plans = tuple(
        ImagePlan(i, View(R[None], t[None], gains), scene.optics, R, t)
        for i, (R, t) in enumerate(
            zip(swing.rotations, swing.translations, strict=True)
        )
    )
    return ScenePlan(scene, swing, measured_pen, gains, image_plans)


def render_plan(scene: Scene, image_plan: ImagePlan) -> Image:
    """Render a planned image; deterministic."""
    light = render_view(scene.camera, scene.pen, image_plan.view, image_plan.optics)
    return expose(light, scene.sensor, image_stream(scene, _NOISE, image_plan.index))


def led_gains(scene: Scene) -> FloatArray:
    """Return the relative brightness of each LED of the scene's pen."""
    rng = stream(scene, _GAINS)
    return rng.uniform(MIN_GAIN, 1, scene.pen.n_leds)


def stream(scene: Scene, *path: int) -> np.random.Generator:
    """Return an independent generator of a scene."""
    return np.random.Generator(np.random.SFC64([scene.seed, *path]))


def image_stream(scene: Scene, what: int, index: int) -> np.random.Generator:
    """Return an independent generator of an image, from 0, of one camera."""
    viewpoint = (scene.viewpoint,) if scene.viewpoint else ()
    return stream(scene, what, index, *viewpoint)
