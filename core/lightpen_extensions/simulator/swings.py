"""Simulated pens and swings, with their truth.

Everything random comes from the generator the caller hands in, so that a seed gives the
same data every time.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.model.camera import Camera
from lightpen.model.ellipse import disc_images
from lightpen.model.pen import Pen
from lightpen.model.rigid import FACING, moved_from

# Postures of the pen, and swing patterns.
#
# A posture is the tilt of the pen, the direction it tilts to and its roll. Upright, the
# pen's y axis points up in the image and its discs face the camera:
#
#     R = A(tilt, direction) diag(1, -1, -1) Ry(roll),
#
# where A turns the image's up direction the short way to the direction of the pen,
# ``(sin(tilt) cos(direction), -cos(tilt), sin(tilt) sin(direction))`` in camera
# coordinates.


MAX_TILT = np.radians(33)
MAX_ROLL = np.radians(32)
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


PAPER_TIP = np.array([-1.3182, -90.4095, -23.8548])  # mm, the paper's result
PAPER_CONE = np.array([-4.871, 214.287, 1087.45])  # mm

MIN_GAP = 6.0  # px between the contours of two discs
MAX_DOUBLINGS = 12


@dataclass(frozen=True, eq=False)
class Swing:
    """A pen in motion, with the truth about its tip."""

    postures: Postures
    rotations: FloatArray  # (F, 3, 3), of cam_from_pen
    translations: FloatArray  # (F, 3), of cam_from_pen, mm
    tip_pen: FloatArray  # (3,), tip in the pen frame, mm
    cone_cam: FloatArray  # (3,), bottom of the cone in the camera frame, mm
    # (F, 3), where the tip is in each frame, mm: in the cone unless it slipped
    tips_cam: FloatArray

    def __len__(self) -> int:
        return len(self.rotations)

    @property
    def slipped(self) -> BoolArray:
        """Frames with the tip out of the cone, (F,)."""
        slipped: BoolArray = np.any(self.tips_cam != self.cone_cam, axis=-1)
        return slipped


SCALE_SIGMA = 5e-6  # of a coordinate measuring machine
DIAMETER_SIGMA = 0.02  # mm, of a turned disc
EXPANSION, EXPANSION_SIGMA = 2e-6, 5e-7  # 1/K, of carbon fibre
MEASURED_AT = 20.0  # degrees C


def paper_camera(binning: int = 1) -> Camera:
    """Return the paper's camera: 5 megapixels, 4638 px focal length, or binned."""
    shift = (binning - 1) / 2  # pixel (0, 0) is the centre of the first one
    return Camera(
        width=2448 // binning,
        height=2048 // binning,
        fx=4638.2 / binning,
        fy=4637.1 / binning,
        cx=(1219.6 - shift) / binning,
        cy=(1031.3 - shift) / binning,
        distortion=np.array([-0.082, 0.105, 0.0003, -0.0002, 0.0]),
        covariance=_board_covariance(binning),
    )


def _board_covariance(binning: int) -> FloatArray:
    """Return the covariance of the paper's camera by 24 board views, (9, 9)."""
    deviations = np.array([0.52, 0.51, 0.66, 0.58, 3.7e-4, 3.9e-3, 3.3e-5, 3.9e-5, 0.0])
    deviations[:4] /= binning
    correlations = np.eye(9)
    # fx and fy, k1 and k2, cy and p1, cx and p2
    for i, j, value in ((0, 1, 0.99), (4, 5, -0.91), (3, 6, 0.8), (2, 7, 0.9)):
        correlations[i, j] = correlations[j, i] = value
    return np.outer(deviations, deviations) * correlations


def paper_pen() -> Pen:
    """Return the paper's pen as designed: four LEDs behind a plane of six."""
    back = [(0, y, -30) for y in (0, 60, 120, 180)]
    left = [(-25, y, 0) for y in (20, 90, 160)]
    right = [(25, y, 0) for y in (35, 105, 170)]
    return flat_pen("paper", back + left + right)


def flat_pen(name: str, leds: Sequence[tuple[float, float, float]]) -> Pen:
    """Return a pen with LEDs, mm, that all face +z, and the paper's nominal tip."""
    return Pen(
        leds=np.array(leds, dtype=np.float64),
        normals=np.tile([0.0, 0.0, 1.0], (len(leds), 1)),
        nominal_tip=np.array([0.0, -90.0, -25.0]),
        name=name,
        scale_sigma=SCALE_SIGMA,
        diameter_sigma=DIAMETER_SIGMA,
        expansion=EXPANSION,
        expansion_sigma=EXPANSION_SIGMA,
        temperature_c=MEASURED_AT,
    )


def perturbed_pen(pen: Pen, sigma: float, rng: np.random.Generator) -> Pen:
    """Return the pen with its LEDs moved by independent noise of ``sigma`` mm."""
    return replace(pen, leds=pen.leds + sigma * rng.standard_normal(pen.leds.shape))


def swing_poses(
    n_frames: int,
    rng: np.random.Generator,
    *,
    pen: Pen | None = None,
    camera: Camera | None = None,
    tip_pen: FloatArray = PAPER_TIP,
    cone_cam: FloatArray = PAPER_CONE,
    shows: Callable[[Swing], BoolArray] | None = None,
) -> Swing:
    """Return a swing with the tip in the cone.

    The postures are random all round; every LED is whole in the image and clear of the
    rest, as a careful operator holds the pen.

    Parameters
    ----------
    pen, camera : optional
        The paper's unless given.
    tip_pen, cone_cam : (3,) array
        Tip in the pen frame and bottom of the cone in the camera frame, mm.
    shows : callable, optional
        Condition that every LED must meet in a frame; by default, visibility in
        ``camera``.
    """
    pen = pen or paper_pen()
    camera = camera or paper_camera()
    shows = shows or partial(shows_all, camera, pen)
    n_drawn = n_frames
    for _ in range(MAX_DOUBLINGS):
        rng.random()  # so that published figures keep their swings
        swing = swing_from_postures(random_postures(n_drawn, rng), tip_pen, cone_cam)
        good = np.flatnonzero(shows(swing))
        if len(good) >= n_frames:
            spread = good[np.arange(n_frames) * len(good) // max(n_frames, 1)]
            return select_frames(swing, spread)
        n_drawn = 2 * n_drawn + 10
    raise ValueError(
        "Hardly a posture shows every LED of this pen whole in this camera: "
        "move `cone_cam`."
    )


def select_frames(swing: Swing, frames: IntArray) -> Swing:
    """Return the swing of the frames with these indices."""
    postures = swing.postures
    return replace(
        swing,
        postures=Postures(
            postures.tilts[frames], postures.directions[frames], postures.rolls[frames]
        ),
        rotations=swing.rotations[frames],
        translations=swing.translations[frames],
        tips_cam=swing.tips_cam[frames],
    )


def swing_from_postures(
    postures: Postures,
    tip_pen: FloatArray = PAPER_TIP,
    cone_cam: FloatArray = PAPER_CONE,
    tips_cam: FloatArray | None = None,
) -> Swing:
    """Return the swing of given postures, with the tip in the cone.

    The tip in each frame, ``tips_cam`` (F, 3), mm, may be given instead.
    """
    rotations = postures.rotations
    if tips_cam is None:
        tips_cam = np.tile(cone_cam, (len(postures), 1))
    translations = tips_cam - rotations @ tip_pen
    return Swing(postures, rotations, translations, tip_pen, cone_cam, tips_cam)


def seen_from(swing: Swing, R: FloatArray, t: FloatArray) -> Swing:
    """Return the swing in the frame of another camera, in which p is at ``R p + t``."""
    cone_cam = R @ swing.cone_cam + t
    slipped = swing.tips_cam @ R.T + t
    return replace(
        swing,
        rotations=R @ swing.rotations,
        translations=swing.translations @ R.T + t,
        cone_cam=cone_cam,
        tips_cam=np.where(swing.slipped[:, None], slipped, cone_cam),
    )


def leds_in_camera(
    pen: Pen, rotations: FloatArray, translations: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return centres, mm, and normals of the LEDs in the camera frame, (..., L, 3)."""
    transposed = np.swapaxes(rotations, -1, -2)
    return pen.leds @ transposed + translations[..., None, :], pen.normals @ transposed


def faces_camera(leds_cam: FloatArray, normals_cam: FloatArray) -> BoolArray:
    """Return the mask of the discs that face the camera, (..., L)."""
    faces: BoolArray = np.einsum("...i,...i->...", leds_cam, normals_cam) < 0
    return faces


def edge_gaps(
    camera: Camera, pen: Pen, rotations: FloatArray, translations: FloatArray
) -> FloatArray:
    """Return a lower bound (F,) of the narrowest gap between two discs, px.

    Each disc reaches as far as its semi-major axis in every direction; discs may
    overlap where it is negative. The poses cam_from_pen are rotations (F, 3, 3) and
    translations (F, 3), mm.
    """
    leds_cam, normals_cam = leds_in_camera(pen, rotations, translations)
    centers, shapes = disc_images(camera, leds_cam, normals_cam, pen.diameter / 2)
    reach = 2 * np.sqrt(np.linalg.eigvalsh(shapes)[..., 1])
    one, other = np.triu_indices(pen.n_leds, k=1)
    distances = np.linalg.norm(centers[..., one, :] - centers[..., other, :], axis=-1)
    gaps = distances - reach[..., one] - reach[..., other]
    narrowest: FloatArray = gaps.min(axis=-1)
    return narrowest


def shows_all(camera: Camera, pen: Pen, swing: Swing) -> BoolArray:
    """Return in which frames every LED is whole and clear of the others, (F,)."""
    leds_cam, normals_cam = leds_in_camera(pen, swing.rotations, swing.translations)
    facing = faces_camera(leds_cam, normals_cam).all(axis=-1)
    radius = camera.fx * pen.diameter / 2 / leds_cam[..., 2].min()
    inside = inside_image(camera, camera.project(leds_cam), margin=2 * radius).all(
        axis=-1
    )
    clear = edge_gaps(camera, pen, swing.rotations, swing.translations) >= MIN_GAP
    shows: BoolArray = facing & inside & clear
    return shows


def inside_image(camera: Camera, pixels: FloatArray, margin: float = 0.0) -> BoolArray:
    """Return the mask of pixels (..., 2) in the image, farther than a margin, px."""
    size = np.array(camera.image_size)
    inside: BoolArray = np.all(
        (pixels >= margin - 0.5) & (pixels <= size - 0.5 - margin), axis=-1
    )
    return inside
