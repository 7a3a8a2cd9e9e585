"""Following the pen from image to image: the spots nearest to where LEDs were.

Where every LED moved by less than half the way to its neighbour, each spot is of the
LED it is nearest to; the fit of the pose then checks all of them at once. Anything
else, a fast hand, a stray light near an LED, two LEDs in one spot, is left to the
search of `lightpen.detection.labelling.labels.track_spots`.
"""

from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.labelling.constellation import certain_leds
from lightpen.detection.labelling.labels import Labels, LabelStatus
from lightpen.detection.labelling.spot_arrays import UNWHOLE
from lightpen.detection.pose import ImagePose, fit_pose
from lightpen.detection.spots import Spots
from lightpen.model.camera import Camera
from lightpen.model.ellipse import centers_from_centroids
from lightpen.model.pen import Pen

UNAMBIGUOUS = 0.4  # of the distance of two LEDs, that one may have moved
MAX_TURN = 0.25  # rad, from image to image
MAX_SIGMA = 0.3  # px
LEAST_WEIGHT = 0.5  # of an LED: residuals of four standard deviations
MAX_GROWTH = 1.5  # of an area from image to image
MAX_OFF_CENTER = 0.5  # radii, of a merged or cut spot from its LED


class Followed(NamedTuple):
    """Labels and pose of one image."""

    labels: Labels
    seen: FloatArray  # (L, 2), ellipse centres of all labelled LEDs, px; NaN elsewhere
    pose: ImagePose


def follow_spots(
    spots: Spots,
    camera: Camera,
    pen: Pen,
    rotation: FloatArray,
    translation: FloatArray,
    there: FloatArray,
    areas: FloatArray,
) -> Followed | None:
    """Return labels and pose of an image, given those of the image before.

    None where anything but small motion is seen.

    Parameters
    ----------
    rotation, translation : (3, 3) and (3,) array
        cam_from_pen of the image before, mm.
    there : (L, 2) array
        LEDs of that pose, px.
    areas : (L,) array
        Of the spots there, px^2; NaN where an LED was not seen.
    """
    if not len(spots) or np.isfinite(spots.tiny_width):
        return None
    x, y = there.T
    apart = np.hypot(x[:, None] - x, y[:, None] - y)
    np.fill_diagonal(apart, np.inf)
    gaps = np.hypot(x[:, None] - spots.centers[:, 0], y[:, None] - spots.centers[:, 1])
    spot = gaps.argmin(axis=1)
    leds = np.arange(pen.n_leds)
    mutual = gaps.argmin(axis=0)[spot] == leds
    labelled = mutual & (gaps[leds, spot] < UNAMBIGUOUS * apart.min(axis=1))
    whole = labelled & (spots.flaws[spot] & UNWHOLE == 0)
    if np.count_nonzero(whole) < certain_leds(pen):
        return None
    growth = np.abs(np.log(spots.areas[spot] / areas))
    if np.any(growth[whole & np.isfinite(areas)] > np.log(MAX_GROWTH)):
        return None
    seen = np.full((pen.n_leds, 2), np.nan)
    seen[labelled] = spots.centers[spot[labelled]]
    shapes = np.full((pen.n_leds, 2, 2), np.nan)
    shapes[labelled] = spots.shapes[spot[labelled]]
    seen = centers_from_centroids(camera, seen[None], shapes[None])[0]
    pixels = np.where(whole[:, None], seen, np.nan)
    sigmas = np.where(whole, spots.sigmas[spot], np.nan)
    pose = fit_pose(camera, pen, pixels, rotation, translation, sigmas)
    turned = np.sum(pose.rotation * rotation) < 1 + 2 * np.cos(MAX_TURN)
    is_poor = pose.sigma > MAX_SIGMA or (pose.weights[whole] < LEAST_WEIGHT).any()
    if turned or is_poor:
        return None
    # A merged or cut spot is of an LED if it is on its disc.
    if np.any(labelled & ~whole):
        placed = camera.project(pen.leds @ pose.rotation.T + pose.translation)
        off = np.linalg.norm(seen - placed, axis=1)
        radii = np.sqrt(np.nanmedian(areas) / np.pi)
        labelled &= whole | (off < MAX_OFF_CENTER * radii)
        seen = np.where(labelled[:, None], seen, np.nan)
    labels = Labels(
        spot=np.where(labelled, spot, -1),
        whole=whole,
        R=pose.rotation,
        t=pose.translation,
        rms_px=float(pose.sigma),
        reason=LabelStatus.LABELLED,
    )
    return Followed(labels, seen, pose)
