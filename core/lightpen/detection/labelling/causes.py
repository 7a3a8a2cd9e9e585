"""Causes of LEDs that are not where the files have them, tried in turn.

A cause is one change of camera, pen or image points. It is named if the LEDs fit with
it: unlabelled spots by how many of them the pen explains, labelled centres by what is
left of their misfit.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.labelling.constellation import certain_leds
from lightpen.detection.labelling.labels import MODERATE, label_images
from lightpen.detection.pose import MIN_POSE_LEDS, Poses, fit_poses, start_poses
from lightpen.detection.robust_residuals import MEDIAN_LENGTH
from lightpen.detection.spots import Spots
from lightpen.messages import Message, message
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen

N_TRIED, N_CENTERS = 4, 9  # images with spots, and with labelled centres
MOSTLY = 0.8  # of the spots that may be LEDs
UNIT_FACTORS = (1000.0, 0.001, 25.4, 1 / 25.4, 10.0, 0.1, 100.0, 0.01)
DISC_FACTORS = (0.6, 1.6, 0.4, 2.5)
FOCAL_FACTORS = (0.9, 1.1, 0.8, 1.25, 0.7, 1.4, 0.5, 2.0)
FITS = 0.3  # px, of the worst LED
REMOVED = 0.4  # at most, of the misfit without the cause
ALIKE = 3.0  # times the least misfit: a cause that explains the images as well
UNKNOWN_CAUSE = message("cause.unknown")
CROPPED = 50.0  # px; less is an error of the principal point
NO_POSE = 1e6  # px, misfit of LEDs that no pose puts before the camera


class _Trial(NamedTuple):
    cause: Message
    camera: Camera
    pen: Pen
    pixels: FloatArray  # (N, L, 2), image points, px


def diagnose(spots: Sequence[Spots], camera: Camera, pen: Pen) -> Message | None:
    """Name the likely cause why LEDs are not found where the pen file has them.

    None if most spots are LEDs of the pen.
    """
    needed = certain_leds(pen)
    counts = np.array([len(s) for s in spots])
    if 2 * np.sum(counts >= needed) < len(spots):
        return message(
            "diagnosis.few-spots",
            n_needed=needed,
            median=float(np.median(counts)),
            n_leds=pen.n_leds,
        )
    sample = _Sample.of(spots, camera, pen)
    if sample.is_explained:
        return None
    changes = (*_mirrored(camera, pen), *_resized(camera, pen))
    for cause, other_camera, other_pen in changes:
        if sample.fits(other_camera, other_pen):
            return message("cause.named", causes=cause)
    return message("diagnosis.spots-do-not-fit", n_needed=needed, n_leds=pen.n_leds)


def diagnose_mirror(spots: Sequence[Spots], camera: Camera, pen: Pen) -> Message | None:
    """Return a message if a mirrored pen explains clearly more of the spots.

    Most LEDs of the mirror image of a nearly symmetric pen can be labelled, so this is
    checked if some LEDs are missing in all images.
    """
    sample = _Sample.of(spots, camera, pen)
    if sample.is_explained:
        return None
    found = (
        cause
        for cause, _, mirrored in _mirrored(camera, pen)
        if sample.fits(camera, mirrored)
    )
    cause = next(found, None)
    return None if cause is None else message("cause.named", causes=cause)


def cause_of_misfit(
    camera: Camera, pen: Pen, pixels: FloatArray, *, is_seated: bool = True
) -> Message | None:
    """Name the causes that remove the misfit of labelled centres; None if none does.

    Several are named if they explain the images alike. ``pixels`` (N, L, 2) are the
    centres, px, NaN where an LED was not seen. The tip rests where the pen is seated.
    """
    n_seen = np.isfinite(pixels[..., 0]).sum(axis=1)
    usable = np.flatnonzero(n_seen > MIN_POSE_LEDS)
    if not len(usable):
        return None
    spread = usable[np.linspace(0, len(usable) - 1, 3 * N_CENTERS).astype(int)]
    most = np.argsort(-n_seen[spread], kind="stable")[:N_CENTERS]
    some = pixels[np.unique(spread[most])]
    limit = min(FITS, REMOVED * _misfit(camera, pen, some, is_seated))
    tried = [
        (_misfit(each.camera, each.pen, each.pixels, is_seated), each.cause)
        for each in _trials(camera, pen, some, is_seated)
    ]
    least = min(misfit for misfit, _ in tried)
    if least > limit:
        return None
    alike = tuple(c for misfit, c in tried if misfit <= min(limit, ALIKE * least))
    if len(alike) > 1:
        return message("cause.one-of", causes=alike)
    return message("cause.named", causes=alike)


def _trials(
    camera: Camera, pen: Pen, pixels: FloatArray, is_seated: bool
) -> Iterator[_Trial]:
    """Yield the causes for labelled centres, the most usual first."""
    for one, other in combinations(range(pen.n_leds), 2):
        leds = pen.leds.copy()
        leds[[one, other]] = leds[[other, one]]
        cause = message("cause.exchanged", one=one + 1, other=other + 1)
        yield _Trial(cause, camera, replace(pen, leds=leds), pixels)
    for cause, _, mirrored in _mirrored(camera, pen):
        yield _Trial(cause, camera, mirrored, pixels)
    last = np.array(camera.image_size) - 1.0
    yield _Trial(
        message("cause.images-mirrored"), camera, pen, pixels * [-1, 1] + [last[0], 0]
    )
    yield _Trial(
        message("cause.images-flipped"), camera, pen, pixels * [1, -1] + [0, last[1]]
    )
    yield _Trial(message("cause.axes-exchanged"), camera, pen, pixels[..., ::-1])
    yield _Trial(message("cause.binned"), camera, pen, 2 * pixels + 0.5)
    yield _Trial(message("cause.not-binned"), camera, pen, (pixels - 0.5) / 2)
    if is_seated:
        cropped = _cropped(camera, pen, pixels)
        off = cropped.camera.matrix[:2, 2] - camera.matrix[:2, 2]
        if np.linalg.norm(off) > CROPPED:
            yield cropped
    for led in range(pen.n_leds):
        others = np.where(np.arange(pen.n_leds)[:, None] == led, np.nan, pixels)
        yield _Trial(message("cause.moved", led=led + 1), camera, pen, others)


def _mirrored(camera: Camera, pen: Pen) -> Iterator[tuple[Message, Camera, Pen]]:
    """Yield mirror images of the pen; others differ from them by a rotation."""
    for sign, cause in (
        ([-1.0, 1.0, 1.0], message("cause.mirrored-across")),
        ([1.0, 1.0, -1.0], message("cause.mirrored-in-z")),
    ):
        yield cause, camera, replace(pen, leds=pen.leds * np.array(sign))


def _resized(camera: Camera, pen: Pen) -> Iterator[tuple[Message, Camera, Pen]]:
    """Yield other units, discs and focal lengths, which areas of spots tell apart."""
    for factor in UNIT_FACTORS:
        unit = message("cause.unit", factor=factor)
        yield unit, camera, replace(pen, leds=pen.leds * factor)
    for factor in DISC_FACTORS:
        disc = message("cause.disc", factor=factor, diameter=pen.diameter)
        yield disc, camera, replace(pen, diameter=pen.diameter * factor)
    for factor in FOCAL_FACTORS:
        changed = replace(camera, fx=camera.fx * factor, fy=camera.fy * factor)
        yield message("cause.focal-length", factor=factor), changed, pen


def _cropped(camera: Camera, pen: Pen, pixels: FloatArray) -> _Trial:
    """Return the principal point that the images fit best."""

    def moved(shift: FloatArray) -> Camera:
        return replace(camera, cx=camera.cx + shift[0], cy=camera.cy + shift[1])

    def residuals(shift: FloatArray) -> FloatArray:
        found = _poses(moved(shift), pen, pixels)
        if found is None:
            return np.full(pixels.size + 2 * len(pixels), NO_POSE)
        return np.append(np.nan_to_num(found.residuals), _of_tip(found, camera))

    # Imported here: the command line does not wait for it.
    from scipy.optimize import least_squares

    shift = least_squares(
        residuals, np.zeros(2), diff_step=1.0, x_scale=100.0, max_nfev=6
    ).x
    cause = message("cause.cropped", x=float(shift[0]), y=float(shift[1]))
    return _Trial(cause, moved(shift), pen, pixels)


def _poses(camera: Camera, pen: Pen, pixels: FloatArray) -> Poses | None:
    """Return the poses of the images; None if one shows the pen from behind."""
    R, t = start_poses(camera, pen, pixels)
    facing = np.einsum("nij,lj,ni->nl", R, pen.normals, t)
    if not np.isfinite(R).all() or (facing.mean(axis=1) > 0).any():
        return None
    return fit_poses(camera, pen, pixels, R, t)


def _misfit(camera: Camera, pen: Pen, pixels: FloatArray, is_seated: bool) -> float:
    """Return the usual residual of the worst LED or of the tip, whichever is larger.

    As a standard deviation, px.
    """
    found = _poses(camera, pen, pixels)
    if found is None:
        return NO_POSE
    lengths = np.linalg.norm(found.residuals, axis=2)
    seen = np.isfinite(lengths).any(axis=0)
    of_tip = 0.0
    if is_seated:
        of_tip = float(np.median(np.linalg.norm(_of_tip(found, camera), axis=1)))
    worst = np.nanmedian(lengths[:, seen], axis=0).max()
    return float(max(worst, of_tip)) / MEDIAN_LENGTH


def _of_tip(poses: Poses, camera: Camera) -> FloatArray:
    """Return where each pose puts the tip beside the others, (N, 2), px.

    Depth is left out: a single image hardly determines it.
    """
    minus_one = np.broadcast_to(-np.eye(3), poses.rotations.shape)
    rows = np.concatenate([poses.rotations, minus_one], axis=2).reshape(-1, 6)
    tip_and_cone = np.linalg.lstsq(rows, -poses.translations.ravel())[0]
    off = poses.rotations @ tip_and_cone[:3] + poses.translations - tip_and_cone[3:]
    return np.asarray(off[:, :2] * camera.fx / tip_and_cone[5])


@dataclass(frozen=True, eq=False)
class _Sample:
    """A few images, with the number of spots that the pen explains."""

    spots: list[Spots]
    n_possible: int
    n_explained: int

    @classmethod
    def of(cls, spots: Sequence[Spots], camera: Camera, pen: Pen) -> "_Sample":
        needed = certain_leds(pen)
        # The images with the fewest spots have the least clutter.
        some = sorted((s for s in spots if len(s) >= needed), key=len)[:N_TRIED]
        return cls(
            some,
            sum(min(len(s), pen.n_leds) for s in some),
            _n_explained(some, camera, pen),
        )

    @property
    def is_explained(self) -> bool:
        return self.n_explained > MOSTLY * self.n_possible

    def fits(self, camera: Camera, pen: Pen) -> bool:
        """Return whether this camera and pen explain the spots, and clearly better."""
        n = _n_explained(self.spots, camera, pen)
        return n > MOSTLY * self.n_possible and n >= self.n_explained + len(self.spots)


def _n_explained(spots: Sequence[Spots], camera: Camera, pen: Pen) -> int:
    labels = label_images(spots, camera, pen, MODERATE)
    return sum(int((label.spot >= 0).sum()) for label in labels)
