"""Comparison of a pen file with the pen before the camera.

LEDs are alike, so an image shows where they are, not which is which: two LEDs that are
exchanged in the file as a whole fit the images, and only the definition of the pen
frame distinguishes them, see `lightpen.pen_check.frame`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.labelling.causes import (
    cause_of_misfit,
    diagnose,
    diagnose_mirror,
)
from lightpen.detection.labelling.labels import MODERATE, label_images
from lightpen.detection.pose import MIN_POSE_LEDS, fit_poses
from lightpen.detection.reasons import Reason
from lightpen.detection.robust_residuals import robust_sigma
from lightpen.detection.spots import Spots
from lightpen.estimation.contact.single_images import USUAL_SIGMA
from lightpen.messages import Message, message
from lightpen.model.camera import Camera
from lightpen.model.ellipse import centers_from_centroids
from lightpen.model.pen import Pen

MAX_VIEWS = 30
MOVED = 0.006  # of the extent of the spots, by which views differ
N_COMPARED = 20  # spots of each, at most, as every image is compared with all views
ENOUGH_VIEWS = 5  # before a pen is said to fit
WORST_SIGMA = 2 * USUAL_SIGMA  # px, of the LED that fits worst


@dataclass(frozen=True)
class Finding:
    """What does not fit, and the LEDs that it names."""

    message: Message
    leds: tuple[int, ...] = ()  # numbers from 1


@dataclass(frozen=True, eq=False)
class PenMatch:
    """Agreement of a pen with views of it."""

    n_views: int
    n_labelled: int  # views in which the pen was found
    rms: FloatArray  # (L,), distance from where the file puts it, px; NaN if unseen
    findings: tuple[Finding, ...]

    @property
    def fits(self) -> bool:
        """Whether the pen was found in enough views, without findings."""
        enough = self.n_labelled > 0 and self.n_views >= ENOUGH_VIEWS
        return enough and not self.findings


def add_view(views: tuple[Spots, ...], spots: Spots) -> tuple[Spots, ...]:
    """Return the views with another image, the newest last.

    It takes the place of a view that is alike, and of the oldest if there are too many;
    smeared images and those with too few spots are passed over.
    """
    if len(spots) < MIN_POSE_LEDS or spots.are_blurred:
        return views
    others = [view for view in views if _differ(view, spots)]
    return (*others, spots)[-MAX_VIEWS:]


def match_pen(camera: Camera, pen: Pen, views: Sequence[Spots]) -> PenMatch:
    """Compare a pen that `lightpen.model.pen.check_leds` passes with views of it."""
    labels = label_images(views, camera, pen, MODERATE)
    found = [
        i
        for i, each in enumerate(labels)
        if each.reason is Reason.NONE and each.whole.sum() >= MIN_POSE_LEDS
    ]
    if not found or 2 * len(found) < len(views):
        advice = diagnose(views, camera, pen) if views else None
        return _without_pen(pen, len(views), advice)
    spots, seen = [views[i] for i in found], [labels[i] for i in found]
    taken = np.stack([label.spot for label in seen])
    missing = np.flatnonzero(2 * (taken >= 0).sum(axis=0) < len(found)) + 1
    if len(missing) > 1:
        advice = diagnose_mirror(spots, camera, pen)
        if advice:
            return _without_pen(pen, len(views), advice)
    whole = np.stack([label.whole for label in seen])
    pixels = _centers(camera, spots, np.where(whole, taken, -1))
    R, t = (np.stack([getattr(label, name) for label in seen]) for name in "Rt")
    residuals = fit_poses(camera, pen, pixels, R, t).residuals
    rms = _rms(residuals)
    findings = [
        Finding(message("match.unseen", led=led), (led,)) for led in missing.tolist()
    ]
    sigma, worst = robust_sigma(residuals, 6), float(np.nanmax(rms)) / sqrt(2)
    if sigma > USUAL_SIGMA or worst > WORST_SIGMA:
        cause = cause_of_misfit(camera, pen, pixels, is_seated=False)
        misfit = message("match.misfit", sigma=max(sigma, worst), usual=USUAL_SIGMA)
        findings.insert(0, Finding(cause or misfit, _named_leds(cause)))
    return PenMatch(len(views), len(found), rms, tuple(findings))


def _named_leds(cause: Message | None) -> tuple[int, ...]:
    """Return the numbers of the LEDs that a cause names."""
    parts = () if cause is None else cause.parts()
    names = ("one", "other", "led")
    leds = {part.values[name] for part in parts for name in names & part.values.keys()}
    return tuple(sorted(led for led in leds if isinstance(led, int)))


def _without_pen(pen: Pen, n_views: int, advice: Message | None) -> PenMatch:
    findings = (Finding(advice),) if advice else ()
    return PenMatch(n_views, 0, np.full(pen.n_leds, np.nan), findings)


def _differ(view: Spots, other: Spots) -> bool:
    """Whether most spots of two views lie at other places."""
    some = other.centers[:: 1 + len(other) // N_COMPARED]
    gaps = view.centers[:, None] - some
    squares = np.sort(np.einsum("vsi,vsi->vs", gaps, gaps).min(axis=0))
    n = len(squares)
    # np.median takes eight times as long on some ten spots.
    median = (sqrt(squares[(n - 1) // 2]) + sqrt(squares[n // 2])) / 2
    extent = float((other.centers.max(axis=0) - other.centers.min(axis=0)).max())
    return median > MOVED * extent


def _centers(camera: Camera, spots: Sequence[Spots], spot: IntArray) -> FloatArray:
    """Return ellipse centres (N, L, 2) of the spots (N, L) of N views, px or NaN."""
    pixels = np.full((*spot.shape, 2), np.nan)
    for i, each in enumerate(spots):
        has = spot[i] >= 0
        chosen = spot[i, has]
        if len(chosen):
            pixels[i, has] = centers_from_centroids(
                camera, each.centers[chosen], each.shapes[chosen]
            )
    return pixels


def _rms(residuals: FloatArray) -> FloatArray:
    squares = np.nansum(residuals**2, axis=(0, 2))
    n_seen = np.isfinite(residuals[..., 0]).sum(axis=0)
    rms: FloatArray = np.sqrt(squares / np.maximum(n_seen, 1))
    return np.where(n_seen > 0, rms, np.nan)
