"""What one live image shows of the pen: its LEDs and its pose."""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray, Image
from lightpen.detection.labelling.labels import (
    Labels,
    LabelStatus,
    label_spots,
    track_spots,
)
from lightpen.detection.pose import MIN_LEDS, fit_poses
from lightpen.detection.reasons import Reason
from lightpen.detection.spots import Flaw, Spots, detect_spots
from lightpen.model.camera import Camera
from lightpen.model.ellipse import centers_from_centroids
from lightpen.model.pen import Pen

_REASONS = {
    LabelStatus.LABELLED: Reason.NONE,
    LabelStatus.NO_SPOTS: Reason.EMPTY,
    LabelStatus.TOO_FEW: Reason.TOO_FEW_LEDS,
    LabelStatus.NO_FIT: Reason.NOT_THE_PEN,
    LabelStatus.AMBIGUOUS: Reason.AMBIGUOUS,
}


@dataclass(frozen=True, eq=False)
class Sighting:
    """The pen in one image.

    Attributes
    ----------
    pixels : (L, 2) array
        Ellipse centres of the LEDs that are fit for use, px; NaN elsewhere.
    seen_pixels : (L, 2) array
        Centres of all labelled LEDs, also of merged and cut ones, px; NaN elsewhere.
    rotation, translation : (3, 3) and (3,) array
        cam_from_pen, mm; NaN without a pose.
    cofactors : (6, 6) array
        Covariance of the pose's (theta, dt) for a noise of 1 px, rad and mm.
    sigma : float
        Standard deviation of one image coordinate, by this image alone, px.
    reason : Reason
        Why there is no pose; `Reason.NONE` where there is one.
    spots : Spots or None
        All that was found in the image.
    labels : Labels or None
        Which spot is which LED.
    """

    pixels: FloatArray
    seen_pixels: FloatArray
    rotation: FloatArray
    translation: FloatArray
    cofactors: FloatArray
    sigma: float
    reason: Reason
    spots: Spots | None = None
    labels: Labels | None = None

    @property
    def has_pose(self) -> bool:
        """Whether the pose of the pen is known."""
        return self.reason is Reason.NONE

    @property
    def n_leds(self) -> int:
        """Number of LEDs fit for use."""
        return int(np.isfinite(self.pixels[:, 0]).sum())

    @property
    def is_blurred(self) -> bool:
        """Whether most of the spots are smeared, as a fast hand smears them."""
        return self.spots is not None and _is_blurred(self.spots)


def look(
    image: Image,
    camera: Camera,
    pen: Pen,
    mask: FloatArray | None = None,
    before: Sighting | None = None,
) -> Sighting:
    """Find the pen in an image.

    Parameters
    ----------
    image : (H, W) array
        Grey image of the camera's size, 8 or 16 bit.
    camera : Camera
    pen : Pen
    mask : (M, 3) array, optional
        Circles of stray light to leave out: centre x, y and radius, px.
    before : Sighting, optional
        Of the image before, which tells where to look first.
    """
    spots = detect_spots(image, mask)
    labels = _label(spots, camera, pen, before)
    seen = np.full((pen.n_leds, 2), np.nan)
    labelled = labels.spot >= 0
    if labelled.any():
        chosen = labels.spot[labelled]
        seen[labelled] = centers_from_centroids(
            camera, spots.centers[chosen], spots.shapes[chosen]
        )
    pixels = np.where((labels.whole & labelled)[:, None], seen, np.nan)
    reason = _REASONS[labels.reason]
    if reason not in (Reason.NONE, Reason.EMPTY) and _is_blurred(spots):
        reason = Reason.BLURRED
    if reason is Reason.NONE and np.isfinite(pixels[:, 0]).sum() < MIN_LEDS:
        reason = Reason.TOO_FEW_LEDS
    if reason is not Reason.NONE:
        return _without_pose(pixels, seen, reason, spots, labels)
    return _with_pose(camera, pen, pixels, seen, labels.R, labels.t, spots, labels)


def sight_centers(
    camera: Camera,
    pen: Pen,
    pixels: FloatArray,
    rotation: FloatArray,
    translation: FloatArray,
) -> Sighting:
    """Return the sighting of labelled centres (L, 2), px, from a rough pose, mm."""
    if np.isfinite(pixels[:, 0]).sum() < MIN_LEDS:
        n_seen = np.isfinite(pixels[:, 0]).any()
        reason = Reason.TOO_FEW_LEDS if n_seen else Reason.EMPTY
        return _without_pose(pixels, pixels, reason)
    return _with_pose(camera, pen, pixels, pixels, rotation, translation)


def _label(spots: Spots, camera: Camera, pen: Pen, before: Sighting | None) -> Labels:
    if before is not None and before.has_pose:
        tracked = track_spots(spots, camera, pen, before.rotation, before.translation)
        if tracked.reason is LabelStatus.LABELLED:
            return tracked
    return label_spots(spots, camera, pen)


def _is_blurred(spots: Spots) -> bool:
    return len(spots) > 0 and bool(np.mean((spots.flaws & Flaw.BLURRED) > 0) > 0.5)


def _with_pose(
    camera: Camera,
    pen: Pen,
    pixels: FloatArray,
    seen_pixels: FloatArray,
    rotation: FloatArray,
    translation: FloatArray,
    spots: Spots | None = None,
    labels: Labels | None = None,
) -> Sighting:
    poses = fit_poses(camera, pen, pixels[None], rotation[None], translation[None])
    return Sighting(
        pixels=pixels,
        seen_pixels=seen_pixels,
        rotation=poses.rotations[0],
        translation=poses.translations[0],
        cofactors=poses.covariances[0] / poses.sigma**2,
        sigma=poses.sigma,
        reason=Reason.NONE,
        spots=spots,
        labels=labels,
    )


def _without_pose(
    pixels: FloatArray,
    seen_pixels: FloatArray,
    reason: Reason,
    spots: Spots | None = None,
    labels: Labels | None = None,
) -> Sighting:
    return Sighting(
        pixels=pixels,
        seen_pixels=seen_pixels,
        rotation=np.full((3, 3), np.nan),
        translation=np.full(3, np.nan),
        cofactors=np.full((6, 6), np.nan),
        sigma=float("nan"),
        reason=reason,
        spots=spots,
        labels=labels,
    )
