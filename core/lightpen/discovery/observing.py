"""Labelled observations, as the calibration of a tip takes them."""

import numpy as np

from lightpen.arrays import IntArray
from lightpen.detection.observations import Observations
from lightpen.detection.pose import MIN_POSE_LEDS
from lightpen.detection.reasons import Reason
from lightpen.detection.spots import EXACT_SIGMA
from lightpen.discovery.labelling import pixels_of
from lightpen.discovery.sightings import Sightings
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.model.ellipse import centers_from_centroids


def labelled_observations(
    sightings: Sightings, start: BundleState, images: IntArray, spots: IntArray
) -> Observations:
    """Return the labelled observations; ``spots`` (N, L) are numbers in sightings."""
    n_images, n_leds = spots.shape
    pixels = pixels_of(spots, sightings.centers)
    areas = np.full((n_images, n_leds), np.nan)
    if sightings.shapes is not None and sightings.areas is not None:
        shapes = np.full((n_images, n_leds, 2, 2), np.nan)
        for i, j in zip(*np.nonzero(spots >= 0), strict=True):
            shapes[i, j] = sightings.shapes[i][spots[i, j]]
            areas[i, j] = sightings.areas[i][spots[i, j]]
        pixels = centers_from_centroids(start.rig.cameras[0], pixels, shapes)
    rotations = np.full((n_images, 3, 3), np.nan)
    rotations[images] = start.rotations
    translations = start.cone_rig - rotations @ start.tip_pen
    widths = sightings.edge_widths
    return Observations(
        names=sightings.names,
        pixels=pixels,
        seen_pixels=pixels,
        areas=areas,
        sigmas=np.where(np.isfinite(pixels[..., 0]), EXACT_SIGMA, np.nan),
        rotations=rotations,
        translations=translations,
        edge_widths=np.full(n_images, np.nan) if widths is None else widths,
        lamps=np.zeros((n_images, 0, 2)),
        reasons=tuple(
            _reason(int((row >= 0).sum()), bool(np.isfinite(R[0, 0])))
            for row, R in zip(spots, rotations, strict=True)
        ),
        details=(None,) * n_images,
    )


def _reason(n_seen: int, has_rotation: bool) -> Reason:
    if not has_rotation:
        return Reason.NOT_THE_PEN
    return Reason.NONE if n_seen >= MIN_POSE_LEDS else Reason.TOO_FEW_LEDS
