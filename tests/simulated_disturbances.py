"""Disturbed scenes: stray lights, fingers, missing LEDs, blur, slips, bad exposure.

Drawn by the same seed as the scene, and added to its plan.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from tests.simulated_lights import Defocus, Lamp
from tests.simulated_swings import SwingKind, scene_swing

from lightpen.arrays import BoolArray, FloatArray
from lightpen.model.camera import Camera
from lightpen.model.ellipse import Ellipses, disc_images
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.image_plans import (
    FRAME,
    SWING,
    ImagePlan,
    ScenePlan,
    image_stream,
    led_gains,
    plan_swing,
    stream,
)
from lightpen_extensions.simulator.render import (
    LightArray,
    Optics,
    View,
    Window,
    clipped,
    disc_contours,
)
from lightpen_extensions.simulator.scene_files import write_set
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import Swing, leds_in_camera

CAP_STEPS = 16  # corners of a round finger end
OUTLINE_BITS = 6  # fraction bits of OpenCV's polygon corners
HIDDEN_SAMPLES = 8  # per pixel and axis
POLYGON_SAMPLES = 4
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


@dataclass(frozen=True)
class Disturbances:
    """Fractions of the images that are disturbed, each 0 to 1."""

    clutter: float = 0.0  # foreign lamps, reflections, bright windows
    fingers: float = 0.0  # a finger before an LED
    missing: float = 0.0  # one to four LEDs off
    motion_blur: float = 0.0
    defocus: float = 0.0
    saturated: float = 0.0
    dim: float = 0.0
    slipped: float = 0.0  # the tip is 0.2 to 2 mm out of the cone
    blurred_away: float = 0.0  # moved so fast that nothing can be measured
    empty: float = 0.0  # all LEDs off

    def __post_init__(self) -> None:
        for item in fields(self):
            fraction = getattr(self, item.name)
            if not 0 <= fraction <= 1:
                raise ValueError(
                    f"`{item.name}` must be a fraction from 0 to 1, got {fraction}."
                )
        if self.slipped + self.blurred_away + self.empty > 1:
            raise ValueError(
                "`slipped`, `blurred_away` and `empty` must not exceed 1 together."
            )


HARD = Disturbances(
    clutter=0.6,
    fingers=0.2,
    missing=0.25,
    motion_blur=0.2,
    defocus=0.15,
    saturated=0.12,
    dim=0.15,
    slipped=0.02,
    blurred_away=0.02,
    empty=0.02,
)


@dataclass(frozen=True, eq=False)
class Glare:
    """A reflection or a bright window: a polygon with soft edges."""

    outline: FloatArray  # (N, 2), corners, px
    level: float  # fraction of full scale
    softness: float = 1.0  # standard deviation of its edges, px

    def draw(self, levels: LightArray, optics: Optics) -> list[Window]:
        """Add its light."""
        window = _window_round(levels, self.outline, self.softness)
        if window is None:
            return []
        mask = _soft_polygon(window, self.outline, self.softness)
        levels[window.slices] += np.float32(self.level * optics.exposure) * mask
        return [window]


@dataclass(frozen=True, eq=False)
class Finger:
    """A dark capsule in front of the pen."""

    start: FloatArray  # (2,), of its axis, px
    end: FloatArray  # (2,), px
    radius: float  # px
    softness: float = 1.5  # standard deviation of its edges, px

    @property
    def outline(self) -> FloatArray:
        """Corners of its outline, px."""
        axis = self.end - self.start
        heading = np.arctan2(axis[1], axis[0])
        half_turn = np.linspace(-np.pi / 2, np.pi / 2, CAP_STEPS) + heading
        cap = self.radius * np.stack([np.cos(half_turn), np.sin(half_turn)], axis=-1)
        return np.concatenate([self.end + cap, self.start - cap])

    def draw(self, levels: LightArray, optics: Optics) -> list[Window]:
        """Hide what is behind it."""
        window = _window_round(levels, self.outline, self.softness)
        if window is not None:
            mask = _soft_polygon(window, self.outline, self.softness)
            levels[window.slices] *= 1 - mask
        return []


@dataclass(frozen=True, eq=False)
class DisturbedImage(ImagePlan):
    """A disturbed image before it is rendered."""

    flags: tuple[str, ...] = ()  # names of the `Disturbances` it suffers


def plan_disturbed(
    scene: Scene, disturbances: Disturbances = HARD, kind: SwingKind = "field"
) -> ScenePlan:
    """Draw everything random of a disturbed scene but the noise; always the same.

    Its images are `DisturbedImage`.
    """
    rng, n = stream(scene, SWING), scene.n_images
    swing = scene_swing(scene, rng, kind)
    hit = _draw_hits(disturbances, n, rng)
    swing = slip_tip(swing, hit["slipped"], rng.uniform(*SLIP, n), rng)
    plan = plan_swing(scene, swing)
    flags = [tuple(name for name, own in hit.items() if own[i]) for i in range(n)]
    image_plans = tuple(
        _plan_image(scene, swing, plan.gains, i, flags[i]) for i in range(n)
    )
    return replace(plan, image_plans=image_plans)


def flags_of(image_plan: ImagePlan) -> tuple[str, ...]:
    """Return the names of the disturbances of an image."""
    return image_plan.flags if isinstance(image_plan, DisturbedImage) else ()


def write_disturbed(
    scene: Scene, folder: Path, disturbances: Disturbances = HARD
) -> None:
    """Write a disturbed set with flags in its truth; fingers may hide LEDs."""
    plan = plan_disturbed(scene, disturbances)
    write_set(plan, folder)
    file = folder / "truth.json"
    truth = json.loads(file.read_text(encoding="utf-8"))
    for frame, image_plan in zip(truth["frames"], plan.image_plans, strict=True):
        frame["flags"] = list(flags_of(image_plan))
        hidden = hidden_fractions(scene, image_plan)
        for led, share in zip(frame["leds"], hidden, strict=True):
            led["visible"] = led["visible"] and bool(share < 1)
    file.write_text(json.dumps(truth), encoding="utf-8")


def hidden_fractions(scene: Scene, image_plan: ImagePlan) -> list[float]:
    """Return the share of each LED that is hidden, as of `hidden_fraction`."""
    pen, optics = scene.pen, scene.optics
    leds, normals = leds_in_camera(pen, image_plan.rotation, image_plan.translation)
    contours = disc_contours(
        scene.camera, leds[None], normals[None], pen.diameter / 2, optics.psf_sigma
    )
    fingers = [each for each in image_plan.view.others if isinstance(each, Finger)]
    return [hidden_fraction(scene.camera, own, fingers) for own in contours.nodes]


def slip_tip(
    swing: Swing,
    frames: BoolArray,
    distances: FloatArray | float,
    rng: np.random.Generator,
) -> Swing:
    """Return the swing with the tip out of the cone in the frames of a mask (F,).

    It is off the bottom of the cone by the distances, mm, in a random direction.
    """
    directions = rng.standard_normal(swing.tips_cam.shape)
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    lengths = np.where(frames, distances, 0.0)
    offsets = directions * lengths[:, None]
    return replace(
        swing,
        tips_cam=swing.tips_cam + offsets,
        translations=swing.translations + offsets,
    )


def _draw_hits(
    wanted: Disturbances, n: int, rng: np.random.Generator
) -> dict[str, BoolArray]:
    """Return the images affected by each disturbance.

    Spoilt images suffer nothing else; none is both saturated and dim.
    """
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
) -> DisturbedImage:
    rng = image_stream(scene, FRAME, index)
    rotation, translation = swing.rotations[index], swing.translations[index]
    moved = 0.0
    optics = scene.optics
    if "motion_blur" in flags:
        moved = rng.uniform(*MOTION)
    if "blurred_away" in flags:
        moved = AWAY_MOTION
        optics = replace(optics, psf_sigma=AWAY_SIGMA)
    blur = (Defocus(rng.uniform(*DEFOCUS)),) if "defocus" in flags else ()
    still = replace(scene, optics=_disturbed_optics(optics, flags, rng))
    turn = _turn_that_moves(still, rotation, translation, moved, rng)
    image_plan = plan_in_motion(still, index, rotation, translation, turn)
    view = _disturbed_view(
        replace(image_plan.view, gains=gains, others=blur),
        _discs(scene, image_plan),
        scene.camera,
        flags,
        rng,
    )
    return DisturbedImage(
        image_plan.index,
        view,
        image_plan.optics,
        image_plan.rotation,
        image_plan.translation,
        flags,
    )


def _disturbed_optics(
    optics: Optics, flags: tuple[str, ...], rng: np.random.Generator
) -> Optics:
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
        view = replace(view, others=(*lamps, *view.others, *glares))
    if "fingers" in flags:
        view = replace(view, others=(*view.others, random_finger(discs, rng)))
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
    view = View(rotations, translations, led_gains(scene))
    return ImagePlan(index, view, scene.optics, rotation, translation)


def moving_poses(
    rotation: FloatArray,
    translation: FloatArray,
    pivot_pen: FloatArray,
    turn: FloatArray,
    n_times: int,
) -> tuple[FloatArray, FloatArray]:
    """Return S poses, (S, 3, 3) and (S, 3), of a pen that turns during the exposure.

    It turns about the point ``pivot_pen`` (3,), mm, from the pose cam_from_pen at
    mid-exposure; ``turn`` (3,) is the rotation vector of the whole exposure in the
    camera frame, rad. ``n_times`` poses suffice if the LEDs move no more than the blur
    between two.
    """
    parts = (np.arange(n_times) + 0.5) / n_times - 0.5
    rotations = rotation_from_vector(parts[:, None] * turn) @ rotation
    pivot_cam = rotation @ pivot_pen + translation
    return rotations, pivot_cam - rotations @ pivot_pen


MAX_TRIES = 30
CLEARANCE = 6.0  # px between a foreign light and a disc
MAX_LAMPS = 4
WINDOW_CHANCE = 0.3
BETWEEN_CHANCE = 0.5
BLOB_CORNERS = 9


def random_lamps(
    camera: Camera, discs: Ellipses, rng: np.random.Generator
) -> tuple[Lamp, ...]:
    """Return one to four stray lamps clear of L discs, px, often one between them."""
    lamps = []
    radius = _reaches(discs).mean()
    if rng.random() < BETWEEN_CHANCE:
        size = radius * rng.uniform(0.4, 1.2)
        place = _clear_place(discs, size, lambda: _place_between(discs, rng))
        if place is not None:
            lamps.append(_lamp(place, size, rng))
    for _ in range(rng.integers(1, MAX_LAMPS)):
        size = radius * np.exp(rng.uniform(np.log(0.2), np.log(2.5)))
        place = _clear_place(discs, size, lambda: _place_anywhere(camera, rng))
        if place is not None:
            lamps.append(_lamp(place, size, rng))
    return tuple(lamps)


def random_glares(
    camera: Camera, discs: Ellipses, rng: np.random.Generator
) -> tuple[Glare, ...]:
    """Return up to two ragged reflections and sometimes a bright window."""
    glares = []
    for _ in range(rng.integers(3)):
        length = _reaches(discs).mean() * rng.uniform(1, 6)
        place = _clear_place(discs, length, lambda: _place_anywhere(camera, rng))
        if place is not None:
            outline = place + _ragged_outline(length, rng)
            glares.append(
                Glare(outline, rng.uniform(0.1, 1.2), softness=rng.uniform(1, 5))
            )
    if rng.random() < WINDOW_CHANCE:
        glares.append(_window(camera, discs, rng))
    return tuple(glares)


def random_finger(discs: Ellipses, rng: np.random.Generator) -> Finger:
    """Return a finger that hides one disc, or part of it, from the side of the pen."""
    reach = _reaches(discs).mean()
    radius = reach * rng.uniform(1.0, 1.7)
    target = discs.centers[rng.integers(len(discs.centers))]
    middle = discs.centers.mean(axis=0)
    pen_axis = np.linalg.svd(discs.centers - middle)[2][0]
    across = np.array([-pen_axis[1], pen_axis[0]])
    if (target - middle) @ across < 0:
        across = -across
    tilt = rng.uniform(-0.4, 0.4)
    heading = np.cos(tilt) * across + np.sin(tilt) * pen_axis
    tip = target + heading * rng.uniform(-0.5, 0.9) * (radius + reach)
    return Finger(tip, tip + heading * 30 * reach, radius)


def _lamp(place: FloatArray, size: float, rng: np.random.Generator) -> Lamp:
    semi_axes = (size, size * rng.uniform(0.7, 1.0))
    return Lamp(place, semi_axes, rng.uniform(0, np.pi), rng.uniform(0.15, 1.3))


def _reaches(discs: Ellipses) -> FloatArray:
    """Return the semi-major axes of the discs, px."""
    return np.asarray(2 * np.sqrt(np.linalg.eigvalsh(discs.shapes)[..., 1]))


def _clear_place(
    discs: Ellipses, size: float, draw: Callable[[], FloatArray]
) -> FloatArray | None:
    """Draw places until a light of ``size`` there is clear of all discs."""
    needed = _reaches(discs) + size + CLEARANCE
    for _ in range(MAX_TRIES):
        place = draw()
        if np.all(np.linalg.norm(discs.centers - place, axis=-1) > needed):
            return place
    return None


def _place_anywhere(camera: Camera, rng: np.random.Generator) -> FloatArray:
    return np.asarray(rng.random(2) * np.array(camera.image_size))


def _place_between(discs: Ellipses, rng: np.random.Generator) -> FloatArray:
    pair = rng.permutation(len(discs.centers))[:2]
    jitter = _reaches(discs).mean() * rng.standard_normal(2)
    return np.asarray(discs.centers[pair].mean(axis=0) + jitter)


def _ragged_outline(length: float, rng: np.random.Generator) -> FloatArray:
    angles = np.arange(BLOB_CORNERS) * 2 * np.pi / BLOB_CORNERS
    radii = length * rng.uniform(0.4, 1.0, BLOB_CORNERS)
    slim = rng.uniform(0.15, 0.8)
    turn = rng.uniform(0, np.pi)
    along = radii * np.cos(angles)
    across = slim * radii * np.sin(angles)
    return np.stack(
        [
            along * np.cos(turn) - across * np.sin(turn),
            along * np.sin(turn) + across * np.cos(turn),
        ],
        axis=-1,
    )


def _window(camera: Camera, discs: Ellipses, rng: np.random.Generator) -> Glare:
    """Return a bright quadrilateral on the side where the pen leaves more room."""
    margin = _reaches(discs).max() + 10 * CLEARANCE
    left = discs.centers[:, 0].min() - margin
    right = discs.centers[:, 0].max() + margin
    if left > camera.width - right:
        inner, outer = left, left - rng.uniform(0.3, 1.2) * left
    else:
        room = camera.width - right
        inner, outer = right, right + rng.uniform(0.3, 1.2) * room
    top, bottom = np.sort(rng.uniform(-0.2, 1.2, 2)) * camera.height
    corners = np.array([[inner, top], [outer, top], [outer, bottom], [inner, bottom]])
    slant = rng.uniform(-0.1, 0.1, (4, 2)) * abs(outer - inner)
    slant[[0, 3], 0] = np.sign(outer - inner) * np.abs(slant[[0, 3], 0])
    return Glare(corners + slant, rng.uniform(0.2, 1.3), softness=rng.uniform(1, 8))


def hidden_fraction(
    camera: Camera, outline: FloatArray, fingers: Sequence[Finger]
) -> float:
    """Return the fraction of the area of an outline (N, 2), px, that is hidden.

    Fingers or the border hide it. To about 0.002 for discs of 40 px.
    """
    top_left = np.floor(outline.min(axis=0)).astype(int) - 1
    right, bottom = np.ceil(outline.max(axis=0)).astype(int) + 2
    window = Window(int(top_left[1]), int(bottom), int(top_left[0]), int(right))
    width, height = camera.width - 0.5, camera.height - 0.5
    sensor = np.array([[-0.5, -0.5], [width, -0.5], [width, height], [-0.5, height]])
    whole = _fine_polygon(window, outline, HIDDEN_SAMPLES)
    shown = whole & _fine_polygon(window, sensor, HIDDEN_SAMPLES)
    for finger in fingers:
        shown &= ~_fine_polygon(window, finger.outline, HIDDEN_SAMPLES)
    return 1 - np.count_nonzero(shown) / np.count_nonzero(whole)


def _window_round(
    levels: LightArray, outline: FloatArray, softness: float
) -> Window | None:
    left, top = np.floor(outline.min(axis=0) - 4 * softness - 1).astype(int)
    right, bottom = np.ceil(outline.max(axis=0) + 4 * softness + 2).astype(int)
    return clipped(levels, Window(top, bottom, left, right))


def _soft_polygon(window: Window, outline: FloatArray, softness: float) -> LightArray:
    fine = _fine_polygon(window, outline, POLYGON_SAMPLES)
    size = (window.right - window.left, window.bottom - window.top)
    covered = cv2.resize(fine, size, interpolation=cv2.INTER_AREA)
    soft = cv2.GaussianBlur(
        covered.astype(np.float32), (0, 0), softness, borderType=cv2.BORDER_REPLICATE
    )
    return np.asarray(soft / 255, dtype=np.float32)


def _fine_polygon(
    window: Window, outline: FloatArray, samples: int
) -> npt.NDArray[np.uint8]:
    """Return 255 inside a polygon, with ``samples`` fine pixels per pixel and axis."""
    height, width = window.bottom - window.top, window.right - window.left
    mask = np.zeros((samples * height, samples * width), dtype=np.uint8)
    corners = outline - np.array([window.left, window.top]) + 0.5
    scaled = np.rint((corners * samples - 0.5) * 2**OUTLINE_BITS).astype(np.int32)
    cv2.fillPoly(mask, [scaled], 255, shift=OUTLINE_BITS)
    return mask
