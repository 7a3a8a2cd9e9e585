"""A second swing in another cone at a certified distance: a length for the pen's scale.

One camera sees how the LEDs stand to each other, not how large the pen is. Two cones at
a known distance tell it: both swings are adjusted together, with one tip, one camera
and one pen, and the distance of the cones as one more observation.
"""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.observations import Observations
from lightpen.estimation.bundle.adjustment import Adjustment
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.estimation.bundle.priors import ConeSeparation
from lightpen.estimation.contact.camera_motion import pose_steadily
from lightpen.estimation.contact.joint import ContactModel, JointFit, fit_contact
from lightpen.estimation.contact.single_images import require_fit
from lightpen.estimation.uncertainty.budget import COVERAGE_FACTOR, Budget
from lightpen.model.camera import Camera
from lightpen.model.information import inverse
from lightpen.model.pen import Pen


@dataclass(frozen=True, eq=False)
class SecondSwing:
    """Observations of a swing in a second cone."""

    observations: Observations
    separation: ConeSeparation


@dataclass(frozen=True, eq=False)
class SecondImages:
    """The images of a second swing that agree on a tip, (M, L, 2), and their fit."""

    pixels: FloatArray
    joint: JointFit

    def joined(
        self, first: BundleState, pixels: FloatArray
    ) -> tuple[BundleState, FloatArray]:
        """Return where the adjustment of both swings begins, and the images of both.

        Parameters
        ----------
        first : BundleState
            State of the first swing.
        pixels : (N, 1, L, 2) array
            Its images, px.
        """
        numbers = [len(pixels), len(self.pixels)]
        state = replace(
            first,
            rotations=np.concatenate([first.rotations, self.joint.rotations]),
            at_second=np.repeat([False, True], numbers),
            between_rig=self.joint.cone_cam - first.cone_rig,
        )
        return state, np.concatenate([pixels, self.pixels[:, None]])


def second_images(camera: Camera, pen: Pen, observations: Observations) -> SecondImages:
    """Return the images of a second swing that agree on a tip.

    Raises
    ------
    CalibrationError
        They do not; the text says what is missing.
    """
    steady = pose_steadily(camera, pen, observations)
    part = steady.posed
    pixels = steady.observations.pixels[part.chosen]
    joint = fit_contact(
        ContactModel.of(camera, pen, pixels),
        part.poses.of(part.kept).rotations,
        part.pivot.tip_pen,
        part.pivot.pivot_cam,
    )
    require_fit(joint.sigma)
    return SecondImages(pixels, joint)


@dataclass(frozen=True, eq=False)
class SecondCone:
    """Effect of a second swing on the tip.

    Attributes
    ----------
    cone_cam : (3,) array
        Cone point in the camera frame, mm.
    n_used : int
        Images of the second swing that take part.
    distance : float
        Of the cones as they were adjusted, mm.
    uncertainty_without, uncertainty_with : (3,) array
        U (k = 2) of the tip by both swings without the distance, and with it, mm.
    """

    cone_cam: FloatArray
    n_used: int
    separation: ConeSeparation
    distance: float
    uncertainty_without: FloatArray
    uncertainty_with: FloatArray


def second_cone(adjusted: Adjustment, budget: Budget, n_first: int) -> SecondCone:
    """Return the effect of a second swing; ``n_first`` images are of the first.

    The adjustment holds a separation.
    """
    bundle, unshrunk = adjusted.bundle, adjusted.unshrunk
    separation = adjusted.priors.separation
    if separation is None:
        raise ValueError("`adjusted` must hold the separation of two cones.")
    at = unshrunk.layout.between
    measured = unshrunk.measured_information.copy()
    measured[at, at] = 0.0
    without = inverse(unshrunk.information + unshrunk.prior_information + measured)
    grown = budget.covariance + (without - unshrunk.covariance)[:6, :6]
    state = bundle.state
    return SecondCone(
        cone_cam=state.cone_rig + state.between_rig,
        n_used=int(bundle.used[n_first:].any(axis=(1, 2)).sum()),
        separation=separation,
        distance=float(np.linalg.norm(state.between_rig)),
        uncertainty_without=COVERAGE_FACTOR * np.sqrt(np.diag(grown)[:3]),
        uncertainty_with=budget.expanded_uncertainty[:3],
    )
