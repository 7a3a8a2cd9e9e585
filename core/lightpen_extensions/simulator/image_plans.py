"""The images of a scene: draw everything random, then render.

The seed of a scene determines everything. Each image draws from its own generator, so
that it does not depend on which others are rendered, nor in which order.
"""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, Image
from lightpen.model.camera import Camera
from lightpen.model.ellipse import Ellipses, disc_images
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig, rig_of
from lightpen_extensions.simulator.faces import Dome, Face, HotSpot, Ring
from lightpen_extensions.simulator.render import render_view
from lightpen_extensions.simulator.scenes import Scene, expose
from lightpen_extensions.simulator.swings import (
    Swing,
    leds_in_camera,
    perturbed_pen,
    seen_from,
    shows_all,
    slip_tip,
    swing_poses,
)
from lightpen_extensions.simulator.view import (
    Optics,
    View,
    moving_poses,
    random_finger,
    random_glares,
    random_lamps,
)

LED_DECIMALS = 5  # of a measuring machine's millimetres
MIN_GAIN = 0.93  # of the dimmest LED against the brightest
HOT_DISTANCE = (0.15, 0.45)  # of a hot spot from the middle, in radii
HOT_WIDTH = (0.3, 0.5)
HOT_SHARE = (0.3, 0.7)
DOME_HEIGHT, DOME_DARKENING = 0.35, 0.75
RING_INNER, RING_SOFTNESS, RING_MIDDLE = 0.55, 0.12, 0.15
MAX_MISSING = 4
MOTION = (2.0, 12.0)  # px moved during the exposure
DEFOCUS = (2.0, 5.0)  # px, radius of the blur disc
SATURATED_EXPOSURE = (1.6, 3.0)
DIM_EXPOSURE = (0.1, 0.25)
SLIP = (0.2, 2.0)  # mm
AWAY_SIGMA = 15.0  # px, of an image blurred away
AWAY_MOTION = 120.0  # px
MAX_TIMES = 128  # poses through one exposure

STILL = 0.02  # px moved during the exposure that blur hides

# Independent streams of a seed.
_SWING, _GEOMETRY, _GAINS, _FRAME, _NOISE, _FACES = range(6)


@dataclass(frozen=True, eq=False)
class ImagePlan:
    """One image of a scene before it is rendered."""

    index: int  # from 0
    view: View
    optics: Optics
    rotation: FloatArray  # (3, 3), cam_from_pen at mid-exposure
    translation: FloatArray  # (3,), mm
    flags: tuple[str, ...] = ()  # names of the `Disturbances` this image suffers


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
    rig = rig_of(scene.camera)
    return plan_rig(scene, rig)[0]


def plan_rig(scene: Scene, rig: Rig) -> tuple[ScenePlan, ...]:
    """Draw everything random that several cameras see at once, but the noise.

    The camera of the scene stands for the middle of the rig, from which cam_from_rig
    is; each plan is in the frame of its camera.
    """
    rng = _stream(scene, _SWING)
    stands = list(zip(rig.cameras, rig.rotations, rig.translations, strict=True))

    def shows(swing: Swing) -> BoolArray:
        each = [
            shows_all(camera, scene.pen, seen_from(swing, R, t))
            for camera, R, t in stands
        ]
        return np.asarray(np.all(each, axis=0))

    swing = swing_poses(
        scene.n_images,
        rng,
        scene.swing,
        pen=scene.pen,
        tip_pen=scene.tip_pen,
        cone_cam=scene.cone_cam,
        shows=shows,
    )
    hit = _draw_hits(scene, rng)
    swing = slip_tip(swing, hit["slipped"], rng.uniform(*SLIP, scene.n_images), rng)
    geometry = _stream(scene, _GEOMETRY)
    measured = perturbed_pen(scene.pen, scene.led_noise, geometry)
    measured_pen = replace(
        measured,
        leds=np.round(measured.leds, LED_DECIMALS),
        led_sigma=scene.led_noise or None,
    )
    gains = led_gains(scene)
    flags = [
        tuple(name for name, frames in hit.items() if frames[index])
        for index in range(scene.n_images)
    ]
    plans = []
    for c, (camera, R, t) in enumerate(stands):
        there = seen_from(swing, R, t)
        seen = replace(scene, camera=camera, cone_cam=there.cone_cam, viewpoint=c)
        image_plans = tuple(
            _plan_image(seen, there, gains, index, flags[index])
            for index in range(scene.n_images)
        )
        plans.append(ScenePlan(seen, there, measured_pen, gains, image_plans))
    return tuple(plans)


def render_plan(scene: Scene, image_plan: ImagePlan) -> Image:
    """Render a planned image; deterministic."""
    light = render_view(scene.camera, scene.pen, image_plan.view, image_plan.optics)
    return expose(light, scene.sensor, _image_stream(scene, _NOISE, image_plan.index))


def led_gains(scene: Scene) -> FloatArray:
    """Return the relative brightness of each LED of the scene's pen."""
    rng = _stream(scene, _GAINS)
    return rng.uniform(MIN_GAIN, 1, scene.pen.n_leds)


def led_faces(scene: Scene) -> tuple[Face, ...]:
    """Return the luminance pattern of each LED; empty if all are uniform."""
    rng = _stream(scene, _FACES)
    match scene.faces:
        case "even":
            return ()
        case "hot-spot":
            return tuple(_random_hot_spot(rng) for _ in scene.pen.leds)
        case "dome":
            return (Dome(DOME_HEIGHT, DOME_DARKENING),) * scene.pen.n_leds
        case "ring":
            return (Ring(RING_INNER, RING_SOFTNESS, RING_MIDDLE),) * scene.pen.n_leds


def _random_hot_spot(rng: np.random.Generator) -> HotSpot:
    distance, direction = rng.uniform(*HOT_DISTANCE), rng.uniform(0, 2 * np.pi)
    place = distance * np.cos(direction), distance * np.sin(direction)
    return HotSpot(place, rng.uniform(*HOT_WIDTH), rng.uniform(*HOT_SHARE))


def _stream(scene: Scene, *path: int) -> np.random.Generator:
    return np.random.Generator(np.random.SFC64([scene.seed, *path]))


def _image_stream(scene: Scene, what: int, index: int) -> np.random.Generator:
    viewpoint = (scene.viewpoint,) if scene.viewpoint else ()
    return _stream(scene, what, index, *viewpoint)


def _draw_hits(scene: Scene, rng: np.random.Generator) -> dict[str, BoolArray]:
    """Return the images affected by each disturbance.

    Spoilt images suffer nothing else; none is both saturated and dim.
    """
    wanted = scene.disturbances
    n = scene.n_images
    hits: dict[str, BoolArray] = {}

    def hit(pool: BoolArray, *names: str) -> None:
        order = rng.permutation(np.flatnonzero(pool))
        for name in names:
            n_hit = round(getattr(wanted, name) * n)
            hits[name] = np.zeros(n, dtype=bool)
            hits[name][order[:n_hit]] = True
            order = order[n_hit:]

    hit(np.ones(n, dtype=bool), "empty", "blurred_away", "slipped")
    sound = ~hits["empty"] & ~hits["blurred_away"]
    hit(sound, "saturated", "dim")
    for name in ("clutter", "fingers", "missing", "motion_blur", "defocus"):
        hit(sound, name)
    return hits


def _plan_image(
    scene: Scene, swing: Swing, gains: FloatArray, index: int, flags: tuple[str, ...]
) -> ImagePlan:
    rng = _image_stream(scene, _FRAME, index)
    rotation, translation = swing.rotations[index], swing.translations[index]
    moved = 0.0
    optics = scene.optics
    if "motion_blur" in flags:
        moved = rng.uniform(*MOTION)
    if "blurred_away" in flags:
        moved = AWAY_MOTION
        optics = replace(optics, psf_sigma=AWAY_SIGMA)
    still = replace(scene, optics=_disturbed_optics(optics, flags, rng))
    turn = _turn_that_moves(still, rotation, translation, moved, rng)
    image_plan = plan_in_motion(still, index, rotation, translation, turn)
    view = _disturbed_view(
        replace(image_plan.view, gains=gains),
        _discs(scene, image_plan),
        scene.camera,
        flags,
        rng,
    )
    return replace(image_plan, view=view, flags=flags)


def _disturbed_optics(
    optics: Optics, flags: tuple[str, ...], rng: np.random.Generator
) -> Optics:
    if "defocus" in flags:
        optics = replace(optics, defocus_radius=rng.uniform(*DEFOCUS))
    if "saturated" in flags:
        brighter = rng.uniform(*SATURATED_EXPOSURE)
        optics = replace(optics, exposure=optics.exposure * brighter)
    if "dim" in flags:
        dimmer = rng.uniform(*DIM_EXPOSURE)
        optics = replace(optics, exposure=optics.exposure * dimmer)
    return optics


def _disturbed_view(
    view: View,
    discs: Ellipses,
    camera: Camera,
    flags: tuple[str, ...],
    rng: np.random.Generator,
) -> View:
    n_leds = len(view.gains)
    if "empty" in flags:
        return replace(view, gains=np.zeros(n_leds))
    if "missing" in flags:
        gains = view.gains.copy()
        n_missing = rng.integers(1, min(MAX_MISSING, max(n_leds - 4, 1)) + 1)
        gains[rng.permutation(n_leds)[:n_missing]] = 0
        view = replace(view, gains=gains)
    if "clutter" in flags:
        lamps = random_lamps(camera, discs, rng)
        glares = random_glares(camera, discs, rng)
        view = replace(view, lamps=view.lamps + lamps, glares=glares)
    if "fingers" in flags:
        view = replace(view, fingers=(random_finger(discs, rng),))
    return view


def _discs(scene: Scene, image_plan: ImagePlan) -> Ellipses:
    leds, normals = leds_in_camera(
        scene.pen, image_plan.rotation, image_plan.translation
    )
    return disc_images(scene.camera, leds, normals, scene.pen.diameter / 2)


def _turn_that_moves(
    scene: Scene,
    rotation: FloatArray,
    translation: FloatArray,
    moved: float,
    rng: np.random.Generator,
) -> FloatArray:
    """Return a random rotation about the tip that moves LEDs by a distance."""
    turn = rng.standard_normal(3)
    per_radian = _pixels_moved(scene, rotation, translation, turn)
    return np.asarray(turn * moved / per_radian)


def _pixels_moved(
    scene: Scene, rotation: FloatArray, translation: FloatArray, turn: FloatArray
) -> float:
    """Return the largest LED displacement by a rotation about the tip, px."""
    leds, _ = leds_in_camera(scene.pen, rotation, translation)
    tip_cam = rotation @ scene.tip_pen + translation
    moves = np.cross(turn, leds - tip_cam)
    jacobian = scene.camera.project_with_jacobian(leds).jacobian
    pixels = np.einsum("lij,lj->li", jacobian, moves)
    return float(np.linalg.norm(pixels, axis=-1).max())


def plan_in_motion(
    scene: Scene,
    index: int,
    rotation: FloatArray,
    translation: FloatArray,
    turn: FloatArray,
) -> ImagePlan:
    """Return the plan of a pen that turns about its tip during the exposure."""
    moved = _pixels_moved(scene, rotation, translation, turn)
    n_times = 1
    if moved > STILL:
        n_times = min(3 + int(moved / scene.optics.psf_sigma), MAX_TIMES)
    rotations, translations = moving_poses(
        rotation, translation, scene.tip_pen, turn, n_times
    )
    view = View(rotations, translations, led_gains(scene), faces=led_faces(scene))
    return ImagePlan(index, view, scene.optics, rotation, translation)
