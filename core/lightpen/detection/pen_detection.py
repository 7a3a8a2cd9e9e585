"""Detection of the pen in an image: LEDs and pose, or why there are none.

Live images and files share `detections_of`: `detect_pen` calls it for single images and
fits the pose, `lightpen.detection.observations` for many at once.

The pen is followed from image to image by the spots nearest to where its LEDs were.
Where every LED moved by less than half the way to its neighbour, each spot is of the
LED it is nearest to; the fit of the pose then drops what is none, such as a lamp near a
hidden LED. Anything else, a fast hand, too few LEDs, is left to a search from nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from math import ceil, cos, floor

import numpy as np

from lightpen.arrays import FloatArray, Image
from lightpen.detection.labelling.constellation import (
    FEWEST_LEDS,
    UNWHOLE,
    certain_leds,
)
from lightpen.detection.labelling.labels import (
    MAX_RMS_OF_FEWEST_AMONG_OTHERS,
    Labels,
    label_spots,
)
from lightpen.detection.pixel_box import PixelBox
from lightpen.detection.pose import MIN_POSE_LEDS, fit_pose
from lightpen.detection.reasons import UNFORESEEN, Reason
from lightpen.detection.robust_residuals import CAUCHY_WIDTH
from lightpen.detection.spots import EXACT_SIGMA, SpotFlaw, Spots, detect_spots
from lightpen.model.camera import Camera
from lightpen.model.ellipse import centers_from_centroids
from lightpen.model.pen import Pen

MAX_SHIFT = 45.0  # px, of an LED from image to image
ROOM = 3.0  # radii of a disc from its centre to the border of what is read

UNAMBIGUOUS = 0.4  # of the distance of two LEDs, that one may have moved
MAX_TURN = 0.25  # rad, from image to image
MAX_SIGMA = 0.3  # px
STRAY = (0.3, 1.0)  # px, from its LED, least and most, if four standard deviations
MAX_GROWTH = 1.5  # of an area from image to image
MAX_OFF_CENTER = 0.5  # radii, of a merged or cut spot from its LED


@dataclass(frozen=True, eq=False)
class PenDetection:
    """The pen in one image."""

    # (L, 2), ellipse centres of the LEDs that are fit for use, px; NaN elsewhere.
    pixels: FloatArray
    # (L, 2), centres of all labelled LEDs, also merged and cut ones, px; else NaN.
    seen_pixels: FloatArray
    reason: Reason  # why there is no pose; `Reason.NONE` where there is one
    # `rotation` and `translation`: (3, 3) and (3,), cam_from_pen, mm; NaN if no pose.
    rotation: FloatArray = field(default_factory=lambda: np.full((3, 3), np.nan))
    translation: FloatArray = field(default_factory=lambda: np.full(3, np.nan))
    # (6, 6), covariance of the pose's (theta, dt) for a noise of 1 px, rad and mm; NaN
    # without a pose or where it is a rough one.
    cofactors: FloatArray = field(default_factory=lambda: np.full((6, 6), np.nan))
    # Noise of a coordinate by this image alone, px; NaN without a pose.
    sigma: float = float("nan")
    spots: Spots | None = None  # all that was found in the image
    labels: Labels | None = None  # assignment of spots to LEDs
    # Of the simultaneous images of a rig's other cameras.
    others: tuple["PenDetection", ...] = ()
    posed_by: int = 0  # index of the camera that determines the pose, from 0

    @property
    def rig_pixels(self) -> FloatArray:
        """Centres in all cameras of a rig, (C, L, 2), px; NaN where not detected."""
        return np.stack([self.pixels, *(other.pixels for other in self.others)])

    @property
    def has_pose(self) -> bool:
        """Whether there is a pose."""
        return self.reason is Reason.NONE

    @property
    def n_leds(self) -> int:
        """Number of LEDs fit for use, by the camera that the pose is by."""
        return _n_seen(self.rig_pixels[self.posed_by])

    @property
    def is_blurred(self) -> bool:
        """Whether most of the spots are smeared, as a fast hand smears them."""
        spots = (self, *self.others)[self.posed_by].spots
        return spots is not None and spots.are_blurred

    @property
    def areas(self) -> FloatArray:
        """Areas of the LEDs fit for use, (L,), px^2; NaN elsewhere.

        So it is of saturated ones, which look larger than they are, and of those that
        blur alone makes large.
        """
        areas = np.full(len(self.pixels), np.nan)
        if self.spots is None or self.labels is None:
            return areas
        spot = self.labels.spot
        known = np.isfinite(self.pixels[:, 0])
        there = spot[known]
        saturated = (self.spots.flaws[there] & SpotFlaw.SATURATED) > 0
        known[known] = ~(saturated | self.spots.are_small[there])
        areas[known] = self.spots.areas[spot[known]]
        return areas

    @property
    def sigmas(self) -> FloatArray:
        """Standard deviation of each centre by its estimator, (L,), px.

        NaN where an LED is not fit for use; the same for all where only centres are
        given.
        """
        known = np.isfinite(self.pixels[:, 0])
        sigmas = np.where(known, EXACT_SIGMA, np.nan)
        if self.spots is not None and self.labels is not None:
            sigmas[known] = self.spots.sigmas[self.labels.spot[known]]
        return sigmas

    @property
    def edge_width(self) -> float:
        """Mean width of the rims of the labelled LEDs, px; NaN without any."""
        if self.spots is None or self.labels is None:
            return float("nan")
        labelled = self.labels.spot[self.labels.spot >= 0]
        widths = self.spots.edge_widths[labelled]
        return float(widths.mean()) if len(widths) else float("nan")


def detect_pen(
    image: Image,
    camera: Camera,
    pen: Pen,
    mask: FloatArray | None = None,
    before: PenDetection | None = None,
    full_scale: int | None = None,
    *,
    is_followed: bool = False,
) -> PenDetection:
    """Find the pen in an image, and its pose by maximum likelihood.

    Parameters
    ----------
    image : (H, W) array
        Grey image, 8 or 16 bit.
    mask : (M, 3) array, optional
        Circles of stray light to leave out: centre x, y and radius, px.
    before : PenDetection, optional
        Detection in the previous image, whose LED positions are searched first. If the
        LEDs are found there, this decides, even for an image that would be rejected on
        its own; otherwise the whole image is searched.
    full_scale : int, optional
        Brightest value a pixel can have; see `lightpen.detection.spots.detect_spots`.
    is_followed : bool
        Whether the pen is all that is requested: where its LEDs are about where they
        were ``before``, the rest of the image is not read.
    """
    if not camera.fits(image):
        return unseen(pen, Reason.WRONG_SIZE)
    try:
        seen = None if before is None else before.spots
        search = partial(detect_spots, image, mask, full_scale=full_scale, before=seen)
        if before is not None and before.has_pose:
            near = _window(camera, pen, before)
            for window in (near, None) if is_followed else (None,):
                spots = search(window=window)
                followed = follow_spots(spots, camera, pen, before)
                if followed is not None:
                    return followed
        else:
            spots = search()
        labels = label_spots(spots, camera, pen)
        detection = detections_of([spots], [labels], camera)[0]
        return _fitted(detection, camera, pen)
    except UNFORESEEN:
        return unseen(pen, Reason.UNHANDLED)


def detections_of(
    spots: Sequence[Spots], labels: Sequence[Labels], camera: Camera
) -> list[PenDetection]:
    """Return the detections of images by their spots and labels, with the rough poses.

    An image is usable if its LEDs are labelled, four of them or more are whole, and few
    are too small. If not, the reason is the first that holds:

    * too small, where most spots are tiny;
    * blurred, where most spots are or where there is light but no spot, since stillness
      comes first: it may part merged LEDs, and distinguish alike ones;
    * empty, without any spot;
    * too few LEDs, where there are not spots enough, or not enough whole LEDs;
    * ambiguous, or not the pen.
    """
    n_leds = len(labels[0].spot)
    seen = np.full((len(labels), n_leds, 2), np.nan)
    shapes = np.full((len(labels), n_leds, 2, 2), np.nan)
    for i, (found, label) in enumerate(zip(spots, labels, strict=True)):
        labelled = label.spot >= 0
        seen[i, labelled] = found.centers[label.spot[labelled]]
        shapes[i, labelled] = found.shapes[label.spot[labelled]]
    seen = centers_from_centroids(camera, seen, shapes)
    return [_detection_of(*image) for image in zip(spots, labels, seen, strict=True)]


def detection_of_centers(
    pixels: FloatArray, rotation: FloatArray, translation: FloatArray
) -> PenDetection:
    """Return the detection by LED centres (L, 2), px, that were labelled elsewhere.

    NaN where an LED was not seen. The pose is a rough cam_from_pen, (3, 3) and (3,),
    mm; NaN where none fits.
    """
    n_seen = _n_seen(pixels)
    if n_seen == 0:
        reason = Reason.EMPTY
    elif n_seen < MIN_POSE_LEDS:
        reason = Reason.TOO_FEW_LEDS
    elif np.isnan(translation).any():
        reason = Reason.MISFIT
    else:
        return PenDetection(pixels, pixels, Reason.NONE, rotation, translation)
    return PenDetection(pixels, pixels, reason)


def detect_from_centers(
    camera: Camera,
    pen: Pen,
    pixels: FloatArray,
    rotation: FloatArray,
    translation: FloatArray,
) -> PenDetection:
    """Return the detection by labelled centres (L, 2), px, from a rough pose."""
    detection = detection_of_centers(pixels, rotation, translation)
    return _fitted(detection, camera, pen)


def unseen(pen: Pen, reason: Reason) -> PenDetection:
    """Return the empty detection of an unused image, with the reason."""
    nothing = np.full((pen.n_leds, 2), np.nan)
    return PenDetection(nothing, nothing, reason)


def follow_spots(
    spots: Spots, camera: Camera, pen: Pen, before: PenDetection
) -> PenDetection | None:
    """Return the detection in an image by the pose in the image before.

    None where anything but small motion is seen. Five LEDs are enough for a pose that
    fits them closely.
    """
    if not len(spots) or np.isfinite(spots.tiny_width):
        return None
    x, y = camera.project(pen.leds @ before.rotation.T + before.translation).T
    apart = np.hypot(x[:, None] - x, y[:, None] - y)
    np.fill_diagonal(apart, np.inf)
    gaps = np.hypot(x[:, None] - spots.centers[:, 0], y[:, None] - spots.centers[:, 1])
    spot = gaps.argmin(axis=1)
    leds = np.arange(pen.n_leds)
    mutual = gaps.argmin(axis=0)[spot] == leds
    labelled = mutual & (gaps[leds, spot] < UNAMBIGUOUS * apart.min(axis=1))
    whole = labelled & (spots.flaws[spot] & UNWHOLE == 0)
    seen, own = np.full((pen.n_leds, 2), np.nan), spot[labelled]
    seen[labelled] = centers_from_centroids(
        camera, spots.centers[own], spots.shapes[own]
    )
    while True:
        if np.count_nonzero(whole) < FEWEST_LEDS:
            return None
        pixels = np.where(whole[:, None], seen, np.nan)
        sigmas = np.where(whole, spots.sigmas[spot], np.nan)
        at = before.rotation, before.translation
        pose = fit_pose(camera, pen, pixels, *at, sigmas)
        off = CAUCHY_WIDTH * pose.sigma * np.sqrt(1 / pose.weights[whole] - 1)
        stray = np.zeros_like(whole)
        stray[whole] = off > np.clip(CAUCHY_WIDTH * pose.sigma, *STRAY)
        if not stray.any():
            break
        labelled, whole = labelled & ~stray, whole & ~stray
    is_certain = np.count_nonzero(whole) >= certain_leds(pen)
    most = MAX_SIGMA if is_certain else MAX_RMS_OF_FEWEST_AMONG_OTHERS
    turned = np.vdot(pose.rotation, before.rotation) < 1 + 2 * cos(MAX_TURN)
    if turned or pose.sigma > most:
        return None
    if before.spots is not None and before.labels is not None:
        both = whole & (before.labels.spot >= 0)
        growth = spots.areas[spot] / before.spots.areas[before.labels.spot]
        if np.any(both & ((growth > MAX_GROWTH) | (growth < 1 / MAX_GROWTH))):
            return None
    seen = np.where(labelled[:, None], seen, np.nan)
    # A merged or cut spot is of an LED if it is on its disc.
    if np.any(labelled & ~whole):
        placed = camera.project(pen.leds @ pose.rotation.T + pose.translation)
        off = np.linalg.norm(seen - placed, axis=1)
        radii = np.sqrt(np.median(spots.areas[spot[labelled]]) / np.pi)
        labelled &= whole | (off < MAX_OFF_CENTER * radii)
        seen = np.where(labelled[:, None], seen, np.nan)
    labels = Labels(
        spot=np.where(labelled, spot, -1),
        whole=whole,
        R=pose.rotation,
        t=pose.translation,
        rms_px=float(pose.sigma),
        reason=Reason.NONE,
    )
    return PenDetection(pixels, seen, Reason.NONE, *pose[:4], spots, labels)


def _window(camera: Camera, pen: Pen, before: PenDetection) -> PixelBox:
    """Return the region of LEDs that hardly moved, with a margin, px."""
    leds = pen.leds @ before.rotation.T + before.translation
    there = camera.project(leds)
    radius = camera.fx * pen.diameter / 2 / float(leds[:, 2].min())
    (left, top), (right, bottom) = there.min(axis=0), there.max(axis=0)
    around = PixelBox(floor(left), floor(top), ceil(right), ceil(bottom))
    room = ceil(MAX_SHIFT + ROOM * radius)
    return around.grown(room, (camera.height, camera.width))


def _detection_of(spots: Spots, labels: Labels, seen: FloatArray) -> PenDetection:
    """Return the detection of an image with labelled LEDs at (L, 2), px."""
    pixels = np.where(labels.whole[:, None], seen, np.nan)
    detection = partial(PenDetection, pixels, seen, spots=spots, labels=labels)
    if np.isfinite(spots.tiny_width):
        return detection(Reason.TOO_SMALL)
    is_labelled = labels.reason is Reason.NONE
    if is_labelled and _n_seen(pixels) >= MIN_POSE_LEDS:
        return detection(Reason.NONE, labels.R, labels.t)
    return detection(
        Reason.BLURRED
        if spots.are_blurred
        else labels.reason or Reason.TOO_FEW_LEDS  # that are whole
    )


def _n_seen(pixels: FloatArray) -> int:
    return int(np.isfinite(pixels[:, 0]).sum())


def _fitted(detection: PenDetection, camera: Camera, pen: Pen) -> PenDetection:
    """Return a detection with its pose, if it has one, fitted to the LEDs."""
    if not detection.has_pose:
        return detection
    pose = fit_pose(
        *(camera, pen, detection.pixels),
        *(detection.rotation, detection.translation, detection.sigmas),
    )
    return PenDetection(
        *(detection.pixels, detection.seen_pixels, Reason.NONE, *pose[:4]),
        *(detection.spots, detection.labels),
    )
