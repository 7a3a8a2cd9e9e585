"""A second swing in another cone at a certified distance: a length for the pen's scale.

One camera sees how the LEDs stand to each other, not how large the pen is. Two cones at
a known distance tell it: both swings are adjusted together, with one tip, one camera
and one pen, and the distance of the cones as one more observation.
"""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.observations import Observations, without_copies
from lightpen.detection.reasons import Reason
from lightpen.estimation.bundle.adjustment import Adjustment
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.estimation.bundle.priors import ConeSeparation
from lightpen.estimation.contact.camera_motion import pose_steadily, without_field
from lightpen.estimation.contact.joint import ContactModel, JointFit, fit_contact
from lightpen.estimation.contact.single_images import require_fit
from lightpen.model.camera import Camera
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.model.pen import Pen


@dataclass(frozen=True, eq=False)
class SecondSwing:
    """Observations of a swing in a second cone."""

    observations: Observations
    separation: ConeSeparation


@dataclass(frozen=True, eq=False)
class SecondImages:
    """The images of a second swing that agree on a tip, and their fit."""

    swing: SecondSwing
    reasons: tuple[Reason, ...]  # why an image of the swing is not among the M
    pixels: FloatArray  # (M, L, 2), px
    sigmas: FloatArray  # (M, L), of the centres by their detector, px
    joint: JointFit

    def joined(
        self, first: BundleState, pixels: FloatArray
    ) -> tuple[BundleState, FloatArray]:
        """Return start values and images of both swings.

        ``first`` and ``pixels`` (N, 1, L, 2), px, belong to the first swing.
        """
        numbers = [len(pixels), len(self.pixels)]
        state = replace(
            first,
            rotations=np.concatenate([first.rotations, self.joint.rotations]),
            at_second=np.repeat([False, True], numbers),
            between_rig=self.joint.cone_cam - first.cone_rig,
        )
        return state, np.concatenate([pixels, self.pixels[:, None]])


def second_images(camera: Camera, pen: Pen, swing: SecondSwing) -> SecondImages:
    """Return the images of a second swing that agree on a tip.

    Raises `CalibrationError` if they do not; the text says what is missing.
    """
    seen = without_field(camera, without_copies(swing.observations))
    steady = pose_steadily(camera, pen, seen)
    part = steady.posed
    pixels = steady.observations.pixels[part.chosen]
    joint = fit_contact(
        ContactModel.of(camera, pen, pixels),
        part.poses.of(part.kept).rotations,
        part.pivot.tip_pen,
        part.pivot.pivot_cam,
    )
    require_fit(joint.sigma, camera, pen, pixels)
    sigmas = steady.observations.sigmas[part.chosen]
    return SecondImages(swing, tuple(part.reasons), pixels, sigmas, joint)


@dataclass(frozen=True, eq=False)
class SecondCone:
    """What a second swing says of the pen's scale."""

    cone_cam: FloatArray  # (3,), cone point in the camera frame, mm
    swing: SecondSwing
    # Why an image of the second swing was left out; `Reason.NONE` for the used ones.
    reasons: tuple[Reason, ...]
    # (N,), root mean square residual of each image, px; NaN of those left out.
    rms: FloatArray
    leds_used: BoolArray  # (N, L)
    distance: float  # of the cones as they were adjusted, mm
    scale: float  # of the pen against its file, relative
    scale_uncertainty: float  # U (k = 2)

    @property
    def observations(self) -> Observations:
        """Observations of the second swing."""
        return self.swing.observations

    @property
    def separation(self) -> ConeSeparation:
        """Certified distance of the cones."""
        return self.swing.separation

    @property
    def n_used(self) -> int:
        """Number of used images of the second swing."""
        return self.reasons.count(Reason.NONE)


def second_cone(adjusted: Adjustment, images: SecondImages) -> SecondCone:
    """Return what a second swing says, whose images are the last adjusted."""
    bundle, at = adjusted.bundle, adjusted.bundle.layout.scale.start
    state, n = bundle.state, len(images.pixels)
    used, residuals = bundle.used[-n:, 0], bundle.residuals[-n:, 0]
    reasons = np.array(images.reasons, dtype=object)
    chosen = np.flatnonzero(reasons == Reason.NONE)
    reasons[chosen[~used.any(axis=1)]] = Reason.MISFIT
    leds_used = np.zeros((len(reasons), used.shape[1]), dtype=bool)
    leds_used[chosen] = used
    squares = np.full(leds_used.shape, np.nan)
    squares[chosen] = np.sum(residuals**2, axis=-1)
    n_leds = leds_used.sum(axis=1)
    totals = np.sum(squares, axis=1, where=leds_used)
    return SecondCone(
        cone_cam=state.cone_rig + state.between_rig,
        swing=images.swing,
        reasons=tuple(reasons),
        rms=np.sqrt(np.where(n_leds > 0, totals / np.maximum(n_leds, 1), np.nan)),
        leds_used=leds_used,
        distance=float(np.linalg.norm(state.between_rig)),
        scale=bundle.scale,
        scale_uncertainty=COVERAGE_FACTOR * float(np.sqrt(bundle.covariance[at, at])),
    )
