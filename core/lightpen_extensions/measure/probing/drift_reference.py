"""Fixed lamps in view, as drift reference while a tip is verified.

A camera that turns by an angle shifts all that it sees alike, so that a point at the
distance w seems to move by ``w / f`` times the shift of a lamp. The images of all
touches are parted into blocks in the order of time: what the lamps moved by from the
first block to any other is stated beside its U by the noise of their centres,
and counts in U of what was touched.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.cameras.protocol import Frame
from lightpen.comparisons.assessment import (
    VERIFY_AGAIN,
    VerificationAssessment,
    accepted,
    refused,
    worst,
)
from lightpen.detection.fixed_lamps import lamps_among, masked_lights, other_lights
from lightpen.detection.observations import Observations
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.pixel_box import RegionOfInterest
from lightpen.estimation.reports.verdict import Grade
from lightpen.messages import message
from lightpen.model.camera import Camera
from lightpen.model.coverage import COVERAGE_FACTOR
from lightpen.model.limits import VerificationLimits

BLOCK = 8  # images, at least
MIN_BLOCKS, MAX_BLOCKS = 3, 10  # before, during and after; larger ones are less noisy


@dataclass(frozen=True, eq=False)
class LampImages:
    """Lamps in images of touches, in order of time."""

    lights: tuple[FloatArray, ...] = ()  # (S, 2), spots that are no LEDs, px
    distances: tuple[float, ...] = ()  # of the pen along the view, mm

    def then(self, other: "LampImages") -> "LampImages":
        """Return these images followed by others."""
        return LampImages(
            (*self.lights, *other.lights), (*self.distances, *other.distances)
        )


@dataclass(frozen=True, eq=False)
class LampObservations:
    """Lamps in the images of each camera; empty before the first image."""

    cameras: tuple[LampImages, ...] = ()

    def then(self, other: "LampObservations") -> "LampObservations":
        """Return these observations followed by others, camera by camera."""
        if not (self.cameras and other.cameras):
            return self if self.cameras else other
        both = zip(self.cameras, other.cameras, strict=True)
        return LampObservations(tuple(one.then(another) for one, another in both))

    def with_frame(
        self, frame: Frame, detection: PenDetection, region: RegionOfInterest
    ) -> "LampObservations":
        """Return a copy with one more image of each camera that sees the pen."""
        views = zip(
            (frame, *frame.others),
            (detection, *detection.others),
            region.regions,
            strict=False,
        )
        seen = [
            LampImages((_lights(own, view, of.mask),), (float(view.translation[2]),))
            if view.has_pose
            else LampImages()
            for own, view, of in views
        ]
        unseen = [LampImages()] * (len(region.regions) - len(seen))
        return self.then(LampObservations((*seen, *unseen)))

    def lamp_drift(
        self, cameras: Sequence[Camera], limits: VerificationLimits
    ) -> "LampDrift | None":
        """Return the drift of the camera that moved farthest."""
        drifts = [
            drift_of_images(lamps, camera.fx, limits)
            for lamps, camera in zip(self.cameras, cameras, strict=False)
        ]
        known = [each for each in drifts if each is not None]
        return max(known, key=lambda each: each.moved, default=None)


def lamps_in(seen: Sequence[Observations]) -> LampObservations:
    """Return the lamps in recorded images of each camera."""
    return LampObservations(tuple(map(_lamps_of, seen)))


def _lamps_of(seen: Observations) -> LampImages:
    (used,) = np.isfinite(seen.translations[:, 2]).nonzero()
    lights = [lamps[np.isfinite(lamps[:, 0])] for lamps in seen.lamps[used]]
    return LampImages(tuple(lights), tuple(seen.translations[used, 2].tolist()))


def _lights(
    frame: Frame, detection: PenDetection, mask: FloatArray | None
) -> FloatArray:
    masked = masked_lights(frame.image, mask, frame.full_scale)
    seen = masked[np.isfinite(masked[:, 0])]
    return np.concatenate([other_lights(detection), seen])


@dataclass(frozen=True, eq=False)
class LampDrift:
    """Drift of fixed lamps during a verification."""

    lamps: FloatArray  # (K, 2), positions in the image, px
    moves: FloatArray  # (B, 2), of each block since the first, along u and v, mm
    uncertainty: float  # U (k = 2) of one move, mm
    assessment: VerificationAssessment = field(repr=False)

    @property
    def share(self) -> FloatArray:
        """Standard uncertainty by the drift for points probed meanwhile, (3,), mm.

        The camera may have been anywhere between, see `verification.tasks.drift`;
        along the line of sight lamps show nothing.
        """
        farthest = np.abs(self.moves).max(axis=0)
        return np.asarray(np.append(farthest, 0.0) / np.sqrt(3))

    @property
    def moved(self) -> float:
        """The farthest move, mm."""
        return float(np.linalg.norm(self.moves, axis=1).max())


def drift_of_images(
    images: LampImages, focal_length: float, limits: VerificationLimits
) -> LampDrift | None:
    """Return the drift of fixed lamps; None without one, or of too few images.

    The focal length is in px.
    """
    if not images.lights:
        return None
    lamps = lamps_among(np.zeros((len(images.lights), 0, 2)), images.lights)
    scale = float(np.median(images.distances)) / focal_length
    return drift_of_lamps(lamps, scale, limits)


def drift_of_lamps(
    lamps: FloatArray, scale: float, limits: VerificationLimits
) -> LampDrift | None:
    """Return the drift of lamps (N, K, 2), px; NaN where an image does not show one.

    The scale is in mm where the pen is, for a pixel.
    """
    lamps = lamps[np.isfinite(lamps[..., 0]).any(axis=1)]
    n_images, n_lamps = lamps.shape[:2]
    n_blocks = min(n_images // BLOCK, MAX_BLOCKS)
    if not n_lamps or n_blocks < MIN_BLOCKS:
        return None
    places = np.nanmean(lamps, axis=0)
    shifts = np.nanmean(lamps - places, axis=1)  # alike for all lamps
    blocks = np.array_split(shifts, n_blocks)
    means = np.array([np.nanmean(part, axis=0) for part in blocks])
    noise = np.concatenate(
        [part - mean for part, mean in zip(blocks, means, strict=True)]
    )
    length = n_images / n_blocks
    spread = float(np.sqrt(np.nanmean(noise**2) * length / (length - 1)))
    uncertainty = COVERAGE_FACTOR * scale * spread * float(np.sqrt(2 / length))
    moves = scale * (means - means[0])
    judged = _judged(moves, scale, uncertainty, limits)
    return LampDrift(places, moves, uncertainty, judged)


def judged_with(
    found: VerificationAssessment, lamp_drift: LampDrift | None
) -> VerificationAssessment:
    """Return the assessment, led by a camera motion that explains it."""
    if lamp_drift is None or lamp_drift.assessment.is_accepted:
        return found
    return worst((lamp_drift.assessment, found))


def lamp_drift_entries(lamp_drift: LampDrift | None) -> dict[str, Any] | None:
    """Return the drift of lamps as an entry of a record."""
    if lamp_drift is None:
        return None
    return {
        "lamps_px": lamp_drift.lamps,
        "moves_mm": lamp_drift.moves,
        "moved_mm": lamp_drift.moved,
        "expanded_uncertainty_mm": lamp_drift.uncertainty,
        "standard_uncertainty_share_mm": lamp_drift.share,
        "grade": lamp_drift.assessment.grade.value,
    }


def _judged(
    moves: FloatArray, scale: float, uncertainty: float, limits: VerificationLimits
) -> VerificationAssessment:
    moved = float(np.linalg.norm(moves, axis=1).max())
    if moved > limits.drift:
        return refused(
            message(
                "witness.moved",
                shift=moved / scale,
                moved=moved,
                uncertainty=uncertainty,
                limit=limits.drift,
            ),
            VERIFY_AGAIN,
        )
    return accepted(
        message(
            "witness.still", moved=moved, uncertainty=uncertainty, limit=limits.drift
        ),
        grade=Grade.STEADY,
    )
